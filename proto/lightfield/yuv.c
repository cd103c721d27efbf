/* RGB to YUV 4:2:0 and back.
 *
 * BT.709: Y = 0.2126 R + 0.7152 G + 0.0722 B, U = (B − Y) / 1.8556 + 128, V = (R − Y) / 1.5748 + 128, on 0..255.
 * Chroma is halved with the taps (−1, 9, 9, −1) / 16 and doubled with the cubic that passes through its samples
 * (Catmull-Rom at 1/4 and 3/4), both separable. */
#include "proto/lightfield/yuv.h"

#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

int lumi_yuv_create(struct lumi_yuv *image, int width, int height)
{
    *image = (struct lumi_yuv){0};
    if (width < 1 || height < 1 || width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX)
        return LUMI_ERR_ARG;

    size_t luma = (size_t)width * (size_t)height;
    size_t chroma = (size_t)((width + 1) / 2) * (size_t)((height + 1) / 2);
    uint8_t *block = lumi_alloc(luma + 2 * chroma, 1);
    if (!block)
        return LUMI_ERR_NOMEM;
    *image = (struct lumi_yuv){width, height, {block, block + luma, block + luma + chroma}};
    return LUMI_OK;
}

void lumi_yuv_finish(struct lumi_yuv *image)
{
    lumi_free(image->plane[0]);
    *image = (struct lumi_yuv){0};
}

static inline uint8_t to_byte(float value)
{
    return (uint8_t)(value <= 0 ? 0 : value >= 255 ? 255 : value + 0.5f);
}

static inline int clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

#define ENCODE_STEPS 4096

/* sRGB encoding scaled to 0..255, tabulated over the square root of the light: error below 0.01. */
static void fill_encode_table(float table[ENCODE_STEPS + 2])
{
    for (int i = 0; i <= ENCODE_STEPS + 1; i++) {
        float root = (float)i / ENCODE_STEPS;
        table[i] = 255 * lumi_srgb_encode(root * root);
    }
}

static void read_row(const struct lumi_raster *raster, const float *table, int y, float *rgb)
{
    int step = raster->channels;

    for (int x = 0; x < raster->width; x++)
        for (int c = 0; c < 3; c++) {
            float value;
            if (raster->sample == LUMI_U8) {
                value = lumi_row_u8(raster, y)[x * step + c];
            } else if (raster->sample == LUMI_U16) {
                value = (float)lumi_row_u16(raster, y)[x * step + c] / 257;
            } else {
                float light = lumi_row_f32(raster, y)[x * step + c];
                float place = light > 0 ? ENCODE_STEPS * sqrtf(light < 1 ? light : 1) : 0;
                int index = (int)place;
                value = table[index] + (place - (float)index) * (table[index + 1] - table[index]);
            }
            rgb[3 * x + c] = value;
        }
}

/* One row of chroma differences, halved in width. */
static void halve_row(const float *full, int width, float *half)
{
    for (int x = 0; x < (width + 1) / 2; x++) {
        float a = full[clamp(2 * x - 1, 0, width - 1)], b = full[2 * x];
        float c = full[clamp(2 * x + 1, 0, width - 1)], d = full[clamp(2 * x + 2, 0, width - 1)];
        half[x] = (9 * (b + c) - a - d) / 16;
    }
}

static void halve_columns(const float *half, int height, int width, uint8_t *plane)
{
    for (int y = 0; y < (height + 1) / 2; y++) {
        const float *a = half + (size_t)clamp(2 * y - 1, 0, height - 1) * width;
        const float *b = half + (size_t)(2 * y) * width;
        const float *c = half + (size_t)clamp(2 * y + 1, 0, height - 1) * width;
        const float *d = half + (size_t)clamp(2 * y + 2, 0, height - 1) * width;
        for (int x = 0; x < width; x++)
            plane[(size_t)y * width + x] = to_byte((9 * (b[x] + c[x]) - a[x] - d[x]) / 16 + 128);
    }
}

