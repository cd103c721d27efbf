/* Captures that arrive in a folder. One thread copies; what it is to do and what came of it goes through `work`, under
 * its lock; everything else is the main loop's. */
#include "daemon/handover/handover.h"

#include "daemon/handover/handover_journal.h"
#include "daemon/handover/ingest_copy.h"
#include "proto/base/bytes.h"

#include <errno.h>
#include <glib.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define NAME_BYTES 200

/* Something in the folder. */
struct arrival {
    struct lumi_ingest_status status;
    char name[NAME_BYTES + 1]; /* in the folder */
    char identity[INGEST_IDENTITY];
    uint64_t signature;
    gint64 since_us; /* of the signature */
    gint64 not_before_us;
    uint64_t quick; /* what changes when a capture that was taken in is another */
    bool gone, refused;
};

/* What was begun or taken in, from the journal. */
struct record {
    char identity[INGEST_IDENTITY];
    char name[NAME_BYTES + 24]; /* in `into` */
    char source[NAME_BYTES + 1];
    bool taken;
};

struct work {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    bool wanted, finished, over; /* wanted: there is something to do; finished: it is done */
    char source[1024], partial[1200], target[1200], identity[INGEST_IDENTITY];
    bool verifying;
    int64_t bytes;
    int code;
    char text[512];
};

struct lumi_ingest {
    struct lumi_ingest_options options;
    char *folder, *into;
    struct journal *journal;
    GPtrArray *arrivals;
    GPtrArray *records;
    struct arrival *current;
    guint timer;
    bool looked, has_thread;
    pthread_t thread;
    struct work work;
};

void lumi_ingest_options_init(struct lumi_ingest_options *options)
{
    memset(options, 0, sizeof *options);
    options->settle = 5;
    options->look = 1;
}

/* ---- The journal ---- */

/* An unsealed capture has no seal to be known by: it is known by its name and what lies in it. */
static void identify(struct arrival *arrival)
{
    snprintf(arrival->identity, sizeof arrival->identity, "open-%016llx", (unsigned long long)arrival->signature);
}

static struct record *find_record(const struct lumi_ingest *ingest, const char *identity, const char *source)
{
    for (guint i = 0; i < ingest->records->len; i++) {
        struct record *record = g_ptr_array_index(ingest->records, i);
        if (!strcmp(record->identity, identity) && (!source || !strcmp(record->source, source)))
            return record;
    }
    return NULL;
}

static int read_line(void *context, const struct journal_line *line, struct lumi_error *error)
{
    struct lumi_ingest *ingest = context;
    const char *what = line->fields[0];

    if (line->count == 4 && !strcmp(what, "begin")) {
        struct record *record = g_new0(struct record, 1);
        g_strlcpy(record->identity, line->fields[1], sizeof record->identity);
        g_strlcpy(record->name, line->fields[2], sizeof record->name);
        g_strlcpy(record->source, line->fields[3], sizeof record->source);
        g_ptr_array_add(ingest->records, record);
        return LUMI_OK;
    }
    struct record *record = line->count == 2 ? find_record(ingest, line->fields[1], NULL) : NULL;
    if (record && !strcmp(what, "taken"))
        record->taken = true;
    else if (record && !strcmp(what, "refused"))
        g_ptr_array_remove(ingest->records, record);
    else
        return lumi_fail(error, LUMI_ERR_FORMAT, "ingest journal: a line '%s' that has no place there", what);
    return LUMI_OK;
}

static bool name_is_free(const struct lumi_ingest *ingest, const char *name)
{
    g_autofree char *path = g_build_filename(ingest->into, name, NULL);
    struct stat status;

    for (guint i = 0; i < ingest->records->len; i++)
        if (!strcmp(((struct record *)g_ptr_array_index(ingest->records, i))->name, name))
            return false;
    return lstat(path, &status) < 0 && errno == ENOENT;
}

