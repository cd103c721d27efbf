/* Files on the disk: written whole or not at all, synced, and put in order after a crash. */
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define COPY_BUFFER ((size_t)1 << 18)

void capture_digest_hex(struct sha256_ctx *context, char hex[65])
{
    uint8_t digest[SHA256_DIGEST_SIZE];

    sha256_digest(context, sizeof digest, digest);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(hex + 2 * i, 3, "%02x", digest[i]);
}

bool capture_name_ok(const char *name, size_t size)
{
    size_t length = strnlen(name, size);

    if (length == 0 || length >= size || name[0] == '.')
        return false;
    for (const char *c = name; *c; c++)
        if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || *c == '.' ||
              *c == '_' || *c == '-'))
            return false;
    return true;
}

bool capture_file_ok(const char *file)
{
    const char *prefix = CAPTURE_FRAMES "/";
    size_t length = strlen(prefix);

    return !strncmp(file, prefix, length) && capture_name_ok(file + length, LUMI_CAPTURE_PATH - length);
}

int capture_sync_path(const char *path, struct lumi_error *error)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    int code = LUMI_OK;

    if (fd < 0 || fsync(fd) < 0)
        code = lumi_fail_errno(error, path, "sync");
    if (fd >= 0)
        close(fd);
    return code;
}

static int remove_entry(const char *path, const struct stat *status, int type, struct FTW *walk)
{
    (void)status;
    (void)type;
    (void)walk;
    return remove(path);
}

int capture_remove_tree(const char *path, struct lumi_error *error)
{
    if (nftw(path, remove_entry, 16, FTW_DEPTH | FTW_PHYS) != 0)
        return lumi_fail_errno(error, path, "remove");
    return LUMI_OK;
}

int capture_write_file(struct lumi_capture *capture, const char *name, const void *data, size_t size,
                       struct lumi_error *error)
{
    char temporary[64], shown[1024];
    int fd = -1, code = LUMI_OK;

    snprintf(temporary, sizeof temporary, ".%s.tmp", name);
    snprintf(shown, sizeof shown, "%s/%s", capture->path, name);
    fd = openat(capture->dir_fd, temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        return lumi_fail_errno(error, shown, "create");
    if (lumi_write_all(fd, data, size) < 0 || fsync(fd) < 0)
        code = lumi_fail_errno(error, shown, "write");
    if (close(fd) < 0 && code == LUMI_OK)
        code = lumi_fail_errno(error, shown, "close");
    if (code == LUMI_OK && renameat(capture->dir_fd, temporary, capture->dir_fd, name) < 0)
        code = lumi_fail_errno(error, shown, "rename");
    if (code == LUMI_OK && fsync(capture->dir_fd) < 0)
        code = lumi_fail_errno(error, capture->path, "sync");
    if (code != LUMI_OK)
        unlinkat(capture->dir_fd, temporary, 0);
    return code;
}

/* ---- Files not yet synced ---- */

static int add_pending(struct lumi_capture *capture, const char *name, bool synced, struct lumi_error *error)
{
    if (capture->pending_count == capture->pending_capacity) {
        int capacity = capture->pending_capacity ? capture->pending_capacity * 2 : 64;
        struct capture_pending *more = lumi_realloc(capture->pending, (size_t)capacity, sizeof *more);
        if (!more)
            return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
        capture->pending = more;
        capture->pending_capacity = capacity;
    }
    char *copy = lumi_alloc(strlen(name) + 1, 1);
    if (!copy)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
    memcpy(copy, name, strlen(name) + 1);
    capture->pending[capture->pending_count++] = (struct capture_pending){.name = copy, .synced = synced};
    return LUMI_OK;
}

void capture_drop_pending(struct lumi_capture *capture, bool remove)
{
    for (int i = 0; i < capture->pending_count; i++) {
        if (remove)
            unlinkat(capture->frames_fd, capture->pending[i].name, 0);
        lumi_free(capture->pending[i].name);
    }
    lumi_free(capture->pending);
    capture->pending = NULL;
    capture->pending_count = capture->pending_capacity = 0;
}

/* The latest, which is not stored after all. */
static void forget_pending(struct lumi_capture *capture)
{
    lumi_free(capture->pending[--capture->pending_count].name);
}

void capture_give_back(struct lumi_capture *capture)
{
    for (int i = 0; i < capture->pending_count; i++)
        if (capture->pending[i].temporary[0])
            renameat(capture->frames_fd, capture->pending[i].name, capture->frames_fd, capture->pending[i].temporary);
}

int capture_sync_pending(struct lumi_capture *capture, struct lumi_error *error)
{
    if (capture->pending_count == 0)
        return LUMI_OK;
    for (int i = 0; i < capture->pending_count; i++) {
        if (capture->pending[i].synced)
            continue;
        int fd = openat(capture->frames_fd, capture->pending[i].name, O_RDONLY | O_CLOEXEC);
        int failed = fd < 0 || fsync(fd) < 0;
        if (failed)
            lumi_fail_errno(error, capture->pending[i].name, "sync");
        if (fd >= 0)
            close(fd);
        if (failed)
            return error ? error->code : LUMI_ERR_IO;
    }
    if (fsync(capture->frames_fd) < 0)
        return lumi_fail_errno(error, capture->path, "sync");
    return LUMI_OK;
}

/* ---- Storing a frame ---- */

/* Where a frame's bytes come from: a file (path set) or memory. */
struct content {
    const char *path;
    const void *data;
    size_t size;
};

struct stored {
    int64_t bytes;
    char sha256[65];
};

static int copy_content(const struct content *content, int to, const char *shown, struct stored *stored,
                        struct lumi_error *error)
{
    struct sha256_ctx hash;
    char *buffer = NULL;
    int from = -1, code = LUMI_OK;

