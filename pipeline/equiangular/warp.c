/* Resampling an image from its lens to a view's grid. */
#include "pipeline/equiangular/warp.h"

#include "proto/base/memory.h"

#include <math.h>

enum { LOBES = 3, TABLE = 1024, MAX_TAPS = 64 };

struct lumi_warp {
    int source_width, source_height, width, height;
    float *positions;                 /* x, y in the source of the centre of each pixel */
    float lanczos[LOBES * TABLE + 2]; /* by distance from the centre */
};

/* The taps of one pixel along one axis. */
struct taps {
    int first, count;
    float weights[MAX_TAPS];
};

bool lumi_warp_is_copy(const struct lumi_lens *lens, const struct lumi_grid *grid)
{
    struct lumi_grid own;

    if (lens->model != LUMI_LENS_BROWN || lens->k1 != 0 || lens->k2 != 0 || lens->k3 != 0 || lens->p1 != 0 ||
        lens->p2 != 0 || lens->width != grid->width || lens->height != grid->height ||
        !lumi_grid_init_pinhole(&own, lens->width, lens->height, lens->fx, lens->fy, lens->cx, lens->cy))
        return false;
    for (int i = 0; i <= own.cols; i++)
        if (own.tan_x[i] != grid->tan_x[i])
            return false;
    for (int i = 0; i <= own.rows; i++)
        if (own.tan_y[i] != grid->tan_y[i])
            return false;
    return true;
}

static double sinc(double x)
{
    return x == 0 ? 1 : sin(LUMI_PI * x) / (LUMI_PI * x);
}

/* Everything but the positions. */
static int create(int source_width, int source_height, const struct lumi_grid *grid, struct lumi_warp **result,
                  struct lumi_error *error)
{
    struct lumi_warp *warp = lumi_calloc(1, sizeof *warp);

    *result = NULL;
    if (warp)
        warp->positions = lumi_alloc((size_t)grid->width * (size_t)grid->height, 2 * sizeof *warp->positions);
    if (!warp || !warp->positions) {
        lumi_warp_destroy(warp);
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    }
    warp->source_width = source_width;
    warp->source_height = source_height;
    warp->width = grid->width;
    warp->height = grid->height;
    for (int i = 0; i <= LOBES * TABLE; i++)
        warp->lanczos[i] = (float)(sinc((double)i / TABLE) * sinc((double)i / TABLE / LOBES));
    *result = warp;
    return LUMI_OK;
}

int lumi_warp_create(const struct lumi_lens *lens, const struct lumi_grid *grid, struct lumi_warp **result,
                     struct lumi_error *error)
{
    LUMI_TRY(create(lens->width, lens->height, grid, result, error));
    float *position = (*result)->positions;
    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++, position += 2) {
            double tan_x, tan_y, sx, sy;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            if (!lumi_lens_project(lens, lumi_vec3(tan_x, tan_y, 1), &sx, &sy)) {
                lumi_warp_destroy(*result);
                *result = NULL;
                return lumi_fail(error, LUMI_ERR_ARG, "the lens does not image pixel (%d, %d) of the view", x, y);
            }
            position[0] = (float)sx;
            position[1] = (float)sy;
        }
    return LUMI_OK;
}

int lumi_warp_create_half(const struct lumi_grid *grid, const struct lumi_grid *half, struct lumi_warp **result,
                          struct lumi_error *error)
{
    LUMI_TRY(create(grid->width, grid->height, half, result, error));
    float *position = (*result)->positions;
    for (int y = 0; y < half->height; y++)
        for (int x = 0; x < half->width; x++, position += 2) {
            double tan_x, tan_y, sx = 0, sy = 0;
            lumi_grid_unproject(half, x + 0.5, y + 0.5, &tan_x, &tan_y);
            lumi_grid_project(grid, lumi_vec3(tan_x, tan_y, 1), &sx, &sy);
            position[0] = (float)sx;
            position[1] = (float)sy;
        }
    return LUMI_OK;
}

void lumi_warp_destroy(struct lumi_warp *warp)
{
    if (!warp)
        return;
    lumi_free(warp->positions);
    lumi_free(warp);
}

/* Weights (sum 1) for the pixels around `centre`, the kernel stretched by `scale` ≥ 1. */
static void make_taps(const struct lumi_warp *warp, float centre, float scale, struct taps *taps)
{
    const float reach = LOBES * scale;
    float sum = 0;

    taps->first = (int)ceilf(centre - reach - 0.5f);
    taps->count = (int)floorf(centre + reach - 0.5f) - taps->first + 1;
    if (taps->count > MAX_TAPS)
        taps->count = MAX_TAPS;
    for (int i = 0; i < taps->count; i++) {
        float at = fabsf((float)(taps->first + i) + 0.5f - centre) / scale * TABLE;
        int low = at < LOBES * TABLE ? (int)at : LOBES * TABLE;
        float share = at - (float)low;
        float weight = warp->lanczos[low] + (share < 1 ? share : 1) * (warp->lanczos[low + 1] - warp->lanczos[low]);
        taps->weights[i] = weight;
        sum += weight;
    }
    for (int i = 0; i < taps->count; i++)
        taps->weights[i] /= sum;
}

