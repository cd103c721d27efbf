/* Frames → light. */
#include "daemon/camera/camera_device.h"
#include "daemon/judge/judge_priv.h"
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/image/image.h"

/* ITU-R BT.709 luminance of linear red, green, blue. */
#define RED 0.2126f
#define GREEN 0.7152f
#define BLUE 0.0722f

#define WHITE_U8 254 /* from here on a coded sample counts as white: JPEG rarely keeps 255 */
#define BLACK_U8 2

struct counts {
    uint64_t white, black;
};

static int claim(struct judge_plane *plane, int width, int height, struct lumi_error *error)
{
    *plane = (struct judge_plane){width, height, lumi_alloc((size_t)width * (size_t)height, sizeof(float))};
    if (!plane->data)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to judge %dx%d pixels", width, height);
    return LUMI_OK;
}

static void srgb_table(float table[256])
{
    for (int i = 0; i < 256; i++)
        table[i] = lumi_srgb_decode((float)i / 255);
}

/* 8-bit sRGB samples, one or three and more a pixel. */
static void take_u8(const uint8_t *data, size_t stride, int channels, const struct judge_plane *plane,
                    struct counts *counts)
{
    float light[256];
    int c = channels;

    srgb_table(light);
    for (int y = 0; y < plane->height; y++) {
        const uint8_t *in = data + (size_t)y * stride;
        float *out = plane->data + (size_t)y * (size_t)plane->width;
        for (int x = 0; x < plane->width; x++, in += c) {
            uint8_t r = in[0], g = c >= 3 ? in[1] : r, b = c >= 3 ? in[2] : r;
            uint8_t most = r > g ? r : g;
            most = most > b ? most : b;
            counts->white += most >= WHITE_U8;
            counts->black += most <= BLACK_U8;
            out[x] = RED * light[r] + GREEN * light[g] + BLUE * light[b];
        }
    }
}

static int take_float(const struct lumi_raster *raster, const struct judge_plane *plane, struct counts *counts,
                      struct lumi_error *error)
{
    struct lumi_raster own = {0};

    if (raster->sample != LUMI_F32) {
        if (lumi_raster_convert(raster, LUMI_F32, &own) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to judge %dx%d pixels", raster->width, raster->height);
        raster = &own;
    }
    int c = raster->channels;
    for (int y = 0; y < plane->height; y++) {
        const float *in = lumi_row_f32(raster, y);
        float *out = plane->data + (size_t)y * (size_t)plane->width;
        for (int x = 0; x < plane->width; x++, in += c) {
            float r = in[0], g = c >= 3 ? in[1] : r, b = c >= 3 ? in[2] : r;
            float most = r > g ? r : g;
            most = most > b ? most : b;
            counts->white += most >= 0.99f;
            counts->black += most <= 0.001f;
            out[x] = RED * r + GREEN * g + BLUE * b;
        }
    }
    lumi_raster_finish(&own);
    return LUMI_OK;
}

static int take_image(const struct lumi_camera_frame *frame, struct judge_plane *plane, struct counts *counts,
                      struct lumi_error *error)
{
    struct lumi_raster raster;
    int code;

