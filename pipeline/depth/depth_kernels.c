/* The kernels of matching in plain C: the definition of what the variants compute. */
#include "pipeline/depth/depth_kernels_priv.h"

static float axis_position(const struct mvs_axis *axis, float tangent)
{
    if (axis->linear)
        return axis->a[0] + axis->b[0] * tangent;
    float cell = (tangent - axis->origin) * axis->scale;
    cell = cell > 0 ? cell : 0;
    cell = cell < MVS_AXIS_CELLS - 1 ? cell : MVS_AXIS_CELLS - 1;
    int i = (int)cell;
    return axis->a[i] + axis->b[i] * tangent;
}

static int distance(uint32_t a, uint32_t b)
{
    int sum = 0;

    for (int shift = 0; shift < 32; shift += 8)
        sum += abs((int)(a >> shift & 255) - (int)(b >> shift & 255));
    return sum < MVS_COST_MAX ? sum : MVS_COST_MAX;
}

static void sweep(const struct mvs_target *target, const float a[3], uint32_t colour, int planes, uint8_t *cost)
{

    for (int k = 0; k < planes; k++) {
        float z = a[2] + target->plane_z[k], scale = 1 / z;
        float x = axis_position(&target->x, (a[0] + target->plane_x[k]) * scale) + 0.5f;
        float y = axis_position(&target->y, (a[1] + target->plane_y[k]) * scale) + 0.5f;
        if (z > 0 && x >= 0 && y >= 0 && x < (float)target->width && y < (float)target->height)
            cost[k] = (uint8_t)distance(colour, target->pixels[(int)y * target->width + (int)x]);
        else
            cost[k] = MVS_INVALID;
    }
}

const struct mvs_kernels mvs_kernels_c = {sweep, path_step, combine};

const struct mvs_kernels *mvs_kernels(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return &mvs_kernels_avx2;
#endif
    return &mvs_kernels_c;
}
