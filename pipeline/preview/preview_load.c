/* From a stored frame to a small view. */
#include "pipeline/equiangular/plan.h"
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "render/cpu/view_shade.h"

#include <math.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)
#define LEAST_DENSITY 2.0 /* pixels a degree; what does not fit then is left out */
#define VIEW_BYTES 5.0    /* a pixel: colours, the same at half the size, the mesh */
#define REDUCED_MOST 8
#define KEPT_LENSES 32

static double density_of(const struct lumi_lens *lens)
{
    return sqrt(lens->fx * lens->fy) * DEGREE;
}

/* Where the pixels of half the size lie in the view's own: in the middle of four, which the filter takes the mean of.
 */
static int make_halving(struct lumi_preview *preview, struct lumi_error *error)
{
    const struct lumi_grid *half = &preview->half;

    preview->halving = lumi_alloc(2 * (size_t)half->width * (size_t)half->height, sizeof(float));
    if (!preview->halving)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", preview->path);
    float *position = preview->halving;
    for (int y = 0; y < half->height; y++)
        for (int x = 0; x < half->width; x++, position += 2) {
            double tan_x, tan_y, sx = 0, sy = 0;
            lumi_grid_unproject(half, x + 0.5, y + 0.5, &tan_x, &tan_y);
            lumi_grid_project(&preview->grid, lumi_vec3(tan_x, tan_y, 1), &sx, &sy);
            position[0] = (float)sx;
            position[1] = (float)sy;
        }
    return LUMI_OK;
}

int preview_choose_grid(struct lumi_preview *preview, const struct lumi_lens *lenses, int count, int planned,
                        struct lumi_error *error)
{
    struct lumi_grid *grid = &preview->grid;
    double density = 0;

    for (int i = 0; i < count; i++)
        density = fmax(density, density_of(&lenses[i]));
    density = fmin(density, preview->options.pixels_per_degree);
    if (lumi_equiangular_choose(lenses, count, LUMI_PROJECTION_EQUIANGULAR, 0, 0, density, grid, error) != LUMI_OK)
        return lumi_fail_prefix(error, "%s", preview->path);
    const double bytes = VIEW_BYTES * grid->width * grid->height, room = (double)preview->options.memory_bytes;
    if (bytes * planned > room && density > LEAST_DENSITY) {
        density = fmax(LEAST_DENSITY, density * sqrt(room / (bytes * planned)));
        if (lumi_equiangular_choose(lenses, count, LUMI_PROJECTION_EQUIANGULAR, 0, 0, density, grid, error) != LUMI_OK)
            return lumi_fail_prefix(error, "%s", preview->path);
    }
    if (!lumi_grid_init_half(&preview->half, grid))
        return lumi_fail(error, LUMI_ERR_INTERNAL, "%s: views of %d × %d cannot be halved", preview->path, grid->width,
                         grid->height);
    LUMI_TRY(make_halving(preview, error));
    preview->most = (int)fmin(fmax(room / (VIEW_BYTES * grid->width * grid->height), 2), 1e6);
    preview->has_grid = true;
    return LUMI_OK;
}

void preview_finish_warps(struct lumi_preview *preview)
{
    for (guint i = 0; i < preview->warps->len; i++)
        lumi_free(g_array_index(preview->warps, struct preview_warp, i).positions);
    g_array_set_size(preview->warps, 0);
    lumi_free(preview->halving);
    preview->halving = NULL;
}

void preview_unload(struct preview_frame *frame)
{
    lumi_raster_finish(&frame->image);
    lumi_raster_finish(&frame->small);
    lumi_view_mesh_finish(&frame->mesh);
    frame->image = frame->small = (struct lumi_raster){0};
    frame->mesh = (struct lumi_view_mesh){0};
    frame->shaped = false;
    frame->proxy = 0;
    frame->neighbour_count = 0;
}

/* ---- smaller ---- */

/* How many pixels each way become one before anything else is done: no view needs more than its own density. */
static int reduction_of(const struct lumi_preview *preview, const struct lumi_lens *lens)
{
    const double wanted =
        preview->grid.width / ((atan(preview->grid.tan_x[preview->grid.cols]) - atan(preview->grid.tan_x[0])) / DEGREE);
    int by = 1;

    while (by < REDUCED_MOST && density_of(lens) / (2 * by) >= wanted)
        by *= 2;
    return by;
}

static struct lumi_lens reduced_lens(const struct lumi_lens *lens, int by)
{
    struct lumi_lens small = *lens;

    small.width = lens->width / by;
    small.height = lens->height / by;
    small.fx = lens->fx / by, small.fy = lens->fy / by;
    small.cx = lens->cx / by, small.cy = lens->cy / by;
    return small;
}