    sha256_init(&hash);
    if (!content->path) {
        sha256_update(&hash, content->size, content->data);
        stored->bytes = (int64_t)content->size;
        if (lumi_write_all(to, content->data, content->size) < 0)
            code = lumi_fail_errno(error, shown, "write");
        capture_digest_hex(&hash, stored->sha256);
        return code;
    }
    stored->bytes = 0;
    buffer = lumi_alloc(COPY_BUFFER, 1);
    if (!buffer)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", content->path);
    from = open(content->path, O_RDONLY | O_CLOEXEC);
    if (from < 0) {
        code = lumi_fail_errno(error, content->path, "open");
        goto done;
    }
    for (;;) {
        ssize_t got = read(from, buffer, COPY_BUFFER);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            code = lumi_fail_errno(error, content->path, "read");
            goto done;
        }
        if (got == 0)
            break;
        sha256_update(&hash, (size_t)got, (const uint8_t *)buffer);
        stored->bytes += got;
        if (lumi_write_all(to, buffer, (size_t)got) < 0) {
            code = lumi_fail_errno(error, shown, "write");
            goto done;
        }
    }
    capture_digest_hex(&hash, stored->sha256);
done:
    if (from >= 0)
        close(from);
    lumi_free(buffer);
    return code;
}

/* Under the final name, and on the disk unless that waits for the end of a batch or for publish. */
static int place_file(struct lumi_capture *capture, const char *name, const struct content *content,
                      struct stored *stored, struct lumi_error *error)
{
    char temporary[LUMI_CAPTURE_PATH + 8], shown[1024];
    bool later = capture->in_batch || capture->final_path;
    int code;

