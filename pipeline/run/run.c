/* A run over a capture: its sources, its work directory, its parameters. */
#include "pipeline/run/key.h"
#include "pipeline/run/run_priv.h"
#include "pipeline/run/sources.h"
#include "pipeline/run/temporary.h"
#include "proto/base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <pthread.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

struct lumi_run_private {
    int lock;              /* the work directory's lock file */
    pthread_mutex_t mutex; /* guards keys */
    GHashTable *keys;      /* "stage/name" → hex key */
};

void lumi_run_defaults(struct lumi_parameters *parameters)
{
    *parameters = (struct lumi_parameters){.calibrate = LUMI_CHOICE_AUTO,
                                           .equalize = LUMI_CHOICE_AUTO,
                                           .synthesize = LUMI_CHOICE_AUTO,
                                           .subsample = LUMI_CHOICE_AUTO,
                                           .prefilter = -1,
                                           .density = 1,
                                           .stand_m = -1,
                                           .geometry_precision = 5,
                                           .disk_scale = 1,
                                           .disk_shape = LUMI_DISK_OVAL,
                                           .kernel = LUMI_KERNEL_LINEAR,
                                           .quality = 70,
                                           .cluster_size = 25};
}

char *lumi_run_path(const struct lumi_run *run, const char *stage, int index, const char *extension)
{
    return g_strdup_printf("%s/%s/%s%s", run->work, stage, index < 0 ? "all" : run->sources[index].name, extension);
}

static char *key_name(const struct lumi_run *run, const char *stage, int index)
{
    return g_strdup_printf("%s/%s", stage, index < 0 ? "all" : run->sources[index].name);
}

void lumi_run_remember_key(const struct lumi_run *run, const char *stage, int index, const char *hex)
{
    struct lumi_run_private *priv = run->priv;

    pthread_mutex_lock(&priv->mutex);
    g_hash_table_replace(priv->keys, key_name(run, stage, index), g_strdup(hex));
    pthread_mutex_unlock(&priv->mutex);
}

bool lumi_run_output_key(const struct lumi_run *run, const char *stage, int index, char *hex)
{
    g_autofree char *name = key_name(run, stage, index);

    pthread_mutex_lock(&run->priv->mutex);
    const char *known = g_hash_table_lookup(run->priv->keys, name);
    if (known)
        g_strlcpy(hex, known, LUMI_KEY_HEX);
    pthread_mutex_unlock(&run->priv->mutex);
    if (known)
        return true;
    g_autofree char *path = lumi_run_path(run, stage, index, ".key");
    if (!lumi_key_load(path, hex))
        return false;
    lumi_run_remember_key(run, stage, index, hex);
    return true;
}

/* Where the file system knows no locks (Lustre without "flock", NFS without its lock service) there is none to hold. */
static int take_lock(struct lumi_run *run, bool alone, struct lumi_error *error)
{
    if (flock(run->priv->lock, (alone ? LOCK_EX : LOCK_SH) | LOCK_NB) && errno == EWOULDBLOCK)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: another run is at work there", run->work);
    if (alone)
        lumi_run_remove_leftovers(run->work, run->priv->lock);
    return LUMI_OK;
}

static int lock_work(struct lumi_run *run, enum lumi_run_use use, struct lumi_error *error)
{
    const bool alone = use == LUMI_RUN_ALONE;
    g_autofree char *path = g_build_filename(run->work, ".lock", NULL);

    if (use == LUMI_RUN_LOOK)
        return LUMI_OK;
    if (g_mkdir_with_parents(run->work, 0777))
        return lumi_fail_errno(error, run->work, "create");
    run->priv->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (run->priv->lock < 0 && !alone && (errno == EROFS || errno == EACCES)) {
        /* What cannot be written here can still be read, beside others that hold the lock as far as there is one. */
        run->priv->lock = open(path, O_RDONLY | O_CLOEXEC);
        if (run->priv->lock < 0)
            return LUMI_OK;
    }
    if (run->priv->lock < 0)
        return lumi_fail_errno(error, path, "create");
    return take_lock(run, alone, error);
}

static char *strip_slashes(const char *path)
{
    size_t length = strlen(path);

    while (length > 1 && path[length - 1] == '/')
        length--;
    return g_strndup(path, length);
}

static bool choose(enum lumi_choice choice, bool by_itself)
{
    return choice == LUMI_CHOICE_AUTO ? by_itself : choice == LUMI_CHOICE_YES;
}

static bool wants_color(const struct lumi_run *run)
{
    const struct lumi_parameters *p = &run->parameters;
    bool wanted = p->icc || p->lut || p->exposure != 0 || p->tone > LUMI_TONE_NONE;

    for (int i = 0; i < 9; i++)
        wanted = wanted || p->color_matrix[i] != 0;
    for (int i = 0; i < 3; i++)
        wanted = wanted || p->white_balance[i] != 0;
    for (int i = 0; i < run->count && p->tone == LUMI_TONE_AUTO; i++)
        wanted = wanted || run->sources[i].part_count > 0;
    return wanted;
}

static void resolve_wants(struct lumi_run *run)
{
    const struct lumi_parameters *p = &run->parameters;
    bool priors = true;

    for (int i = 0; i < run->count; i++)
        priors = priors && run->sources[i].pose_source == LUMI_POSE_PRIOR;
    run->wants.calibrate = choose(p->calibrate, priors);
    run->wants.equalize = choose(p->equalize, run->wants.calibrate);
    run->wants.synthesize = choose(p->synthesize, run->rig != NULL);
    run->wants.subsample = choose(p->subsample, run->rig != NULL);
    run->wants.color = wants_color(run);
    run->wants.prefilter = p->prefilter < 0 ? run->rig != NULL : p->prefilter > 0;
}

int lumi_run_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                  enum lumi_run_use use, struct lumi_run **result, struct lumi_error *error)
{
    struct lumi_run *run = g_new0(struct lumi_run, 1);
    int code;

    *result = NULL;
    run->priv = g_new0(struct lumi_run_private, 1);
    run->priv->lock = -1;
    pthread_mutex_init(&run->priv->mutex, NULL);
    run->priv->keys = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, g_free);
    run->capture = strip_slashes(capture);
    run->work = work ? strip_slashes(work) : g_strconcat(run->capture, ".work", NULL);
    run->parameters = *parameters;
    run->threads = threads;
    LUMI_GOTO(code, fail, lumi_sources_load(run, error));
    LUMI_GOTO(code, fail, lumi_sources_mend(run, error));
    LUMI_GOTO(code, fail, lumi_file_check_output(run->work, run->capture, error));
    LUMI_GOTO(code, fail, lock_work(run, use, error));
    run->dense = run->count;
    run_list_kept(run);
    resolve_wants(run);
    *result = run;
    return LUMI_OK;
fail:
    lumi_run_close(run);
    return code;
}

void lumi_run_close(struct lumi_run *run)
{
    if (!run)
        return;
    for (int i = 0; i < run->count; i++)
        sources_free(&run->sources[i]);
    g_free(run->sources);
    g_free(run->missing);
    g_free(run->kept);
    g_free(run->rig);
    if (run->priv->lock >= 0)
        close(run->priv->lock);
    g_hash_table_destroy(run->priv->keys);
    pthread_mutex_destroy(&run->priv->mutex);
    g_free(run->priv);
    g_free(run->capture);
    g_free(run->work);
    g_free(run);
}
