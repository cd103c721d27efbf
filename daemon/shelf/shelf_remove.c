/* Throwing a capture away: renamed at once, removed at leisure. */
#include "daemon/shelf/shelf.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define DELETED ".deleted-"
#define DEPTH_MAX 16

/* Whoever writes a capture holds its directory (docs/capture-format.md); the lock goes with the descriptor, and while
 * it is ours nobody begins to. */
int lumi_shelf_take_away(const char *folder, const char *name, struct lumi_error *error)
{
    char path[LUMI_SHELF_PATH], gone[LUMI_SHELF_PATH + 32];
    struct stat is;
    int code = LUMI_OK, fd;

    LUMI_TRY(lumi_shelf_find(folder, name, path, error));
    fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0)
        return lumi_fail_errno(error, path, "opening it");
    /* As much of its name as leaves room for the rest. */
    snprintf(gone, sizeof gone, "%s/" DELETED "%.200s", folder, name);
    for (int i = 2; !lstat(gone, &is) && i < 1000; i++) /* one of this name that is not quite removed yet */
        snprintf(gone, sizeof gone, "%s/" DELETED "%.200s-%d", folder, name, i);
    if (flock(fd, LOCK_EX | LOCK_NB))
        code = lumi_fail(error, LUMI_ERR_BUSY, "%s: it is being written", path);
    else if (rename(path, gone))
        code = lumi_fail_errno(error, path, "removing it");
    close(fd);
    fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    return code;
}

struct emptying {
    bool (*ending)(void *context);
    void *context;
    const char *folder;
    struct lumi_error *error;
};

static int remove_tree(const struct emptying *e, int parent, const char *name, int depth);

static int remove_entry(const struct emptying *e, int fd, const char *name, int depth)
{
    struct stat is;

    if (fstatat(fd, name, &is, AT_SYMLINK_NOFOLLOW))
        return lumi_fail_errno(e->error, name, "removing it");
    if (S_ISDIR(is.st_mode))
        return remove_tree(e, fd, name, depth + 1);
    return unlinkat(fd, name, 0) ? lumi_fail_errno(e->error, name, "removing it") : LUMI_OK;
}

static int remove_tree(const struct emptying *e, int parent, const char *name, int depth)
{
    const int fd = openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *directory = fd >= 0 ? fdopendir(fd) : NULL;
    struct dirent *entry;
    int code = LUMI_OK;

    if (!directory || depth > DEPTH_MAX) {
        code = lumi_fail_errno(e->error, name, "removing it");
        if (directory)
            closedir(directory);
        else if (fd >= 0)
            close(fd);
        return code;
    }
    while (code == LUMI_OK && (entry = readdir(directory))) {
        if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
            continue;
        if (e->ending && e->ending(e->context))
            code = lumi_fail(e->error, LUMI_ERR_CANCELLED, "%s: ended before it was removed", name);
        else
            code = remove_entry(e, fd, entry->d_name, depth);
    }
    closedir(directory);
    if (code == LUMI_OK && unlinkat(parent, name, AT_REMOVEDIR))
        code = lumi_fail_errno(e->error, name, "removing it");
    return code;
}

int lumi_shelf_empty(const char *folder, bool (*ending)(void *context), void *context, struct lumi_error *error)
{
    const struct emptying e = {ending, context, folder, error};
    DIR *directory = opendir(folder);
    struct dirent *entry;
    int code = LUMI_OK;

    if (!directory)
        return lumi_fail_errno(error, folder, "reading it");
    while (code != LUMI_ERR_CANCELLED && (entry = readdir(directory)))
        if (!strncmp(entry->d_name, DELETED, strlen(DELETED))) { /* one that stays keeps no other */
            const int removed = remove_entry(&e, dirfd(directory), entry->d_name, 0);
            code = removed != LUMI_OK ? removed : code;
        }
    closedir(directory);
    return code;
}
