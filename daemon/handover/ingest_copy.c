/* Copying a capture: file by file under temporary names, verified as a whole, then renamed. */
#include "daemon/handover/ingest_copy.h"

#include "proto/base/bytes.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <glib.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define DEPTH 8
#define SEAL_MAX ((size_t)64 << 10)
#define BLOCK ((size_t)1 << 20)

/* What a capture is made of beside data/: nothing else is taken along. */
static const char *const tags[] = {"bagit.txt", "bag-info.txt", "manifest-sha256.txt", "tagmanifest-sha256.txt"};

int ingest_seal_of(const char *capture, char identity[INGEST_IDENTITY], struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(capture, tags[3], NULL);
    uint8_t digest[SHA256_DIGEST_SIZE], *data;
    struct sha256_ctx hash;
    size_t size;

    LUMI_TRY(lumi_file_read(path, SEAL_MAX, &data, &size, error));
    sha256_init(&hash);
    sha256_update(&hash, size, data);
    sha256_digest(&hash, sizeof digest, digest);
    lumi_free(data);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(identity + 2 * i, 3, "%02x", digest[i]);
    return LUMI_OK;
}

bool ingest_is_held(const char *capture)
{
    const int fd = open(capture, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

    if (fd < 0)
        return false;
    const bool held = flock(fd, LOCK_SH | LOCK_NB) < 0 && errno == EWOULDBLOCK;
    close(fd);
    return held;
}

/* ---- Walking ---- */

typedef int (*entry_fn)(void *context, const char *path, const struct stat *status, struct lumi_error *error);

static int walk(const char *root, const char *folder, int depth, entry_fn entry, void *context,
                struct lumi_error *error)
{
    g_autofree char *place = g_build_filename(root, folder, NULL);
    DIR *directory = opendir(place);
    struct dirent *name;
    int code = LUMI_OK;

    if (!directory)
        return lumi_fail_errno(error, place, "list");
    while (code == LUMI_OK && (name = readdir(directory))) {
        struct stat status;
        if (!strcmp(name->d_name, ".") || !strcmp(name->d_name, ".."))
            continue;
        g_autofree char *path = *folder ? g_build_filename(folder, name->d_name, NULL) : g_strdup(name->d_name);
        if (fstatat(dirfd(directory), name->d_name, &status, AT_SYMLINK_NOFOLLOW) < 0) {
            if (errno != ENOENT)
                code = lumi_fail_errno(error, path, "look at");
            continue;
        }
        code = entry(context, path, &status, error);
        if (code == LUMI_OK && S_ISDIR(status.st_mode) && depth < DEPTH)
            code = walk(root, path, depth + 1, entry, context, error);
    }
    closedir(directory);
    return code;
}

/* A sum: folders are listed in any order. */
static int sign(void *context, const char *path, const struct stat *status, struct lumi_error *error)
{
    struct ingest_look *look = context;
    const int64_t numbers[] = {(int64_t)status->st_size, (int64_t)status->st_mtim.tv_sec,
                               (int64_t)status->st_mtim.tv_nsec, (int64_t)status->st_mode};

    (void)error;
    look->sum += lumi_fnv1a(lumi_fnv1a(LUMI_FNV1A_BASIS, path, strlen(path)), numbers, sizeof numbers);
    if (S_ISREG(status->st_mode) && g_str_has_prefix(path, "data/")) {
        look->bytes += (int64_t)status->st_size;
        look->files++;
    }
    return LUMI_OK;
}

void ingest_look(const char *folder, struct ingest_look *look)
{
    *look = (struct ingest_look){.sum = 1};
    walk(folder, "", 0, sign, look, NULL);
}

bool ingest_is_whole(const char *capture, const struct ingest_look *look)
{
    g_autofree char *path = g_build_filename(capture, tags[1], NULL);
    uint8_t *data;
    size_t size;

    if (lumi_file_read(path, SEAL_MAX, &data, &size, NULL) != LUMI_OK)
        return false;
    const char *line = strstr((const char *)data, "Payload-Oxum: ");
    char *end = NULL;
    const gint64 bytes = line ? g_ascii_strtoll(line + 14, &end, 10) : -1;
    const gint64 files = end && *end == '.' ? g_ascii_strtoll(end + 1, NULL, 10) : -1;
    lumi_free(data);
    return bytes == look->bytes && files == look->files;
}

/* ---- Copying ---- */

struct copying {
    const struct ingest_task *task;
    uint8_t *block;
    int64_t done;
    bool verifying;
};

static int told(struct copying *copying, int64_t bytes)
{
    copying->done += bytes;
    return copying->task->progress ? copying->task->progress(copying->task->context, copying->verifying, copying->done)
                                   : 0;
}

static int copy_bytes(struct copying *copying, int from, int to, const char *path, struct lumi_error *error)
{
    for (;;) {
        const ssize_t got = read(from, copying->block, BLOCK);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return lumi_fail_errno(error, path, "read");
        if (got == 0)
            return fdatasync(to) < 0 ? lumi_fail_errno(error, path, "sync its copy") : LUMI_OK;
        if (lumi_write_all(to, copying->block, (size_t)got) < 0)
            return lumi_fail_errno(error, path, "write its copy");
        if (told(copying, got))
            return lumi_fail(error, LUMI_ERR_CANCELLED, "%s: cancelled", path);
    }
}

static int copy_file(struct copying *copying, const char *path, struct lumi_error *error)
{
    g_autofree char *source = g_build_filename(copying->task->source, path, NULL);
    g_autofree char *target = g_build_filename(copying->task->partial, path, NULL);
    g_autofree char *folder = g_path_get_dirname(target);
    g_autofree char *name = g_path_get_basename(target);
    g_autofree char *temporary = g_strdup_printf("%s/.%s.tmp", folder, name); /* what a capture clears away itself */
    int to = -1, code;

    const int from = open(source, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (from < 0)
        return lumi_fail_errno(error, source, "open");
    to = open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (to < 0) {
        code = lumi_fail_errno(error, temporary, "create");
        goto done;
    }
    code = copy_bytes(copying, from, to, source, error);
    if (close(to) < 0 && code == LUMI_OK)
        code = lumi_fail_errno(error, temporary, "close");
    if (code == LUMI_OK && rename(temporary, target) < 0)
        code = lumi_fail_errno(error, target, "rename");
done:
    close(from);
    return code;
}

/* Of data/: folders are made, files copied unless one of that size is there; the checksums tell if it is another. */
static int copy_entry(void *context, const char *path, const struct stat *status, struct lumi_error *error)
{
    struct copying *copying = context;
    g_autofree char *target = g_build_filename(copying->task->partial, "data", path, NULL);
    g_autofree char *relative = g_build_filename("data", path, NULL);
    struct stat there;

    if (S_ISDIR(status->st_mode))
        return mkdir(target, 0777) < 0 && errno != EEXIST ? lumi_fail_errno(error, target, "create") : LUMI_OK;
    if (!S_ISREG(status->st_mode))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s/%s: is no plain file", copying->task->source, relative);
    if (g_str_has_prefix(path, "capture.db-shm"))
        return LUMI_OK;
    if (!g_str_has_prefix(path, "capture.db") && lstat(target, &there) == 0 && S_ISREG(there.st_mode) &&
        there.st_size == status->st_size) {
        told(copying, (int64_t)status->st_size);
        return LUMI_OK;
    }
    return copy_file(copying, relative, error);
}

static int copy_all(struct copying *copying, struct lumi_error *error)
{
    const struct ingest_task *task = copying->task;
    static const char *const beside[] = {"-wal", "-shm", "-journal"};
    g_autofree char *source = g_build_filename(task->source, "data", NULL);
    g_autofree char *data = g_build_filename(task->partial, "data", NULL);

    if ((mkdir(task->partial, 0777) < 0 && errno != EEXIST) || (mkdir(data, 0777) < 0 && errno != EEXIST))
        return lumi_fail_errno(error, data, "create");
    for (int i = 0; i < 3; i++) {
        g_autofree char *stale = g_strconcat(data, "/capture.db", beside[i], NULL);
        unlink(stale);
    }
    LUMI_TRY(walk(source, "", 0, copy_entry, copying, error));
    for (int i = 0; i < 4 && task->identity[0]; i++)
        LUMI_TRY(copy_file(copying, tags[i], error));
    return LUMI_OK;
}

/* ---- Verifying ---- */

struct finding {
    struct copying *copying;
    int problems;
    bool remove;
    char first[512];
};

static void found(void *context, const char *file, const char *text)
{
    struct finding *finding = context;
    g_autofree char *path = g_build_filename(finding->copying->task->partial, file, NULL);

    if (finding->problems++ == 0)
        snprintf(finding->first, sizeof finding->first, "%.200s: %.300s", file, text);
    if (finding->remove && g_str_has_prefix(file, "data/frames/") && !strstr(file, ".."))
        unlink(path);
}

static int on_verify(void *context, int64_t done, int64_t total)
{
    struct copying *copying = ((struct finding *)context)->copying;

    (void)total;
    copying->done = done;
    return told(copying, 0);
}

static int verify(struct copying *copying, struct finding *finding, bool remove, struct lumi_error *error)
{
    struct lumi_verify_result result;

    *finding = (struct finding){.copying = copying, .remove = remove};
    copying->verifying = true;
    const int code = lumi_capture_verify(copying->task->partial, found, on_verify, finding, &result, error);
    copying->verifying = false;
    copying->done = 0;
    return code;
}

/* What does not match is copied once more, for it may be the rest of another attempt; then it is the source's fault. */
static int verify_copy(struct copying *copying, struct lumi_error *error)
{
    struct finding finding;

    const bool again = copying->task->identity[0] != '\0'; /* one that is sealed here has been changed here */

    LUMI_TRY(verify(copying, &finding, again, error));
    if (finding.problems && again) {
        LUMI_TRY(copy_all(copying, error));
        LUMI_TRY(verify(copying, &finding, false, error));
    }
    return finding.problems ? lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %s", copying->task->source, finding.first)
                            : LUMI_OK;
}

static int seal(const char *path, struct lumi_error *error)
{
    struct lumi_capture *capture;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    const int code = lumi_capture_seal(capture, NULL, error);
    lumi_capture_close(capture);
    return code;
}

/* ---- All of it ---- */

static int sync_path(const char *path, struct lumi_error *error)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    int code = LUMI_OK;

    if (fd < 0 || fsync(fd) < 0)
        code = lumi_fail_errno(error, path, "sync");
    if (fd >= 0)
        close(fd);
    return code;
}

static int sync_all(const struct ingest_task *task, struct lumi_error *error)
{
    static const char *const folders[] = {"data/frames", "data", ""};
    g_autofree char *above = g_path_get_dirname(task->target);

    for (int i = 0; i < 3; i++) {
        g_autofree char *path = g_build_filename(task->partial, folders[i], NULL);
        LUMI_TRY(sync_path(path, error));
    }
    if (rename(task->partial, task->target) < 0)
        return lumi_fail_errno(error, task->target, "rename");
    return sync_path(above, error);
}

static int remove_entry(const char *path, const struct stat *status, int type, struct FTW *place)
{
    (void)status;
    (void)type;
    (void)place;
    return remove(path);
}

int ingest_copy(const struct ingest_task *task, struct lumi_error *error)
{
    struct copying copying = {.task = task, .block = lumi_alloc(BLOCK, 1)};
    int code;

    if (!copying.block)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", task->source);
    LUMI_GOTO(code, done, copy_all(&copying, error));
    if (!task->identity[0])
        LUMI_GOTO(code, done, seal(task->partial, error));
    LUMI_GOTO(code, done, verify_copy(&copying, error));
    code = sync_all(task, error);
done:
    lumi_free(copying.block);
    if (lumi_exit_status(code) == 3)
        nftw(task->partial, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    return code;
}
