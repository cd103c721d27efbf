/* Pixels in memory. */
#include "proto/base/raster.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

int lumi_raster_create(struct lumi_raster *raster, int width, int height, int channels, enum lumi_sample sample)
{
    *raster = (struct lumi_raster){0};
    if (width < 1 || height < 1 || width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX || channels < 1 || channels > 4)
        return LUMI_ERR_ARG;
    size_t stride = ((size_t)width * (size_t)channels * (size_t)sample + 63) & ~(size_t)63;
    void *data = lumi_calloc((size_t)height, stride);
    if (!data)
        return LUMI_ERR_NOMEM;
    *raster = (struct lumi_raster){width, height, channels, sample, stride, data};
    return LUMI_OK;
}

void lumi_raster_finish(struct lumi_raster *raster)
{
    lumi_free(raster->data);
    *raster = (struct lumi_raster){0};
}

float lumi_srgb_encode(float linear)
{
    if (linear < 0)
        return -lumi_srgb_encode(-linear);
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}

float lumi_srgb_decode(float encoded)
{
    if (encoded < 0)
        return -lumi_srgb_decode(-encoded);
    return encoded <= 0.04045f ? encoded / 12.92f : powf((encoded + 0.055f) / 1.055f, 2.4f);
}

static float decode_u8[256];
static float decode_u16[65536];
static pthread_once_t tables_once = PTHREAD_ONCE_INIT;

static void make_tables(void)
{
    for (int i = 0; i < 256; i++)
        decode_u8[i] = lumi_srgb_decode((float)i / 255);
    for (int i = 0; i < 65536; i++)
        decode_u16[i] = lumi_srgb_decode((float)i / 65535);
}

static float clamp01(float value)
{
    return value > 0 ? (value < 1 ? value : 1) : 0; /* NaN becomes 0 */
}

/* The nearest 8-bit code of a linear value. */
static uint8_t encode_u8(float linear)
{
    return (uint8_t)(lumi_srgb_encode(clamp01(linear)) * 255 + 0.5f);
}

static void convert_row(const struct lumi_raster *from, const struct lumi_raster *to, int y)
{
    int count = from->width * from->channels;
    const uint8_t *in8 = lumi_row_u8(from, y);
    const uint16_t *in16 = lumi_row_u16(from, y);
    const float *in = lumi_row_f32(from, y);
    uint8_t *out8 = lumi_row_u8(to, y);
    uint16_t *out16 = lumi_row_u16(to, y);
    float *out = lumi_row_f32(to, y);

    for (int i = 0; i < count; i++) {
        int alpha = from->channels == 4 && i % 4 == 3;
        switch (from->sample * 8 + to->sample) {
        case LUMI_U8 * 8 + LUMI_U16:
            out16[i] = (uint16_t)(in8[i] * 257);
            break;
        case LUMI_U8 * 8 + LUMI_F32:
            out[i] = alpha ? (float)in8[i] / 255 : decode_u8[in8[i]];
            break;
        case LUMI_U16 * 8 + LUMI_U8:
            out8[i] = (uint8_t)((in16[i] + 128u) / 257u);
            break;
        case LUMI_U16 * 8 + LUMI_F32:
            out[i] = alpha ? (float)in16[i] / 65535 : decode_u16[in16[i]];
            break;
        case LUMI_F32 * 8 + LUMI_U8:
            out8[i] = alpha ? (uint8_t)(clamp01(in[i]) * 255 + 0.5f) : encode_u8(in[i]);
            break;
        case LUMI_F32 * 8 + LUMI_U16:
            out16[i] = (uint16_t)((alpha ? clamp01(in[i]) : lumi_srgb_encode(clamp01(in[i]))) * 65535 + 0.5f);
            break;
        default:
            break;
        }
    }
}

int lumi_raster_convert(const struct lumi_raster *source, enum lumi_sample sample, struct lumi_raster *result)
{
    pthread_once(&tables_once, make_tables);
    LUMI_TRY(lumi_raster_create(result, source->width, source->height, source->channels, sample));
    for (int y = 0; y < source->height; y++) {
        if (source->sample == sample)
            memcpy(lumi_row_u8(result, y), lumi_row_u8(source, y),
                   (size_t)source->width * (size_t)source->channels * (size_t)sample);
        else
            convert_row(source, result, y);
    }
    return LUMI_OK;
}

int lumi_raster_write_ppm(const struct lumi_raster *raster, const char *path, struct lumi_error *error)
{
    char header[48];

    if (raster->channels != 3 || raster->sample != LUMI_U8)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: a PPM file holds three channels of bytes", path);
    size_t begin = (size_t)snprintf(header, sizeof header, "P6\n%d %d\n255\n", raster->width, raster->height);
    size_t row = 3 * (size_t)raster->width;
    uint8_t *bytes = lumi_alloc(begin + row * (size_t)raster->height, 1);
    if (!bytes)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory to write it", path);
    memcpy(bytes, header, begin);
    for (int y = 0; y < raster->height; y++)
        memcpy(bytes + begin + (size_t)y * row, lumi_row_u8(raster, y), row);
    int code = lumi_file_write(path, bytes, begin + row * (size_t)raster->height, false, error);
    lumi_free(bytes);
    return code;
}
