/* Frames in memory for the tests of previews: one colour, or grey columns, in every layout; who holds them is counted.
 */
#ifndef LUMI_TESTS_UNIT_PREVIEW_FRAME_H
#define LUMI_TESTS_UNIT_PREVIEW_FRAME_H

#include "daemon/camera/camera_device.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct preview_frame {
    struct lumi_camera_frame frame;
    atomic_int *out;
    uint8_t bytes[];
};

static inline void preview_frame_release(struct lumi_camera_frame *frame)
{
    struct preview_frame *whole = frame->owner;

    atomic_fetch_sub(whole->out, 1);
    free(whole);
}

/* All zero; `out` counts those that are held. */
static inline struct preview_frame *preview_frame_new(enum lumi_frame_layout layout, int width, int height, int bits,
                                                      size_t size, atomic_int *out)
{
    const int pixel = layout == LUMI_LAYOUT_RGB ? 3 : layout == LUMI_LAYOUT_YUYV || bits > 8 ? 2 : 1;
    const int stride = pixel * width + 16; /* rows with something behind them */
    const size_t rows = (size_t)(layout == LUMI_LAYOUT_NV12 ? height + height / 2 : height);
    const size_t bytes = size ? size : rows * (size_t)stride;
    struct preview_frame *whole = calloc(1, sizeof *whole + bytes);

    whole->out = out;
    atomic_fetch_add(out, 1);
    whole->frame = (struct lumi_camera_frame){
        .format = {.layout = layout, .width = width, .height = height, .bits = bits, .stride = stride},
        .data = whole->bytes,
        .size = bytes,
        .file_mtime_ns = LUMI_CAMERA_NO_TIME,
        .device_ns = LUMI_CAMERA_NO_TIME,
        .temperature = NAN,
        .release = preview_frame_release,
        .owner = whole};
    return whole;
}

static inline void preview_put(struct preview_frame *whole, int x, int y, unsigned value)
{
    uint8_t *row = whole->bytes + (size_t)y * (size_t)whole->frame.format.stride;

    if (whole->frame.format.bits <= 8) {
        row[x] = (uint8_t)value;
        return;
    }
    row[2 * x] = (uint8_t)value;
    row[2 * x + 1] = (uint8_t)(value >> 8);
}

#endif
