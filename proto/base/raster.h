/* Pixels in memory. */
#ifndef LUMI_PROTO_BASE_RASTER_H
#define LUMI_PROTO_BASE_RASTER_H

#include "proto/base/result.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum lumi_sample { LUMI_U8 = 1, LUMI_U16 = 2, LUMI_F32 = 4 }; /* the value is the size in bytes */

/* What the numbers mean. U8 and U16 rasters are sRGB-encoded (IEC 61966-2-1), full scale white; F32 ones are linear
 * light, 1.0 white. */
#define LUMI_RASTER_MAX 65536 /* largest width or height anything here accepts */

/* Interleaved pixels, rows top to bottom, `stride` bytes a row, 64-byte aligned rows when made by lumi_raster_create.
 */
struct lumi_raster {
    int width, height;
    int channels; /* 1 grey, 3 RGB, 4 RGB and alpha */
    enum lumi_sample sample;
    size_t stride;
    void *data;
};

/* Allocates (zeroed). LUMI_ERR_NOMEM, or LUMI_ERR_ARG for a size that is not 1..LUMI_RASTER_MAX. */
int lumi_raster_create(struct lumi_raster *raster, int width, int height, int channels, enum lumi_sample sample);
/* Releases the pixels; accepts an all-zero raster. */
void lumi_raster_finish(struct lumi_raster *raster);

static inline uint8_t *lumi_row_u8(const struct lumi_raster *raster, int y)
{
    return (uint8_t *)raster->data + (size_t)y * raster->stride;
}
static inline uint16_t *lumi_row_u16(const struct lumi_raster *raster, int y)
{
    return (uint16_t *)(void *)((uint8_t *)raster->data + (size_t)y * raster->stride);
}
static inline float *lumi_row_f32(const struct lumi_raster *raster, int y)
{
    return (float *)(void *)((uint8_t *)raster->data + (size_t)y * raster->stride);
}

/* The sRGB transfer function and its inverse (IEC 61966-2-1), on 0..1, extended oddly below 0 and by the same power
 * above 1. */
float lumi_srgb_encode(float linear);
float lumi_srgb_decode(float encoded);

/* A new raster with another sample type, values converted: sRGB ↔ linear where it changes between integer and float,
 * rounding to nearest, clamped to what the target holds. Channels stay. */
int lumi_raster_convert(const struct lumi_raster *source, enum lumi_sample sample, struct lumi_raster *result);

/* Writes an U8 RGB raster as a binary PPM file: for programs that have no library of pictures. */
int lumi_raster_write_ppm(const struct lumi_raster *raster, const char *path, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
