/* The disk under the store: how long a job takes, what it answers, and how much is free. */
#include "capture_world.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define TELL_NS (2 * WORLD_SECOND)

/* ---- folders ---- */

static bool copy_file(const char *from, const char *to)
{
    g_autofree char *data = NULL;
    gsize size;
    int fd;
    bool good;

    if (!g_file_get_contents(from, &data, &size, NULL))
        return false;
    fd = open(to, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    good = fd >= 0 && write(fd, data, size) == (ssize_t)size;
    if (fd >= 0)
        close(fd);
    return good;
}

bool world_copy_folder(const char *from, const char *to)
{
    g_autoptr(GDir) dir = g_dir_open(from, 0, NULL);
    const char *name;
    bool good = dir && (g_mkdir(to, 0755) == 0 || errno == EEXIST);

    while (good && (name = g_dir_read_name(dir))) {
        g_autofree char *a = g_build_filename(from, name, NULL), *b = g_build_filename(to, name, NULL);
        good = g_file_test(a, G_FILE_TEST_IS_DIR) ? world_copy_folder(a, b) : copy_file(a, b);
    }
    return good;
}

void world_remove_folder(const char *path)
{
    g_autoptr(GDir) dir = g_dir_open(path, 0, NULL);
    const char *name;

    while (dir && (name = g_dir_read_name(dir))) {
        g_autofree char *inner = g_build_filename(path, name, NULL);
        if (g_file_test(inner, G_FILE_TEST_IS_DIR))
            world_remove_folder(inner);
        else
            g_unlink(inner);
    }
    g_rmdir(path);
}

/* ---- the disk ---- */

int world_disk_answer(void *context, size_t bytes, struct lumi_error *error)
{
    struct world *w = context;
    struct world_disk *disk = &w->disk;

    if (w->killed_inside)
        return lumi_fail(error, LUMI_ERR_IO, "the daemon is dead");
    if (disk->kill_in > 0 && --disk->kill_in == 0) {
        g_autofree char *corpse = g_strconcat(w->folder, ".corpse", NULL);
        w->killed_inside = true;
        if (!world_copy_folder(w->folder, corpse))
            world_wrong(w, "%s cannot be copied", w->folder);
        return lumi_fail(error, LUMI_ERR_IO, "the daemon is dead");
    }
    if (disk->full || (int64_t)bytes > disk->free_bytes)
        return lumi_fail(error, LUMI_ERR_NOSPACE, "the simulated disk is full");
    if (disk->fail_next > 0) {
        disk->fail_next--;
        return lumi_fail(error, LUMI_ERR_IO, "the simulated disk does not write");
    }
    disk->free_bytes -= (int64_t)bytes;
    return LUMI_OK;
}

static void tell(struct world *w)
{
    w->disk.told_ns = w->now_ns;
    lumi_engine_disk(w->engine, w->now_ns, w->disk.full ? 0 : w->disk.free_bytes, w->disk.rate);
}

void world_disk_service(struct world *w)
{
    struct lumi_store *store = w->engine ? lumi_engine_store(w->engine) : NULL;
    struct lumi_store_figures figures;

    if (w->engine && w->now_ns - w->disk.told_ns >= TELL_NS)
        tell(w);
    if (!store) {
        w->disk.due_ns = 0;
        return;
    }
    if (w->disk.due_ns && w->now_ns >= w->disk.due_ns) {
        lumi_store_work(store, 1);
        w->disk.due_ns = 0;
        if (w->killed_inside)
            return;
        lumi_engine_run(w->engine, w->now_ns);
        store = lumi_engine_store(w->engine);
    }
    if (!store)
        return;
    lumi_store_figures(store, &figures);
    if (figures.waiting > w->waiting_most)
        w->waiting_most = figures.waiting;
    if (!w->disk.due_ns && figures.jobs > 0)
        w->disk.due_ns =
            w->now_ns + (int64_t)((w->disk.latency + (double)figures.waiting / figures.jobs / w->disk.rate) * 1e9) + 1;
}

int64_t world_disk_next(const struct world *w)
{
    int64_t next = w->engine ? w->disk.told_ns + TELL_NS : INT64_MAX;

    return w->disk.due_ns && w->disk.due_ns < next ? w->disk.due_ns : next;
}
