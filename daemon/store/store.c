/* Jobs in, jobs done: the queue, the threads, the figures. */
#include "daemon/store/store_priv.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void lumi_store_options_init(struct lumi_store_options *options)
{
    memset(options, 0, sizeof *options);
    options->memory = (size_t)512 << 20;
}

static int64_t now_of(const struct lumi_store *store)
{
    struct timespec time;

    if (store->options.now)
        return store->options.now(store->options.context);
    if (store->options.synchronous)
        return 0;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

/* ---- The queue; under the lock ---- */

static struct store_entry *next_to_write(struct lumi_store *store)
{
    struct store_entry *entry = store->first;

    while (entry && entry->stage != STORE_WAITING)
        entry = entry->next;
    return entry;
}

/* Whether a job of the same frame that was given earlier is not ready. */
static bool held_up(const struct lumi_store *store, const struct store_entry *entry)
{
    if (entry->job.kind == LUMI_STORE_SEAL)
        return entry != store->first || store->committing > 0;
    if (!entry->job.frame)
        return false;
    for (const struct store_entry *other = store->first; other != entry; other = other->next)
        if (other->job.frame == entry->job.frame && other->job.kind != LUMI_STORE_SHOT)
            return true;
    return false;
}

/* Takes what can be committed out of the queue, in its order. Nothing given after a seal goes before it. */
static int take_ready(struct lumi_store *store, struct store_entry **group, int most)
{
    struct store_entry **link = &store->first;
    int count = 0;

    while (*link && count < most) {
        struct store_entry *entry = *link;
        const bool sealing = entry->job.kind == LUMI_STORE_SEAL;
        if (sealing && (count > 0 || held_up(store, entry)))
            break;
        if (entry->stage != STORE_READY || held_up(store, entry)) {
            link = &entry->next;
            continue;
        }
        *link = entry->next;
        if (!entry->next)
            store->last = link;
        group[count++] = entry;
        if (sealing)
            break;
    }
    return count;
}

static void count_second(struct lumi_store *store, int64_t now, int64_t bytes, double seconds)
{
    const int64_t second = now / 1000000000;
    const int place = (int)(second % STORE_SECONDS);

    if (store->seconds[place].second != second) {
        store->seconds[place].second = second;
        store->seconds[place].bytes = 0;
        store->seconds[place].slowest = 0;
    }
    store->seconds[place].bytes += bytes;
    if (seconds > store->seconds[place].slowest)
        store->seconds[place].slowest = seconds;
}

static void finish(struct lumi_store *store, struct store_entry *entry)
{
    struct lumi_store_done *done = &entry->done;
    const int64_t now = now_of(store);

    done->id = entry->job.id;
    done->kind = entry->job.kind;
    done->code = entry->code;
    snprintf(done->text, sizeof done->text, "%s", entry->text);
    if (entry->job.kind != LUMI_STORE_RETAKE || entry->code != LUMI_OK)
        done->frame = entry->job.frame;
    done->bytes = entry->code == LUMI_OK ? (size_t)entry->written : 0;
    done->seconds = (double)(now - entry->given_ns) * 1e-9;
    store->waiting -= entry->bytes;
    store->jobs--;
    store->stored_bytes += (int64_t)done->bytes;
    count_second(store, now, (int64_t)done->bytes, done->seconds);
    if (store->copy && entry->code == LUMI_OK && entry->file[0])
        store_copy_add(store->copy, entry->file, entry->sha256, entry->written);
    entry->next = NULL;
    *store->done_last = entry;
    store->done_last = &entry->next;
}

/* ---- Threads ---- */

static void wake(const struct lumi_store *store)
{
    if (store->options.wake)
        store->options.wake(store->options.context);
}

static void *run_writer(void *context)
{
    struct lumi_store *store = context;
    struct store_entry *entry;

    pthread_mutex_lock(&store->lock);
    for (;;) {
        while (!(entry = next_to_write(store)) && !store->stopping)
            pthread_cond_wait(&store->to_write, &store->lock);
        if (!entry)
            break;
        entry->stage = STORE_WRITING;
        pthread_mutex_unlock(&store->lock);
        store_write(store, entry);
        pthread_mutex_lock(&store->lock);
        entry->stage = STORE_READY;
        if (--store->unwritten == 0 && store->copy)
            store_copy_wake(store->copy);
        pthread_cond_signal(&store->to_commit);
    }
    pthread_mutex_unlock(&store->lock);
    return NULL;
}

/* A seal is done when the second copy is, or is given up; which of them its text tells. */
static void sealed(struct lumi_store *store, struct store_entry *entry)
{
    char text[256];
    int64_t behind;
    int code;

    store->sealed = true;
    if (!store->copy)
        return;
    store_copy_finish(store->copy);
    store_copy_tell(store->copy, &behind, &code, text, sizeof text);
    snprintf(entry->text, sizeof entry->text, code == LUMI_OK ? "second copy: %s" : "no second copy: %s", text);
}

/* Commits one group. False: there was none. Called and returns with the lock. */
static bool commit_ready(struct lumi_store *store, int most)
{
    struct store_entry *group[STORE_GROUP];
    const int count = take_ready(store, group, most < STORE_GROUP ? most : STORE_GROUP);

    if (!count)
        return false;
    store->committing = count;
    pthread_mutex_unlock(&store->lock);
    store_commit(store, group, count);
    pthread_mutex_lock(&store->lock);
    store->committing = 0;
    if (group[0]->job.kind == LUMI_STORE_SEAL && group[0]->code == LUMI_OK)
        sealed(store, group[0]);
    for (int i = 0; i < count; i++)
        finish(store, group[i]);
    return true;
}

static void *run_committer(void *context)
{
    struct lumi_store *store = context;

    pthread_mutex_lock(&store->lock);
    for (;;) {
        if (commit_ready(store, STORE_GROUP)) {
            pthread_mutex_unlock(&store->lock);
            wake(store);
            pthread_mutex_lock(&store->lock);
        } else if (store->stopping && !store->first) {
            break;
        } else {
            pthread_cond_wait(&store->to_commit, &store->lock);
        }
    }
    pthread_mutex_unlock(&store->lock);
    return NULL;
}

static int start_threads(struct lumi_store *store, struct lumi_error *error)
{
    int wanted = store->options.writers > 0 ? store->options.writers : 2 * lumi_thread_count();

    if (wanted > STORE_WRITERS)
        wanted = STORE_WRITERS;
    if (store->options.writers <= 0 && wanted < 4)
        wanted = 4; /* a disk wants several requests at once */
    if (pthread_create(&store->committer, NULL, run_committer, store) != 0)
        return lumi_fail(error, LUMI_ERR_NOMEM, "store: no thread can be started");
    store->has_committer = true;
    while (store->writer_count < wanted &&
           pthread_create(&store->writers[store->writer_count], NULL, run_writer, store) == 0)
        store->writer_count++;
    return store->writer_count ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "store: no thread can be started");
}