/* NAME, NAME-2, NAME-3 …: before ".capture", where it has that. */
static void free_name(const struct lumi_ingest *ingest, const char *name, char *into, size_t size)
{
    const bool capture = g_str_has_suffix(name, ".capture");
    const int stem = (int)strlen(name) - (capture ? 8 : 0);

    g_strlcpy(into, name, size);
    for (int i = 2; !name_is_free(ingest, into); i++)
        snprintf(into, size, "%.*s-%d%s", stem, name, i, capture ? ".capture" : "");
}

/* ---- The thread ---- */

static int on_progress(void *context, bool verifying, int64_t bytes)
{
    struct work *work = context;

    pthread_mutex_lock(&work->lock);
    work->verifying = verifying;
    work->bytes = bytes;
    const int over = work->over;
    pthread_mutex_unlock(&work->lock);
    return over;
}

/* What was renamed before the program was killed, and is not in the journal as taken. */
static bool was_renamed(const struct work *work)
{
    char identity[INGEST_IDENTITY];

    if (ingest_seal_of(work->target, identity, NULL) != LUMI_OK)
        return false;
    return g_str_has_prefix(work->identity, "open-") || !strcmp(identity, work->identity);
}

static void *run_work(void *context)
{
    struct work *work = context;

    pthread_mutex_lock(&work->lock);
    while (!work->over) {
        if (!work->wanted) {
            pthread_cond_wait(&work->changed, &work->lock);
            continue;
        }
        const bool sealed = !g_str_has_prefix(work->identity, "open-");
        const struct ingest_task task = {work->source, work->partial, work->target, sealed ? work->identity : "",
                                         on_progress,  work};
        struct lumi_error error = {0};
        pthread_mutex_unlock(&work->lock);
        const int code = was_renamed(work) ? LUMI_OK : ingest_copy(&task, &error);
        pthread_mutex_lock(&work->lock);
        work->code = code;
        snprintf(work->text, sizeof work->text, "%.511s", error.text);
        work->wanted = false;
        work->finished = true;
    }
    pthread_mutex_unlock(&work->lock);
    return NULL;
}

/* ---- One after another ---- */

static void tell(const struct lumi_ingest *ingest, const struct arrival *arrival)
{
    if (ingest->options.changed)
        ingest->options.changed(ingest->options.context, &arrival->status);
}

static void set_state(const struct lumi_ingest *ingest, struct arrival *arrival, enum lumi_ingest_state state,
                      const char *text)
{
    const bool same = arrival->status.state == state && !strcmp(arrival->status.text, text);

    arrival->status.state = state;
    g_strlcpy(arrival->status.text, text, sizeof arrival->status.text);
    if (!same)
        tell(ingest, arrival);
}

static void hand_over(const struct lumi_ingest *ingest, const char *name)
{
    g_autofree char *path = g_build_filename(ingest->into, name, NULL);

    if (ingest->options.handover && access(path, F_OK) == 0)
        lumi_handover_give(ingest->options.handover, path, false, NULL);
}

static void begin(struct lumi_ingest *ingest, struct arrival *arrival)
{
    struct record *record = find_record(ingest, arrival->identity, NULL);
    struct work *work = &ingest->work;
    struct lumi_error error = {0};

    if (!record) {
        char name[sizeof record->name];
        free_name(ingest, arrival->name, name, sizeof name);
        const char *const fields[] = {"begin", arrival->identity, name, arrival->name};
        if (journal_write(ingest->journal, fields, 4, &error) != LUMI_OK) {
            set_state(ingest, arrival, LUMI_INGEST_SEEN, error.text);
            return;
        }
        record = g_new0(struct record, 1);
        g_strlcpy(record->identity, arrival->identity, sizeof record->identity);
        g_strlcpy(record->name, name, sizeof record->name);
        g_strlcpy(record->source, arrival->name, sizeof record->source);
        g_ptr_array_add(ingest->records, record);
    }
    pthread_mutex_lock(&work->lock);
    g_strlcpy(work->source, arrival->status.source, sizeof work->source);
    snprintf(work->target, sizeof work->target, "%.900s/%s", ingest->into, record->name);
    snprintf(work->partial, sizeof work->partial, "%.900s/%s.partial", ingest->into, record->name);
    g_strlcpy(work->identity, record->identity, sizeof work->identity);
    work->wanted = true;
    work->finished = work->verifying = false;
    work->bytes = 0;
    pthread_cond_signal(&work->changed);
    pthread_mutex_unlock(&work->lock);
    snprintf(arrival->status.capture, sizeof arrival->status.capture, "%.800s/%.200s", ingest->into, record->name);
    ingest->current = arrival;
    set_state(ingest, arrival, LUMI_INGEST_COPYING, "");
}

