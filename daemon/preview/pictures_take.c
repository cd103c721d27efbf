/* Frames → small copies: means of squares of samples, clipped samples counted on the way. */
#include "daemon/preview/pictures_priv.h"
#include "proto/base/memory.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#define CODED_MAX ((size_t)64 << 20) /* a camera's own file in memory */
#define SIDE_MAX 32768               /* so that no sum runs over */
#define WHITE_SHARE 0.99             /* of full scale: counts as white, as the judge has it */
#define BLACK_SHARE (1.0 / 256)
#define PLANES 4
#define BLOCK 16

/* A cell is what the small copy's samples are means of: of 2 × 2 samples, which are kept apart, where the layout has
 * such (Bayer: the four of the filter; YUV: Y, and U and V), otherwise one pixel. */
struct cells {
    int across, down;  /* in the frame */
    int width, height; /* in the copy */
    int side;          /* in cells, of what a pixel of the copy is the mean of */
};

/* Numbers that a row of the copy is added up in: its own, and columns of the frame's. */
static size_t sums_of(const struct cells *cells)
{
    return (size_t)cells->width * PLANES * (size_t)(1 + cells->side);
}

struct counts {
    uint64_t white, black, all;
};

static struct cells cells_of(int across, int down, int most)
{
    struct cells cells = {.across = across, .down = down, .side = (across + most - 1) / most};

    cells.side = cells.side < 1 ? 1 : cells.side;
    if (cells.side > down)
        cells.side = down;
    cells.width = across / cells.side;
    cells.height = down / cells.side;
    return cells;
}

/* ---- rows: the same for 8 and 16 bits, in blocks that a compiler makes vectors of ---- */

static void count_u8(const uint8_t *row, int count, unsigned low, unsigned high, struct counts *counts)
{
    uint32_t white = 0, black = 0;
    int i = 0;

    for (; i + BLOCK <= count; i += BLOCK)
        for (int k = 0; k < BLOCK; k++) {
            white += row[i + k] >= high;
            black += row[i + k] <= low;
        }
    for (; i < count; i++) {
        white += row[i] >= high;
        black += row[i] <= low;
    }
    counts->white += white;
    counts->black += black;
    counts->all += (uint64_t)count;
}

static unsigned word_at(const uint8_t *row, int i)
{
    return (unsigned)row[2 * i] | (unsigned)row[2 * i + 1] << 8;
}

static void count_u16(const uint8_t *row, int count, unsigned low, unsigned high, struct counts *counts)
{
    uint32_t white = 0, black = 0;

    for (int i = 0; i < count; i++) {
        const unsigned value = word_at(row, i);
        white += value >= high;
        black += value <= low;
    }
    counts->white += white;
    counts->black += black;
    counts->all += (uint64_t)count;
}

/* Adds a row's samples to the sums of their columns. */
static void add_u8(const uint8_t *restrict row, int count, uint32_t *restrict columns)
{
    int i = 0;

    for (; i + BLOCK <= count; i += BLOCK)
        for (int k = 0; k < BLOCK; k++)
            columns[i + k] += row[i + k];
    for (; i < count; i++)
        columns[i] += row[i];
}

static void add_u16(const uint8_t *restrict row, int count, uint32_t *restrict columns)
{
    for (int i = 0; i < count; i++)
        columns[i] += word_at(row, i);
}

/* Adds the columns, `group` of them a cell, to the sums, `planes` a pixel of the copy. */
static void fold(const uint32_t *columns, const struct cells *cells, int group, uint32_t *sums, int planes)
{
    for (int x = 0; x < cells->width; x++, sums += planes)
        for (int i = 0; i < cells->side; i++, columns += group)
            for (int k = 0; k < group; k++)
                sums[k] += columns[k];
}

/* ---- layouts ---- */

