/* What a capture or a field holds, in numbers: read. */
#include "pipeline/evaluate/info.h"

#include "proto/base/memory.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <string.h>

/* The sizes of a file or of all files under a directory. Links are not followed. */
static uint64_t bytes_under(const char *path)
{
    uint64_t bytes = 0;
    g_autoptr(GDir) dir = g_dir_open(path, 0, NULL);

    for (const char *name; dir && (name = g_dir_read_name(dir));) {
        g_autofree char *file = g_build_filename(path, name, NULL);
        GStatBuf about;
        if (g_lstat(file, &about))
            continue;
        if (S_ISDIR(about.st_mode))
            bytes += bytes_under(file);
        else if (S_ISREG(about.st_mode))
            bytes += (uint64_t)about.st_size;
    }
    return bytes;
}

static void count_extension(const char *file, char *list, size_t size)
{
    const char *dot = strrchr(file, '.');
    g_auto(GStrv) known = g_strsplit(list, ", ", -1);

    if (!dot || g_strv_contains((const char *const *)known, dot + 1))
        return;
    if (list[0])
        g_strlcat(list, ", ", size);
    g_strlcat(list, dot + 1, size);
}

/* Counts the frame's image size; `counts` maps width·2³² + height to how many there are. */
static void count_size(struct lumi_capture_summary *summary, GHashTable *counts, const struct lumi_capture_frame *frame)
{
    gint64 size = (gint64)frame->width << 32 | frame->height;
    int count = GPOINTER_TO_INT(g_hash_table_lookup(counts, &size)) + 1;
    gint64 most = (gint64)summary->width << 32 | summary->height;

    if (count > GPOINTER_TO_INT(g_hash_table_lookup(counts, &most))) {
        summary->width = frame->width;
        summary->height = frame->height;
    }
    g_hash_table_replace(counts, g_memdup2(&size, sizeof size), GINT_TO_POINTER(count));
    summary->pixels += (uint64_t)frame->width * (uint64_t)frame->height;
}

static int read_frames(struct lumi_capture *capture, struct lumi_capture_summary *summary, struct lumi_error *error)
{
    struct lumi_capture_frame *frames;
    int count;
    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));

    GHashTable *sizes = g_hash_table_new_full(g_int64_hash, g_int64_equal, g_free, NULL);
    for (int i = 0; i < count; i++) {
        if (frames[i].file[0]) {
            count_size(summary, sizes, &frames[i]);
            count_extension(frames[i].file, summary->extensions, sizeof summary->extensions);
        }
        if (frames[i].has_pose && frames[i].pose_source >= LUMI_POSE_TRUE &&
            frames[i].pose_source <= LUMI_POSE_IMPORTED)
            summary->in_pose_source[frames[i].pose_source]++;
    }
    summary->sizes = (int)g_hash_table_size(sizes);
    g_hash_table_unref(sizes);
    lumi_free(frames);
    return LUMI_OK;
}

static int read_capture(const char *path, struct lumi_capture_summary *summary, struct lumi_error *error)
{
    struct lumi_capture *capture;
    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));

    const struct {
        const char *key;
        char *value;
        size_t size;
    } metas[] = {
        {"title", summary->title, sizeof summary->title},
        {"source", summary->source, sizeof summary->source},
        {"surface", summary->surface, sizeof summary->surface},
        {"created", summary->created, sizeof summary->created},
        {"software", summary->software, sizeof summary->software},
    };
    int code = LUMI_OK;
    for (size_t i = 0; i < G_N_ELEMENTS(metas); i++)
        LUMI_GOTO(code, done, lumi_capture_get_meta(capture, metas[i].key, metas[i].value, metas[i].size, error));
    LUMI_GOTO(code, done, lumi_capture_info(capture, &summary->info, error));
    LUMI_GOTO(code, done, read_frames(capture, summary, error));
    summary->total_bytes = bytes_under(path);
done:
    lumi_capture_close(capture);
    return code;
}

static void read_level(const struct lumi_field *field, int level, struct lumi_field_summary *summary)
{
    for (int i = 0; i < summary->info.view_count[level]; i++) {
        const struct lumi_field_view *view = lumi_field_view(field, level, i);
        const struct lumi_grid *grid = lumi_field_grid(field, view->grid);
        const struct lumi_view_mesh *mesh = lumi_field_mesh(field, level, i);
        if (i == 0) {
            double left, top, right, bottom;
            lumi_grid_unproject(grid, 0, 0, &left, &top);
            lumi_grid_unproject(grid, grid->width, grid->height, &right, &bottom);
            summary->levels[level].width = grid->width;
            summary->levels[level].height = grid->height;
            summary->levels[level].cols = grid->cols;
            summary->levels[level].rows = grid->rows;
            summary->levels[level].fov_x = atan(right) - atan(left);
            summary->levels[level].fov_y = atan(bottom) - atan(top);
        }
        summary->levels[level].references += view->reference == i;
        summary->levels[level].tiles += (uint64_t)grid->cols * (uint64_t)grid->rows;
        if (view->grid >= summary->grids)
            summary->grids = view->grid + 1;
        for (int tile = 0; mesh && tile < mesh->cols * mesh->rows; tile++) {
            summary->levels[level].vertices += mesh->tiles[tile].vertex_count;
            summary->levels[level].triangles += mesh->tiles[tile].triangle_count;
        }
    }
}

static int read_field(const char *path, int threads, struct lumi_field_summary *summary, struct lumi_error *error)
{
    struct lumi_field *field;
    LUMI_TRY(lumi_field_open(path, threads, &field, error));

    summary->info = *lumi_field_info(field);
    for (int level = 0; level < LUMI_LEVELS; level++)
        read_level(field, level, summary);
    lumi_field_close(field);
    return LUMI_OK;
}

int lumi_info_read(const char *path, int threads, struct lumi_info *info, struct lumi_error *error)
{
    memset(info, 0, sizeof *info);
    info->is_field = !g_file_test(path, G_FILE_TEST_IS_DIR);
    return info->is_field ? read_field(path, threads, &info->field, error) : read_capture(path, &info->capture, error);
}
