/* Sealing: the database into one file, the directory into a BagIt bag (RFC 8493), and back. */
#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define BAGIT "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n"

static const char *const tag_files[] = {"bagit.txt", "bag-info.txt", "manifest-sha256.txt"};

static void append(struct lumi_writer *writer, const char *text)
{
    lumi_write_bytes(writer, text, strlen(text));
}

static void append_line(struct lumi_writer *writer, const char *hex, const char *path)
{
    append(writer, hex);
    append(writer, "  ");
    append(writer, path);
    append(writer, "\n");
}

int capture_hash_file(int dir_fd, const char *name, char hex[65], int (*progress)(void *context, int64_t bytes),
                      void *context, struct lumi_error *error)
{
    const size_t size = (size_t)1 << 18;
    uint8_t *buffer = lumi_alloc(size, 1);
    struct sha256_ctx hash;
    int code = LUMI_OK, fd = -1;

    if (!buffer)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", name);
    sha256_init(&hash);
    fd = openat(dir_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0) {
        code = lumi_fail_errno(error, name, "open");
        goto done;
    }
    for (;;) {
        ssize_t got = read(fd, buffer, size);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            code = lumi_fail_errno(error, name, "read");
            goto done;
        }
        if (got == 0)
            break;
        sha256_update(&hash, (size_t)got, buffer);
        if (progress && progress(context, got)) {
            code = lumi_fail(error, LUMI_ERR_CANCELLED, "%s: cancelled", name);
            goto done;
        }
    }
    capture_digest_hex(&hash, hex);
done:
    if (fd >= 0)
        close(fd);
    lumi_free(buffer);
    return code;
}

static int by_file(const void *a, const void *b)
{
    return strcmp(((const struct lumi_capture_frame *)a)->file, ((const struct lumi_capture_frame *)b)->file);
}

/* The lines of all frames' files, from the checksums taken when they came in: a file that has changed since is found,
 * not blessed. Their number of files and bytes as well. */
static int list_frames(struct lumi_capture *capture, struct lumi_writer *manifest, int64_t *files, int64_t *bytes,
                       struct lumi_error *error)
{
    struct lumi_capture_frame *frames;
    int count, code = LUMI_OK;

    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    if (count)
        qsort(frames, (size_t)count, sizeof *frames, by_file);
    for (int i = 0; i < count; i++) {
        const struct lumi_capture_frame *frame = &frames[i];
        struct stat status;
        if (!frame->file[0])
            continue;
        if (fstatat(capture->dir_fd, frame->file, &status, AT_SYMLINK_NOFOLLOW) < 0) {
            if (errno == ENOENT && frame->state == LUMI_FRAME_REJECTED)
                continue;
            code = lumi_fail_errno(error, frame->file, "seal");
            break;
        }
        if ((int64_t)status.st_size != frame->bytes) {
            code = lumi_fail(error, LUMI_ERR_CHECKSUM, "%s/%s: %lld bytes, %lld were stored", capture->path,
                             frame->file, (long long)status.st_size, (long long)frame->bytes);
            break;
        }
        append_line(manifest, frame->sha256, frame->file);
        ++*files;
        *bytes += frame->bytes;
    }
    lumi_free(frames);
    return code;
}

static int close_database(struct lumi_capture *capture, struct lumi_error *error)
{
    sqlite3_stmt *statement;
    char mode[16] = "";
    bool row;
    int64_t busy = 1;

    LUMI_TRY(capture_db_int(capture, &busy, error, "PRAGMA wal_checkpoint(TRUNCATE)", ""));
    LUMI_TRY(capture_db_prepare(capture, &statement, error, "PRAGMA journal_mode = DELETE", ""));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && row)
        capture_db_text(statement, 0, mode, sizeof mode);
    sqlite3_finalize(statement);
    LUMI_TRY(code);
    if (busy || strcmp(mode, "delete") != 0)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: somebody is reading the capture; it cannot be sealed yet",
                         capture->path);
    capture->writable = false;
    capture_db_close(capture);
    /* Left by a process killed while it began a journal; SQLite ignores it, a bag must not hold it. */
    unlinkat(capture->dir_fd, CAPTURE_DB "-journal", 0);
    char *path = lumi_capture_join(capture, CAPTURE_DB);
    if (!path)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
    code = capture_sync_path(path, error);
    lumi_free(path);
    return code;
}