    if (frame->format.layout == LUMI_LAYOUT_FILE)
        code = lumi_image_read(frame->path, 0, &raster, NULL, error);
    else
        code = lumi_image_read_memory(frame->data, frame->size, "frame", 0, &raster, NULL, error);
    LUMI_TRY(code);
    code = claim(plane, raster.width, raster.height, error);
    if (code == LUMI_OK && raster.sample == LUMI_U8)
        take_u8(raster.data, raster.stride, raster.channels, plane, counts);
    else if (code == LUMI_OK)
        code = take_float(&raster, plane, counts, error);
    lumi_raster_finish(&raster);
    return code;
}

static unsigned raw_sample(const struct lumi_camera_frame *frame, int x, int y)
{
    const uint8_t *row = frame->data + (size_t)y * (size_t)frame->format.stride;

    if (frame->format.bits <= 8)
        return row[x];
    return (unsigned)row[2 * x] | (unsigned)row[2 * x + 1] << 8;
}

/* Every pixel becomes the mean of itself and its right, lower and diagonal neighbours: of each colour one (green two),
 * wherever it begins, so that the filter's pattern vanishes from what is grey and the sharpness stays the same
 * everywhere. */
static void take_raw(const struct lumi_camera_frame *frame, const struct judge_plane *plane, struct counts *counts)
{
    bool bayer = frame->format.layout == LUMI_LAYOUT_BAYER;
    unsigned white = (1u << frame->format.bits) - 1, high = white - white / 100;
    float black = frame->black > 0 && frame->black < 0.9 * white ? (float)frame->black : 0;
    float unit = 1 / ((float)white - black);
    unsigned low = (unsigned)(black + ((float)white - black) / 256);

    for (int y = 0; y < plane->height; y++) {
        float *out = plane->data + (size_t)y * (size_t)plane->width;
        int below = y + 1 < plane->height ? y + 1 : y - 1;
        for (int x = 0; x < plane->width; x++) {
            unsigned own = raw_sample(frame, x, y);
            counts->white += own >= high;
            counts->black += own <= low;
            out[x] = ((float)own - black) * unit;
            if (!bayer)
                continue;
            int right = x + 1 < plane->width ? x + 1 : x - 1;
            unsigned sum =
                own + raw_sample(frame, right, y) + raw_sample(frame, x, below) + raw_sample(frame, right, below);
            out[x] = ((float)sum / 4 - black) * unit;
        }
    }
}

/* Y alone, of 16..235 or of all there is. */
static void take_luma(const struct lumi_camera_frame *frame, const struct judge_plane *plane, struct counts *counts)
{
    int step = frame->format.layout == LUMI_LAYOUT_YUYV ? 2 : 1;
    const int black = frame->format.full_range ? 0 : 16, white = frame->format.full_range ? 255 : 235;
    const int low = black + (frame->format.full_range ? BLACK_U8 : 1);
    float light[256];

    for (int i = 0; i < 256; i++)
        light[i] = i <= black ? 0 : lumi_srgb_decode(i >= white ? 1 : (float)(i - black) / (float)(white - black));
    for (int y = 0; y < plane->height; y++) {
        const uint8_t *in = frame->data + (size_t)y * (size_t)frame->format.stride;
        float *out = plane->data + (size_t)y * (size_t)plane->width;
        for (int x = 0; x < plane->width; x++) {
            uint8_t value = in[x * step];
            counts->white += value >= white - 1;
            counts->black += value <= low;
            out[x] = light[value];
        }
    }
}

static int take_pixels(const struct lumi_camera_frame *frame, struct judge_plane *plane, struct counts *counts,
                       struct lumi_error *error)
{
    const struct lumi_frame_format *f = &frame->format;
    enum lumi_frame_layout layout = f->layout;
    bool raw = layout == LUMI_LAYOUT_BAYER || layout == LUMI_LAYOUT_GREY;
    int pixel = layout == LUMI_LAYOUT_RGB ? 3 : layout == LUMI_LAYOUT_YUYV || (raw && f->bits > 8) ? 2 : 1;

    if (f->width < 2 || f->height < 2 || f->width > LUMI_RASTER_MAX || f->height > LUMI_RASTER_MAX ||
        f->stride < pixel * f->width || (raw && (f->bits < 8 || f->bits > 16)))
        return lumi_fail(error, LUMI_ERR_FORMAT, "a frame of %dx%d pixels in rows of %d bytes", f->width, f->height,
                         f->stride);
    if (frame->size < (size_t)f->stride * (size_t)(f->height - 1) + (size_t)pixel * (size_t)f->width)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the frame has %zu bytes: too few for %dx%d pixels", frame->size,
                         f->width, f->height);
    LUMI_TRY(claim(plane, f->width, f->height, error));
    if (raw)
        take_raw(frame, plane, counts);
    else if (layout == LUMI_LAYOUT_RGB)
        take_u8(frame->data, (size_t)f->stride, 3, plane, counts);
    else
        take_luma(frame, plane, counts);
    return LUMI_OK;
}

int judge_decode(const struct lumi_camera_frame *frame, struct judge_plane *plane, double *clipped, double *dark,
                 struct lumi_error *error)
{
    struct counts counts = {0};
    int code;

    *plane = (struct judge_plane){0};
    switch (frame->format.layout) {
    case LUMI_LAYOUT_JPEG:
    case LUMI_LAYOUT_FILE:
        code = take_image(frame, plane, &counts, error);
        break;
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
    case LUMI_LAYOUT_RGB:
    case LUMI_LAYOUT_YUYV:
    case LUMI_LAYOUT_NV12:
        code = take_pixels(frame, plane, &counts, error);
        break;
    default:
        code =
            lumi_fail(error, LUMI_ERR_UNSUPPORTED, "frames of layout %d cannot be judged", (int)frame->format.layout);
    }
    if (code != LUMI_OK) {
        lumi_free(plane->data);
        *plane = (struct judge_plane){0};
        return code;
    }
    double all = (double)plane->width * plane->height;
    *clipped = (double)counts.white / all;
    *dark = (double)counts.black / all;
    return LUMI_OK;
}