static void finish(struct lumi_ingest *ingest, int code, const char *text)
{
    struct arrival *arrival = ingest->current;
    struct record *record = find_record(ingest, arrival->identity, NULL);
    struct lumi_error error = {0};

    ingest->current = NULL;
    if (code == LUMI_OK) {
        const char *const fields[] = {"taken", arrival->identity};
        if (journal_write(ingest->journal, fields, 2, &error) != LUMI_OK) {
            set_state(ingest, arrival, LUMI_INGEST_SEEN, error.text); /* once more: it is found renamed then */
            return;
        }
        record->taken = true;
        arrival->status.bytes = arrival->status.total;
        set_state(ingest, arrival, LUMI_INGEST_TAKEN, "");
        hand_over(ingest, record->name);
    } else if (lumi_exit_status(code) == 3) {
        const char *const fields[] = {"refused", arrival->identity};
        journal_write(ingest->journal, fields, 2, NULL); /* if not, the name stays reserved */
        g_ptr_array_remove(ingest->records, record);
        arrival->refused = true;
        set_state(ingest, arrival, LUMI_INGEST_REFUSED, text);
    } else { /* a full disk and the like: once more a little later */
        arrival->not_before_us = g_get_monotonic_time() + (gint64)(10 * ingest->options.look * 1e6);
        arrival->identity[0] = '\0';
        set_state(ingest, arrival, LUMI_INGEST_SEEN, text);
    }
}

static void look_at_work(struct lumi_ingest *ingest)
{
    struct work *work = &ingest->work;
    char text[sizeof work->text];

    if (!ingest->current)
        return;
    pthread_mutex_lock(&work->lock);
    const bool finished = work->finished, verifying = work->verifying;
    const int code = work->code;
    ingest->current->status.bytes = work->bytes;
    memcpy(text, work->text, sizeof text);
    pthread_mutex_unlock(&work->lock);
    if (finished)
        finish(ingest, code, text);
    else
        set_state(ingest, ingest->current, verifying ? LUMI_INGEST_VERIFYING : LUMI_INGEST_COPYING, "");
}

/* ---- The folder ---- */

static struct arrival *find_arrival(struct lumi_ingest *ingest, const char *name)
{
    struct arrival *arrival;

    for (guint i = 0; i < ingest->arrivals->len; i++) {
        arrival = g_ptr_array_index(ingest->arrivals, i);
        if (!strcmp(arrival->name, name))
            return arrival;
    }
    arrival = g_new0(struct arrival, 1);
    g_strlcpy(arrival->name, name, sizeof arrival->name);
    snprintf(arrival->status.source, sizeof arrival->status.source, "%.800s/%s", ingest->folder, name);
    g_ptr_array_add(ingest->arrivals, arrival);
    tell(ingest, arrival);
    return arrival;
}

