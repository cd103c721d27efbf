/* The files in a folder: which are pictures, which are whole, in what order.
 *
 * 1. A file is whole when it has not changed for a while; a JPEG also ends as JPEGs do, or has not changed for much
 *    longer. Names that begin with a dot, and what is neither picture nor video (thumbnails, sidecars), do not count.
 * 2. Files come in the order of their names. One that is still being written holds those after it back.
 * 3. A raw file and a JPEG with the same name are one picture, and the raw file is it. */
#include "daemon/camera/camera_files_priv.h"
#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define END_BYTES 65536          /* a JPEG's end is looked for in so many */
#define NOT_WHOLE_NS 30000000000 /* what does not end as it should is taken after this all the same */
#define MATES_NS 10000000000     /* between a raw file and its JPEG */
#define FILES_MOST 200000

int lumi_camera_file_order(const char *a, const char *b)
{
    while (*a && *b) {
        if (isdigit((unsigned char)*a) && isdigit((unsigned char)*b)) {
            char *end_a, *end_b;
            unsigned long long x = strtoull(a, &end_a, 10), y = strtoull(b, &end_b, 10);
            if (x != y)
                return x < y ? -1 : 1;
            a = end_a;
            b = end_b;
            continue;
        }
        if (*a != *b)
            return (unsigned char)*a < (unsigned char)*b ? -1 : 1;
        a++;
        b++;
    }
    return (*a != '\0') - (*b != '\0');
}

uint64_t files_number(const char *path)
{
    const char *dot = strrchr(path, '.'), *at = dot ? dot : path + strlen(path);
    const char *end = at;

    while (at > path && isdigit((unsigned char)at[-1]) && end - at < 18)
        at--;
    return at < end ? strtoull(at, NULL, 10) : 0;
}

static bool is_video(const char *name)
{
    static const char *const known[] = {".mp4", ".mov", ".mkv", ".webm", ".avi", ".insv"};
    const char *dot = strrchr(name, '.');

    for (size_t i = 0; dot && i < sizeof known / sizeof *known; i++)
        if (!strcasecmp(dot, known[i]))
            return true;
    return false;
}

/* Up to the extension, in small letters. */
static uint64_t stem_of(const char *path)
{
    const char *dot = strrchr(path, '.');
    uint64_t hash = LUMI_FNV1A_BASIS;

    for (const char *c = path; *c && c != dot; c++) {
        char small = (char)tolower((unsigned char)*c);
        hash = lumi_fnv1a(hash, &small, 1);
    }
    return hash;
}

static bool is_raw(const char *path)
{
    return lumi_image_format_of_name(path) == LUMI_IMAGE_RAW;
}

int files_watch_init(struct files_watch *watch, const char *folder, struct lumi_error *error)
{
    struct stat status;

    *watch = (struct files_watch){.depth = 3, .settle_ns = 1000000000};
    snprintf(watch->folder, sizeof watch->folder, "%s", folder);
    if (stat(folder, &status) != 0)
        return lumi_fail_errno(error, folder, "looking for the camera's folder");
    if (!S_ISDIR(status.st_mode))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: not a folder", folder);
    watch->device = (uint64_t)status.st_dev;
    watch->memory = files_memory_of(folder);
    return watch->memory ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", folder);
}

static void drop_items(struct files_item *items, size_t count)
{
    for (size_t i = 0; i < count; i++)
        lumi_free(items[i].path);
    lumi_free(items);
}

void files_watch_finish(struct files_watch *watch)
{
    drop_items(watch->items, watch->count);
    *watch = (struct files_watch){0};
}

struct scan {
    struct files_watch *watch;
    struct files_item *items;
    size_t count, room;
    int64_t now_ns;
    struct lumi_error *error;
};

