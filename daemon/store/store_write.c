/* A frame's bytes on their way to the disk. */
#include "daemon/store/store_priv.h"
#include "daemon/store/store_sink.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int put_path(struct store_sink *sink, const char *path, struct lumi_error *error)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);

    if (fd < 0)
        return lumi_fail_errno(error, path, "open");
    const int code = store_sink_put_file(sink, fd, path, NULL, NULL, error);
    close(fd);
    return code;
}

static int put_all(struct store_sink *sink, const struct lumi_store_job *job, struct lumi_error *error)
{
    if (job->path)
        return put_path(sink, job->path, error);
    for (int i = 0; i < job->piece_count; i++)
        LUMI_TRY(store_sink_put(sink, job->pieces[i].iov_base, job->pieces[i].iov_len, error));
    return LUMI_OK;
}

static int write_new(struct lumi_store *store, struct store_entry *entry, struct lumi_error *error)
{
    struct store_sink sink;

    LUMI_TRY(store_sink_open(&sink, store->folder, entry->temporary, error));
    int code = put_all(&sink, &entry->job, error);
    code = store_sink_close(&sink, code, &entry->written, entry->sha256, error);
    if (code != LUMI_OK)
        unlinkat(store->folder, entry->temporary, 0);
    return code;
}

/* ---- Room for rows ---- */

#define RESERVE_BYTES ((int64_t)8 << 20)

int store_reserve_kept(struct lumi_store *store, struct lumi_error *error)
{
    pthread_mutex_lock(&store->lock);
    if (store->full && store_reserve(store->folder, LUMI_CAPTURE_RESERVE, RESERVE_BYTES) == 0)
        store->full = false;
    const bool full = store->full;
    pthread_mutex_unlock(&store->lock);
    return full ? lumi_fail(error, LUMI_ERR_NOSPACE, "the disk is full") : LUMI_OK;
}

bool store_reserve_spend(struct lumi_store *store)
{
    pthread_mutex_lock(&store->lock);
    store->full = true;
    pthread_mutex_unlock(&store->lock);
    return unlinkat(store->folder, LUMI_CAPTURE_RESERVE, 0) == 0;
}

void store_reserve_remove(struct lumi_store *store)
{
    unlinkat(store->folder, LUMI_CAPTURE_RESERVE, 0);
}

/* ---- A frame ---- */

void store_write(struct lumi_store *store, struct store_entry *entry)
{
    struct lumi_error error = {0};
    int code = LUMI_OK;

    if (entry->job.prepare)
        code = entry->job.prepare(entry->job.context, &entry->job, &error);
    if (code == LUMI_OK && entry->job.piece_count > LUMI_STORE_IOV)
        code = lumi_fail(&error, LUMI_ERR_ARG, "a frame in %d pieces", entry->job.piece_count);
    if (code == LUMI_OK && store->options.disk)
        code = store->options.disk(store->options.context, entry->bytes, &error);
    if (code == LUMI_OK)
        code = store_reserve_kept(store, &error);
    if (code == LUMI_OK) {
        snprintf(entry->temporary, sizeof entry->temporary, ".s%llu.tmp", (unsigned long long)entry->number);
        code = write_new(store, entry, &error);
    }
    if (code != LUMI_OK) {
        char place[512];
        entry->temporary[0] = '\0';
        snprintf(place, sizeof place, "%.511s", lumi_capture_path(store->capture));
        lumi_fail_prefix(&error, "%s", place);
    }
    entry->code = code;
    snprintf(entry->text, sizeof entry->text, "%.511s", error.text);
}