/* Whether it is whole, as far as can be told from outside; then it has its identity. */
static bool is_ready(struct lumi_ingest *ingest, struct arrival *arrival)
{
    const gint64 now = g_get_monotonic_time();
    g_autofree char *database = g_build_filename(arrival->status.source, "data", "capture.db", NULL);
    struct ingest_look look;

    ingest_look(arrival->status.source, &look);
    if (look.sum != arrival->signature) {
        arrival->signature = look.sum;
        arrival->since_us = now;
        arrival->refused = false;
    }
    arrival->status.total = look.bytes;
    if (arrival->refused || now < arrival->not_before_us || ingest_is_held(arrival->status.source))
        return false;
    const bool settled = (double)(now - arrival->since_us) >= ingest->options.settle * 1e6;
    if (ingest_seal_of(arrival->status.source, arrival->identity, NULL) == LUMI_OK)
        return settled || ingest_is_whole(arrival->status.source, &look);
    if (!settled)
        return false;
    if (access(database, F_OK) < 0) {
        arrival->refused = true;
        set_state(ingest, arrival, LUMI_INGEST_REFUSED, "is no capture: data/capture.db is missing");
        return false;
    }
    identify(arrival);
    return true;
}

/* Times of the seal and of the database: without reading through thousands of files at every look. */
static uint64_t quick_look(const struct arrival *arrival)
{
    static const char *const files[] = {"tagmanifest-sha256.txt", "data/capture.db", "data/capture.db-wal"};
    uint64_t hash = LUMI_FNV1A_BASIS;

    for (int i = 0; i < 3; i++) {
        g_autofree char *path = g_build_filename(arrival->status.source, files[i], NULL);
        struct stat status = {0};
        if (lstat(path, &status) < 0)
            continue;
        const int64_t numbers[] = {i, (int64_t)status.st_size, (int64_t)status.st_mtim.tv_sec,
                                   (int64_t)status.st_mtim.tv_nsec};
        hash = lumi_fnv1a(hash, numbers, sizeof numbers);
    }
    return hash;
}

static void look_at(struct lumi_ingest *ingest, struct arrival *arrival)
{
    struct record *record;

    arrival->gone = false;
    if (arrival == ingest->current)
        return;
    const uint64_t quick = quick_look(arrival);
    if (arrival->status.state == LUMI_INGEST_TAKEN && quick == arrival->quick)
        return;
    arrival->quick = quick;
    if (!is_ready(ingest, arrival))
        return;
    record = find_record(ingest, arrival->identity, NULL);
    if (record && record->taken) {
        snprintf(arrival->status.capture, sizeof arrival->status.capture, "%.800s/%.200s", ingest->into, record->name);
        arrival->status.bytes = arrival->status.total;
        set_state(ingest, arrival, LUMI_INGEST_TAKEN, "");
    } else if (!ingest->current) {
        begin(ingest, arrival);
    }
}

static gboolean look(gpointer context)
{
    struct lumi_ingest *ingest = context;
    GDir *folder = g_dir_open(ingest->folder, 0, NULL);
    const char *name;

    look_at_work(ingest);
    for (guint i = 0; i < ingest->arrivals->len; i++)
        ((struct arrival *)g_ptr_array_index(ingest->arrivals, i))->gone = folder != NULL;
    while (folder && (name = g_dir_read_name(folder))) {
        g_autofree char *path = g_build_filename(ingest->folder, name, NULL);
        struct stat status;
        if (name[0] == '.' || strlen(name) > NAME_BYTES || lstat(path, &status) < 0 || !S_ISDIR(status.st_mode) ||
            g_str_has_suffix(name, ".partial") || g_str_has_suffix(name, ".work"))
            continue;
        bool plain = true;
        for (const char *c = name; *c; c++)
            plain = plain && (unsigned char)*c >= 0x20 && *c != 0x7f;
        if (plain)
            look_at(ingest, find_arrival(ingest, name));
    }
    if (folder)
        g_dir_close(folder);
    for (guint i = ingest->arrivals->len; i-- > 0;) {
        struct arrival *arrival = g_ptr_array_index(ingest->arrivals, i);
        if (arrival->gone && arrival != ingest->current)
            g_ptr_array_remove_index(ingest->arrivals, i);
    }
    ingest->looked = true;
    return G_SOURCE_CONTINUE;
}

/* ---- Life ---- */

