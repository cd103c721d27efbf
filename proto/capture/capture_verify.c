/* Verifying: rows against files, files against checksums, the bag against its manifests. */
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define NAME_MAX_BYTES 512
#define DEPTH_MAX 8
#define MANIFEST_MAX ((int64_t)256 << 20)

/* One file of the directory, with what its row and its manifest say. */
struct item {
    char *path;
    int64_t bytes;
    bool present, tag;        /* tag: outside data/ */
    bool in_row, in_manifest; /* named by a frame's row, by a manifest */
    int64_t row_bytes;
    char row_hash[65], manifest_hash[65];
};

struct check {
    const char *path;
    int dir_fd;
    struct item *items;
    int count, capacity;
    lumi_verify_fn problem;
    lumi_verify_progress_fn progress;
    void *context;
    int64_t done, total;
    struct lumi_verify_result *result;
    struct lumi_error *error;
};

static void report(struct check *check, const char *file, const char *text)
{
    check->result->problems++;
    if (check->problem)
        check->problem(check->context, file, text);
}

/* ---- The list of files ---- */

static int add_item(struct check *check, const char *path, struct item **item)
{
    if (check->count == check->capacity) {
        int capacity = check->capacity ? check->capacity * 2 : 256;
        struct item *more = lumi_realloc(check->items, (size_t)capacity, sizeof *more);
        if (!more)
            return lumi_fail(check->error, LUMI_ERR_NOMEM, "%s: out of memory", check->path);
        check->items = more;
        check->capacity = capacity;
    }
    size_t size = strlen(path) + 1;
    char *copy = lumi_alloc(size, 1);
    if (!copy)
        return lumi_fail(check->error, LUMI_ERR_NOMEM, "%s: out of memory", check->path);
    memcpy(copy, path, size);
    *item = &check->items[check->count++];
    memset(*item, 0, sizeof **item);
    (*item)->path = copy;
    (*item)->tag = strncmp(path, "data/", 5) != 0;
    return LUMI_OK;
}

static int by_path(const void *a, const void *b)
{
    return strcmp(((const struct item *)a)->path, ((const struct item *)b)->path);
}

/* Files on the disk come first and stay sorted; what rows and manifests name beyond them is added behind. */
static struct item *find(const struct check *check, int sorted, const char *path)
{
    int low = 0, high = sorted;

