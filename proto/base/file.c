/* Whole files. */
#include "proto/base/file.h"

#include "proto/base/memory.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static int read_open(int fd, const char *path, size_t limit, uint8_t **data, size_t *size, struct lumi_error *error)
{
    struct stat status;

    if (fstat(fd, &status))
        return lumi_fail_errno(error, path, "cannot look at it");
    if (S_ISDIR(status.st_mode))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is a folder, not a file", path);
    if (!S_ISREG(status.st_mode))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is not a regular file", path);
    if ((uint64_t)status.st_size > limit)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: has %lld bytes, more than the %zu accepted", path,
                         (long long)status.st_size, limit);
    size_t count = (size_t)status.st_size, at = 0;
    uint8_t *bytes = lumi_alloc(count + 1, 1);
    if (!bytes)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for its %zu bytes", path, count);
    while (at < count) {
        ssize_t got = read(fd, bytes + at, count - at);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            int code = lumi_fail_errno(error, path, "cannot read");
            lumi_free(bytes);
            return code;
        }
        if (got == 0) /* it shrank meanwhile: what is there now is the file */
            break;
        at += (size_t)got;
    }
    bytes[at] = 0;
    *data = bytes;
    *size = at;
    return LUMI_OK;
}

int lumi_file_read(const char *path, size_t limit, uint8_t **data, size_t *size, struct lumi_error *error)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

    *data = NULL;
    *size = 0;
    if (fd < 0)
        return lumi_fail_errno(error, path, "cannot open");
    int code = read_open(fd, path, limit, data, size, error);
    close(fd);
    return code;
}

static atomic_uint names;

int lumi_write_all(int fd, const void *data, size_t size)
{
    const uint8_t *at = data;

    while (size > 0) {
        ssize_t put = write(fd, at, size);
        if (put < 0 && errno == EINTR)
            continue;
        if (put < 0)
            return -1;
        at += put;
        size -= (size_t)put;
    }
    return 0;
}

/* The folder of a path: "." where it names none. Released with free. */
static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash ? strndup(path, slash == path ? 1 : (size_t)(slash - path)) : strdup(".");
}

