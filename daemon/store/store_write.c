/* A frame's bytes on their way to the disk. */
#include "daemon/store/store_priv.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define COPY_BUFFER ((size_t)1 << 20)

struct target {
    int fd;
    const char *name;
    struct sha256_ctx hash;
    int64_t bytes;
};

static int put(struct target *target, const void *data, size_t size, struct lumi_error *error)
{
    sha256_update(&target->hash, size, data);
    target->bytes += (int64_t)size;
    return lumi_write_all(target->fd, data, size) < 0 ? lumi_fail_errno(error, target->name, "write") : LUMI_OK;
}

static int put_file(struct target *target, const char *path, struct lumi_error *error)
{
    uint8_t *buffer = lumi_alloc(COPY_BUFFER, 1);
    int fd = -1, code = LUMI_OK;

    if (!buffer)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        code = lumi_fail_errno(error, path, "open");
        goto done;
    }
    for (;;) {
        ssize_t got = read(fd, buffer, COPY_BUFFER);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            code = lumi_fail_errno(error, path, "read");
        if (got <= 0)
            break;
        LUMI_GOTO(code, done, put(target, buffer, (size_t)got, error));
    }
done:
    if (fd >= 0)
        close(fd);
    lumi_free(buffer);
    return code;
}

static int put_all(struct target *target, const struct lumi_store_job *job, struct lumi_error *error)
{
    if (job->path)
        return put_file(target, job->path, error);
    for (int i = 0; i < job->piece_count; i++)
        LUMI_TRY(put(target, job->pieces[i].iov_base, job->pieces[i].iov_len, error));
    return LUMI_OK;
}

static void hex(struct sha256_ctx *hash, char text[65])
{
    uint8_t digest[SHA256_DIGEST_SIZE];

    sha256_digest(hash, sizeof digest, digest);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(text + 2 * i, 3, "%02x", digest[i]);
}

static int write_new(struct lumi_store *store, struct store_entry *entry, struct lumi_error *error)
{
    struct target target = {.fd = -1, .name = entry->temporary};
    int code;

    sha256_init(&target.hash);
    target.fd = openat(store->folder, entry->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (target.fd < 0)
        return lumi_fail_errno(error, lumi_capture_path(store->capture), "create a frame's file");
    code = put_all(&target, &entry->job, error);
    if (code == LUMI_OK && fsync(target.fd) < 0)
        code = lumi_fail_errno(error, entry->temporary, "sync");
    if (close(target.fd) < 0 && code == LUMI_OK)
        code = lumi_fail_errno(error, entry->temporary, "close");
    entry->written = target.bytes;
    hex(&target.hash, entry->sha256);
    if (code != LUMI_OK)
        unlinkat(store->folder, entry->temporary, 0);
    return code;
}

void store_write(struct lumi_store *store, struct store_entry *entry)
{
    struct lumi_error error = {0};
    int code = LUMI_OK;

    if (entry->job.prepare)
        code = entry->job.prepare(entry->job.context, &entry->job, &error);
    if (code == LUMI_OK && store->options.disk)
        code = store->options.disk(store->options.context, entry->bytes, &error);
    if (code == LUMI_OK) {
        snprintf(entry->temporary, sizeof entry->temporary, ".s%llu.tmp", (unsigned long long)entry->number);
        code = write_new(store, entry, &error);
        if (code != LUMI_OK)
            entry->temporary[0] = '\0';
    }
    entry->code = code;
    snprintf(entry->text, sizeof entry->text, "%.511s", error.text);
}