static int keep(struct scan *scan, const char *path, const struct stat *status)
{
    struct files_item item = {.size = (int64_t)status->st_size,
                              .mtime_ns = (int64_t)status->st_mtim.tv_sec * 1000000000 + status->st_mtim.tv_nsec};

    item.key = lumi_fnv1a(LUMI_FNV1A_BASIS, path, strlen(path) + 1);
    item.key = lumi_fnv1a(item.key, &item.size, sizeof item.size);
    item.key = lumi_fnv1a(item.key, &item.mtime_ns, sizeof item.mtime_ns);
    if (item.size == 0 || files_memory_has(scan->watch->memory, item.key) || scan->count >= FILES_MOST)
        return LUMI_OK;
    if (scan->count == scan->room) {
        size_t room = scan->room ? 2 * scan->room : 64;
        struct files_item *items = lumi_realloc(scan->items, room, sizeof *items);
        if (!items)
            return lumi_fail(scan->error, LUMI_ERR_NOMEM, "%s: no memory", scan->watch->folder);
        scan->items = items;
        scan->room = room;
    }
    size_t length = strlen(path) + 1;
    item.path = lumi_alloc(length, 1);
    if (!item.path)
        return lumi_fail(scan->error, LUMI_ERR_NOMEM, "%s: no memory", scan->watch->folder);
    memcpy(item.path, path, length);
    scan->items[scan->count++] = item;
    return LUMI_OK;
}

/* `below` is the folder's path below the watched one, with a slash at its end, or empty. What vanishes while one looks
 * is no error; a folder that cannot be read is. */