/* So that the new name itself survives a power cut. */
static void sync_folder_of(const char *path)
{
    char *folder = folder_of(path);
    int fd = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;

    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

/* Whether `name` is "<base>.tmp-<process>-<count>" and that process is no more. */
static bool left_behind(const char *name, const char *base, size_t length)
{
    long process;
    unsigned count;
    int end = 0;

    if (strncmp(name, base, length) != 0 || strncmp(name + length, ".tmp-", 5) != 0 ||
        sscanf(name + length + 5, "%ld-%u%n", &process, &count, &end) != 2 || name[length + 5 + (size_t)end])
        return false;
    return process > 0 && kill((pid_t)process, 0) != 0 && errno == ESRCH;
}

/* A lock that is held says that its writer lives on another machine, or where process numbers are counted apart. */
static void remove_unlocked(int folder, const char *name)
{
    int fd = openat(folder, name, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);

    if (fd < 0)
        return;
    if (flock(fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
        unlinkat(folder, name, 0);
    close(fd);
}

static void remove_leftovers(const char *path)
{
    const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
    char *folder = folder_of(path);
    DIR *dir = folder ? opendir(folder) : NULL;
    const struct dirent *entry;

    while (dir && (entry = readdir(dir)))
        if (left_behind(entry->d_name, base, strlen(base)))
            remove_unlocked(dirfd(dir), entry->d_name);
    if (dir)
        closedir(dir);
    free(folder);
}

/* What is named for output is no input that is missing. */
static int fail_folder(const char *path, struct lumi_error *error)
{
    char *folder = folder_of(path);
    int code = lumi_fail(error, LUMI_ERR_ARG, "%s: there is no folder '%s'", path, folder ? folder : "");

    free(folder);
    return code;
}

/* A device or a pipe is not to be put aside for a file of its name. */
static bool is_special(const char *path)
{
    struct stat status;

    return stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

static int fail_special(const char *path, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_ARG, "%s: is a device or a pipe; the name of a file is wanted", path);
}

int lumi_new_file_open(struct lumi_new_file *file, const char *path, struct lumi_error *error)
{
    size_t length = strlen(path) + 48;
    int code;

    if (is_special(path)) {
        *file = (struct lumi_new_file){.fd = -1};
        return fail_special(path, error);
    }
    *file = (struct lumi_new_file){.fd = -1, .path = lumi_alloc(length, 1), .temporary = lumi_alloc(length, 1)};
    if (!file->path || !file->temporary) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory to write it", path);
        goto fail;
    }
    memcpy(file->path, path, strlen(path) + 1);
    remove_leftovers(path);
    /* Process and a count make the name unique on one machine; what is there in spite of it is stepped over. */
    do {
        snprintf(file->temporary, length, "%s.tmp-%ld-%u", path, (long)getpid(), atomic_fetch_add(&names, 1));
        file->fd = open(file->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (file->fd < 0 && errno == EEXIST);
    if (file->fd >= 0) {
        flock(file->fd, LOCK_EX | LOCK_NB); /* where there are no locks, the process's number has to do */
        return LUMI_OK;
    }
    code = errno == ENOENT || errno == ENOTDIR ? fail_folder(path, error)
                                               : lumi_fail_errno(error, path, "cannot make a file there");
fail:
    lumi_free(file->path);
    lumi_free(file->temporary);
    *file = (struct lumi_new_file){.fd = -1};
    return code;
}

int lumi_new_file_close(struct lumi_new_file *file, int code, bool sync, struct lumi_error *error)
{
    if (code == LUMI_OK && sync && fsync(file->fd))
        code = lumi_fail_errno(error, file->path, "cannot write");
    if (close(file->fd) && code == LUMI_OK)
        code = lumi_fail_errno(error, file->path, "cannot write");
    if (code == LUMI_OK && rename(file->temporary, file->path))
        code = lumi_fail_errno(error, file->path, "cannot give the finished file its name");
    if (code != LUMI_OK)
        unlink(file->temporary);
    else if (sync)
        sync_folder_of(file->path);
    lumi_free(file->path);
    lumi_free(file->temporary);
    *file = (struct lumi_new_file){.fd = -1};
    return code;
}

int lumi_file_write(const char *path, const void *data, size_t size, bool sync, struct lumi_error *error)
{
    struct lumi_new_file file;

    LUMI_TRY(lumi_new_file_open(&file, path, error));
    int code = lumi_write_all(file.fd, data, size) ? lumi_fail_errno(error, path, "cannot write") : LUMI_OK;
    return lumi_new_file_close(&file, code, sync, error);
}

int lumi_file_check_place(const char *path, struct lumi_error *error)
{
    struct stat status;
    char *folder = folder_of(path);
    int code = LUMI_OK;

    if (!folder)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", path);
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode))
        code = lumi_fail(error, LUMI_ERR_ARG, "%s: is a folder; the name of a file is wanted", path);
    else if (is_special(path))
        code = fail_special(path, error);
    else if (stat(folder, &status) || !S_ISDIR(status.st_mode))
        code = fail_folder(path, error);
    else if (access(folder, W_OK))
        code = lumi_fail_errno(error, path, "create");
    free(folder);
    return code;
}

static bool same_file(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/* Whether `path`, which need not be there, lies in the folder or is it. Asked of the folders above it one by one, so
 * that links and other spellings do not matter. */
static bool lies_in(const char *path, const struct stat *folder)
{
    char *above = strdup(path);
    struct stat status;
    bool found = false;

    while (above && !found) {
        char *real = realpath(above, NULL);
        if (real) { /* from here on the way up is in the name */
            free(above);
            above = real;
            found = stat(above, &status) == 0 && same_file(&status, folder);
        }
        if (!strcmp(above, "/") || !strcmp(above, "."))
            break;
        char *next = folder_of(above);
        free(above);
        above = next;
    }
    free(above);
    return found;
}

int lumi_file_check_output(const char *path, const char *input, struct lumi_error *error)
{
    struct stat status, there;

    if (stat(input, &status))
        return LUMI_OK;
    if (S_ISDIR(status.st_mode) && lies_in(path, &status))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: lies in '%s', which is the input", path, input);
    if (lstat(path, &there) == 0 && same_file(&there, &status))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: is the input", path);
    return LUMI_OK;
}