    snprintf(temporary, sizeof temporary, ".%s.tmp", name);
    snprintf(shown, sizeof shown, "%s/" CAPTURE_FRAMES "/%s", capture->path, name);
    int fd = openat(capture->frames_fd, temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        return lumi_fail_errno(error, shown, "create");
    code = copy_content(content, fd, shown, stored, error);
    if (code == LUMI_OK && !later && fsync(fd) < 0)
        code = lumi_fail_errno(error, shown, "sync");
    if (close(fd) < 0 && code == LUMI_OK)
        code = lumi_fail_errno(error, shown, "close");
    if (code == LUMI_OK && later)
        code = add_pending(capture, name, false, error);
    if (code == LUMI_OK && renameat(capture->frames_fd, temporary, capture->frames_fd, name) < 0)
        code = lumi_fail_errno(error, shown, "rename");
    if (code == LUMI_OK && !later && fsync(capture->frames_fd) < 0)
        code = lumi_fail_errno(error, shown, "sync");
    if (code != LUMI_OK)
        unlinkat(capture->frames_fd, temporary, 0);
    return code;
}

/* What the database says about the frame to be filled. */
struct planned {
    char name[LUMI_CAPTURE_NAME], state[16];
    int width, height;
    bool has_file;
};

static int find_planned(struct lumi_capture *capture, int64_t frame, struct planned *planned, struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    LUMI_TRY(capture_db_prepare(
        capture, &statement, error,
        "SELECT f.name, f.state, l.width, l.height, f.file IS NOT NULL FROM frames f JOIN lenses l ON l.id = "
        "f.lens WHERE f.id = ?",
        "i", frame));
    LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
    if (!row) {
        code = lumi_fail(error, LUMI_ERR_ARG, "%s: no frame %lld", capture->path, (long long)frame);
        goto done;
    }
    capture_db_text(statement, 0, planned->name, sizeof planned->name);
    capture_db_text(statement, 1, planned->state, sizeof planned->state);
    planned->width = sqlite3_column_int(statement, 2);
    planned->height = sqlite3_column_int(statement, 3);
    planned->has_file = sqlite3_column_int(statement, 4) != 0;
done:
    sqlite3_finalize(statement);
    return code;
}

static bool extension_ok(const char *extension)
{
    size_t length = strnlen(extension, 12);

    return length >= 2 && length < 12 && extension[0] == '.' && extension[1] != '.' &&
           capture_name_ok(extension + 1, 12);
}

static int check_store(struct lumi_capture *capture, const struct planned *planned,
                       const struct lumi_capture_file *file, struct lumi_error *error)
{
    const char *label = file->label ? file->label : planned->name;

    if (!file->extension || !extension_ok(file->extension))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: '%s' is no extension for a frame", label,
                         file->extension ? file->extension : "");
    if (strcmp(planned->state, "planned") != 0 && strcmp(planned->state, "triggered") != 0 &&
        (strcmp(planned->state, "rejected") != 0 || planned->has_file))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: frame '%s' is %s already", capture->path, planned->name,
                         planned->state);
    if (file->width != planned->width || file->height != planned->height)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image is %dx%d, its camera %dx%d", label, file->width,
                         file->height, planned->width, planned->height);
    return LUMI_OK;
}

static int record(struct lumi_capture *capture, int64_t frame, const char *name, const struct stored *stored,
                  const struct lumi_capture_file *file, struct lumi_error *error)
{
    char path[LUMI_CAPTURE_PATH];

    snprintf(path, sizeof path, CAPTURE_FRAMES "/%s", name);
    LUMI_TRY(capture_db_enter(capture, error));
    int code = capture_db_run(
        capture, error,
        "UPDATE frames SET state = 'received', reason = NULL, file = ?, bytes = ?, sha256 = ?, width = ?, "
        "height = ?, exposure_s = ?, iso = ?, camera_time_us = nullif(?, ?) WHERE id = ?",
        "titiiddiii", path, stored->bytes, stored->sha256, (int64_t)file->width, (int64_t)file->height,
        file->exposure_s, file->iso, file->camera_time_us, LUMI_NO_TIME, frame);
    if (code == LUMI_OK && file->exif && file->exif_size)
        code = capture_db_run(capture, error, "INSERT INTO exif(frame, data) VALUES(?, ?)", "ib", frame, file->exif,
                              file->exif_size);
    return capture_db_leave(capture, code, error);
}

static int store(struct lumi_capture *capture, int64_t frame, const struct content *content,
                 const struct lumi_capture_file *file, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_NAME + 12];
    struct planned planned;
    struct stored stored;

    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(find_planned(capture, frame, &planned, error));
    LUMI_TRY(check_store(capture, &planned, file, error));
    snprintf(name, sizeof name, "%s%s", planned.name, file->extension);
    LUMI_TRY(place_file(capture, name, content, &stored, error));
    int code = record(capture, frame, name, &stored, file, error);
    if (code != LUMI_OK) {
        unlinkat(capture->frames_fd, name, 0);
        if (capture->in_batch || capture->final_path)
            forget_pending(capture);
    }
    return code;
}

int lumi_capture_store_file(struct lumi_capture *capture, int64_t frame, const char *source_path,
                            const struct lumi_capture_file *file, struct lumi_error *error)
{
    const struct content content = {source_path, NULL, 0};

    return store(capture, frame, &content, file, error);
}

int lumi_capture_store_bytes(struct lumi_capture *capture, int64_t frame, const void *data, size_t size,
                             const struct lumi_capture_file *file, struct lumi_error *error)
{
    const struct content content = {NULL, data, size};

    return store(capture, frame, &content, file, error);
}

int lumi_capture_frames_folder(const struct lumi_capture *capture)
{
    return capture->frames_fd;
}