/* `share` 1: the sample of full scale is 65535. */
static void put(uint16_t *out, uint32_t sum, uint32_t count, unsigned full)
{
    const uint64_t value = ((uint64_t)sum * 65535 + (uint64_t)count * full / 2) / ((uint64_t)count * full);

    *out = (uint16_t)(value > 65535 ? 65535 : value);
}

static void put_bayer(uint16_t *out, const uint32_t *sums, uint32_t count, unsigned full, enum lumi_bayer bayer)
{
    /* Of the four of a cell, in reading order: red, the two greens, blue. */
    static const uint8_t place[4][4] = {
        [LUMI_BAYER_RGGB] = {0, 1, 2, 3},
        [LUMI_BAYER_GRBG] = {1, 0, 3, 2},
        [LUMI_BAYER_GBRG] = {2, 0, 3, 1},
        [LUMI_BAYER_BGGR] = {3, 1, 2, 0},
    };
    const uint8_t *at = place[(unsigned)bayer & 3];

    put(out, sums[at[0]], count, full);
    put(out + 1, sums[at[1]] + sums[at[2]], 2 * count, full);
    put(out + 2, sums[at[3]], count, full);
}

static void take_raw(const struct lumi_camera_frame *frame, const struct cells *cells, uint32_t *sums,
                     struct pictures_small *small, struct counts *counts)
{
    const struct lumi_frame_format *f = &frame->format;
    const bool bayer = f->layout == LUMI_LAYOUT_BAYER, wide = f->bits > 8;
    const unsigned full = (1u << f->bits) - 1, high = (unsigned)(full * WHITE_SHARE);
    const unsigned low = (unsigned)(small->black * full + (1 - small->black) * full * BLACK_SHARE);
    const int rows = bayer ? 2 : 1, planes = bayer ? 4 : 1, samples = cells->width * cells->side * rows;
    uint32_t *columns = sums + (size_t)cells->width * PLANES;

    for (int y = 0; y < cells->height; y++) {
        uint16_t *out = lumi_row_u16(&small->means, y);
        memset(sums, 0, sizeof *sums * sums_of(cells));
        for (int i = 0; i < cells->side * rows; i++) {
            const uint8_t *row = frame->data + (size_t)(y * cells->side * rows + i) * (size_t)f->stride;
            (wide ? count_u16 : count_u8)(row, f->width, low, high, counts);
            (wide ? add_u16 : add_u8)(row, samples, columns + (i % rows) * samples);
        }
        for (int i = 0; i < rows; i++)
            fold(columns + i * samples, cells, rows, sums + 2 * i, planes);
        for (int x = 0; x < cells->width; x++) {
            const uint32_t count = (uint32_t)(cells->side * cells->side);
            if (bayer)
                put_bayer(out + (size_t)x * 3, sums + (size_t)x * 4, count, full, f->bayer);
            else
                put(out + x, sums[x], count, full);
        }
    }
}

static void take_rgb(const struct lumi_camera_frame *frame, const struct cells *cells, uint32_t *sums,
                     struct pictures_small *small, struct counts *counts)
{
    const struct lumi_frame_format *f = &frame->format;
    const int samples = 3 * cells->width * cells->side;
    uint32_t *columns = sums + (size_t)cells->width * PLANES;

    for (int y = 0; y < cells->height; y++) {
        uint16_t *out = lumi_row_u16(&small->means, y);
        memset(sums, 0, sizeof *sums * sums_of(cells));
        for (int i = 0; i < cells->side; i++) {
            const uint8_t *row = frame->data + (size_t)(y * cells->side + i) * (size_t)f->stride;
            count_u8(row, 3 * f->width, 2, 254, counts);
            add_u8(row, samples, columns);
        }
        fold(columns, cells, 3, sums, 3);
        for (int x = 0; x < 3 * cells->width; x++)
            put(out + x, sums[x], (uint32_t)(cells->side * cells->side), 255);
    }
}

