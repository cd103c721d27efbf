/* Pictures that carry their number and the exposure they were taken with, as rows of black and white squares. */
#ifndef LUMI_TESTS_HARDWARE_NUMBERED_PICTURE_H
#define LUMI_TESTS_HARDWARE_NUMBERED_PICTURE_H

#include <stdbool.h>
#include <stdint.h>

#define PICTURE_SQUARE 16
#define PICTURE_BITS 16

static inline uint8_t picture_grey(int x, int y, unsigned number, unsigned exposure)
{
    const unsigned row = y < PICTURE_SQUARE ? number : exposure;

    if (x >= PICTURE_SQUARE * PICTURE_BITS || y >= 2 * PICTURE_SQUARE)
        return (uint8_t)(64 + (x + y + (int)number * 3) % 128);
    return row >> (x / PICTURE_SQUARE) & 1 ? 235 : 16;
}

/* From luma samples `step` bytes apart, in rows of `stride` bytes. */
static inline void picture_read(const uint8_t *luma, int step, int stride, unsigned *number, unsigned *exposure)
{
    unsigned *const rows[2] = {number, exposure};

    for (int r = 0; r < 2; r++) {
        *rows[r] = 0;
        for (int bit = 0; bit < PICTURE_BITS; bit++) {
            const int x = bit * PICTURE_SQUARE + PICTURE_SQUARE / 2, y = r * PICTURE_SQUARE + PICTURE_SQUARE / 2;

            *rows[r] |= (unsigned)(luma[y * stride + x * step] > 128) << bit;
        }
    }
}

#endif