int lumi_capture_adopt_file(struct lumi_capture *capture, int64_t frame, struct lumi_capture_written *written,
                            const struct lumi_capture_file *file, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_NAME + 12];
    struct stored stored = {.bytes = written->bytes};
    struct planned planned;

    LUMI_TRY(capture_need_writable(capture, error));
    if (!capture->in_batch)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no batch has begun", capture->path);
    LUMI_TRY(find_planned(capture, frame, &planned, error));
    LUMI_TRY(check_store(capture, &planned, file, error));
    snprintf(name, sizeof name, "%s%s", planned.name, file->extension);
    snprintf(stored.sha256, sizeof stored.sha256, "%s", written->sha256);
    snprintf(written->file, sizeof written->file, CAPTURE_FRAMES "/%s", name);
    LUMI_TRY(add_pending(capture, name, true, error));
    struct capture_pending *pending = &capture->pending[capture->pending_count - 1];
    snprintf(pending->temporary, sizeof pending->temporary, "%s", written->temporary);
    int code = LUMI_OK;
    if (renameat(capture->frames_fd, written->temporary, capture->frames_fd, name) < 0)
        code = lumi_fail_errno(error, name, "rename");
    if (code != LUMI_OK) {
        forget_pending(capture);
        return code;
    }
    code = record(capture, frame, name, &stored, file, error);
    if (code != LUMI_OK) {
        renameat(capture->frames_fd, name, capture->frames_fd, written->temporary);
        forget_pending(capture);
    }
    return code;
}

/* ---- After a crash ---- */

static int set_aside(struct lumi_capture *capture, const char *name, struct lumi_error *error)
{
    char to[LUMI_CAPTURE_PATH + 300];

    if (mkdirat(capture->dir_fd, "unclaimed", 0777) < 0 && errno != EEXIST)
        return lumi_fail_errno(error, capture->path, "create unclaimed/");
    snprintf(to, sizeof to, "unclaimed/%s", name);
    for (int i = 1; faccessat(capture->dir_fd, to, F_OK, 0) == 0; i++)
        snprintf(to, sizeof to, "unclaimed/%s.%d", name, i);
    if (renameat(capture->frames_fd, name, capture->dir_fd, to) < 0)
        return lumi_fail_errno(error, name, "set aside in unclaimed/");
    return LUMI_OK;
}

static int reconcile_file(struct lumi_capture *capture, const char *name, struct lumi_error *error)
{
    char path[LUMI_CAPTURE_PATH + 300];
    size_t length = strlen(name);
    int64_t claimed;

    if (name[0] == '.' && length > 5 && !strcmp(name + length - 4, ".tmp")) {
        if (unlinkat(capture->frames_fd, name, 0) < 0)
            return lumi_fail_errno(error, name, "remove");
        return LUMI_OK;
    }
    snprintf(path, sizeof path, CAPTURE_FRAMES "/%s", name);
    LUMI_TRY(capture_db_int(capture, &claimed, error, "SELECT count(*) FROM frames WHERE file = ?", "t", path));
    return claimed ? LUMI_OK : set_aside(capture, name, error);
}

static int reconcile_files(struct lumi_capture *capture, struct lumi_error *error)
{
    int fd = openat(capture->frames_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC), code = LUMI_OK;
    DIR *directory = fd < 0 ? NULL : fdopendir(fd);
    struct dirent *entry;

    if (!directory) {
        code = lumi_fail_errno(error, capture->path, "list " CAPTURE_FRAMES);
        if (fd >= 0)
            close(fd);
        return code;
    }
    while (code == LUMI_OK && (entry = readdir(directory)))
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            code = reconcile_file(capture, entry->d_name, error);
    closedir(directory);
    return code;
}

/* A row that says "received" without its file cannot come from a crash of ours, but from a hand or a bad disk. */
static int reconcile_rows(struct lumi_capture *capture, struct lumi_error *error)
{
    struct lumi_capture_frame *frames;
    int count, code = LUMI_OK;

    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    for (int i = 0; i < count && code == LUMI_OK; i++)
        if (faccessat(capture->dir_fd, frames[i].file, F_OK, 0) < 0)
            code = capture_db_run(capture, error,
                                  "UPDATE frames SET state = 'rejected', reason = 'its file is missing' WHERE id = ?",
                                  "i", frames[i].id);
    lumi_free(frames);
    return code;
}

int capture_reconcile(struct lumi_capture *capture, struct lumi_error *error)
{
    unlinkat(capture->frames_fd, LUMI_CAPTURE_RESERVE, 0);
    LUMI_TRY(reconcile_files(capture, error));
    return reconcile_rows(capture, error);
}
