/* From a stored frame to a small view. */
#include "pipeline/equiangular/plan.h"
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>

#define DEGREE (LUMI_PI / 180)
#define LEAST_DENSITY 2.0 /* pixels a degree; what does not fit then is left out */
#define VIEW_BYTES 5.0    /* a pixel: colours, the same at half the size, the mesh */
#define REDUCED_MOST 8

static double density_of(const struct lumi_lens *lens)
{
    return sqrt(lens->fx * lens->fy) * DEGREE;
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
    LUMI_TRY(lumi_warp_create_half(grid, &preview->half, &preview->halving, error));
    preview->most = (int)fmin(fmax(room / (VIEW_BYTES * grid->width * grid->height), 2), 1e6);
    preview->has_grid = true;
    return LUMI_OK;
}

void preview_finish_warps(struct lumi_preview *preview)
{
    for (guint i = 0; i < preview->warps->len; i++)
        lumi_warp_destroy(g_array_index(preview->warps, struct preview_warp, i).warp);
    g_array_set_size(preview->warps, 0);
    lumi_warp_destroy(preview->halving);
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
    const double wanted = preview->grid.width /
                          ((atan(preview->grid.tan_x[preview->grid.cols]) - atan(preview->grid.tan_x[0])) / DEGREE);
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

static void add_row(const struct lumi_raster *source, int y, const float table[256], int by, float *sums, int width)
{
    if (source->sample == LUMI_U8) {
        const uint8_t *in = lumi_row_u8(source, y);
        for (int x = 0; x < width * by; x++, in += 3)
            for (int c = 0; c < 3; c++)
                sums[3 * (x / by) + c] += table[in[c]];
    } else {
        const float *in = lumi_row_f32(source, y);
        for (int x = 0; x < width * by; x++, in += 3)
            for (int c = 0; c < 3; c++)
                sums[3 * (x / by) + c] += in[c];
    }
}

/* Linear light, the mean of by × by pixels; what is left over at the right and below is dropped. */
static int reduce(struct lumi_raster *source, int by, struct lumi_raster *result)
{
    float table[256];

    *result = (struct lumi_raster){0};
    if (source->sample == LUMI_U16) {
        struct lumi_raster linear;
        LUMI_TRY(lumi_raster_convert(source, LUMI_F32, &linear));
        lumi_raster_finish(source);
        *source = linear;
    }
    if (source->width / by < 1 || source->height / by < 1)
        return LUMI_ERR_FORMAT;
    LUMI_TRY(lumi_raster_create(result, source->width / by, source->height / by, 3, LUMI_F32));
    for (int i = 0; i < 256; i++)
        table[i] = lumi_srgb_decode((float)i / 255);
    for (int y = 0; y < result->height; y++) {
        float *sums = lumi_row_f32(result, y);
        for (int k = 0; k < by; k++)
            add_row(source, y * by + k, table, by, sums, result->width);
        for (int i = 0; i < 3 * result->width; i++)
            sums[i] /= (float)(by * by);
    }
    return LUMI_OK;
}

/* ---- the view ---- */

static int find_warp(struct lumi_preview *preview, const struct lumi_lens *lens, const struct lumi_warp **warp,
                     struct lumi_error *error)
{
    struct preview_warp made = {.lens = *lens};

    for (guint i = 0; i < preview->warps->len; i++) {
        const struct preview_warp *known = &g_array_index(preview->warps, struct preview_warp, i);
        if (lumi_lens_equal(&known->lens, lens)) {
            *warp = known->warp;
            return LUMI_OK;
        }
    }
    LUMI_TRY(lumi_warp_create(lens, &preview->grid, &made.warp, error));
    if (preview->warps->len >= 32) { /* a lens for every frame: none is worth keeping */
        lumi_warp_destroy(g_array_index(preview->warps, struct preview_warp, 0).warp);
        g_array_remove_index(preview->warps, 0);
    }
    g_array_append_val(preview->warps, made);
    *warp = made.warp;
    return LUMI_OK;
}

static int read_frame(struct lumi_preview *preview, const struct preview_frame *frame, const char *path, int by,
                      struct lumi_raster *linear, struct lumi_error *error)
{
    struct lumi_raster raster;

    (void)preview;
    LUMI_TRY(lumi_image_read(path, 3, &raster, NULL, error));
    int code = LUMI_OK;
    if (raster.width != frame->lens.width || raster.height != frame->lens.height)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image is %d × %d, its camera %d × %d", path, raster.width,
                         raster.height, frame->lens.width, frame->lens.height);
    else if ((code = reduce(&raster, by, linear)) != LUMI_OK)
        lumi_fail(error, code, "%s: %s", path, code == LUMI_ERR_NOMEM ? "out of memory" : "the image is too small");
    lumi_raster_finish(&raster);
    return code;
}

int preview_load(struct lumi_preview *preview, struct preview_frame *frame, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(preview->path, frame->file, NULL);
    const int by = reduction_of(preview, &frame->lens);
    const struct lumi_lens lens = reduced_lens(&frame->lens, by);
    struct lumi_raster linear = {0}, view = {0}, small = {0};
    const struct lumi_warp *warp;
    int code;

    LUMI_TRY(read_frame(preview, frame, path, by, &linear, error));
    LUMI_GOTO(code, out, find_warp(preview, &lens, &warp, error));
    LUMI_GOTO(code, out, lumi_warp_apply(warp, &linear, &view, error));
    LUMI_GOTO(code, out, lumi_warp_apply(preview->halving, &view, &small, error));
    code = lumi_raster_convert(&view, LUMI_U8, &frame->image);
    if (code == LUMI_OK)
        code = lumi_raster_convert(&small, LUMI_U8, &frame->small);
    if (code != LUMI_OK)
        lumi_fail(error, code, "out of memory");
    frame->proxy = 0;
out:
    if (code != LUMI_OK) {
        lumi_fail_prefix(error, "%s", path);
        preview_unload(frame);
    }
    lumi_raster_finish(&linear);
    lumi_raster_finish(&view);
    lumi_raster_finish(&small);
    return code;
}
