/* Reading a capture that is being written without taking part in it: a copy in memory, made without SQLite's locks.
 *
 * A reader that SQLite knows of holds a lock; one that is stopped in the middle of a look (it runs when nothing else
 * wants the processor) would keep the writer from sealing. So the bytes are copied, first of the database, then of its
 * log (https://sqlite.org/fileformat2.html, "The Write-Ahead Log"), and the log is put into the copy here. The copy is
 * whole as of the log's last commit where the log's header is the same before and after: then nothing was begun anew,
 * and what a checkpoint wrote into the database meanwhile stands in the log that was read after it. */
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define WAL_HEADER 32
#define WAL_FRAME 24
#define WAL_MAGIC 0x377f0682u /* its lowest bit: checksums of big-endian words */
#define DB_HEADER 100
#define COPY_MAX ((size_t)1 << 30)
#define ATTEMPTS 8
#define FREE_PAGES 256

struct part {
    uint8_t *data;
    size_t size;
};

static uint32_t big(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static uint32_t little(const uint8_t *bytes)
{
    return (uint32_t)bytes[3] << 24 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[1] << 8 | bytes[0];
}

/* Goes on with a checksum of the log over `size` bytes, a multiple of 8. */
static void sum(const uint8_t *bytes, size_t size, bool big_endian, uint32_t sums[2])
{
    for (size_t i = 0; i + 8 <= size; i += 8) {
        sums[0] += (big_endian ? big(bytes + i) : little(bytes + i)) + sums[1];
        sums[1] += (big_endian ? big(bytes + i + 4) : little(bytes + i + 4)) + sums[0];
    }
}

static bool size_is_one_of_pages(uint32_t size)
{
    return size >= 512 && size <= 65536 && (size & (size - 1)) == 0;
}

/* The frames up to the last commit whose checksums are right: *count of them, and how many pages the database has
 * then. False: nothing in it counts. */
static bool measure(const struct part *wal, size_t *count, size_t *pages)
{
    uint32_t sums[2] = {0, 0};

    *count = *pages = 0;
    if (wal->size < WAL_HEADER || (big(wal->data) & ~1u) != WAL_MAGIC || !size_is_one_of_pages(big(wal->data + 8)))
        return false;
    const bool big_endian = big(wal->data) & 1;
    const size_t page = big(wal->data + 8), step = WAL_FRAME + page;
    sum(wal->data, 24, big_endian, sums);
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (sums[0] != big(wal->data + 24) || sums[1] != big(wal->data + 28))
        return false;
#endif
    for (size_t i = 0; (i + 1) * step <= wal->size - WAL_HEADER; i++) {
        const uint8_t *frame = wal->data + WAL_HEADER + i * step;
        sum(frame, 8, big_endian, sums);
        sum(frame + WAL_FRAME, page, big_endian, sums);
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
        if (sums[0] != big(frame + 16) || sums[1] != big(frame + 20))
            break;
#endif
        if (memcmp(frame + 8, wal->data + 16, 8) || big(frame) == 0)
            break;
        if (big(frame + 4)) {
            *count = i + 1;
            *pages = big(frame + 4);
        }
    }
    return *count > 0;
}

int capture_apply_log(uint8_t **data, size_t *size, const uint8_t *log, size_t log_size)
{
    const struct part wal = {(uint8_t *)log, log_size};
    size_t count, pages;

    if (!measure(&wal, &count, &pages))
        return LUMI_OK;
    const size_t page = big(log + 8), whole = pages * page;
    /* A log adds the pages it has, and some that are free; one that claims much more is none of ours. */
    if (whole > COPY_MAX || pages > 2 * (*size / page + count) + FREE_PAGES)
        return LUMI_ERR_LIMIT;
    if (whole != *size) {
        uint8_t *more = lumi_realloc(*data, whole, 1);
        if (!more)
            return LUMI_ERR_NOMEM;
        if (whole > *size)
            memset(more + *size, 0, whole - *size);
        *data = more;
        *size = whole;
    }
    for (size_t i = 0; i < count; i++) {
        const uint8_t *frame = log + WAL_HEADER + i * (WAL_FRAME + page);
        const size_t number = big(frame);
        if (number <= pages)
            memcpy(*data + (number - 1) * page, frame + WAL_FRAME, page);
    }
    return LUMI_OK;
}

/* What the file has now, at most `most` bytes; nothing where it is not there. */
static int read_part(int fd, const char *name, size_t most, struct part *part)
{
    struct stat status;
    const int file = openat(fd, name, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    int code = LUMI_OK;

    *part = (struct part){0};
    if (file < 0)
        return errno == ENOENT ? LUMI_OK : LUMI_ERR_IO;
    if (fstat(file, &status) < 0 || !S_ISREG(status.st_mode))
        code = LUMI_ERR_IO;
    else if ((size_t)status.st_size > COPY_MAX)
        code = LUMI_ERR_LIMIT;
    else if (status.st_size > 0) {
        const size_t size = (size_t)status.st_size < most ? (size_t)status.st_size : most;
        part->data = lumi_alloc(size, 1);
        if (!part->data)
            code = LUMI_ERR_NOMEM;
        while (code == LUMI_OK && part->size < size) {
            const ssize_t got = read(file, part->data + part->size, size - part->size);
            if (got < 0 && errno != EINTR)
                code = LUMI_ERR_IO;
            if (got == 0)
                break;
            part->size += got > 0 ? (size_t)got : 0;
        }
    }
    close(file);
    return code;
}

static int copy_once(int fd, struct part *db, bool *whole)
{
    struct part before = {0}, wal = {0};
    int code;

    *db = (struct part){0};
    LUMI_GOTO(code, out, read_part(fd, CAPTURE_DB "-wal", WAL_HEADER, &before));
    LUMI_GOTO(code, out, read_part(fd, CAPTURE_DB, COPY_MAX, db));
    LUMI_GOTO(code, out, read_part(fd, CAPTURE_DB "-wal", COPY_MAX, &wal));
    *whole = before.size <= wal.size && (wal.size == 0 || before.size == WAL_HEADER) &&
             (before.size == 0 || memcmp(before.data, wal.data, WAL_HEADER) == 0);
    if (*whole)
        code = capture_apply_log(&db->data, &db->size, wal.data, wal.size);
out:
    lumi_free(before.data);
    lumi_free(wal.data);
    if (code != LUMI_OK || !*whole) {
        lumi_free(db->data);
        *db = (struct part){0};
    }
    return code;
}

static int copy(int fd, const char *path, struct part *db, struct lumi_error *error)
{
    bool whole = false;
    int code = LUMI_OK;

    for (int i = 0; i < ATTEMPTS && code == LUMI_OK && !whole; i++)
        code = copy_once(fd, db, &whole);
    if (code == LUMI_ERR_NOMEM)
        return lumi_fail(error, code, "%s: out of memory", path);
    if (code != LUMI_OK)
        return lumi_fail(error, code, "%s/" CAPTURE_DB ": cannot be read", path);
    if (!whole)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s/" CAPTURE_DB ": it is being written too fast to be read", path);
    if (db->size == 0)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no capture (" CAPTURE_DB " is missing)", path);
    if (db->size >= DB_HEADER && db->data[18] == 2 && db->data[19] == 2)
        db->data[18] = db->data[19] = 1; /* the copy has no log beside it */
    return LUMI_OK;
}

int lumi_capture_open_copy(const char *path, struct lumi_capture **capture, struct lumi_error *error)
{
    struct part db = {0};
    int code;
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    *capture = NULL;
    if (fd < 0)
        return lumi_fail_errno(error, path, "open capture");
    LUMI_GOTO(code, out, copy(fd, path, &db, error));
    LUMI_GOTO(code, out, lumi_capture_open_memory(db.data, db.size, path, capture, error));
    (*capture)->copy = db.data;
    db.data = NULL;
    (*capture)->sealed = faccessat(fd, CAPTURE_SEAL, F_OK, 0) == 0;
out:
    lumi_free(db.data);
    close(fd);
    return code;
}

static void stamp_part(int fd, const char *name, uint64_t stamp[3])
{
    struct stat status;

    if (fstatat(fd, name, &status, 0) < 0)
        memset(&status, 0, sizeof status);
    stamp[0] = (uint64_t)status.st_ino;
    stamp[1] = (uint64_t)status.st_size;
    stamp[2] = (uint64_t)status.st_mtim.tv_sec * 1000000000u + (uint64_t)status.st_mtim.tv_nsec;
}

int lumi_capture_changed(const char *path, struct lumi_capture_stamp *stamp, bool *changed, struct lumi_error *error)
{
    struct lumi_capture_stamp now;
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    *changed = false;
    if (fd < 0)
        return lumi_fail_errno(error, path, "open capture");
    stamp_part(fd, CAPTURE_DB, now.numbers);
    stamp_part(fd, CAPTURE_DB "-wal", now.numbers + 3);
    close(fd);
    *changed = memcmp(&now, stamp, sizeof now) != 0;
    *stamp = now;
    return LUMI_OK;
}
