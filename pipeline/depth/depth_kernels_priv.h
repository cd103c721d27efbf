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

static inline void order(uint8_t *restrict a, uint8_t *restrict b, int planes)
{
    for (int k = 0; k < planes; k++) {
        uint8_t low = a[k] < b[k] ? a[k] : b[k], high = a[k] < b[k] ? b[k] : a[k];
        a[k] = low;
        b[k] = high;
    }
}

static void combine(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int planes, uint8_t *restrict result)
{
    /* Batcher's odd-even merge network. */
    static const uint8_t pairs[19][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {1, 2}, {5, 6},
                                         {0, 4}, {1, 5}, {2, 6}, {3, 7}, {2, 4}, {3, 5}, {1, 2}, {3, 4}, {5, 6}};
    uint16_t sum[MVS_PLANES_MAX] = {0}, valid[MVS_PLANES_MAX] = {0};

    for (int i = 0; i < 19; i++)
        order(cost[pairs[i][0]], cost[pairs[i][1]], planes);
    for (int n = 0; n < best; n++)
        for (int k = 0; k < planes; k++) {
            uint16_t value = cost[n][k], counts = value != MVS_INVALID;
            sum[k] = (uint16_t)(sum[k] + (counts ? value : 0));
            valid[k] = (uint16_t)(valid[k] + counts);
        }
    for (int k = 0; k < planes; k++) {
        uint16_t share = valid[k] == 4 ? 64 : valid[k] == 3 ? 85 : valid[k] == 2 ? 128 : 256;
        uint16_t mean = (uint16_t)((uint16_t)(sum[k] * share) >> 8);
        result[k] = (uint8_t)(valid[k] ? mean : MVS_COST_MAX / 2);
    }
}

#endif