static void stop_threads(struct lumi_store *store)
{
    pthread_mutex_lock(&store->lock);
    store->stopping = true;
    pthread_cond_broadcast(&store->to_write);
    pthread_cond_broadcast(&store->to_commit);
    pthread_mutex_unlock(&store->lock);
    for (int i = 0; i < store->writer_count; i++)
        pthread_join(store->writers[i], NULL);
    if (store->has_committer)
        pthread_join(store->committer, NULL);
}

/* ---- Life ---- */

static void release(struct lumi_store *store)
{
    while (store->done) {
        struct store_entry *entry = store->done;
        store->done = entry->next;
        lumi_free(entry);
    }
    pthread_cond_destroy(&store->to_commit);
    pthread_cond_destroy(&store->to_write);
    pthread_mutex_destroy(&store->lock);
    lumi_free(store);
}

int lumi_store_open(struct lumi_capture *capture, const struct lumi_store_options *options, struct lumi_store **store,
                    struct lumi_error *error)
{
    struct lumi_store *made = lumi_calloc(1, sizeof *made);

    *store = NULL;
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "store: out of memory");
    made->capture = capture;
    made->options = *options;
    made->folder = lumi_capture_frames_folder(capture);
    made->last = &made->first;
    made->done_last = &made->done;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->to_write, NULL);
    pthread_cond_init(&made->to_commit, NULL);
    made->full = true; /* until something is set aside */
    store_reserve_kept(made, NULL);
    int code = options->second_copy ? store_copy_create(made, error) : LUMI_OK;
    if (code == LUMI_OK && !options->synchronous)
        code = start_threads(made, error);
    if (code != LUMI_OK) {
        stop_threads(made);
        store_copy_destroy(made->copy);
        store_reserve_remove(made);
        release(made);
        return code;
    }
    *store = made;
    return LUMI_OK;
}

int lumi_store_close(struct lumi_store *store, struct lumi_error *error)
{
    (void)error;
    if (!store)
        return LUMI_OK;
    if (store->options.synchronous)
        lumi_store_work(store, 0);
    else
        stop_threads(store);
    store_copy_destroy(store->copy);
    store_reserve_remove(store);
    lumi_capture_close(store->capture);
    release(store);
    return LUMI_OK;
}

/* ---- Giving and taking ---- */