/* The mean of by × by pixels, of linear light; what is left over at the right and below is dropped. */
static int reduce(const struct lumi_raster *source, int by, struct lumi_raster *result)
{
    const int width = source->width / by, height = source->height / by;
    float table[256];

    if (width < 1 || height < 1)
        return LUMI_ERR_FORMAT;
    g_autofree float *sums = g_new(float, 3 * (size_t)width);
    LUMI_TRY(lumi_raster_create(result, width, height, 3, LUMI_U8));
    for (int i = 0; i < 256; i++)
        table[i] = lumi_srgb_decode((float)i / 255);
    for (int y = 0; y < height; y++) {
        memset(sums, 0, 3 * (size_t)width * sizeof *sums);
        for (int k = 0; k < by; k++) {
            const uint8_t *in = lumi_row_u8(source, y * by + k);
            for (int x = 0; x < width * by; x++, in += 3)
                for (int c = 0; c < 3; c++)
                    sums[3 * (x / by) + c] += table[in[c]];
        }
        uint8_t *out = lumi_row_u8(result, y);
        for (int i = 0; i < 3 * width; i++)
            out[i] = (uint8_t)(lumi_srgb_encode(sums[i] / (float)(by * by)) * 255 + 0.5f);
    }
    return LUMI_OK;
}

/* ---- the view ---- */

static void make_positions(const struct lumi_lens *lens, const struct lumi_grid *grid, float *positions)
{
    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++, positions += 2) {
            double tan_x, tan_y, sx = 0, sy = 0;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            lumi_lens_project(lens, lumi_vec3(tan_x, tan_y, 1), &sx, &sy); /* the grid was chosen so that it does */
            positions[0] = (float)sx;
            positions[1] = (float)sy;
        }
}

/* Where the pixels of views lie in images of this lens. */
static const float *find_positions(struct lumi_preview *preview, const struct lumi_lens *lens)
{
    struct preview_warp made = {.lens = *lens};

    for (guint i = 0; i < preview->warps->len; i++) {
        const struct preview_warp *known = &g_array_index(preview->warps, struct preview_warp, i);
        if (lumi_lens_equal(&known->lens, lens))
            return known->positions;
    }
    made.positions = lumi_alloc(2 * (size_t)preview->grid.width * (size_t)preview->grid.height, sizeof(float));
    if (!made.positions)
        return NULL;
    make_positions(lens, &preview->grid, made.positions);
    if (preview->warps->len >= KEPT_LENSES) { /* a lens for every frame: none is worth keeping */
        lumi_free(g_array_index(preview->warps, struct preview_warp, 0).positions);
        g_array_remove_index(preview->warps, 0);
    }
    g_array_append_val(preview->warps, made);
    return made.positions;
}

/* The frame's pixels, fewer where there are more than a view needs. */
static int read_frame(const struct preview_frame *frame, const char *path, int by, struct lumi_raster *pixels,
                      struct lumi_error *error)
{
    struct lumi_raster raster, bytes = {0};

    LUMI_TRY(lumi_image_read(path, 3, &raster, NULL, error));
    int code = LUMI_OK;
    if (raster.width != frame->lens.width || raster.height != frame->lens.height)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "the image is %d × %d, its camera %d × %d", raster.width,
                         raster.height, frame->lens.width, frame->lens.height);
    if (code == LUMI_OK && raster.sample != LUMI_U8) {
        code = lumi_raster_convert(&raster, LUMI_U8, &bytes);
        lumi_raster_finish(&raster);
        raster = bytes;
    }
    if (code == LUMI_OK && by == 1) {
        *pixels = raster;
        return LUMI_OK;
    }
    if (code == LUMI_OK)
        code = reduce(&raster, by, pixels);
    lumi_raster_finish(&raster);
    return code == LUMI_OK || (error && error->code == code)
               ? code
               : lumi_fail(error, code, code == LUMI_ERR_NOMEM ? "out of memory" : "the image is too small");
}

static int resample(const struct lumi_raster *source, const float *positions, int width, int height,
                    struct lumi_raster *result)
{
    const struct lumi_source_image image = {.pixels = *source, .filter = LUMI_FILTER_CUBIC};
    float color[3];

    LUMI_TRY(lumi_raster_create(result, width, height, 3, LUMI_U8));
    for (int y = 0; y < height; y++) {
        uint8_t *out = lumi_row_u8(result, y);
        for (int x = 0; x < width; x++, positions += 2) {
            lumi_sample_image(&image, positions[0], positions[1], color);
            for (int c = 0; c < 3; c++)
                *out++ = (uint8_t)(fminf(fmaxf(color[c], 0), 1) * 255 + 0.5f);
        }
    }
    return LUMI_OK;
}

int preview_load(struct lumi_preview *preview, struct preview_frame *frame, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(preview->path, frame->file, NULL);
    const int by = reduction_of(preview, &frame->lens);
    const struct lumi_lens lens = reduced_lens(&frame->lens, by);
    const struct lumi_grid *grid = &preview->grid, *half = &preview->half;
    const float *positions = find_positions(preview, &lens);
    struct lumi_raster pixels = {0};

    lumi_shade_tables();
    if (!positions)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    if (read_frame(frame, path, by, &pixels, error) != LUMI_OK)
        return strncmp(error->text, path, strlen(path)) ? lumi_fail_prefix(error, "%s", path) : error->code;
    int code = resample(&pixels, positions, grid->width, grid->height, &frame->image);
    if (code == LUMI_OK)
        code = resample(&frame->image, preview->halving, half->width, half->height, &frame->small);
    lumi_raster_finish(&pixels);
    frame->proxy = 0;
    if (code == LUMI_OK)
        return LUMI_OK;
    preview_unload(frame);
    return lumi_fail(error, code, "%s: out of memory", path);
}
