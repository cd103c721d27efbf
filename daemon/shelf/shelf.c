/* Captures by name. */
#include "daemon/shelf/shelf.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static bool is_name(const char *name)
{
    static const char partial[] = ".partial";
    const size_t size = strlen(name), tail = sizeof partial - 1;

    return size > 0 && size < 256 && name[0] != '.' && !strchr(name, '/') &&
           !(size >= tail && !strcmp(name + size - tail, partial));
}

int lumi_shelf_find(const char *folder, const char *name, char path[LUMI_SHELF_PATH], struct lumi_error *error)
{
    char database[LUMI_SHELF_PATH + 32];
    struct stat is;

    if (!is_name(name) || snprintf(path, LUMI_SHELF_PATH, "%s/%s", folder, name) >= LUMI_SHELF_PATH)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "there is no capture of this name");
    snprintf(database, sizeof database, "%s/data/capture.db", path);
    /* A link that lies in the folder leads wherever it likes: it is no capture of this folder. */
    if (lstat(path, &is) || !S_ISDIR(is.st_mode) || lstat(database, &is) || !S_ISREG(is.st_mode))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "there is no capture '%.100s'", name);
    return LUMI_OK;
}
