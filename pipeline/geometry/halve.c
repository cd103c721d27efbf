/* Inverse depth at half resolution. */
#include "pipeline/geometry/simplify.h"

#include <math.h>

static float second_largest(float a, float b, float c, float d)
{
    const float high = fmaxf(a, b), low = fminf(a, b), other_high = fmaxf(c, d), other_low = fminf(c, d);

    return high > other_high ? fmaxf(low, other_high) : fmaxf(high, other_low);
}

static int clamp(int value, int size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

int lumi_halve_inverse_depth(const struct lumi_raster *inverse_depth, const struct lumi_grid *grid,
                             const struct lumi_grid *half, struct lumi_raster *result)
{
    LUMI_TRY(lumi_raster_create(result, half->width, half->height, 1, LUMI_F32));
    for (int y = 0; y < half->height; y++)
        for (int x = 0; x < half->width; x++) {
            double tan_x, tan_y, fx = 0, fy = 0;
            lumi_grid_unproject(half, x + 0.5, y + 0.5, &tan_x, &tan_y);
            lumi_grid_project(grid, lumi_vec3(tan_x, tan_y, 1), &fx, &fy);
            const int x1 = clamp((int)floor(fx + 0.5), grid->width), x0 = clamp(x1 - 1, grid->width);
            const int y1 = clamp((int)floor(fy + 0.5), grid->height), y0 = clamp(y1 - 1, grid->height);
            const float *upper = lumi_row_f32(inverse_depth, y0), *lower = lumi_row_f32(inverse_depth, y1);
            lumi_row_f32(result, y)[x] = second_largest(upper[x0], upper[x1], lower[x0], lower[x1]);
        }
    return LUMI_OK;
}
