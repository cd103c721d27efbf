/* A capture as one tar. Where each byte comes from is laid out before the first is read: a header and a file after
 * another, so that any part of the whole can be read at any time. libarchive makes the headers. */
#include "daemon/shelf/shelf.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <archive.h>
#include <archive_entry.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define BLOCK 512
#define END (2 * BLOCK)
#define DEPTH_MAX 8
#define PATH_MOST 1024
#define HEADER_MOST 8192

struct part {
    char *path; /* in the capture */
    int64_t begin, size;
    uint8_t *header;
    size_t header_size;
};

struct lumi_shelf_bundle {
    int fd; /* of the capture */
    struct part *parts;
    int count, room;
    int64_t size, time;
    char seal[65];
    int opened, opened_fd; /* the file that was read last; −1 none */
};

static int64_t padded(int64_t size)
{
    return (size + BLOCK - 1) / BLOCK * BLOCK;
}

/* ---- what there is ---- */

static int add(struct lumi_shelf_bundle *b, const char *path, int64_t size, struct lumi_error *error)
{
    if (b->count == b->room) {
        const int room = b->room ? 2 * b->room : 256;
        struct part *parts = lumi_realloc(b->parts, (size_t)room, sizeof *parts);
        if (!parts)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a bundle");
        b->parts = parts;
        b->room = room;
    }
    const size_t length = strlen(path) + 1;
    char *copy = lumi_alloc(length, 1);
    if (!copy)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a bundle");
    memcpy(copy, path, length);
    b->parts[b->count++] = (struct part){.path = copy, .size = size};
    return LUMI_OK;
}