/* Two rows of YUYV, or of NV12 with one of its U and V, are a row of cells. Sums are of Y, U, V. */
static void add_yuyv(const uint8_t *row, const struct cells *cells, uint32_t *sums)
{
    for (int x = 0; x < cells->width; x++, sums += 3)
        for (int i = 0; i < cells->side; i++, row += 4) {
            sums[0] += (uint32_t)row[0] + row[2];
            sums[1] += row[1];
            sums[2] += row[3];
        }
}

static void add_nv12(const uint8_t *luma, const uint8_t *chroma, const struct cells *cells, uint32_t *sums)
{
    for (int x = 0; x < cells->width; x++, sums += 3)
        for (int i = 0; i < cells->side; i++, luma += 2) {
            sums[0] += (uint32_t)luma[0] + luma[1];
            if (!chroma)
                continue;
            sums[1] += chroma[0];
            sums[2] += chroma[1];
            chroma += 2;
        }
}

static void count_luma(const uint8_t *row, int count, int step, bool full_range, struct counts *counts)
{
    const int low = full_range ? 2 : 17, high = full_range ? 254 : 234;

    for (int i = 0; i < count; i++, row += step) {
        counts->white += *row >= high;
        counts->black += *row <= low;
    }
    counts->all += (uint64_t)count;
}

static void take_yuv(const struct lumi_camera_frame *frame, const struct cells *cells, uint32_t *sums,
                     struct pictures_small *small, struct counts *counts)
{
    const struct lumi_frame_format *f = &frame->format;
    const bool packed = f->layout == LUMI_LAYOUT_YUYV;
    const size_t stride = (size_t)f->stride;
    const uint8_t *chroma = frame->data + stride * (size_t)f->height;
    const uint32_t count = (uint32_t)(cells->side * cells->side);

    for (int y = 0; y < cells->height; y++) {
        uint16_t *out = lumi_row_u16(&small->means, y);
        memset(sums, 0, sizeof *sums * (size_t)cells->width * PLANES);
        for (int i = 0; i < 2 * cells->side; i++) {
            const size_t at = (size_t)(2 * y * cells->side + i);
            const uint8_t *row = frame->data + at * stride;
            count_luma(row, f->width, packed ? 2 : 1, f->full_range, counts);
            if (packed)
                add_yuyv(row, cells, sums);
            else
                add_nv12(row, i % 2 ? NULL : chroma + at / 2 * stride, cells, sums);
        }
        for (int x = 0; x < cells->width; x++, out += 3) {
            put(out, sums[3 * x], 4 * count, 255);
            put(out + 1, sums[3 * x + 1], packed ? 2 * count : count, 255);
            put(out + 2, sums[3 * x + 2], packed ? 2 * count : count, 255);
        }
    }
}

static int check_pixels(const struct lumi_camera_frame *frame, struct lumi_error *error)
{
    const struct lumi_frame_format *f = &frame->format;
    const bool raw = f->layout == LUMI_LAYOUT_BAYER || f->layout == LUMI_LAYOUT_GREY;
    const bool planar = f->layout == LUMI_LAYOUT_NV12;
    const int pixel = f->layout == LUMI_LAYOUT_RGB ? 3 : f->layout == LUMI_LAYOUT_YUYV || (raw && f->bits > 8) ? 2 : 1;
    const int rows = planar ? f->height + f->height / 2 : f->height;

    if (f->width < 2 || f->height < 2 || f->width > SIDE_MAX || f->height > SIDE_MAX || f->stride < pixel * f->width ||
        (raw && (f->bits < 8 || f->bits > 16)))
        return lumi_fail(error, LUMI_ERR_FORMAT, "a frame of %dx%d pixels in rows of %d bytes", f->width, f->height,
                         f->stride);
    if (!frame->data || frame->size < (size_t)f->stride * (size_t)(rows - 1) + (size_t)pixel * (size_t)f->width)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the frame has %zu bytes: too few for %dx%d pixels", frame->size,
                         f->width, f->height);
    return LUMI_OK;
}