static size_t bytes_of(const struct lumi_store_job *job)
{
    size_t bytes = 0;

    if (job->kind != LUMI_STORE_FRAME)
        return 0;
    for (int i = 0; i < job->piece_count && i < LUMI_STORE_IOV; i++)
        bytes += job->pieces[i].iov_len;
    return bytes > job->bytes ? bytes : job->bytes;
}

static int admit(const struct lumi_store *store, size_t bytes, struct lumi_error *error)
{
    if (store->stopping || store->sealed)
        return lumi_fail(error, LUMI_ERR_ARG, "store: the capture is sealed");
    if (store->waiting > 0 && bytes > 0 &&
        (bytes > store->options.memory || store->waiting > store->options.memory - bytes))
        return lumi_fail(error, LUMI_ERR_LIMIT, "store: %zu bytes wait for the disk, there is no room for %zu more",
                         store->waiting, bytes);
    return LUMI_OK;
}

int lumi_store_give(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    struct store_entry *entry = lumi_calloc(1, sizeof *entry);

    if (!entry)
        return lumi_fail(error, LUMI_ERR_NOMEM, "store: out of memory");
    entry->job = *job;
    entry->bytes = bytes_of(job);
    entry->stage = job->kind == LUMI_STORE_FRAME ? STORE_WAITING : STORE_READY;
    pthread_mutex_lock(&store->lock);
    int code = admit(store, entry->bytes, error);
    if (code == LUMI_OK) {
        entry->number = ++store->count;
        entry->given_ns = now_of(store);
        *store->last = entry;
        store->last = &entry->next;
        store->jobs++;
        store->waiting += entry->bytes;
        store->unwritten += entry->stage == STORE_WAITING;
        pthread_cond_signal(entry->stage == STORE_WAITING ? &store->to_write : &store->to_commit);
    }
    pthread_mutex_unlock(&store->lock);
    if (code != LUMI_OK)
        lumi_free(entry);
    return code;
}

bool lumi_store_done(struct lumi_store *store, struct lumi_store_done *done)
{
    pthread_mutex_lock(&store->lock);
    struct store_entry *entry = store->done;
    if (entry) {
        store->done = entry->next;
        if (!store->done)
            store->done_last = &store->done;
    }
    pthread_mutex_unlock(&store->lock);
    if (entry)
        *done = entry->done;
    lumi_free(entry);
    return entry != NULL;
}

void lumi_store_work(struct lumi_store *store, int jobs)
{
    int left = jobs > 0 ? jobs : INT32_MAX;
    bool any = false;

    if (!store->options.synchronous)
        return;
    pthread_mutex_lock(&store->lock);
    while (left > 0 && store->first) {
        struct store_entry *entry;
        int count = 0;
        for (entry = store->first; entry && count < left && entry->job.kind != LUMI_STORE_SEAL; entry = entry->next) {
            if (entry->stage == STORE_WAITING) {
                pthread_mutex_unlock(&store->lock);
                store_write(store, entry);
                pthread_mutex_lock(&store->lock);
                store->unwritten--;
            }
            entry->stage = STORE_READY;
            count++;
        }
        const int before = store->jobs;
        if (!commit_ready(store, count > 0 ? count : 1))
            break;
        left -= before - store->jobs;
        any = true;
    }
    while (store->copy && store_copy_step(store->copy))
        ;
    pthread_mutex_unlock(&store->lock);
    if (any)
        wake(store);
}

size_t lumi_store_room(struct lumi_store *store)
{
    pthread_mutex_lock(&store->lock);
    const size_t room = store->waiting < store->options.memory ? store->options.memory - store->waiting : 0;
    pthread_mutex_unlock(&store->lock);
    return room;
}

void lumi_store_figures(struct lumi_store *store, struct lumi_store_figures *figures)
{
    const int over = 4; /* seconds, of which the one that runs is not counted */

    memset(figures, 0, sizeof *figures);
    pthread_mutex_lock(&store->lock);
    const int64_t now = now_of(store) / 1000000000;
    figures->waiting = store->waiting;
    figures->room = store->waiting < store->options.memory ? store->options.memory - store->waiting : 0;
    figures->jobs = store->jobs;
    figures->stored_bytes = store->stored_bytes;
    if (store->copy)
        store_copy_tell(store->copy, &figures->copy_behind_bytes, &figures->copy_code, figures->copy_text,
                        sizeof figures->copy_text);
    for (int i = 0; i < STORE_SECONDS; i++) {
        const int64_t age = now - store->seconds[i].second;
        if (age > 0 && age <= over)
            figures->bytes_per_second += (double)store->seconds[i].bytes / over;
        if (age < STORE_SECONDS && store->seconds[i].slowest > figures->slowest_seconds)
            figures->slowest_seconds = store->seconds[i].slowest;
    }
    pthread_mutex_unlock(&store->lock);
}
