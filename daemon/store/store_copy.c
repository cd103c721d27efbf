/* The second copy: made from the first, file by file, while nothing else wants the disk; verified when the first is
 * sealed. Where it cannot be made it is given up, with the reason, and the first goes on. */
#include "daemon/store/store_priv.h"
#include "daemon/store/store_sink.h"

#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct item {
    struct item *next;
    int64_t bytes;
    char file[LUMI_CAPTURE_PATH], sha256[65];
};

struct store_copy {
    struct lumi_store *store;
    char *path, *final_path; /* "<second>/<name>.partial" until it is verified */
    int first_fd, dir_fd;
    /* under the store's lock */
    struct item *items, **last;
    int64_t behind;
    bool finish, finished, cancel;
    int code;
    char text[256];
    pthread_cond_t changed;
    pthread_t thread;
    bool has_thread;
    /* the copying thread's */
    char (*damaged)[LUMI_CAPTURE_PATH];
    int damaged_count, problems;
};

static char *joined(const char *a, const char *b, const char *c)
{
    const size_t size = strlen(a) + strlen(b) + strlen(c) + 2;
    char *path = lumi_alloc(size, 1);

    if (path)
        snprintf(path, size, "%s/%s%s", a, b, c);
    return path;
}

/* ---- One file ---- */

/* The first disk's own work goes before. Non-zero: it is over. */
static int stand_back(void *context)
{
    struct store_copy *copy = context;
    struct lumi_store *store = copy->store;

    if (store->options.synchronous)
        return 0;
    pthread_mutex_lock(&store->lock);
    while (store->unwritten > 0 && !copy->cancel)
        pthread_cond_wait(&copy->changed, &store->lock);
    const int over = copy->cancel;
    pthread_mutex_unlock(&store->lock);
    return over;
}

/* From the first under a name that a crash leaves behind for the next attempt to remove, then renamed. */
static int copy_file(struct store_copy *copy, const char *file, const char *sha256, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_PATH + 8], hash[65];
    struct store_sink sink;
    int64_t bytes;
    int code;

    const int from = openat(copy->first_fd, file, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (from < 0)
        return lumi_fail_errno(error, file, "open");
    snprintf(name, sizeof name, "%s.tmp", file);
    unlinkat(copy->dir_fd, name, 0);
    code = store_sink_open(&sink, copy->dir_fd, name, error);
    if (code == LUMI_OK) {
        code = store_sink_put_file(&sink, from, file, stand_back, copy, error);
        code = store_sink_close(&sink, code, &bytes, hash, error);
        if (code == LUMI_OK && sha256 && strcmp(hash, sha256) != 0)
            code = lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: the first copy has changed since it was stored", file);
        if (code == LUMI_OK && renameat(copy->dir_fd, name, copy->dir_fd, file) < 0)
            code = lumi_fail_errno(error, file, "rename");
        if (code != LUMI_OK)
            unlinkat(copy->dir_fd, name, 0);
    }
    posix_fadvise(from, 0, 0, POSIX_FADV_DONTNEED); /* read once; the page cache is for others */
    close(from);
    return code;
}

static bool is_there(const struct store_copy *copy, const struct item *item)
{
    struct stat status;

    return fstatat(copy->dir_fd, item->file, &status, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(status.st_mode) &&
           (int64_t)status.st_size == item->bytes;
}

/* ---- The end ---- */

static void found(void *context, const char *file, const char *text)
{
    struct store_copy *copy = context;
    char(*more)[LUMI_CAPTURE_PATH] = lumi_realloc(copy->damaged, (size_t)copy->damaged_count + 1, sizeof *more);

    (void)text;
    copy->problems++;
    if (!more)
        return;
    copy->damaged = more;
    snprintf(copy->damaged[copy->damaged_count++], LUMI_CAPTURE_PATH, "%s", file);
}

static int verify(struct store_copy *copy, struct lumi_error *error)
{
    struct lumi_verify_result result;

    copy->problems = copy->damaged_count = 0;
    return lumi_capture_verify(copy->path, found, NULL, copy, &result, error);
}

/* A file that was there from an earlier attempt, or went bad, is made once more. */
static int mend(struct store_copy *copy, struct lumi_error *error)
{
    for (int i = 0; i < copy->damaged_count; i++) {
        const char *file = copy->damaged[i];
        if (strncmp(file, "data/frames/", 12) != 0)
            continue;
        unlinkat(copy->dir_fd, file, 0);
        if (faccessat(copy->first_fd, file, F_OK, 0) == 0)
            LUMI_TRY(copy_file(copy, file, NULL, error));
    }
    LUMI_TRY(verify(copy, error));
    if (copy->problems)
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %d files are not as they were stored; the first: %s",
                         copy->path, copy->problems, copy->damaged_count ? copy->damaged[0] : "");
    return LUMI_OK;
}

