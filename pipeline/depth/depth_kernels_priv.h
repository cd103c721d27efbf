/* The kernels' bodies in C, compiled once for every CPU and once for AVX2 (x86/depth_kernels_avx2.c). */
#ifndef LUMI_PIPELINE_DEPTH_KERNELS_PRIV_H
#define LUMI_PIPELINE_DEPTH_KERNELS_PRIV_H

#include "pipeline/depth/mvs_priv.h"

#include <stdlib.h>

static inline int16_t smaller(int16_t a, int16_t b)
{
    return a < b ? a : b;
}

static int path_step(const uint8_t *restrict cost, int16_t *restrict previous, int lowest, int p1, int p2, int planes,
                     int16_t *restrict path, uint16_t *restrict sum)
{
    const int16_t jump = (int16_t)(lowest + p2), one = (int16_t)p1, low = (int16_t)lowest;
    int16_t minimum = INT16_MAX;

    previous[-1] = previous[planes] = INT16_MAX / 2;
    for (int k = 0; k < planes; k++) {
        int16_t best = smaller(previous[k], jump);
        best = smaller(best, (int16_t)(smaller(previous[k - 1], previous[k + 1]) + one));
        int16_t value = (int16_t)(cost[k] + best - low);
        path[k] = value;
        sum[k] = (uint16_t)(sum[k] + value);
        minimum = smaller(minimum, value);
    }
    return minimum;
}

#endif