    while (low < high) {
        int middle = (low + high) / 2, order = strcmp(check->items[middle].path, path);
        if (order == 0)
            return &check->items[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

static int walk(struct check *check, const char *folder, int depth);

static int walk_entry(struct check *check, const char *folder, const char *name, int depth)
{
    char path[NAME_MAX_BYTES];
    struct stat status;
    struct item *item;

    int length = snprintf(path, sizeof path, "%s/%s", folder, name);
    if (length < 0 || (size_t)length >= sizeof path) {
        report(check, folder, "holds a file whose path is too long");
        return LUMI_OK;
    }
    if (fstatat(check->dir_fd, path, &status, AT_SYMLINK_NOFOLLOW) < 0) {
        report(check, path, strerror(errno));
        return LUMI_OK;
    }
    if (S_ISDIR(status.st_mode)) {
        if (depth < DEPTH_MAX)
            return walk(check, path, depth + 1);
        report(check, path, "lies too deep");
        return LUMI_OK;
    }
    if (!S_ISREG(status.st_mode)) {
        report(check, path, "is no plain file");
        return LUMI_OK;
    }
    LUMI_TRY(add_item(check, path, &item));
    item->present = true;
    item->bytes = (int64_t)status.st_size;
    check->total += item->bytes;
    return LUMI_OK;
}

static int walk(struct check *check, const char *folder, int depth)
{
    int fd = openat(check->dir_fd, folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW), code = LUMI_OK;
    DIR *directory = fd < 0 ? NULL : fdopendir(fd);
    struct dirent *entry;

    if (!directory) {
        report(check, folder, strerror(errno));
        if (fd >= 0)
            close(fd);
        return LUMI_OK;
    }
    while (code == LUMI_OK && (entry = readdir(directory)))
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            code = walk_entry(check, folder, entry->d_name, depth);
    closedir(directory);
    return code;
}

/* ---- The database ---- */

static int check_integrity(struct check *check, struct lumi_capture *capture)
{
    sqlite3_stmt *statement;
    char text[256];
    bool row = true;

    int code = capture_db_prepare(capture, &statement, check->error, "PRAGMA integrity_check(10)", "");
    while (code == LUMI_OK && row) {
        code = capture_db_step(capture, statement, &row, check->error);
        if (code != LUMI_OK || !row)
            break;
        capture_db_text(statement, 0, text, sizeof text);
        if (strcmp(text, "ok") != 0)
            report(check, CAPTURE_DB, text);
    }
    sqlite3_finalize(statement);
    LUMI_TRY(code);
    LUMI_TRY(capture_db_prepare(capture, &statement, check->error, "PRAGMA foreign_key_check", ""));
    code = capture_db_step(capture, statement, &row, check->error);
    if (code == LUMI_OK && row)
        report(check, CAPTURE_DB, "a row refers to one that is not there");
    sqlite3_finalize(statement);
    return code;
}

static int check_rows(struct check *check, struct lumi_capture *capture, int sorted)
{
    struct lumi_capture_frame *frames;
    int count, code = LUMI_OK;

    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, check->error));
    for (int i = 0; i < count && code == LUMI_OK; i++) {
        const struct lumi_capture_frame *frame = &frames[i];
        if (!frame->file[0])
            continue;
        struct item *item = find(check, sorted, frame->file);
        if (!item) {
            report(check, frame->file, "is missing");
            continue;
        }
        item->in_row = true;
        item->row_bytes = frame->bytes;
        memcpy(item->row_hash, frame->sha256, sizeof item->row_hash);
    }
    lumi_free(frames);
    return code;
}

/* What is wrong inside the database is a problem like any other; only what makes the check impossible is an error. */
static int check_database(struct check *check, int sorted)
{
    struct lumi_capture *capture = NULL;
    struct lumi_error local = {0}, *outer = check->error;

    check->error = &local;
    int code = lumi_capture_open(check->path, LUMI_CAPTURE_READ, &capture, &local);
    if (code == LUMI_OK)
        code = check_integrity(check, capture);
    if (code == LUMI_OK)
        code = check_rows(check, capture, sorted);
    lumi_capture_close(capture);
    check->error = outer;
    if (code == LUMI_ERR_FORMAT || code == LUMI_ERR_LIMIT) {
        report(check, CAPTURE_DB, local.text);
        return LUMI_OK;
    }
    return code == LUMI_OK ? code : lumi_fail(outer, code, "%s", local.text);
}

/* ---- The manifests ---- */

static int read_text(struct check *check, const char *name, char **text)
{
    int fd = openat(check->dir_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    struct stat status;
    size_t used = 0;
    int code = LUMI_OK;

    *text = NULL;
    if (fd < 0) {
        report(check, name, errno == ENOENT ? "is missing" : strerror(errno));
        return LUMI_OK;
    }
    if (fstat(fd, &status) < 0 || !S_ISREG(status.st_mode) || status.st_size > MANIFEST_MAX) {
        report(check, name, "cannot be read");
        goto done;
    }
    *text = lumi_alloc((size_t)status.st_size + 1, 1);
    if (!*text) {
        code = lumi_fail(check->error, LUMI_ERR_NOMEM, "%s: out of memory", name);
        goto done;
    }
    for (ssize_t got; used < (size_t)status.st_size; used += (size_t)got) {
        got = read(fd, *text + used, (size_t)status.st_size - used);
        if (got < 0 && errno == EINTR)
            got = 0;
        else if (got <= 0)
            break;
    }
    (*text)[used] = '\0';
done:
    close(fd);
    return code;
}

/* RFC 8493, section 2.1.3: CR, LF and % in a path are percent-encoded. In place. */
static void decode_path(char *path)
{
    char *out = path;

    for (const char *in = path; *in; in++) {
        if (!strncmp(in, "%0A", 3) || !strncmp(in, "%0a", 3))
            *out++ = '\n', in += 2;
        else if (!strncmp(in, "%0D", 3) || !strncmp(in, "%0d", 3))
            *out++ = '\r', in += 2;
        else if (!strncmp(in, "%25", 3))
            *out++ = '%', in += 2;
        else
            *out++ = *in;
    }
    *out = '\0';
}

static int manifest_line(struct check *check, const char *name, char *line, bool tags, int *sorted)
{
    size_t hash = strspn(line, "0123456789abcdefABCDEF");
    struct item *item;

    if (hash != 64 || (line[hash] != ' ' && line[hash] != '\t')) {
        report(check, name, "has a line that is no checksum and path");
        return LUMI_OK;
    }
    char *path = line + hash;
    *path++ = '\0';
    path += strspn(path, " \t*");
    decode_path(path);
    for (char *c = line; *c; c++)
        if (*c >= 'A' && *c <= 'F')
            *c = (char)(*c - 'A' + 'a');
    if (path[0] == '/' || strstr(path, "..") || tags == !strncmp(path, "data/", 5)) {
        report(check, path, "has no place in this manifest");
        return LUMI_OK;
    }
    item = find(check, *sorted, path);
    if (!item && tags) {
        struct stat status;
        if (fstatat(check->dir_fd, path, &status, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(status.st_mode)) {
            LUMI_TRY(add_item(check, path, &item));
            item->present = true;
            item->bytes = (int64_t)status.st_size;
            check->total += item->bytes;
            qsort(check->items, (size_t)check->count, sizeof *check->items, by_path);
            *sorted = check->count;
            item = find(check, *sorted, path);
        }
    }
    if (!item) {
        report(check, path, "is in the manifest and missing");
        return LUMI_OK;
    }
    if (item->in_manifest)
        report(check, path, "is in the manifest twice");
    item->in_manifest = true;
    memcpy(item->manifest_hash, line, 65);
    return LUMI_OK;
}

static int check_manifest(struct check *check, const char *name, bool tags, int *sorted)
{
    char *text, *save = NULL;
    int code = LUMI_OK;

    LUMI_TRY(read_text(check, name, &text));
    if (!text)
        return LUMI_OK;
    for (char *line = strtok_r(text, "\r\n", &save); line && code == LUMI_OK; line = strtok_r(NULL, "\r\n", &save))
        code = manifest_line(check, name, line, tags, sorted);
    lumi_free(text);
    return code;
}

static int check_declaration(struct check *check)
{
    char *text;

    LUMI_TRY(read_text(check, "bagit.txt", &text));
    if (text && strncmp(text, "BagIt-Version: 1.0\n", 19) != 0)
        report(check, "bagit.txt", "does not declare a bag of version 1.0");
    lumi_free(text);
    LUMI_TRY(read_text(check, "bag-info.txt", &text));
    const char *oxum = text ? strstr(text, "Payload-Oxum: ") : NULL;
    if (oxum) {
        long long bytes = -1, files = -1, have = 0, found = 0;
        for (int i = 0; i < check->count; i++)
            if (!check->items[i].tag) {
                have += check->items[i].bytes;
                found++;
            }
        if (sscanf(oxum, "Payload-Oxum: %lld.%lld", &bytes, &files) != 2 || bytes != have || files != found)
            report(check, "bag-info.txt", "Payload-Oxum is not what the payload holds");
    }
    lumi_free(text);
    return LUMI_OK;
}

/* ---- The files ---- */

static int advance(void *context, int64_t bytes)
{
    struct check *check = context;

    check->done += bytes;
    return check->progress ? check->progress(check->context, check->done, check->total) : 0;
}

/* The database and what SQLite keeps beside it while it is open. */
static bool live_file(const char *path)
{
    const char *const files[] = {CAPTURE_DB, CAPTURE_DB "-wal", CAPTURE_DB "-shm", CAPTURE_DB "-journal"};

    for (int i = 0; i < 4; i++)
        if (!strcmp(path, files[i]))
            return true;
    return false;
}

/* A frame that nobody was told is stored: being written, or left by a crash for the next who opens the capture for
 * writing. */
static bool unclaimed_file(const struct check *check, const char *path)
{
    return !check->result->sealed && !strncmp(path, CAPTURE_FRAMES "/", strlen(CAPTURE_FRAMES) + 1);
}

static int check_item(struct check *check, const struct item *item)
{
    char hex[65];
    struct lumi_error local;

    if (!item->tag && !item->in_row && !live_file(item->path) && !unclaimed_file(check, item->path))
        report(check, item->path, "belongs to no frame");
    if (check->result->sealed && !item->in_manifest)
        report(check, item->path, "is not in the manifest");
    if (!item->in_row && !item->in_manifest)
        return LUMI_OK;
    int code = capture_hash_file(check->dir_fd, item->path, hex, advance, check, &local);
    if (code == LUMI_ERR_CANCELLED || code == LUMI_ERR_NOMEM)
        return lumi_fail(check->error, code, "%s", local.text);
    check->result->files++;
    check->result->bytes += item->bytes;
    if (code != LUMI_OK) {
        report(check, item->path, local.text);
    } else if (item->in_row && item->row_bytes != item->bytes) {
        char text[96];
        snprintf(text, sizeof text, "has %lld bytes, %lld were stored", (long long)item->bytes,
                 (long long)item->row_bytes);
        report(check, item->path, text);
    } else if (item->in_row && strcmp(hex, item->row_hash) != 0) {
        report(check, item->path, "does not match its checksum");
    } else if (item->in_manifest && strcmp(hex, item->manifest_hash) != 0) {
        report(check, item->path, "does not match the manifest");
    }
    return LUMI_OK;
}

static int run(struct check *check)
{
    LUMI_TRY(walk(check, "data", 0));
    if (check->count)
        qsort(check->items, (size_t)check->count, sizeof *check->items, by_path);
    int sorted = check->count;
    LUMI_TRY(check_database(check, sorted));
    if (check->result->sealed) {
        LUMI_TRY(check_declaration(check));
        LUMI_TRY(check_manifest(check, "manifest-sha256.txt", false, &sorted));
        LUMI_TRY(check_manifest(check, CAPTURE_SEAL, true, &sorted));
    }
    for (int i = 0; i < check->count; i++)
        LUMI_TRY(check_item(check, &check->items[i]));
    return LUMI_OK;
}

int lumi_capture_verify(const char *path, lumi_verify_fn problem, lumi_verify_progress_fn progress, void *context,
                        struct lumi_verify_result *result, struct lumi_error *error)
{
    struct check check = {
        .path = path, .problem = problem, .progress = progress, .context = context, .result = result, .error = error};
    int code;

    memset(result, 0, sizeof *result);
    check.dir_fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (check.dir_fd < 0)
        return lumi_fail_errno(error, path, "open capture");
    if (faccessat(check.dir_fd, CAPTURE_DB, F_OK, 0) < 0) {
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no capture (" CAPTURE_DB " is missing)", path);
        goto done;
    }
    result->sealed = faccessat(check.dir_fd, CAPTURE_SEAL, F_OK, 0) == 0;
    code = run(&check);
done:
    for (int i = 0; i < check.count; i++)
        lumi_free(check.items[i].path);
    lumi_free(check.items);
    close(check.dir_fd);
    return code;
}
