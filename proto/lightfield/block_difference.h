/* Sums of absolute differences, the inner loop of every search. */
#ifndef LUMI_PROTO_LIGHTFIELD_BLOCK_DIFFERENCE_H
#define LUMI_PROTO_LIGHTFIELD_BLOCK_DIFFERENCE_H

#include <stdint.h>
#include <stdlib.h>

#define LUMI_DIFFERENCE_BLOCK 16

/* Of two blocks of 16×16. gcc unrolls so short a loop before it can see that one instruction does a whole row. */
static inline unsigned lumi_block_difference(const uint8_t *a, int stride_a, const uint8_t *b, int stride_b)
{
    unsigned sum = 0;

    for (int y = 0; y < LUMI_DIFFERENCE_BLOCK; y++, a += stride_a, b += stride_b) {
        unsigned row = 0;
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC unroll 1
#endif
        for (int x = 0; x < LUMI_DIFFERENCE_BLOCK; x++)
            row += (unsigned)abs(a[x] - b[x]);
        sum += row;
    }
    return sum;
}

#endif
