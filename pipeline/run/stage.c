/* Running one stage over a range of images. */
#include "pipeline/run/key.h"
#include "pipeline/run/run_priv.h"
#include "pipeline/run/temporary.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <pthread.h>
#include <string.h>
#include <unistd.h>

#include "proto/base/parallel.h"

void lumi_key_input(struct lumi_key *key, const struct lumi_run *run, const char *stage, int index)
{
    char hex[LUMI_KEY_HEX] = "";

    if (!lumi_run_output_key(run, stage, index, hex) && !key->missing) {
        key->missing = true;
        g_snprintf(key->missing_what, sizeof key->missing_what, "stage '%s'%s%s", stage, index < 0 ? "" : " of ",
                   index < 0 ? "" : run->sources[index].name);
    }
    lumi_key_bytes(key, hex, strlen(hex) + 1);
}

static int sync_file(const char *path, struct lumi_error *error)
{
    int file = open(path, O_RDONLY | O_CLOEXEC);

    if (file < 0)
        return lumi_fail_errno(error, path, "open");
    int code = fsync(file) ? lumi_fail_errno(error, path, "sync") : LUMI_OK;
    close(file);
    return code;
}

/* One image whose output has to be made. */
struct job {
    int index;
    char key[LUMI_KEY_HEX];
};

struct work {
    struct lumi_run *run;
    const struct lumi_stage *stage;
    void *state;
    GArray *jobs;
    pthread_mutex_t lock; /* guards done, error_index, error */
    long done;
    int error_index;
    struct lumi_error *error;
};

static int make_one(struct work *work, const struct job *job, int thread, struct lumi_error *error)
{
    struct lumi_run *run = work->run;
    g_autofree char *path = lumi_run_path(run, work->stage->name, job->index, work->stage->extension);
    g_autofree char *temporary = lumi_run_temporary(path, work->stage->extension);
    g_autofree char *key = lumi_run_path(run, work->stage->name, job->index, ".key");
    int code = work->stage->make(run, work->state, job->index, thread, temporary, error);

    if (code == LUMI_OK)
        code = sync_file(temporary, error);
    /* The old key goes first, so that it never stands beside a new output. */
    if (code == LUMI_OK && unlink(key) && errno != ENOENT)
        code = lumi_fail_errno(error, key, "remove");
    if (code == LUMI_OK && rename(temporary, path))
        code = lumi_fail_errno(error, path, "rename");
    if (code == LUMI_OK)
        code = lumi_key_save(key, path, job->key, error);
    if (code != LUMI_OK)
        unlink(temporary);
    else
        lumi_run_remember_key(run, work->stage->name, job->index, job->key);
    return code;
}

static int run_job(void *context, int number, int thread)
{
    struct work *work = context;
    struct lumi_error error = {0};
    const struct job *job = &g_array_index(work->jobs, struct job, number);
    int code = make_one(work, job, thread, &error);

    pthread_mutex_lock(&work->lock);
    if (code != LUMI_OK && number < work->error_index) {
        work->error_index = number;
        if (work->error)
            *work->error = error;
    }
    work->done++;
    if (code == LUMI_OK && work->run->progress)
        work->run->progress(work->stage->title, work->done, work->jobs->len);
    pthread_mutex_unlock(&work->lock);
    return code;
}

static bool in_set(const struct lumi_run *run, const struct lumi_stage *stage, int index)
{
    const struct lumi_source *source = &run->sources[index];

    switch (stage->set) {
    case LUMI_SET_DENSE:
        return index < run->dense;
    case LUMI_SET_FILLED:
        return source->synthetic || source->masked;
    case LUMI_SET_KEPT:
        return source->kept;
    case LUMI_SET_FRAMES:
        break;
    }
    return true;
}

/* The indices a stage works on; −1 alone where it makes one output for all. */
static GArray *indices_of(const struct lumi_run *run, const struct lumi_stage *stage)
{
    GArray *indices = g_array_new(FALSE, FALSE, sizeof(int));
    const int all = -1;

    if (stage->wanted && !stage->wanted(run, all))
        return indices;
    if (stage->whole)
        g_array_append_val(indices, all);
    else
        for (int i = 0; i < run->count; i++)
            if (in_set(run, stage, i) && (!stage->wanted || stage->wanted(run, i)))
                g_array_append_val(indices, i);
    return indices;
}

