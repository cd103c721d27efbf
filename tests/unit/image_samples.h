/* Pictures for the image tests: every sample type and number of channels, from a seed. */
#ifndef LUMI_TESTS_UNIT_IMAGE_SAMPLES_H
#define LUMI_TESTS_UNIT_IMAGE_SAMPLES_H

#include "proto/base/raster.h"

/* Smooth ramps with some noise, so that predictors and entropy coders have work to do. */
static inline void make_picture(struct lumi_raster *raster, int width, int height, int channels,
                                enum lumi_sample sample)
{
    uint32_t state = (uint32_t)(width * 31 + height * 7 + channels);

    lumi_raster_create(raster, width, height, channels, sample);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width * channels; x++) {
            state = state * 1664525u + 1013904223u;
            uint32_t value = ((uint32_t)x * 211u + (uint32_t)y * 157u + (state >> 25)) & 0xffffu;
            if (sample == LUMI_U8)
                lumi_row_u8(raster, y)[x] = (uint8_t)(value >> 8);
            else if (sample == LUMI_U16)
                lumi_row_u16(raster, y)[x] = (uint16_t)value;
            else
                lumi_row_f32(raster, y)[x] = (float)value / 48000.0f;
        }
}

#endif