static int clamp(int value, int size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

/* How far the source moves along axis `axis` for one pixel of the view: the kernel's scale, at least 1. */
static float footprint(const struct lumi_warp *warp, int x, int y, int axis)
{
    const float *p = warp->positions;
    const size_t width = (size_t)warp->width;
    const int x0 = clamp(x - 1, warp->width), x1 = clamp(x + 1, warp->width);
    const int y0 = clamp(y - 1, warp->height), y1 = clamp(y + 1, warp->height);
    const float across =
        p[2 * ((size_t)y * width + (size_t)x1) + (size_t)axis] - p[2 * ((size_t)y * width + (size_t)x0) + (size_t)axis];
    const float down =
        p[2 * ((size_t)y1 * width + (size_t)x) + (size_t)axis] - p[2 * ((size_t)y0 * width + (size_t)x) + (size_t)axis];
    const float a = x1 > x0 ? across / (float)(x1 - x0) : 0, d = y1 > y0 ? down / (float)(y1 - y0) : 0;
    const float scale = sqrtf(a * a + d * d);

    return scale < 1 ? 1 : scale > MAX_TAPS / (2 * LOBES) - 1 ? MAX_TAPS / (2 * LOBES) - 1 : scale;
}

static void filter(const struct lumi_raster *source, const struct taps *across, const struct taps *down, float out[3])
{
    float sum[3] = {0, 0, 0};

    for (int j = 0; j < down->count; j++) {
        const float *row = lumi_row_f32(source, clamp(down->first + j, source->height));
        float r = 0, g = 0, b = 0;
        if (across->first >= 0 && across->first + across->count <= source->width) {
            const float *pixel = row + 3 * across->first;
            for (int i = 0; i < across->count; i++, pixel += 3) {
                r += across->weights[i] * pixel[0];
                g += across->weights[i] * pixel[1];
                b += across->weights[i] * pixel[2];
            }
        } else {
            for (int i = 0; i < across->count; i++) {
                const float *pixel = row + 3 * clamp(across->first + i, source->width);
                r += across->weights[i] * pixel[0];
                g += across->weights[i] * pixel[1];
                b += across->weights[i] * pixel[2];
            }
        }
        sum[0] += down->weights[j] * r;
        sum[1] += down->weights[j] * g;
        sum[2] += down->weights[j] * b;
    }
    for (int c = 0; c < 3; c++)
        out[c] = sum[c];
}

/* Holds the value to those of the 4 × 4 pixels around (x, y). */
static void hold(const struct lumi_raster *source, float x, float y, float out[3])
{
    const int first_x = (int)floorf(x - 0.5f) - 1, first_y = (int)floorf(y - 0.5f) - 1;
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {0, 0, 0};

    for (int j = 0; j < 4; j++) {
        const float *row = lumi_row_f32(source, clamp(first_y + j, source->height));
        for (int i = 0; i < 4; i++) {
            const float *pixel = row + 3 * clamp(first_x + i, source->width);
            for (int c = 0; c < 3; c++) {
                low[c] = pixel[c] < low[c] ? pixel[c] : low[c];
                high[c] = pixel[c] > high[c] ? pixel[c] : high[c];
            }
        }
    }
    for (int c = 0; c < 3; c++)
        out[c] = out[c] < low[c] ? low[c] : out[c] > high[c] ? high[c] : out[c];
}

int lumi_warp_apply(const struct lumi_warp *warp, const struct lumi_raster *source, struct lumi_raster *result,
                    struct lumi_error *error)
{
    *result = (struct lumi_raster){0};
    if (source->width != warp->source_width || source->height != warp->source_height || source->channels != 3 ||
        source->sample != LUMI_F32)
        return lumi_fail(error, LUMI_ERR_ARG, "an image of %d × %d does not fit its lens (%d × %d)", source->width,
                         source->height, warp->source_width, warp->source_height);
    if (lumi_raster_create(result, warp->width, warp->height, 3, LUMI_F32) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    const float *position = warp->positions;
    for (int y = 0; y < warp->height; y++) {
        float *out = lumi_row_f32(result, y);
        for (int x = 0; x < warp->width; x++, position += 2, out += 3) {
            struct taps across, down;
            make_taps(warp, position[0], footprint(warp, x, y, 0), &across);
            make_taps(warp, position[1], footprint(warp, x, y, 1), &down);
            filter(source, &across, &down, out);
            hold(source, position[0], position[1], out);
        }
    }
    return LUMI_OK;
}