static int sync_folder(int fd, const char *name, const char *path, struct lumi_error *error)
{
    const int folder = openat(fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int code = LUMI_OK;

    if (folder < 0 || fsync(folder) < 0)
        code = lumi_fail_errno(error, path, "sync");
    if (folder >= 0)
        close(folder);
    return code;
}

static int complete(struct store_copy *copy, struct lumi_error *error)
{
    static const char *const rest[] = {"data/capture.db", "bagit.txt", "bag-info.txt", "manifest-sha256.txt",
                                       "tagmanifest-sha256.txt"};

    for (int i = 0; i < 5; i++)
        LUMI_TRY(copy_file(copy, rest[i], NULL, error));
    LUMI_TRY(sync_folder(copy->dir_fd, "data/frames", copy->path, error));
    LUMI_TRY(sync_folder(copy->dir_fd, "data", copy->path, error));
    LUMI_TRY(sync_folder(copy->dir_fd, ".", copy->path, error));
    LUMI_TRY(verify(copy, error));
    if (copy->problems)
        LUMI_TRY(mend(copy, error));
    if (rename(copy->path, copy->final_path) < 0)
        return lumi_fail_errno(error, copy->final_path, "rename");
    return sync_folder(AT_FDCWD, copy->store->options.second_copy, copy->final_path, error);
}

/* ---- The thread ---- */

static void give_up(struct store_copy *copy, int code, const char *text)
{
    copy->code = code;
    snprintf(copy->text, sizeof copy->text, "%.255s", text);
    copy->finished = true;
}

/* Takes one step; called and returns with the lock. False: there was nothing to do. */
static bool step(struct store_copy *copy)
{
    struct lumi_store *store = copy->store;
    struct lumi_error error = {0};
    struct item *item = copy->items;
    int code = LUMI_OK;

    if (copy->finished || (!item && !copy->finish))
        return false;
    pthread_mutex_unlock(&store->lock);
    if (!item)
        code = complete(copy, &error);
    else if (!is_there(copy, item))
        code = copy_file(copy, item->file, item->sha256, &error);
    pthread_mutex_lock(&store->lock);
    if (item && code == LUMI_OK) {
        copy->items = item->next;
        if (!copy->items)
            copy->last = &copy->items;
        copy->behind -= item->bytes;
        lumi_free(item);
    } else if (code == LUMI_OK) {
        copy->finished = true;
        snprintf(copy->text, sizeof copy->text, "%.255s", copy->final_path);
    } else if (code != LUMI_ERR_CANCELLED) {
        give_up(copy, code, error.text);
    }
    return true;
}

static void *run_copy(void *context)
{
    struct store_copy *copy = context;
    struct lumi_store *store = copy->store;

    store_be_humble();
    pthread_mutex_lock(&store->lock);
    while (!copy->cancel) {
        if (step(copy))
            pthread_cond_broadcast(&copy->changed);
        else
            pthread_cond_wait(&copy->changed, &store->lock);
    }
    pthread_mutex_unlock(&store->lock);
    return NULL;
}

/* ---- Beginning ---- */

/* What is there already is gone on with: a copy that was interrupted, or one that was finished before a retake. */
static int make_folders(struct store_copy *copy, struct lumi_error *error)
{
    struct stat status;

    if (stat(copy->final_path, &status) == 0 && rename(copy->final_path, copy->path) < 0)
        return lumi_fail_errno(error, copy->final_path, "rename");
    if (mkdir(copy->path, 0777) < 0 && errno != EEXIST)
        return lumi_fail_errno(error, copy->path, "create the second copy");
    copy->dir_fd = open(copy->path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (copy->dir_fd < 0)
        return lumi_fail_errno(error, copy->path, "open the second copy");
    unlinkat(copy->dir_fd, "tagmanifest-sha256.txt", 0); /* it is not whole until the end */
    if ((mkdirat(copy->dir_fd, "data", 0777) < 0 && errno != EEXIST) ||
        (mkdirat(copy->dir_fd, "data/frames", 0777) < 0 && errno != EEXIST))
        return lumi_fail_errno(error, copy->path, "create the second copy");
    return LUMI_OK;
}

static int add_stored(struct store_copy *copy, struct lumi_error *error)
{
    struct lumi_capture_frame *frames;
    int count;

    LUMI_TRY(lumi_capture_frames(copy->store->capture, LUMI_FRAMES_ALL, &frames, &count, error));
    for (int i = 0; i < count; i++)
        if (frames[i].file[0])
            store_copy_add(copy, frames[i].file, frames[i].sha256, frames[i].bytes);
    lumi_free(frames);
    return LUMI_OK;
}

static int begin(struct store_copy *copy, struct lumi_error *error)
{
    const char *path = lumi_capture_path(copy->store->capture);
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;

    copy->path = joined(copy->store->options.second_copy, name, ".partial");
    copy->final_path = joined(copy->store->options.second_copy, name, "");
    if (!copy->path || !copy->final_path)
        return lumi_fail(error, LUMI_ERR_NOMEM, "second copy: out of memory");
    copy->first_fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (copy->first_fd < 0)
        return lumi_fail_errno(error, path, "open");
    LUMI_TRY(make_folders(copy, error));
    LUMI_TRY(add_stored(copy, error));
    if (copy->store->options.synchronous)
        return LUMI_OK;
    if (pthread_create(&copy->thread, NULL, run_copy, copy) != 0)
        return lumi_fail(error, LUMI_ERR_NOMEM, "second copy: no thread can be started");
    copy->has_thread = true;
    return LUMI_OK;
}

int store_copy_create(struct lumi_store *store, struct lumi_error *error)
{
    struct store_copy *copy = lumi_calloc(1, sizeof *copy);
    struct lumi_error own = {0};

    if (!copy)
        return lumi_fail(error, LUMI_ERR_NOMEM, "second copy: out of memory");
    copy->store = store;
    copy->first_fd = copy->dir_fd = -1;
    copy->last = &copy->items;
    pthread_cond_init(&copy->changed, NULL);
    store->copy = copy;
    const int code = begin(copy, &own);
    if (code != LUMI_OK)
        give_up(copy, code, own.text);
    return LUMI_OK;
}

void store_copy_destroy(struct store_copy *copy)
{
    if (!copy)
        return;
    pthread_mutex_lock(&copy->store->lock);
    copy->cancel = true;
    pthread_cond_broadcast(&copy->changed);
    pthread_mutex_unlock(&copy->store->lock);
    if (copy->has_thread)
        pthread_join(copy->thread, NULL);
    while (copy->items) {
        struct item *item = copy->items;
        copy->items = item->next;
        lumi_free(item);
    }
    if (copy->first_fd >= 0)
        close(copy->first_fd);
    if (copy->dir_fd >= 0)
        close(copy->dir_fd);
    pthread_cond_destroy(&copy->changed);
    lumi_free(copy->damaged);
    lumi_free(copy->path);
    lumi_free(copy->final_path);
    lumi_free(copy);
}

/* ---- For the store, with its lock ---- */

void store_copy_add(struct store_copy *copy, const char *file, const char *sha256, int64_t bytes)
{
    struct item *item = copy->finished ? NULL : lumi_calloc(1, sizeof *item);

    if (!item) {
        if (!copy->finished)
            give_up(copy, LUMI_ERR_NOMEM, "second copy: out of memory");
        return;
    }
    snprintf(item->file, sizeof item->file, "%s", file);
    snprintf(item->sha256, sizeof item->sha256, "%s", sha256);
    item->bytes = bytes;
    *copy->last = item;
    copy->last = &item->next;
    copy->behind += bytes;
    pthread_cond_broadcast(&copy->changed);
}

void store_copy_wake(struct store_copy *copy)
{
    pthread_cond_broadcast(&copy->changed);
}

void store_copy_finish(struct store_copy *copy)
{
    copy->finish = true;
    pthread_cond_broadcast(&copy->changed);
    while (!copy->finished && !copy->cancel) {
        if (copy->store->options.synchronous)
            step(copy);
        else
            pthread_cond_wait(&copy->changed, &copy->store->lock);
    }
}

bool store_copy_step(struct store_copy *copy)
{
    return !copy->finish && step(copy);
}

void store_copy_tell(const struct store_copy *copy, int64_t *behind, int *code, char *text, size_t size)
{
    *behind = copy->behind;
    *code = copy->code;
    snprintf(text, size, "%s", copy->text);
}
