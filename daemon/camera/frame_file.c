/* Frames → files. */
#include "daemon/camera/frame_file.h"

#include "proto/base/memory.h"
#include "proto/image/image_head.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

void lumi_frame_about_init(struct lumi_frame_about *about, const struct lumi_camera_identity *identity)
{
    *about = (struct lumi_frame_about){.unix_us = INT64_MIN};
    if (identity) {
        about->make = identity->vendor;
        about->model = identity->model;
        about->serial = identity->serial;
    }
}

/* Bytes that a frame of this format has at least: its last row may end without padding. */
static size_t least_bytes(const struct lumi_frame_format *format)
{
    size_t width = (size_t)format->width, rows = (size_t)format->height, row = width;

    switch (format->layout) {
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
        row = format->bits > 8 ? 2 * width : width;
        break;
    case LUMI_LAYOUT_RGB:
        row = 3 * width;
        break;
    case LUMI_LAYOUT_YUYV:
        row = 2 * width;
        break;
    case LUMI_LAYOUT_NV12:
        rows += rows / 2;
        break;
    default:
        return 0;
    }
    return (size_t)format->stride * (rows - 1) + row;
}

static int check(const struct lumi_camera_frame *frame, struct lumi_error *error)
{
    const struct lumi_frame_format *format = &frame->format;

    if (format->layout == LUMI_LAYOUT_JPEG) {
        if (frame->size < 4 || frame->data[0] != 0xff || frame->data[1] != 0xd8)
            return lumi_fail(error, LUMI_ERR_FORMAT, "the frame is no JPEG picture (%zu bytes)", frame->size);
        return LUMI_OK;
    }
    if (format->width < 1 || format->height < 1 || format->stride < 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "a frame of %dx%d pixels in rows of %d bytes", format->width,
                         format->height, format->stride);
    if (frame->size < least_bytes(format))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the frame has %zu bytes of %zu", frame->size, least_bytes(format));
    return LUMI_OK;
}

/* YUYV: Y0 U Y1 V → Y0 Y1 U V. */
static void order_422(const struct lumi_camera_frame *frame, uint8_t *out)
{
    for (int y = 0; y < frame->format.height; y++) {
        const uint8_t *in = frame->data + (size_t)y * (size_t)frame->format.stride;
        for (int x = 0; x + 1 < frame->format.width; x += 2, in += 4, out += 4) {
            out[0] = in[0];
            out[1] = in[2];
            out[2] = in[1];
            out[3] = in[3];
        }
    }
}

/* NV12: a plane of Y, a plane of U V → four Y, U, V for every 2 × 2 pixels. */
static void order_420(const struct lumi_camera_frame *frame, uint8_t *out)
{
    size_t stride = (size_t)frame->format.stride;
    const uint8_t *colour = frame->data + stride * (size_t)frame->format.height;

    for (int y = 0; y + 1 < frame->format.height; y += 2, colour += stride) {
        const uint8_t *top = frame->data + (size_t)y * stride, *low = top + stride;
        for (int x = 0; x + 1 < frame->format.width; x += 2, out += 6) {
            out[0] = top[x];
            out[1] = top[x + 1];
            out[2] = low[x];
            out[3] = low[x + 1];
            out[4] = colour[x];
            out[5] = colour[x + 1];
        }
    }
}

static int reorder(const struct lumi_camera_frame *frame, struct lumi_frame_file *file, struct lumi_error *error)
{
    size_t pixels = (size_t)frame->format.width * (size_t)frame->format.height;
    bool packed = frame->format.layout == LUMI_LAYOUT_YUYV;
    size_t size = packed ? 2 * pixels : pixels + pixels / 2;

    file->owned[1] = lumi_alloc(size, 1);
    if (!file->owned[1])
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a frame of %zu bytes", size);
    if (packed)
        order_422(frame, file->owned[1]);
    else
        order_420(frame, file->owned[1]);
    file->pieces[1] = (struct iovec){file->owned[1], size};
    return LUMI_OK;
}

/* The pixels as they lie in the frame; copied only where the last row's padding is missing. */
static int take_pixels(const struct lumi_camera_frame *frame, struct lumi_frame_file *file, struct lumi_error *error)
{
    size_t size = (size_t)frame->format.stride * (size_t)frame->format.height;

    if (frame->size >= size) {
        file->pieces[1] = (struct iovec){(void *)(uintptr_t)frame->data, size};
        return LUMI_OK;
    }
    file->owned[1] = lumi_calloc(size, 1);
    if (!file->owned[1])
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a frame of %zu bytes", size);
    memcpy(file->owned[1], frame->data, frame->size);
    file->pieces[1] = (struct iovec){file->owned[1], size};
    return LUMI_OK;
}