int lumi_stage_count(const struct lumi_run *run, const struct lumi_stage *stage)
{
    g_autoptr(GArray) indices = indices_of(run, stage);

    return (int)indices->len;
}

/* Whether the output for `index` is there with the key it would have now, which is left in `hex`. */
static int is_there(struct lumi_run *run, const struct lumi_stage *stage, int index, char hex[LUMI_KEY_HEX],
                    bool *there, struct lumi_error *error)
{
    char found[LUMI_KEY_HEX];
    struct lumi_key key;

    *there = false;
    lumi_key_init(&key, stage->name, stage->version);
    LUMI_TRY(stage->key(run, index, &key, error));
    if (key.missing)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: stage '%s' needs %s, which has not been run", run->work,
                         stage->name, key.missing_what);
    lumi_key_hex(&key, hex);
    g_autofree char *path = lumi_run_path(run, stage->name, index, ".key");
    *there = lumi_key_load(path, found) && !strcmp(found, hex);
    if (*there)
        lumi_run_remember_key(run, stage->name, index, hex);
    return LUMI_OK;
}

int lumi_stage_done(struct lumi_run *run, const struct lumi_stage *stage, bool *done)
{
    g_autoptr(GArray) indices = indices_of(run, stage);
    int count = 0;

    for (guint i = 0; i < indices->len; i++) {
        char hex[LUMI_KEY_HEX];
        struct lumi_error error;
        bool there;
        const int code = is_there(run, stage, g_array_index(indices, int, i), hex, &there, &error);
        done[i] = code == LUMI_OK && there;
        count += done[i];
    }
    return count;
}

static int find_jobs(struct lumi_run *run, const struct lumi_stage *stage, const int *indices, int count, GArray *jobs,
                     struct lumi_error *error)
{
    for (int i = 0; i < count; i++) {
        struct job job = {.index = indices[i]};
        bool there;

        LUMI_TRY(is_there(run, stage, job.index, job.key, &there, error));
        if (!there)
            g_array_append_val(jobs, job);
    }
    return LUMI_OK;
}

int lumi_run_stage(struct lumi_run *run, const struct lumi_stage *stage, int first, int last, int *skipped,
                   struct lumi_error *error)
{
    g_autofree char *folder = g_build_filename(run->work, stage->name, NULL);
    g_autoptr(GArray) jobs = g_array_new(FALSE, FALSE, sizeof(struct job));
    g_autoptr(GArray) indices = indices_of(run, stage);
    struct work work = {.run = run, .stage = stage, .jobs = jobs, .error_index = G_MAXINT, .error = error};
    const int count = (int)indices->len;
    int code;

    if (skipped)
        *skipped = 0;
    if (count == 0)
        return LUMI_OK;
    if (stage->whole)
        first = 0, last = 1;
    last = last < 0 ? count : last;
    if (first < 0 || last > count || first > last)
        return lumi_fail(error, LUMI_ERR_ARG, "range %d:%d: the stage '%s' has images 0 to %d", first, last,
                         stage->name, count);
    if (g_mkdir_with_parents(folder, 0777))
        return lumi_fail_errno(error, folder, "create");
    LUMI_TRY(find_jobs(run, stage, &g_array_index(indices, int, first), last - first, jobs, error));
    if (skipped)
        *skipped = last - first - (int)jobs->len;
    if (jobs->len == 0)
        return LUMI_OK;
    if (stage->begin)
        LUMI_TRY(stage->begin(run, &work.state, error));
    pthread_mutex_init(&work.lock, NULL);
    const int threads = run->parallel ? run->parallel(run, stage, (int)jobs->len) : run->threads;
    code = lumi_parallel_for((int)jobs->len, stage->serial || stage->whole ? 1 : threads, run_job, &work);
    pthread_mutex_destroy(&work.lock);
    if (stage->end)
        stage->end(run, work.state);
    return code;
}