static int write_tags(struct lumi_capture *capture, const char *date, struct lumi_writer *manifest, int64_t files,
                      int64_t bytes, struct lumi_error *error)
{
    struct lumi_writer tags;
    struct stat status;
    char info[512], hex[65];
    int code;

    lumi_writer_init(&tags);
    LUMI_GOTO(code, done, capture_hash_file(capture->dir_fd, CAPTURE_DB, hex, NULL, NULL, error));
    append_line(manifest, hex, CAPTURE_DB);
    if (fstatat(capture->dir_fd, CAPTURE_DB, &status, 0) < 0) {
        code = lumi_fail_errno(error, capture->path, "seal");
        goto done;
    }
    snprintf(info, sizeof info, "%s%s%sBag-Software-Agent: lumisphere " LUMI_VERSION "\nPayload-Oxum: %lld.%lld\n",
             date ? "Bagging-Date: " : "", date ? date : "", date ? "\n" : "", (long long)(bytes + status.st_size),
             (long long)(files + 1));
    if (manifest->failed) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
        goto done;
    }
    LUMI_GOTO(code, done, capture_write_file(capture, "bagit.txt", BAGIT, strlen(BAGIT), error));
    LUMI_GOTO(code, done, capture_write_file(capture, "bag-info.txt", info, strlen(info), error));
    LUMI_GOTO(code, done, capture_write_file(capture, "manifest-sha256.txt", manifest->data, manifest->size, error));
    for (int i = 0; i < 3; i++) {
        LUMI_GOTO(code, done, capture_hash_file(capture->dir_fd, tag_files[i], hex, NULL, NULL, error));
        append_line(&tags, hex, tag_files[i]);
    }
    if (tags.failed) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
        goto done;
    }
    code = capture_write_file(capture, CAPTURE_SEAL, tags.data, tags.size, error);
done:
    lumi_writer_finish(&tags);
    return code;
}

/* RFC 8493 knows no more than "YYYY-MM-DD". */
static bool date_ok(const char *date)
{
    if (strlen(date) != 10)
        return false;
    for (int i = 0; i < 10; i++)
        if (i == 4 || i == 7 ? date[i] != '-' : date[i] < '0' || date[i] > '9')
            return false;
    return true;
}

int lumi_capture_seal(struct lumi_capture *capture, const char *date, struct lumi_error *error)
{
    struct lumi_writer manifest;
    int64_t files = 0, bytes = 0;
    int code;

    LUMI_TRY(capture_need_writable(capture, error));
    if (capture->in_batch)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: a batch is not committed", capture->path);
    if (date && !date_ok(date))
        return lumi_fail(error, LUMI_ERR_ARG, "'%s' is no date", date);
    lumi_writer_init(&manifest);
    LUMI_GOTO(code, done, list_frames(capture, &manifest, &files, &bytes, error));
    LUMI_GOTO(code, done, close_database(capture, error));
    LUMI_GOTO(code, done, write_tags(capture, date, &manifest, files, bytes, error));
    capture->sealed = true;
done:
    lumi_writer_finish(&manifest);
    return code;
}

int capture_unseal(struct lumi_capture *capture, struct lumi_error *error)
{
    const char *const names[] = {CAPTURE_SEAL, tag_files[2], tag_files[1], tag_files[0]};

    for (int i = 0; i < 4; i++) {
        if (unlinkat(capture->dir_fd, names[i], 0) < 0 && errno != ENOENT)
            return lumi_fail_errno(error, capture->path, "unseal");
        if (i == 0 && fsync(capture->dir_fd) < 0)
            return lumi_fail_errno(error, capture->path, "sync");
    }
    return LUMI_OK;
}

int lumi_capture_seal_of(const char *path, char seal[65], struct lumi_error *error)
{
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int code = LUMI_OK;

    seal[0] = '\0';
    if (fd < 0)
        return lumi_fail_errno(error, path, "opening it");
    if (faccessat(fd, CAPTURE_SEAL, F_OK, 0) == 0)
        code = capture_hash_file(fd, CAPTURE_SEAL, seal, NULL, NULL, error);
    close(fd);
    return code;
}
