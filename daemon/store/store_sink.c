/* Bytes on their way past the page cache. What is aligned in memory and in the file (a head of whole 4096 bytes, then
 * pixels in pages of their own) is not copied.
 *
 * Measured (docs/capture-format.md): written in the ordinary way and synced, frames of 5.5 MB reach a third of the
 * speed that they reach with O_DIRECT from several threads, and push everything else out of the page cache. io_uring is
 * not used: hashing a block takes much longer than its call costs, and the threads keep the disk's queue filled. */
#define _GNU_SOURCE /* O_DIRECT, fallocate, syscall */
#include "daemon/store/store_sink.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#define ALIGN ((size_t)4096)      /* what every disk in use is content with */
#define BLOCK ((size_t)256 << 10) /* stays in a processor's second-level cache between copying, hashing and writing */
#define SPAN ((size_t)1 << 20)    /* written at once where the caller's bytes are aligned */

int store_sink_open(struct store_sink *sink, int folder, const char *name, struct lumi_error *error)
{
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;

    memset(sink, 0, sizeof *sink);
    sink->name = name;
    sink->direct = true;
    sink->fd = openat(folder, name, flags | O_DIRECT, 0666);
    if (sink->fd < 0 && errno == EINVAL) {
        sink->direct = false;
        unlinkat(folder, name, 0); /* Linux makes the file before it refuses the flag */
        sink->fd = openat(folder, name, flags, 0666);
    }
    if (sink->fd < 0)
        return lumi_fail_errno(error, name, "create");
    sink->memory = lumi_alloc(BLOCK + ALIGN, 1);
    if (!sink->memory) {
        close(sink->fd);
        sink->fd = -1;
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", name);
    }
    sink->block = (uint8_t *)(((uintptr_t)sink->memory + ALIGN - 1) / ALIGN * ALIGN);
    sha256_init(&sink->hash);
    return LUMI_OK;
}

static int put_direct(struct store_sink *sink, const uint8_t *data, size_t size, struct lumi_error *error)
{
    while (size > 0) {
        const ssize_t put = write(sink->fd, data, size);
        if (put < 0 && errno == EINTR)
            continue;
        if (put < 0 && errno == EINVAL && sink->direct) { /* a disk with larger sectors, or a part that was written */
            if (fcntl(sink->fd, F_SETFL, 0) < 0)
                return lumi_fail_errno(error, sink->name, "write");
            sink->direct = false;
            continue;
        }
        if (put < 0)
            return lumi_fail_errno(error, sink->name, "write");
        data += put;
        size -= (size_t)put;
    }
    return LUMI_OK;
}

static int flush(struct store_sink *sink, struct lumi_error *error)
{
    sha256_update(&sink->hash, sink->held, sink->block);
    LUMI_TRY(put_direct(sink, sink->block, sink->held, error));
    sink->held = 0;
    return LUMI_OK;
}

int store_sink_put(struct store_sink *sink, const void *data, size_t size, struct lumi_error *error)
{
    const uint8_t *from = data;

    sink->at += (int64_t)size;
    while (size > 0) {
        if (sink->held % ALIGN == 0 && size >= ALIGN && (uintptr_t)from % ALIGN == 0) {
            if (sink->held > 0)
                LUMI_TRY(flush(sink, error));
            const size_t span = (size < SPAN ? size : SPAN) / ALIGN * ALIGN;
            sha256_update(&sink->hash, span, from);
            LUMI_TRY(put_direct(sink, from, span, error));
            from += span;
            size -= span;
            continue;
        }
        const size_t room = BLOCK - sink->held, part = size < room ? size : room;
        memcpy(sink->block + sink->held, from, part);
        sink->held += part;
        from += part;
        size -= part;
        if (sink->held == BLOCK)
            LUMI_TRY(flush(sink, error));
    }
    return LUMI_OK;
}

int store_sink_put_file(struct store_sink *sink, int fd, const char *path, int (*yield)(void *context), void *context,
                        struct lumi_error *error)
{
    for (;;) {
        if (yield && yield(context))
            return lumi_fail(error, LUMI_ERR_CANCELLED, "%s: cancelled", path);
        const ssize_t got = read(fd, sink->block + sink->held, BLOCK - sink->held);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return lumi_fail_errno(error, path, "read");
        if (got == 0)
            return LUMI_OK;
        sink->at += got;
        sink->held += (size_t)got;
        if (sink->held == BLOCK)
            LUMI_TRY(flush(sink, error));
    }
}

/* The last block is written whole, as O_DIRECT wants it, and what is over is cut off. */
static int put_rest(struct store_sink *sink, struct lumi_error *error)
{
    const size_t whole = (sink->held + ALIGN - 1) / ALIGN * ALIGN;

    if (!sink->held)
        return LUMI_OK;
    if (!sink->direct || whole == sink->held)
        return flush(sink, error);
    sha256_update(&sink->hash, sink->held, sink->block);
    memset(sink->block + sink->held, 0, whole - sink->held);
    LUMI_TRY(put_direct(sink, sink->block, whole, error));
    return ftruncate(sink->fd, sink->at) < 0 ? lumi_fail_errno(error, sink->name, "cut") : LUMI_OK;
}

static void hex(struct sha256_ctx *hash, char text[65])
{
    uint8_t digest[SHA256_DIGEST_SIZE];

    sha256_digest(hash, sizeof digest, digest);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(text + 2 * i, 3, "%02x", digest[i]);
}

int store_sink_close(struct store_sink *sink, int code, int64_t *bytes, char sha256[65], struct lumi_error *error)
{
    if (code == LUMI_OK)
        code = put_rest(sink, error);
    if (code == LUMI_OK && fdatasync(sink->fd) < 0)
        code = lumi_fail_errno(error, sink->name, "sync");
    if (close(sink->fd) < 0 && code == LUMI_OK)
        code = lumi_fail_errno(error, sink->name, "close");
    sink->fd = -1;
    *bytes = sink->at;
    hex(&sink->hash, sha256);
    lumi_free(sink->memory);
    sink->memory = NULL;
    return code;
}

void store_be_humble(void)
{
    /* ioprio_set(2) has no function of its own: IOPRIO_WHO_PROCESS 1, class idle 3 << 13. Where it is refused the
     * thread is no worse than others. */
    syscall(SYS_ioprio_set, 1, 0, 3 << 13);
    setpriority(PRIO_PROCESS, (id_t)syscall(SYS_gettid), 15); /* a thread's own, as nice(2) says of Linux */
}

int store_reserve(int folder, const char *name, int64_t bytes)
{
    const int fd = openat(folder, name, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);

    if (fd < 0)
        return -1;
    const int result = fallocate(fd, 0, 0, bytes);
    const bool unknown = result < 0 && errno == EOPNOTSUPP;
    close(fd);
    if (result < 0)
        unlinkat(folder, name, 0);
    return result < 0 && !unknown ? -1 : 0;
}