static int walk(struct scan *scan, const char *below, int depth)
{
    char path[1024];
    int code = LUMI_OK;

    if (snprintf(path, sizeof path, "%s/%s", scan->watch->folder, below) >= (int)sizeof path)
        return LUMI_OK;
    DIR *folder = opendir(path);
    if (!folder && errno == ENOENT && depth > 0)
        return LUMI_OK;
    if (!folder)
        return lumi_fail(scan->error, LUMI_ERR_IO, "%s: the camera's folder cannot be read: %s", path, strerror(errno));
    while (code == LUMI_OK) {
        struct stat status;
        errno = 0;
        struct dirent *entry = readdir(folder);
        if (!entry && errno != 0)
            code = lumi_fail(scan->error, LUMI_ERR_IO, "%s: the camera's folder cannot be read: %s",
                             scan->watch->folder, strerror(errno));
        if (!entry)
            break;
        if (entry->d_name[0] == '.' || fstatat(dirfd(folder), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0 ||
            snprintf(path, sizeof path, "%s%s", below, entry->d_name) >= (int)sizeof path - 2)
            continue;
        if (S_ISDIR(status.st_mode) && depth < scan->watch->depth) {
            strcat(path, "/");
            code = walk(scan, path, depth + 1);
        } else if (S_ISREG(status.st_mode) && (lumi_image_format_of_name(path) != LUMI_IMAGE_AUTO || is_video(path))) {
            code = keep(scan, path, &status);
        }
    }
    closedir(folder);
    return code;
}

static int by_path(const void *a, const void *b)
{
    const struct files_item *x = a, *y = b;
    int order = lumi_camera_file_order(x->path, y->path);

    return order ? order : strcmp(x->path, y->path);
}

int files_watch_scan(struct files_watch *watch, int64_t now_ns, struct lumi_error *error)
{
    struct scan scan = {.watch = watch, .now_ns = now_ns, .error = error};
    struct stat status;

    if (stat(watch->folder, &status) != 0 || (uint64_t)status.st_dev != watch->device)
        return lumi_fail(error, LUMI_ERR_IO, "%s: the camera's folder is gone", watch->folder);
    int code = walk(&scan, "", 0);
    if (code != LUMI_OK) {
        drop_items(scan.items, scan.count);
        return code;
    }
    if (scan.count > 0)
        qsort(scan.items, scan.count, sizeof *scan.items, by_path);
    for (size_t i = 0; i < scan.count; i++) {
        struct files_item *item = &scan.items[i];
        const struct files_item *before =
            watch->count ? bsearch(item, watch->items, watch->count, sizeof *item, by_path) : NULL;
        bool same = before && before->key == item->key;
        item->changed_ns = same ? before->changed_ns : now_ns;
        item->checked = same && before->checked;
        item->whole = same && before->whole;
    }
    drop_items(watch->items, watch->count);
    watch->items = scan.items;
    watch->count = scan.count;
    return LUMI_OK;
}

int files_watch_skip(struct files_watch *watch, struct lumi_error *error)
{
    for (size_t i = 0; i < watch->count; i++)
        if (!files_memory_add(watch->memory, watch->items[i].key))
            return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", watch->folder);
    drop_items(watch->items, watch->count);
    watch->items = NULL;
    watch->count = 0;
    return LUMI_OK;
}

/* Ends with the marker that ends a JPEG (ITU-T T.81, B.1.1.3); cameras put more behind it. */
static bool ends_well(const struct files_watch *watch, const struct files_item *item)
{
    static const uint8_t start[2] = {0xff, 0xd8};
    char path[1280];
    uint8_t head[2];
    bool well = false;

    snprintf(path, sizeof path, "%s/%s", watch->folder, item->path);
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    uint8_t *tail = lumi_alloc(END_BYTES, 1);
    if (fd >= 0 && tail && pread(fd, head, 2, 0) == 2 && !memcmp(head, start, 2)) {
        off_t from = item->size > END_BYTES ? (off_t)(item->size - END_BYTES) : 0;
        ssize_t got = pread(fd, tail, END_BYTES, from);
        for (ssize_t i = got - 2; i >= 0 && !well; i--)
            well = tail[i] == 0xff && tail[i + 1] == 0xd9;
    }
    lumi_free(tail);
    if (fd >= 0)
        close(fd);
    return well;
}

static bool settled(const struct files_watch *watch, struct files_item *item, int64_t now_ns)
{
    int64_t still = now_ns - item->changed_ns;

    if (still < watch->settle_ns)
        return false;
    if (!item->checked) {
        item->whole = lumi_image_format_of_name(item->path) != LUMI_IMAGE_JPEG || ends_well(watch, item);
        item->checked = true;
    }
    return item->whole || still >= NOT_WHOLE_NS + watch->settle_ns;
}

static bool has_taken_mate(const struct files_watch *watch, const struct files_item *item)
{
    uint64_t stem = stem_of(item->path);

    for (int i = 0; i < FILES_MATES; i++) {
        int64_t apart = watch->mates[i].mtime_ns - item->mtime_ns;
        if (watch->mates[i].stem == stem && apart > -MATES_NS && apart < MATES_NS)
            return true;
    }
    return false;
}

/* A JPEG with a raw file beside it in the list. They are neighbours there, or nearly. */
static bool has_raw_mate(const struct files_watch *watch, size_t at)
{
    uint64_t stem = stem_of(watch->items[at].path);

    if (lumi_image_format_of_name(watch->items[at].path) != LUMI_IMAGE_JPEG)
        return false;
    for (size_t i = at < 4 ? 0 : at - 4; i < watch->count && i <= at + 4; i++)
        if (i != at && is_raw(watch->items[i].path) && stem_of(watch->items[i].path) == stem)
            return true;
    return false;
}

bool files_watch_next(struct files_watch *watch, int64_t now_ns, struct files_item **found)
{
    for (size_t i = 0; i < watch->count; i++) {
        struct files_item *item = &watch->items[i];
        if (files_memory_has(watch->memory, item->key))
            continue;
        if (has_taken_mate(watch, item)) {
            files_memory_add(watch->memory, item->key);
            continue;
        }
        if (has_raw_mate(watch, i))
            continue; /* its raw file comes next; then this one has a mate that was taken */
        if (!settled(watch, item, now_ns) || !files_memory_add(watch->memory, item->key))
            return false;
        watch->mates[watch->mate].stem = stem_of(item->path);
        watch->mates[watch->mate].mtime_ns = item->mtime_ns;
        watch->mate = (watch->mate + 1) % FILES_MATES;
        *found = item;
        return true;
    }
    return false;
}
