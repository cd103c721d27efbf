/* What stands between a test and the disk: functions in front of the C library's for the whole program, SQLite
 * included. They count what goes to the disk and can end the process there, say that the disk is full, and know what
 * was changed and not synced since. Included by one file of a program. */
#ifndef LUMI_TESTS_UNIT_DISK_MODEL_H
#define LUMI_TESTS_UNIT_DISK_MODEL_H

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

long syscall(long number, ...);

/* ---- Between the program and the disk ---- */

static long calls, kill_at = -1; /* counted calls; the one before which the process dies */
static long long space = -1;     /* bytes that can still be written; negative: no limit */
static ino_t dirty[256];         /* what was changed and not synced since */
static int dirty_count;
static bool watching;

static ino_t inode(int fd)
{
    struct stat status;

    return fstat(fd, &status) == 0 ? status.st_ino : 0;
}

static void soil(int fd)
{
    ino_t which = inode(fd);

    for (int i = 0; i < dirty_count; i++)
        if (dirty[i] == which)
            return;
    if (watching && dirty_count < 256)
        dirty[dirty_count++] = which;
}

static void clean(int fd)
{
    ino_t which = inode(fd);

    for (int i = 0; i < dirty_count; i++)
        if (dirty[i] == which)
            dirty[i--] = dirty[--dirty_count];
}

/* True when this is the call to die at. */
static bool counted(void)
{
    return __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED) == kill_at;
}

static bool full(size_t size)
{
    if (space >= 0 && (long long)size > space) {
        errno = ENOSPC;
        return true;
    }
    if (space >= 0)
        space -= (long long)size;
    return false;
}

static bool is_file(int fd)
{
    struct stat status;

    return fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

ssize_t write(int fd, const void *data, size_t size)
{
    if (is_file(fd)) {
        if (counted()) {
            syscall(SYS_write, fd, data, size / 2); /* a torn write */
            kill(getpid(), SIGKILL);
        }
        if (full(size))
            return -1;
        soil(fd);
    }
    return syscall(SYS_write, fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t at)
{
    if (counted()) {
        syscall(SYS_pwrite64, fd, data, size / 2, at);
        kill(getpid(), SIGKILL);
    }
    if (full(size))
        return -1;
    soil(fd);
    return syscall(SYS_pwrite64, fd, data, size, at);
}

int fsync(int fd)
{
    if (counted())
        kill(getpid(), SIGKILL);
    clean(fd);
    return 0; /* the kernel outlives a kill, and tests are quicker so */
}

int fdatasync(int fd)
{
    return fsync(fd);
}

int ftruncate(int fd, off_t size)
{
    if (counted())
        kill(getpid(), SIGKILL);
    return (int)syscall(SYS_ftruncate, fd, size);
}

int renameat(int from_fd, const char *from, int to_fd, const char *to)
{
    if (counted())
        kill(getpid(), SIGKILL);
    soil(to_fd);
    return (int)syscall(SYS_renameat, from_fd, from, to_fd, to);
}

int rename(const char *from, const char *to)
{
    return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

int unlinkat(int fd, const char *path, int flags)
{
    if (counted())
        kill(getpid(), SIGKILL);
    return (int)syscall(SYS_unlinkat, fd, path, flags);
}

int unlink(const char *path)
{
    return unlinkat(AT_FDCWD, path, 0);
}

#endif