int lumi_yuv_from_raster(const struct lumi_raster *raster, struct lumi_yuv *image)
{
    if (raster->channels < 3)
        return LUMI_ERR_ARG;
    LUMI_TRY(lumi_yuv_create(image, raster->width, raster->height));

    int width = raster->width, height = raster->height, half_width = (width + 1) / 2;
    size_t half_size = (size_t)half_width * (size_t)height;
    float table[ENCODE_STEPS + 2];
    float *rgb = lumi_alloc((size_t)width * 5 + 2 * half_size, sizeof *rgb);
    if (!rgb) {
        lumi_yuv_finish(image);
        return LUMI_ERR_NOMEM;
    }
    float *u = rgb + 3 * (size_t)width, *v = u + width, *half_u = v + width, *half_v = half_u + half_size;

    fill_encode_table(table);
    for (int y = 0; y < height; y++) {
        uint8_t *luma = image->plane[0] + (size_t)y * width;
        read_row(raster, table, y, rgb);
        for (int x = 0; x < width; x++) {
            float r = rgb[3 * x], g = rgb[3 * x + 1], b = rgb[3 * x + 2];
            float l = 0.2126f * r + 0.7152f * g + 0.0722f * b;
            luma[x] = to_byte(l);
            u[x] = (b - l) / 1.8556f;
            v[x] = (r - l) / 1.5748f;
        }
        halve_row(u, width, half_u + (size_t)y * half_width);
        halve_row(v, width, half_v + (size_t)y * half_width);
    }
    halve_columns(half_u, height, half_width, image->plane[1]);
    halve_columns(half_v, height, half_width, image->plane[2]);
    lumi_free(rgb);
    return LUMI_OK;
}

/* Weights for the place 1/4 before (even) or 1/4 after (odd) a chroma sample, over the four samples around. */
static const float cubic[2][4] = {{-0.0234375f, 0.2265625f, 0.8671875f, -0.0703125f},
                                  {-0.0703125f, 0.8671875f, 0.2265625f, -0.0234375f}};

/* The four chroma samples around luma place `i`. */
static void taps(int i, int count, int at[4])
{
    int first = i / 2 - (i & 1 ? 1 : 2);

    for (int k = 0; k < 4; k++)
        at[k] = clamp(first + k, 0, count - 1);
}

/* Row y of a chroma plane at luma resolution, less 128. `between` holds a chroma-wide row. */
static void double_row(const struct lumi_yuv *image, int plane, int y, float *between, float *row)
{
    int width = lumi_yuv_width(image, plane), at[4];
    const float *w = cubic[y & 1];

    taps(y, lumi_yuv_height(image, plane), at);
    const uint8_t *a = image->plane[plane] + (size_t)at[0] * width, *b = image->plane[plane] + (size_t)at[1] * width;
    const uint8_t *c = image->plane[plane] + (size_t)at[2] * width, *d = image->plane[plane] + (size_t)at[3] * width;
    for (int x = 0; x < width; x++)
        between[x] = w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + w[3] * d[x] - 128;
    for (int x = 0; x < image->width; x++) {
        w = cubic[x & 1];
        taps(x, width, at);
        row[x] = w[0] * between[at[0]] + w[1] * between[at[1]] + w[2] * between[at[2]] + w[3] * between[at[3]];
    }
}

int lumi_yuv_to_raster(const struct lumi_yuv *image, const struct lumi_raster *raster)
{
    if (raster->channels != 3 || raster->sample != LUMI_U8 || raster->width != image->width ||
        raster->height != image->height)
        return LUMI_ERR_ARG;

    size_t width = (size_t)image->width;
    float *u = lumi_alloc(3 * width, sizeof *u);
    if (!u)
        return LUMI_ERR_NOMEM;
    float *v = u + width, *between = v + width;
    for (int y = 0; y < image->height; y++) {
        const uint8_t *luma = image->plane[0] + (size_t)y * width;
        uint8_t *rgb = lumi_row_u8(raster, y);
        double_row(image, 1, y, between, u);
        double_row(image, 2, y, between, v);
        for (size_t x = 0; x < width; x++) {
            float l = luma[x];
            rgb[3 * x] = to_byte(l + 1.5748f * v[x]);
            rgb[3 * x + 1] = to_byte(l - 0.1873243f * u[x] - 0.4681243f * v[x]);
            rgb[3 * x + 2] = to_byte(l + 1.8556f * u[x]);
        }
    }
    lumi_free(u);
    return LUMI_OK;
}