static void take_layout(const struct lumi_camera_frame *frame, const struct cells *cells, uint32_t *sums,
                        struct pictures_small *small, struct counts *counts)
{
    switch (frame->format.layout) {
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
        small->kind = PICTURES_SENSOR;
        take_raw(frame, cells, sums, small, counts);
        break;
    case LUMI_LAYOUT_RGB:
        small->kind = PICTURES_SRGB;
        take_rgb(frame, cells, sums, small, counts);
        break;
    default:
        small->kind = PICTURES_YUV;
        take_yuv(frame, cells, sums, small, counts);
    }
}

static int take_pixels(const struct lumi_camera_frame *frame, int most, struct pictures_small *small,
                       struct lumi_error *error)
{
    const struct lumi_frame_format *f = &frame->format;
    const int cell = f->layout == LUMI_LAYOUT_GREY || f->layout == LUMI_LAYOUT_RGB ? 1 : 2;
    const double full = (double)((1u << (f->bits > 0 && f->bits <= 16 ? f->bits : 8)) - 1);
    struct counts counts = {0};
    uint32_t *sums;

    LUMI_TRY(check_pixels(frame, error));
    const struct cells cells = cells_of(f->width / cell, f->height / cell, most);
    small->black = frame->black > 0 && frame->black < 0.9 * full ? frame->black / full : 0;
    small->bt709 = f->bt709;
    small->full_range = f->full_range;
    sums = lumi_alloc(sums_of(&cells), sizeof *sums);
    if (!sums || lumi_raster_create(&small->means, cells.width, cells.height, f->layout == LUMI_LAYOUT_GREY ? 1 : 3,
                                    LUMI_U16) != LUMI_OK) {
        lumi_free(sums);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture of %dx%d pixels", f->width, f->height);
    }
    take_layout(frame, &cells, sums, small, &counts);
    lumi_free(sums);
    small->counted = counts.all > 0;
    if (small->counted) {
        small->clipped_low = (double)counts.black / (double)counts.all;
        small->clipped_high = (double)counts.white / (double)counts.all;
    }
    return LUMI_OK;
}

static int take_coded(const struct lumi_camera_frame *frame, struct pictures_small *small, struct lumi_error *error)
{
    small->kind = PICTURES_CODED;
    if (!frame->data || frame->size == 0 || frame->size > CODED_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "a picture of %zu bytes", frame->size);
    small->bytes = lumi_alloc(frame->size, 1);
    if (!small->bytes)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture of %zu bytes", frame->size);
    memcpy(small->bytes, frame->data, frame->size);
    small->size = frame->size;
    return LUMI_OK;
}

static int take_file(const struct lumi_camera_frame *frame, struct pictures_small *small, struct lumi_error *error)
{
    small->kind = PICTURES_FILE;
    small->fd = open(frame->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    return small->fd < 0 ? lumi_fail_errno(error, frame->path, "opening it") : LUMI_OK;
}

int pictures_take(const struct lumi_camera_frame *frame, int most, struct pictures_small *small,
                  struct lumi_error *error)
{
    *small = (struct pictures_small){.fd = -1, .width = frame->format.width, .height = frame->format.height};
    small->white[0] = frame->white[0];
    small->white[1] = frame->white[1];
    switch (frame->format.layout) {
    case LUMI_LAYOUT_JPEG:
        return take_coded(frame, small, error);
    case LUMI_LAYOUT_FILE:
        return take_file(frame, small, error);
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
    case LUMI_LAYOUT_RGB:
    case LUMI_LAYOUT_YUYV:
    case LUMI_LAYOUT_NV12:
        return take_pixels(frame, most, small, error);
    default:
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "frames of layout %d make no picture", (int)frame->format.layout);
    }
}

void pictures_small_clear(struct pictures_small *small)
{
    lumi_free(small->bytes);
    lumi_raster_finish(&small->means);
    if (small->fd >= 0)
        close(small->fd);
    *small = (struct pictures_small){.fd = -1};
}
