/* Small copies → pictures: colour as a screen shows it, figures, JPEG. */
#include "daemon/preview/pictures_priv.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FILE_MAX ((off_t)256 << 20)
#define WHITE_U8 254
#define BLACK_U8 2
#define TABLE 4096

/* ---- to 8 bits, sRGB ---- */

static uint8_t to_u8(double value)
{
    return (uint8_t)(value <= 0 ? 0 : value >= 1 ? 255 : value * 255 + 0.5);
}

static void srgb_table(uint8_t table[TABLE])
{
    for (int i = 0; i < TABLE; i++)
        table[i] = to_u8((double)lumi_srgb_encode((float)i / (TABLE - 1)));
}

static int of_sensor(const struct pictures_small *small, const struct lumi_raster *shown)
{
    const int channels = small->means.channels;
    const double unit = (TABLE - 1) / (1 - small->black);
    const double gain[3] = {small->white[0] > 0 ? small->white[0] : 1, 1, small->white[1] > 0 ? small->white[1] : 1};
    uint8_t *table = lumi_alloc(TABLE, 1);

    if (!table)
        return LUMI_ERR_NOMEM;
    srgb_table(table);
    for (int y = 0; y < shown->height; y++) {
        const uint16_t *in = lumi_row_u16(&small->means, y);
        uint8_t *out = lumi_row_u8(shown, y);
        for (int x = 0; x < shown->width; x++)
            for (int c = 0; c < channels; c++, in++, out++) {
                const double light = (*in / 65535.0 - small->black) * (channels == 3 ? gain[c] : 1) * unit;
                *out = table[light <= 0 ? 0 : light >= TABLE - 1 ? TABLE - 1 : (int)(light + 0.5)];
            }
    }
    lumi_free(table);
    return LUMI_OK;
}

/* ITU-R BT.601 or BT.709, as the format says. */
static void of_yuv(const struct pictures_small *small, const struct lumi_raster *shown)
{
    const double kr = small->bt709 ? 0.2126 : 0.299, kb = small->bt709 ? 0.0722 : 0.114, kg = 1 - kr - kb;
    const double base = small->full_range ? 0 : 16, luma = small->full_range ? 255 : 219;
    const double chroma = small->full_range ? 255 : 224;

    for (int row = 0; row < shown->height; row++) {
        const uint16_t *in = lumi_row_u16(&small->means, row);
        uint8_t *out = lumi_row_u8(shown, row);
        for (int x = 0; x < shown->width; x++, in += 3, out += 3) {
            const double y = (in[0] / 257.0 - base) / luma;
            const double u = (in[1] / 257.0 - 128) / chroma, v = (in[2] / 257.0 - 128) / chroma;
            out[0] = to_u8(y + 2 * (1 - kr) * v);
            out[1] = to_u8(y - 2 * kb * (1 - kb) / kg * u - 2 * kr * (1 - kr) / kg * v);
            out[2] = to_u8(y + 2 * (1 - kb) * u);
        }
    }
}

static void of_srgb(const struct pictures_small *small, const struct lumi_raster *shown)
{
    for (int y = 0; y < shown->height; y++) {
        const uint16_t *in = lumi_row_u16(&small->means, y);
        uint8_t *out = lumi_row_u8(shown, y);
        for (int x = 0; x < 3 * shown->width; x++)
            out[x] = (uint8_t)((in[x] + 128) / 257);
    }
}

/* ---- files ---- */

/* Means of squares of an 8-bit image; alpha is left out. */
static int shrink(const struct lumi_raster *image, int most, struct lumi_raster *shown)
{
    const int channels = image->channels < 3 ? 1 : 3;
    int side = (image->width + most - 1) / most;

    side = side < 1 ? 1 : side > image->height ? image->height : side;
    LUMI_TRY(lumi_raster_create(shown, image->width / side, image->height / side, channels, LUMI_U8));
    for (int y = 0; y < shown->height; y++)
        for (int x = 0; x < shown->width; x++)
            for (int c = 0; c < channels; c++) {
                uint32_t sum = 0, count = (uint32_t)(side * side);
                for (int i = 0; i < side * side; i++)
                    sum += lumi_row_u8(image, y * side + i / side)[(x * side + i % side) * image->channels + c];
                lumi_row_u8(shown, y)[x * channels + c] = (uint8_t)((sum + count / 2) / count);
            }
    return LUMI_OK;
}

static int of_bytes(const void *bytes, size_t size, int most, struct lumi_raster *shown, struct lumi_picture *picture,
                    struct lumi_error *error)
{
    struct lumi_raster image, coded = {0};
    struct lumi_image_info info;
    int code;

