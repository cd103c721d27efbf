/* Pictures between linear light and what is shown. */
#include "pipeline/prefilter/display.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

/* A cell holds the floats that have the exponent and the ten leading bits of the mantissa in common: a half's worth. */
#define CELL_BITS 13
#define CELLS (1 << (31 - CELL_BITS))
#define LARGEST 0x477fe000u /* 65504 */

static float to_display[CELLS + 1], to_linear[CELLS + 1];

static void fill_tables(void)
{
    for (uint32_t i = 0; i <= CELLS; i++) {
        const uint32_t bits = i << CELL_BITS > LARGEST ? LARGEST : i << CELL_BITS;
        float value;
        memcpy(&value, &bits, sizeof value);
        to_display[i] = lumi_srgb_encode(value);
        to_linear[i] = lumi_srgb_decode(value);
    }
}

static float follow(const float *table, float value)
{
    uint32_t bits;

    memcpy(&bits, &value, sizeof bits);
    const uint32_t sign = bits & 0x80000000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return 0;
    const uint32_t held = magnitude < LARGEST ? magnitude : LARGEST;
    const float *at = table + (held >> CELL_BITS);
    const float result = at[0] + (float)(held & ((1u << CELL_BITS) - 1)) * 0x1p-13f * (at[1] - at[0]);
    return sign ? -result : result;
}

static void convert(const float *table, struct lumi_raster *raster)
{
    const int count = raster->width * raster->channels;

    for (int y = 0; y < raster->height; y++) {
        float *row = lumi_row_f32(raster, y);
        for (int i = 0; i < count; i++)
            row[i] = follow(table, row[i]);
    }
}

static void prepare(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    pthread_once(&once, fill_tables);
}

void prefilter_to_display(struct lumi_raster *raster)
{
    prepare();
    convert(to_display, raster);
}

void prefilter_to_linear(struct lumi_raster *raster)
{
    prepare();
    convert(to_linear, raster);
}
