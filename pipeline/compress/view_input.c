/* What a level reads of a view: its picture, and where its tiles are in another view. */
#include "pipeline/compress/level.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>

int compress_view_image(const struct compress_level *level, int view, struct lumi_yuv *image, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_view(level->run, level->sources[view], LUMI_VIEW_FINAL);
    struct lumi_raster raster = {0}, half = {0};
    const struct lumi_raster *from = &raster;
    int code;

    *image = (struct lumi_yuv){0};
    LUMI_GOTO(code, done, lumi_image_read(path, 3, &raster, NULL, error));
    LUMI_GOTO(code, done, lumi_run_check_view(level->run, &raster, path, error));
    if (level->half) {
        LUMI_GOTO(code, done, lumi_warp_apply(level->half, &raster, &half, error));
        from = &half;
    }
    code = lumi_yuv_from_raster(from, image);
    if (code != LUMI_OK)
        lumi_fail(error, code, "%s: no memory to convert it", path);
done:
    lumi_raster_finish(&raster);
    lumi_raster_finish(&half);
    return code;
}

enum { SAMPLES = 5 }; /* depths a tile, each way */

/* The median of a tile's inverse depths. `depth` is of the run's grid, the tile of the level's. */
static float tile_depth(const struct compress_level *level, const struct lumi_raster *depth, int x0, int y0)
{
    float values[SAMPLES * SAMPLES];
    int count = 0;

    for (int i = 0; i < SAMPLES * SAMPLES; i++) {
        double x = x0 + (i % SAMPLES + 0.5) * LUMI_TILE / SAMPLES, y = y0 + (i / SAMPLES + 0.5) * LUMI_TILE / SAMPLES;
        double tan_x, tan_y, u, v;
        if (x >= level->grid.width || y >= level->grid.height)
            continue;
        lumi_grid_unproject(&level->grid, x, y, &tan_x, &tan_y);
        if (!lumi_grid_project(&level->run->grid, lumi_vec3(tan_x, tan_y, 1), &u, &v))
            continue;
        if (u >= 0 && v >= 0 && u < depth->width && v < depth->height) {
            float w = lumi_row_f32(depth, (int)v)[(int)u];
            values[count++] = isfinite(w) && w > 0 ? w : 0;
        }
    }
    if (count == 0)
        return 0;
    lumi_sort_floats(values, count);
    return values[count / 2];
}

static struct lumi_shift tile_shift(const struct compress_level *level, const struct lumi_pose *from,
                                    const struct lumi_pose *to, int x0, int y0, float w)
{
    double x = x0 + LUMI_TILE / 2, y = y0 + LUMI_TILE / 2, tan_x, tan_y, u, v;

    lumi_grid_unproject(&level->grid, x, y, &tan_x, &tan_y);
    /* The point times w, so that one at infinity is as good as any. */
    struct lumi_vec3 ray = lumi_rotate(from->r, lumi_vec3(tan_x, tan_y, 1));
    struct lumi_vec3 point = lumi_add(ray, lumi_scale(lumi_sub(from->t, to->t), w));
    if (!lumi_grid_project(&level->grid, lumi_rotate_back(to->r, point), &u, &v))
        return (struct lumi_shift){0, 0};
    return (struct lumi_shift){(int16_t)(2 * lround(fmax(fmin(u - x, LUMI_SHIFT_MAX), -LUMI_SHIFT_MAX) / 2)),
                               (int16_t)(2 * lround(fmax(fmin(v - y, LUMI_SHIFT_MAX), -LUMI_SHIFT_MAX) / 2))};
}

int compress_view_seeds(const struct compress_level *level, int view, int reference, struct lumi_shift **seeds,
                        struct lumi_error *error)
{
    g_autofree char *path = lumi_run_view(level->run, level->sources[view], LUMI_VIEW_DEPTH);
    const int cols = level->grid.cols, rows = level->grid.rows;
    struct lumi_raster depth = {0};
    int code;

    *seeds = NULL;
    LUMI_GOTO(code, done, lumi_image_read_channel(path, "W", &depth, error));
    LUMI_GOTO(code, done, lumi_run_check_view(level->run, &depth, path, error));
    *seeds = lumi_alloc((size_t)cols * (size_t)rows, sizeof **seeds);
    if (!*seeds)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for it", path);
    for (int i = 0; *seeds && i < cols * rows; i++) {
        int x = i % cols * LUMI_TILE, y = i / cols * LUMI_TILE;
        (*seeds)[i] =
            tile_shift(level, &level->poses[view], &level->poses[reference], x, y, tile_depth(level, &depth, x, y));
    }
done:
    lumi_raster_finish(&depth);
    return code;
}
