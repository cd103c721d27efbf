/* What a disk has room for, and how fast it is. */
#include "daemon/store/store.h"

#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

int lumi_store_disk(const char *path, int64_t *free_bytes, struct lumi_error *error)
{
    struct statvfs status;

    if (statvfs(path, &status) < 0)
        return lumi_fail_errno(error, path, "look at the disk");
    if (status.f_flag & ST_RDONLY)
        return lumi_fail(error, LUMI_ERR_IO, "%s: the disk is read-only", path);
    if (faccessat(AT_FDCWD, path, W_OK | X_OK, AT_EACCESS) < 0)
        return lumi_fail_errno(error, path, "write to the folder");
    *free_bytes = (int64_t)status.f_bavail * (int64_t)status.f_frsize;
    return LUMI_OK;
}

static double seconds(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + (double)time.tv_nsec * 1e-9;
}

static int write_for(int fd, const char *path, const uint8_t *block, size_t size, size_t bytes,
                     struct lumi_error *error)
{
    for (size_t left = bytes; left > 0;) {
        const size_t part = left < size ? left : size;
        const ssize_t put = write(fd, block, part);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return lumi_fail_errno(error, path, "write");
        left -= (size_t)put;
    }
    return fsync(fd) < 0 ? lumi_fail_errno(error, path, "sync") : LUMI_OK;
}

int lumi_store_measure(const char *path, size_t bytes, double *bytes_per_second, struct lumi_error *error)
{
    const size_t size = (size_t)4 << 20;
    char name[1100];
    uint8_t *block = lumi_alloc(size, 1);
    int code, fd;

    if (!block)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    for (size_t i = 0; i < size; i++) /* a disk that compresses shall not seem faster than it is */
        block[i] = (uint8_t)((i * UINT64_C(0x9e3779b97f4a7c15)) >> 56 ^ i >> 7);
    snprintf(name, sizeof name, "%.1000s/.speed-XXXXXX", path);
    fd = mkstemp(name);
    if (fd < 0) {
        code = lumi_fail_errno(error, path, "create a file to measure the disk");
        goto done;
    }
    unlink(name);
    const double begun = seconds();
    code = write_for(fd, path, block, size, bytes, error);
    const double took = seconds() - begun;
    *bytes_per_second = took > 0 ? (double)bytes / took : (double)bytes * 1e9;
    close(fd);
done:
    lumi_free(block);
    return code;
}