static int with_head(const struct lumi_camera_frame *frame, const struct lumi_frame_about *about,
                     struct lumi_frame_file *file, struct lumi_error *error)
{
    static const uint8_t filters[4][4] = {[LUMI_BAYER_RGGB] = {0, 1, 1, 2},
                                          [LUMI_BAYER_GRBG] = {1, 0, 2, 1},
                                          [LUMI_BAYER_GBRG] = {1, 2, 0, 1},
                                          [LUMI_BAYER_BGGR] = {2, 1, 1, 0}};
    static const enum lumi_head_kind kinds[] = {[LUMI_LAYOUT_BAYER] = LUMI_HEAD_BAYER,
                                                [LUMI_LAYOUT_GREY] = LUMI_HEAD_GREY,
                                                [LUMI_LAYOUT_RGB] = LUMI_HEAD_RGB,
                                                [LUMI_LAYOUT_YUYV] = LUMI_HEAD_YCBCR_422,
                                                [LUMI_LAYOUT_NV12] = LUMI_HEAD_YCBCR_420};
    const struct lumi_frame_format *format = &frame->format;
    bool ordered = format->layout == LUMI_LAYOUT_YUYV || format->layout == LUMI_LAYOUT_NV12;
    struct lumi_head head;
    size_t size;

    lumi_head_init(&head);
    head.kind = kinds[format->layout];
    head.width = format->width;
    head.height = format->height;
    head.stride = ordered ? 0 : format->stride;
    head.bits = format->bits;
    head.narrow = ordered && !format->full_range;
    head.bt709 = ordered && format->bt709;
    if (format->layout == LUMI_LAYOUT_BAYER)
        memcpy(head.filter, filters[(unsigned)format->bayer % 4], 4);
    head.black = about->black > 0 ? about->black : frame->black;
    for (int i = 0; i < 2; i++)
        head.white[i] = about->white[i] > 0 ? about->white[i] : frame->white[i];
    head.exposure_s = file->exposure_s;
    head.iso = file->iso;
    head.unix_us = about->unix_us;
    head.make = about->make;
    head.model = about->model;
    head.serial = about->serial;
    head.software = "Lumisphere";
    LUMI_TRY(lumi_head_make(&head, &file->owned[0], &size, error));
    file->pieces[0] = (struct iovec){file->owned[0], size};
    LUMI_TRY(ordered ? reorder(frame, file, error) : take_pixels(frame, file, error));
    file->count = 2;
    bool raw = head.kind == LUMI_HEAD_BAYER || head.kind == LUMI_HEAD_GREY;
    snprintf(file->extension, sizeof file->extension, "%s", raw ? ".dng" : ".tif");
    return LUMI_OK;
}

/* The camera's own file: what it is the extension of its name tells. */
static int as_it_is(const struct lumi_camera_frame *frame, struct lumi_frame_file *file, struct lumi_error *error)
{
    const char *slash = frame->path ? strrchr(frame->path, '/') : NULL;
    const char *name = slash ? slash + 1 : frame->path;
    const char *dot = name ? strrchr(name, '.') : NULL;
    size_t length = dot ? strlen(dot) : 0;

    if (length < 2 || length >= sizeof file->extension)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a file whose name does not say what it is",
                         frame->path ? frame->path : "(no path)");
    for (size_t i = 0; i < length; i++) {
        if (i > 0 && !isalnum((unsigned char)dot[i]))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a file whose name does not say what it is", frame->path);
        file->extension[i] = (char)tolower((unsigned char)dot[i]);
    }
    file->path = frame->path;
    return LUMI_OK;
}

int lumi_frame_file_make(const struct lumi_camera_frame *frame, const struct lumi_frame_about *about,
                         struct lumi_frame_file *file, struct lumi_error *error)
{
    struct lumi_frame_about nothing;
    int code = LUMI_OK;

    *file = (struct lumi_frame_file){.width = frame->format.width, .height = frame->format.height};
    file->exposure_s = frame->exposure_s > 0 ? frame->exposure_s : 0;
    file->iso = frame->gain > 0 ? 100 * frame->gain : 0;
    lumi_frame_about_init(&nothing, NULL);
    switch (frame->format.layout) {
    case LUMI_LAYOUT_FILE:
        return as_it_is(frame, file, error);
    case LUMI_LAYOUT_JPEG:
        LUMI_TRY(check(frame, error));
        file->pieces[0] = (struct iovec){(void *)(uintptr_t)frame->data, frame->size};
        file->count = 1;
        snprintf(file->extension, sizeof file->extension, ".jpg");
        break;
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
    case LUMI_LAYOUT_RGB:
    case LUMI_LAYOUT_YUYV:
    case LUMI_LAYOUT_NV12:
        LUMI_TRY(check(frame, error));
        code = with_head(frame, about ? about : &nothing, file, error);
        break;
    default:
        code = lumi_fail(error, LUMI_ERR_UNSUPPORTED, "no file for frames of layout %d", (int)frame->format.layout);
    }
    for (int i = 0; i < file->count; i++)
        file->bytes += file->pieces[i].iov_len;
    if (code != LUMI_OK)
        lumi_frame_file_finish(file);
    return code;
}

void lumi_frame_file_finish(struct lumi_frame_file *file)
{
    lumi_free(file->owned[0]);
    lumi_free(file->owned[1]);
    *file = (struct lumi_frame_file){0};
}

size_t lumi_frame_file_bytes(const struct lumi_camera_frame *frame)
{
    switch (frame->format.layout) {
    case LUMI_LAYOUT_FILE:
    case LUMI_LAYOUT_NONE:
        return 0;
    case LUMI_LAYOUT_JPEG:
        return frame->size;
    default:
        return frame->size + 2 * LUMI_HEAD_BLOCK;
    }
}