    LUMI_TRY(lumi_image_read_reduced(bytes, size, "frame", most, &image, &info, error));
    picture->width = info.width;
    picture->height = info.height;
    code = image.sample == LUMI_U8 ? LUMI_OK : lumi_raster_convert(&image, LUMI_U8, &coded);
    if (code == LUMI_OK)
        code = shrink(coded.data ? &coded : &image, most, shown);
    if (code != LUMI_OK)
        lumi_fail(error, code, "no memory for a picture of %dx%d pixels", info.width, info.height);
    lumi_raster_finish(&coded);
    lumi_raster_finish(&image);
    return code;
}

static int of_file(int fd, int most, struct lumi_raster *shown, struct lumi_picture *picture, struct lumi_error *error)
{
    struct stat status;
    uint8_t *bytes;
    size_t got = 0;
    int code;

    if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size <= 0 || status.st_size > FILE_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the frame's file is none, or too large");
    bytes = lumi_alloc((size_t)status.st_size, 1);
    if (!bytes)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a file of %lld bytes", (long long)status.st_size);
    for (ssize_t size = 1; size > 0 && got<(size_t)status.st_size; got += size> 0 ? (size_t)size : 0)
        size = pread(fd, bytes + got, (size_t)status.st_size - got, (off_t)got);
    code = of_bytes(bytes, got, most, shown, picture, error);
    lumi_free(bytes);
    return code;
}

/* ---- figures ---- */

/* Luma by BT.709 of what is shown. */
static void take_figures(const struct lumi_raster *shown, bool counted, struct lumi_picture *picture)
{
    uint64_t sum = 0, white = 0, black = 0;
    const uint64_t all = (uint64_t)shown->width * (uint64_t)shown->height;
    const int c = shown->channels;

    for (int y = 0; y < shown->height; y++) {
        const uint8_t *in = lumi_row_u8(shown, y);
        for (int x = 0; x < shown->width; x++, in += c) {
            const unsigned r = in[0], g = c >= 3 ? in[1] : r, b = c >= 3 ? in[2] : r;
            const unsigned luma = (13933 * r + 46871 * g + 4732 * b + 32768) >> 16;
            const unsigned most = r > g ? (r > b ? r : b) : g > b ? g : b;
            white += most >= WHITE_U8;
            black += most <= BLACK_U8;
            sum += luma;
            picture->histogram[luma * LUMI_PICTURE_BINS / 256]++;
        }
    }
    picture->mean = (double)sum / (255.0 * (double)all);
    if (!counted) {
        picture->clipped_low = (double)black / (double)all;
        picture->clipped_high = (double)white / (double)all;
    }
}

static int show(const struct pictures_small *small, int most, struct lumi_raster *shown, struct lumi_picture *picture,
                struct lumi_error *error)
{
    if (small->kind == PICTURES_CODED)
        return of_bytes(small->bytes, small->size, most, shown, picture, error);
    if (small->kind == PICTURES_FILE)
        return of_file(small->fd, most, shown, picture, error);
    int code = lumi_raster_create(shown, small->means.width, small->means.height, small->means.channels, LUMI_U8);
    if (code == LUMI_OK && small->kind == PICTURES_SENSOR)
        code = of_sensor(small, shown);
    else if (code == LUMI_OK && small->kind == PICTURES_YUV)
        of_yuv(small, shown);
    else if (code == LUMI_OK)
        of_srgb(small, shown);
    return code == LUMI_OK ? code : lumi_fail(error, code, "no memory for a picture");
}

int pictures_make(const struct pictures_small *small, int most, int quality, struct lumi_picture **picture,
                  struct lumi_error *error)
{
    struct lumi_picture *made = lumi_calloc(1, sizeof *made);
    struct lumi_image_options options;
    struct lumi_raster shown = {0};
    int code;

    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture");
    made->width = small->width;
    made->height = small->height;
    made->clipped_low = small->clipped_low;
    made->clipped_high = small->clipped_high;
    made->shot = small->shot;
    made->unix_us = small->unix_us;
    made->sharpness = NAN;
    snprintf(made->frame, sizeof made->frame, "%s", small->name);
    LUMI_GOTO(code, out, show(small, most, &shown, made, error));
    made->small_width = shown.width;
    made->small_height = shown.height;
    take_figures(&shown, small->counted, made);
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.quality = quality;
    options.subsample = true;
    LUMI_GOTO(code, out, lumi_image_encode(&shown, &options, &made->jpeg, &made->size, error));
out:
    lumi_raster_finish(&shown);
    if (code != LUMI_OK) {
        lumi_free(made->jpeg);
        lumi_free(made);
        made = NULL;
    }
    *picture = made;
    return code;
}