static int check_folders(struct lumi_ingest *ingest, const struct lumi_ingest_options *options,
                         struct lumi_error *error)
{
    char *folder = realpath(options->folder, NULL), *into = realpath(options->into, NULL);
    int code = LUMI_OK;

    if (!folder || !into) {
        code = lumi_fail_errno(error, folder ? options->into : options->folder, "ingest");
        goto done;
    }
    ingest->folder = g_strdup(folder);
    ingest->into = g_strdup(into);
    const size_t a = strlen(folder), b = strlen(into);
    if (!strncmp(folder, into, a < b ? a : b) && (a == b || (a < b ? into[a] : folder[b]) == '/'))
        code = lumi_fail(error, LUMI_ERR_ARG, "ingest: %s and %s lie in one another", folder, into);
    else if (a > 800 || b > 800)
        code = lumi_fail(error, LUMI_ERR_LIMIT, "ingest: %s: the path is too long", a > b ? folder : into);
done:
    free(folder);
    free(into);
    return code;
}

int lumi_ingest_create(const struct lumi_ingest_options *options, struct lumi_ingest **ingest, struct lumi_error *error)
{
    struct lumi_ingest *made = g_new0(struct lumi_ingest, 1);
    int code;

    *ingest = NULL;
    made->options = *options;
    made->arrivals = g_ptr_array_new_with_free_func(g_free);
    made->records = g_ptr_array_new_with_free_func(g_free);
    pthread_mutex_init(&made->work.lock, NULL);
    pthread_cond_init(&made->work.changed, NULL);
    LUMI_GOTO(code, fail, check_folders(made, options, error));
    LUMI_GOTO(code, fail, journal_open(options->journal, read_line, made, &made->journal, error));
    if (pthread_create(&made->thread, NULL, run_work, &made->work) != 0) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "ingest: no thread can be started");
        goto fail;
    }
    made->has_thread = true;
    /* Taken in, and the program was killed before it was handed over: giving twice is giving once. */
    for (guint i = 0; i < made->records->len; i++) {
        const struct record *record = g_ptr_array_index(made->records, i);
        if (record->taken)
            hand_over(made, record->name);
    }
    made->timer = g_timeout_add((guint)MAX(options->look * 1000, 1), look, made);
    *ingest = made;
    return LUMI_OK;
fail:
    lumi_ingest_destroy(made);
    return code;
}

void lumi_ingest_destroy(struct lumi_ingest *ingest)
{
    if (!ingest)
        return;
    if (ingest->timer)
        g_source_remove(ingest->timer);
    pthread_mutex_lock(&ingest->work.lock);
    ingest->work.over = true;
    pthread_cond_signal(&ingest->work.changed);
    pthread_mutex_unlock(&ingest->work.lock);
    if (ingest->has_thread)
        pthread_join(ingest->thread, NULL);
    pthread_cond_destroy(&ingest->work.changed);
    pthread_mutex_destroy(&ingest->work.lock);
    g_ptr_array_free(ingest->arrivals, TRUE);
    g_ptr_array_free(ingest->records, TRUE);
    journal_close(ingest->journal);
    g_free(ingest->folder);
    g_free(ingest->into);
    g_free(ingest);
}

bool lumi_ingest_idle(const struct lumi_ingest *ingest)
{
    if (!ingest->looked || ingest->current)
        return false;
    for (guint i = 0; i < ingest->arrivals->len; i++)
        if (((const struct arrival *)g_ptr_array_index(ingest->arrivals, i))->status.state < LUMI_INGEST_TAKEN)
            return false;
    return true;
}

int lumi_ingest_list(struct lumi_ingest *ingest, struct lumi_ingest_status *list, int max)
{
    const int count = (int)ingest->arrivals->len;

    for (int i = 0; i < count && i < max; i++)
        list[i] = ((struct arrival *)g_ptr_array_index(ingest->arrivals, (guint)i))->status;
    return count < max ? count : max;
}