static int walk(struct lumi_shelf_bundle *b, const char *folder, int depth, struct lumi_error *error)
{
    const int fd = openat(b->fd, folder[0] ? folder : ".", O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *directory = fd >= 0 ? fdopendir(fd) : NULL;
    struct dirent *entry;
    int code = LUMI_OK;

    if (!directory) {
        code = lumi_fail_errno(error, folder, "reading it");
        if (fd >= 0)
            close(fd);
        return code;
    }
    while (code == LUMI_OK && (entry = readdir(directory))) {
        char path[PATH_MOST];
        struct stat is;
        if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
            continue;
        if (snprintf(path, sizeof path, "%s%s%s", folder, folder[0] ? "/" : "", entry->d_name) >= (int)sizeof path ||
            fstatat(b->fd, path, &is, AT_SYMLINK_NOFOLLOW))
            code = lumi_fail(error, LUMI_ERR_IO, "%s: it cannot be read", entry->d_name);
        else if (S_ISDIR(is.st_mode) && depth < DEPTH_MAX)
            code = walk(b, path, depth + 1, error);
        else if (S_ISREG(is.st_mode))
            code = add(b, path, is.st_size, error);
    }
    closedir(directory);
    return code;
}

static int by_path(const void *a, const void *b)
{
    return strcmp(((const struct part *)a)->path, ((const struct part *)b)->path);
}

/* ---- headers ---- */

static int make_header(const struct lumi_shelf_bundle *b, struct part *part, const char *name, struct lumi_error *error)
{
    uint8_t bytes[HEADER_MOST];
    char path[PATH_MOST + 300];
    size_t used = 0;
    struct archive *archive = archive_write_new();
    struct archive_entry *entry = archive_entry_new();
    int code = LUMI_ERR_NOMEM;

    if (!archive || !entry)
        goto done;
    snprintf(path, sizeof path, "%s/%s", name, part->path);
    archive_entry_set_pathname(entry, path);
    archive_entry_set_size(entry, part->size);
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_mtime(entry, b->time, 0);
    archive_write_set_format_pax_restricted(archive);
    archive_write_set_bytes_per_block(archive, 0); /* what is written is there at once */
    if (archive_write_open_memory(archive, bytes, sizeof bytes, &used) != ARCHIVE_OK ||
        archive_write_header(archive, entry) < ARCHIVE_WARN)
        goto done;
    part->header = lumi_alloc(used ? used : 1, 1);
    if (!part->header)
        goto done;
    memcpy(part->header, bytes, used);
    part->header_size = used;
    code = used && used % BLOCK == 0 ? LUMI_OK : LUMI_ERR_INTERNAL;
done:
    if (archive) {
        archive_write_fail(archive);  /* the file itself is not its business */
        archive_write_close(archive); /* which it does not do by itself then, nor let go of what it has */
        archive_write_free(archive);
    }
    archive_entry_free(entry);
    return code == LUMI_OK ? code : lumi_fail(error, code, "%s: no header could be made", part->path);
}

static int lay_out(struct lumi_shelf_bundle *b, const char *name, struct lumi_error *error)
{
    qsort(b->parts, (size_t)b->count, sizeof *b->parts, by_path);
    for (int i = 0; i < b->count; i++) {
        struct part *part = &b->parts[i];
        LUMI_TRY(make_header(b, part, name, error));
        part->begin = b->size;
        b->size += (int64_t)part->header_size + padded(part->size);
    }
    b->size += END;
    return LUMI_OK;
}

int lumi_shelf_bundle_open(const char *capture, const char *name, struct lumi_shelf_bundle **bundle,
                           struct lumi_error *error)
{
    struct lumi_shelf_bundle *b = lumi_calloc(1, sizeof *b);
    struct stat is;
    int code;

    if (!b)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a bundle");
    b->opened = b->opened_fd = -1;
    b->fd = open(capture, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (b->fd < 0) {
        code = lumi_fail_errno(error, capture, "opening it");
        goto failed;
    }
    LUMI_GOTO(code, failed, lumi_capture_seal_of(capture, b->seal, error));
    if (!b->seal[0] || fstatat(b->fd, "tagmanifest-sha256.txt", &is, AT_SYMLINK_NOFOLLOW)) {
        code =
            lumi_fail(error, LUMI_ERR_BUSY, "%s: it is not sealed: only what changes no more is carried away", capture);
        goto failed;
    }
    b->time = is.st_mtime; /* of the sealing */
    LUMI_GOTO(code, failed, walk(b, "", 0, error));
    LUMI_GOTO(code, failed, lay_out(b, name, error));
    *bundle = b;
    return LUMI_OK;
failed:
    lumi_shelf_bundle_close(b);
    return code;
}

void lumi_shelf_bundle_close(struct lumi_shelf_bundle *b)
{
    if (!b)
        return;
    for (int i = 0; i < b->count; i++) {
        lumi_free(b->parts[i].path);
        lumi_free(b->parts[i].header);
    }
    lumi_free(b->parts);
    if (b->opened_fd >= 0)
        close(b->opened_fd);
    if (b->fd >= 0)
        close(b->fd);
    lumi_free(b);
}

int64_t lumi_shelf_bundle_size(const struct lumi_shelf_bundle *b)
{
    return b->size;
}

const char *lumi_shelf_bundle_seal(const struct lumi_shelf_bundle *b)
{
    return b->seal;
}

/* ---- reading ---- */

/* The part that `offset` lies in, or `count` for what ends the whole. */
static int part_at(const struct lumi_shelf_bundle *b, int64_t offset)
{
    int low = 0, high = b->count;

    while (low < high) {
        const int middle = (low + high) / 2;
        const struct part *part = &b->parts[middle];
        if (offset >= part->begin + (int64_t)part->header_size + padded(part->size))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int open_part(struct lumi_shelf_bundle *b, int number, struct lumi_error *error)
{
    const struct part *part = &b->parts[number];
    struct stat is;

    if (b->opened == number)
        return LUMI_OK;
    if (b->opened_fd >= 0)
        close(b->opened_fd);
    b->opened = -1;
    b->opened_fd = openat(b->fd, part->path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    if (b->opened_fd < 0)
        return lumi_fail_errno(error, part->path, "opening it");
    if (fstat(b->opened_fd, &is) || is.st_size != part->size)
        return lumi_fail(error, LUMI_ERR_IO, "%s: it has changed", part->path);
    b->opened = number;
    return LUMI_OK;
}

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Some bytes from there on, one at least. */
static int read_some(struct lumi_shelf_bundle *b, int64_t offset, uint8_t *data, size_t size, size_t *got,
                     struct lumi_error *error)
{
    const int number = part_at(b, offset);
    const struct part *part = number < b->count ? &b->parts[number] : NULL;
    int64_t at = part ? offset - part->begin : 0;

    if (part && at < (int64_t)part->header_size) {
        *got = (size_t)least((int64_t)size, (int64_t)part->header_size - at);
        memcpy(data, part->header + at, *got);
        return LUMI_OK;
    }
    at -= part ? (int64_t)part->header_size : 0;
    if (!part || at >= part->size) { /* what fills a block up, what ends the whole */
        *got = (size_t)least((int64_t)size, part ? padded(part->size) - at : b->size - offset);
        memset(data, 0, *got);
        return LUMI_OK;
    }
    LUMI_TRY(open_part(b, number, error));
    const ssize_t read = pread(b->opened_fd, data, (size_t)least((int64_t)size, part->size - at), at);
    if (read <= 0)
        return lumi_fail(error, LUMI_ERR_IO, "%s: it is shorter than it was", part->path);
    *got = (size_t)read;
    return LUMI_OK;
}

int lumi_shelf_bundle_read(struct lumi_shelf_bundle *b, int64_t offset, void *data, size_t size, size_t *got,
                           struct lumi_error *error)
{
    size_t part = 0;

    *got = 0;
    while (*got < size && offset + (int64_t)*got < b->size) {
        LUMI_TRY(read_some(b, offset + (int64_t)*got, (uint8_t *)data + *got, size - *got, &part, error));
        *got += part;
    }
    return LUMI_OK;
}
