/* The kernels of matching in plain C: the definition of what the variants compute. */
#include "pipeline/depth/mvs_priv.h"

#include <math.h>
#include <stdlib.h>

static inline uint8_t lesser(uint8_t a, uint8_t b)
{
    return a < b ? a : b;
}

static int distance(uint32_t a, uint32_t b)
{
    int sum = 0;

    for (int shift = 0; shift < 32; shift += 8)
        sum += abs((int)(a >> shift & 255) - (int)(b >> shift & 255));
    return sum < MVS_COST_MAX ? sum : MVS_COST_MAX;
}

static float position(const struct mvs_axis *axis, const struct mvs_line *line, float tangent)
{
    return line->straight ? line->a + line->b * tangent : mvs_axis_position(axis, tangent);
}

static void sweep(const struct mvs_target *target, const struct mvs_ends *ends, const float a[3], uint32_t colour,
                  uint8_t *cost)
{
    float x[2 * MVS_GROUPS_MAX], y[2 * MVS_GROUPS_MAX];

    for (int e = 0; e < ends->count; e++) {
        float z = a[2] + ends->z[e], scale = z > 0 ? 1 / z : NAN;
        x[e] = position(&target->x, &ends->column, (a[0] + ends->x[e]) * scale) + 0.5f;
        y[e] = position(&target->y, &ends->row, (a[1] + ends->y[e]) * scale) + 0.5f;
    }
    for (int i = 0; i < ends->groups; i++) {
        const int e = ends->end[i];
        const float step_x = (x[e + 1] - x[e]) * (1.0f / MVS_GROUP), step_y = (y[e + 1] - y[e]) * (1.0f / MVS_GROUP);
        for (int k = 0; k < MVS_GROUP; k++) {
            float at_x = x[e] + (float)k * step_x, at_y = y[e] + (float)k * step_y;
            bool inside = at_x >= 0 && at_y >= 0 && at_x < (float)target->width && at_y < (float)target->height;
            cost[i * MVS_GROUP + k] =
                (uint8_t)(inside ? distance(colour, target->pixels[(int)at_y * target->width + (int)at_x])
                                 : MVS_INVALID);
        }
    }
}

static void order(uint8_t *a, uint8_t *b)
{
    const uint8_t low = *a < *b ? *a : *b, high = *a < *b ? *b : *a;

    *a = low;
    *b = high;
}

static void combine(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int lanes, uint8_t *result)
{
    for (int k = 0; k < lanes; k++) {
        uint8_t v[LUMI_MVS_NEIGHBOURS];
        for (int n = 0; n < LUMI_MVS_NEIGHBOURS; n++)
            v[n] = cost[n][k];
        for (int i = 0; i < best; i++)
            for (int n = LUMI_MVS_NEIGHBOURS - 1; n > i; n--)
                order(&v[n - 1], &v[n]);
        int sum = 0, valid = 0;
        for (int n = 0; n < best; n++)
            if (v[n] != MVS_INVALID) {
                sum += v[n];
                valid++;
            }
        const int share = valid == 4 ? 64 : valid == 3 ? 85 : valid == 2 ? 128 : 256;
        result[k] = (uint8_t)(valid ? sum * share >> 8 : MVS_COST_MAX / 2);
    }
}

static uint8_t plus(uint8_t a, uint8_t b)
{
    int sum = a + b;

    return (uint8_t)(sum < 255 ? sum : 255);
}

static void step(struct mvs_step *s)
{
    for (int d = 0; d < MVS_PATHS; d++) {
        const uint8_t *previous = s->previous[d], jump = (uint8_t)(s->lowest[d] + s->p2[d]);
        const uint8_t before = (uint8_t)s->lowest[d];
        uint8_t lowest = 255;
        for (int k = 0; k < s->lanes; k++) {
            uint8_t best = lesser(previous[k], jump);
            best = lesser(best, plus(previous[k - 1], s->below[k]));
            best = lesser(best, plus(previous[k + 1], s->above[k]));
            uint8_t value = plus(s->cost[k], (uint8_t)(best - before));
            s->path[d][k] = value;
            s->sum[k] = (uint16_t)((d > 0 || s->add ? s->sum[k] : 0) + value);
            lowest = lesser(lowest, value);
        }
        s->lowest[d] = lowest;
    }
}

static int smallest(const uint16_t *sum, int lanes)
{
    int best = 0;

    for (int k = 1; k < lanes; k++)
        if (sum[k] < sum[best])
            best = k;
    return best;
}

const struct mvs_kernels mvs_kernels_c = {sweep, combine, step, smallest};

const struct mvs_kernels *mvs_kernels(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return &mvs_kernels_avx2;
#endif
    return &mvs_kernels_c;
}
