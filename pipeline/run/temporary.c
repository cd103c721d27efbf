/* Names of files that are being made, on a disk that several computers may share. */
#include "pipeline/run/temporary.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PLACE_DIGITS = 8, DAY_S = 24 * 60 * 60 };

/* FNV-1a (Fowler, Noll and Vo) of the host's name and the namespace its process numbers are of. */
static void name_place(char place[PLACE_DIGITS + 1])
{
    char text[512] = "";
    uint32_t hash = 2166136261U;

    gethostname(text, 255);
    text[255] = '\0';
    const size_t length = strlen(text);
    const ssize_t more = readlink("/proc/self/ns/pid", text + length, sizeof text - length - 1);
    text[length + (size_t)MAX(more, 0)] = '\0';
    for (const char *at = text; *at; at++)
        hash = (hash ^ (uint8_t)*at) * 16777619U;
    snprintf(place, PLACE_DIGITS + 1, "%08x", hash);
}

char *lumi_run_temporary(const char *path, const char *extension)
{
    char place[PLACE_DIGITS + 1];

    name_place(place);
    return g_strdup_printf("%s.tmp-%s-%ld%s", path, place, (long)getpid(), extension);
}

/* What stands behind the first ".tmp-": place and process, or, of files that are locked while they are written
 * (proto/base/file.h), a process and a count. False: neither. */
static bool split_name(const char *name, char place[PLACE_DIGITS + 1], long *process)
{
    const char *at = strstr(name, ".tmp-");

    place[0] = '\0';
    if (!at)
        return false;
    at += strlen(".tmp-");
    if (strspn(at, "0123456789abcdef") == PLACE_DIGITS && at[PLACE_DIGITS] == '-') {
        g_strlcpy(place, at, PLACE_DIGITS + 1);
        at += PLACE_DIGITS + 1;
    }
    return sscanf(at, "%ld", process) == 1 && *process > 0;
}

static bool is_locked(const char *path)
{
    const int file = open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);

    if (file < 0)
        return false;
    const bool locked = flock(file, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK;
    close(file);
    return locked;
}

static bool is_left_behind(const char *path, const char *name, const char *here, time_t now)
{
    char place[PLACE_DIGITS + 1];
    struct stat status;
    long process;

    if (!split_name(name, place, &process) || g_lstat(path, &status))
        return false;
    if (!place[0] || !strcmp(place, here))
        return process != (long)getpid() && kill((pid_t)process, 0) && errno == ESRCH && !is_locked(path);
    return status.st_mtime < now - DAY_S;
}

static void remove_in(const char *folder, const char *here, time_t now)
{
    g_autoptr(GDir) dir = g_dir_open(folder, 0, NULL);
    const char *name;

    while (dir && (name = g_dir_read_name(dir))) {
        g_autofree char *path = g_build_filename(folder, name, NULL);
        if (is_left_behind(path, name, here, now))
            unlink(path);
    }
}

void lumi_run_remove_leftovers(const char *work, int lock)
{
    g_autoptr(GDir) dir = g_dir_open(work, 0, NULL);
    char here[PLACE_DIGITS + 1];
    struct stat status;
    const char *name;

    name_place(here);
    if (futimens(lock, NULL) || fstat(lock, &status))
        return;
    while (dir && (name = g_dir_read_name(dir))) {
        g_autofree char *folder = g_build_filename(work, name, NULL);
        if (g_file_test(folder, G_FILE_TEST_IS_DIR))
            remove_in(folder, here, status.st_mtime);
    }
}
