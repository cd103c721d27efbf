/* Whole files. */
#include "proto/base/file.h"

#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

static int write_all(int fd, const uint8_t *data, size_t size)
{
    while (size > 0) {
        ssize_t put = write(fd, data, size);
        if (put < 0 && errno == EINTR)
            continue;
        if (put < 0)
            return -1;
        data += put;
        size -= (size_t)put;
    }
    return 0;
}

/* So that the new name itself survives a power cut. */
static void sync_folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, slash == path ? 1 : (size_t)(slash - path)) : strdup(".");
    int fd = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;

    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

int lumi_file_write(const char *path, const void *data, size_t size, bool sync, struct lumi_error *error)
{
    size_t length = strlen(path) + 48;
    char *temporary = lumi_alloc(length, 1);
    const char *doing = "cannot write";
    int code = LUMI_OK;
    int fd;

    if (!temporary)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory to write it", path);
    /* Process and a count make the name unique on one machine; what a killed process left is stepped over. */
    do {
        snprintf(temporary, length, "%s.part-%ld-%u", path, (long)getpid(), atomic_fetch_add(&names, 1));
        fd = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (fd < 0 && errno == EEXIST);
    if (fd < 0) {
        code = lumi_fail_errno(error, path, "cannot make a file there");
        lumi_free(temporary);
        return code;
    }
    int failed = write_all(fd, data, size) || (sync && fsync(fd));
    int number = errno;
    if (close(fd) && !failed) {
        failed = 1;
        number = errno;
    }
    errno = number;
    if (!failed && rename(temporary, path)) {
        failed = 1;
        doing = "cannot give the finished file its name";
    }
    if (failed) {
        code = lumi_fail_errno(error, path, doing);
        unlink(temporary);
    } else if (sync) {
        sync_folder_of(path);
    }
    lumi_free(temporary);
    return code;
}
