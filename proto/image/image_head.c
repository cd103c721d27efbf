/* Writing the one image file directory that a head is: entries first, sorted by tag, then what does not fit them. */
#include "proto/image/image_head.h"

#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/base/raster.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum {
    BYTE = 1,
    ASCII = 2,
    SHORT = 3,
    LONG = 4,
    RATIONAL = 5,
    UNDEFINED = 7,
    SRATIONAL = 10
}; /* TIFF 6.0, section 2 */
#define ENTRIES 40

/* A directory under construction. Values of more than four bytes lie in `extra`, which the file has right after the
 * directories; entries hold its offsets until the place is known. */
struct entry {
    unsigned tag, type;
    uint32_t count, value;
    bool outside;
};
struct directory {
    struct entry entries[ENTRIES];
    int count;
};
struct job {
    struct directory main, exif;
    struct lumi_writer extra;
};

static struct entry *add(struct directory *directory, unsigned tag, unsigned type, uint32_t count, uint32_t value)
{
    struct entry *entry = &directory->entries[directory->count++];

    *entry = (struct entry){tag, type, count, value, false};
    return entry;
}

static void begin_outside(struct job *job, struct directory *directory, unsigned tag, unsigned type, uint32_t count)
{
    if (job->extra.size % 2)
        lumi_write_u8(&job->extra, 0);
    add(directory, tag, type, count, (uint32_t)job->extra.size)->outside = true;
}

static void add_text(struct job *job, struct directory *directory, unsigned tag, const char *text)
{
    size_t size = text ? strnlen(text, 255) : 0;
    uint32_t value = 0;

    if (size == 0)
        return;
    if (size < 4) {
        for (size_t i = 0; i < size; i++)
            value |= (uint32_t)(uint8_t)text[i] << 8 * i;
        add(directory, tag, ASCII, (uint32_t)size + 1, value);
        return;
    }
    begin_outside(job, directory, tag, ASCII, (uint32_t)size + 1);
    lumi_write_bytes(&job->extra, text, size);
    lumi_write_u8(&job->extra, 0);
}

/* As fine a fraction as 31 bits hold. */
static void put_fraction(struct lumi_writer *extra, double value)
{
    int exponent;
    double scale;

    frexp(value, &exponent);
    scale = ldexp(1, exponent > 0 ? 30 - exponent : 30);
    if (fabs(value) > 0 && fabs(value) < 1) { /* 1/n is what exposure times are */
        double n = 1 / fabs(value);
        if (fabs(n - floor(n + 0.5)) < 1e-9 * n && n < 2e9) {
            lumi_write_u32(extra, value < 0 ? (uint32_t)-1 : 1);
            lumi_write_u32(extra, (uint32_t)floor(n + 0.5));
            return;
        }
    }
    if (scale < 1)
        scale = 1;
    lumi_write_u32(extra, (uint32_t)(int32_t)floor(value * scale + 0.5));
    lumi_write_u32(extra, (uint32_t)scale);
}

static void add_fractions(struct job *job, struct directory *directory, unsigned tag, unsigned type,
                          const double *values, uint32_t count)
{
    begin_outside(job, directory, tag, type, count);
    for (uint32_t i = 0; i < count; i++)
        put_fraction(&job->extra, values[i]);
}

static void add_numbers(struct job *job, struct directory *directory, unsigned tag, unsigned type,
                        const uint32_t *values, uint32_t count)
{
    begin_outside(job, directory, tag, type, count);
    for (uint32_t i = 0; i < count; i++) {
        if (type == SHORT)
            lumi_write_u16(&job->extra, (uint16_t)values[i]);
        else
            lumi_write_u32(&job->extra, values[i]);
    }
}

static int sample_bytes(const struct lumi_head *head)
{
    return head->bits > 8 ? 2 : 1;
}

static int row_bytes(const struct lumi_head *head)
{
    switch (head->kind) {
    case LUMI_HEAD_RGB:
        return 3 * head->width;
    case LUMI_HEAD_YCBCR_422:
        return 2 * head->width;
    case LUMI_HEAD_YCBCR_420: /* half of what two rows have */
        return head->width + head->width / 2;
    default:
        return sample_bytes(head) * head->width;
    }
}

static int check(const struct lumi_head *head, int stride, struct lumi_error *error)
{
    bool raw = head->kind == LUMI_HEAD_BAYER || head->kind == LUMI_HEAD_GREY;
    bool ycbcr = head->kind == LUMI_HEAD_YCBCR_422 || head->kind == LUMI_HEAD_YCBCR_420;

    if (head->width < 1 || head->height < 1 || head->width > LUMI_RASTER_MAX || head->height > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of %dx%d pixels", head->width, head->height);
    if (raw && (head->bits < 8 || head->bits > 16))
        return lumi_fail(error, LUMI_ERR_ARG, "%d bits a sample: 8 to 16 wanted", head->bits);
    if (stride < row_bytes(head) || (raw && stride % sample_bytes(head)) || stride / sample_bytes(head) > 65535)
        return lumi_fail(error, LUMI_ERR_ARG, "rows of %d bytes for %d pixels", stride, head->width);
    if (ycbcr && (head->width % 2 || (head->kind == LUMI_HEAD_YCBCR_420 && head->height % 2)))
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of %dx%d pixels with halved colour", head->width,
                         head->height);
    if (ycbcr && stride != row_bytes(head))
        return lumi_fail(error, LUMI_ERR_ARG, "padded rows of YCbCr");
    if ((uint64_t)stride * (uint64_t)head->height > UINT32_MAX - (1u << 24))
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of more bytes than a TIFF file holds");
    return LUMI_OK;
}

/* "1970:01:01 00:00:00", universal time. */
static void describe_time(int64_t unix_us, char text[20], char fraction[7])
{
    int64_t seconds = unix_us / 1000000, rest = unix_us % 1000000;
    struct tm when = {0};

    if (rest < 0) {
        seconds--;
        rest += 1000000;
    }
    time_t clock = (time_t)seconds;
    gmtime_r(&clock, &when);
    snprintf(text, 20, "%04u:%02u:%02u %02u:%02u:%02u", (unsigned)(when.tm_year + 1900) % 10000u,
             (unsigned)(when.tm_mon + 1) % 100u, (unsigned)when.tm_mday % 100u, (unsigned)when.tm_hour % 100u,
             (unsigned)when.tm_min % 100u, (unsigned)when.tm_sec % 100u);
    snprintf(fraction, 7, "%06u", (unsigned)rest % 1000000u);
}

/* Exif 2.32, section 4.6.5. */
static void describe_shot(struct job *job, const struct lumi_head *head)
{
    char text[20], fraction[7];

    if (head->exposure_s > 0 && head->exposure_s < 1e6)
        add_fractions(job, &job->exif, 0x829a, RATIONAL, &head->exposure_s, 1);
    if (head->iso >= 1 && head->iso < 65535)
        add(&job->exif, 0x8827, SHORT, 1, (uint32_t)(head->iso + 0.5));
    add(&job->exif, 0x9000, UNDEFINED, 4, '0' | '2' << 8 | '3' << 16 | '2' << 24);
    if (head->unix_us != INT64_MIN) {
        describe_time(head->unix_us, text, fraction);
        add_text(job, &job->exif, 0x9003, text);
        add_text(job, &job->exif, 0x9011, "+00:00");
        add_text(job, &job->exif, 0x9291, fraction);
    }
    add_text(job, &job->exif, 0xa431, head->serial);
}

/* DNG 1.4, chapter 4. */
static void describe_raw(struct job *job, const struct lumi_head *head)
{
    /* XYZ of D65 to linear sRGB (IEC 61966-2-1). */
    static const double srgb[9] = {3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108,
                                   0.0415560, 0.0556434,  -0.2040259, 1.0572252};
    struct directory *main = &job->main;
    bool own = false;

    if (head->kind == LUMI_HEAD_BAYER) {
        add(main, 33421, SHORT, 2, 2u | 2u << 16); /* CFARepeatPatternDim */
        add(main, 33422, BYTE, 4,
            (uint32_t)head->filter[0] | (uint32_t)head->filter[1] << 8 | (uint32_t)head->filter[2] << 16 |
                (uint32_t)head->filter[3] << 24);
    }
    add(main, 34665, LONG, 1, 0);                                             /* the Exif directory, filled in later */
    add(main, 50706, BYTE, 4, 1u | 4u << 8);                                  /* DNGVersion 1.4.0.0 */
    add(main, 50707, BYTE, 4, 1u | 1u << 8);                                  /* DNGBackwardVersion 1.1.0.0 */
    add_text(job, main, 50708, head->model ? head->model : "unknown camera"); /* UniqueCameraModel */
    if (head->black > 0)
        add_fractions(job, main, 50714, RATIONAL, &head->black, 1);
    add(main, 50717, LONG, 1, (1u << head->bits) - 1); /* WhiteLevel */
    if (head->kind == LUMI_HEAD_BAYER) {
        double red = head->white[0] > 0 ? head->white[0] : 1, blue = head->white[1] > 0 ? head->white[1] : 1;
        const double neutral[3] = {1 / red, 1, 1 / blue};
        for (int i = 0; i < 9; i++)
            own = own || head->matrix[i] != 0;
        add_fractions(job, main, 50721, SRATIONAL, own ? head->matrix : srgb, 9); /* ColorMatrix1 */
        add_fractions(job, main, 50728, RATIONAL, neutral, 3);                    /* AsShotNeutral */
    }
    add_text(job, main, 50735, head->serial); /* CameraSerialNumber */
    if (head->kind == LUMI_HEAD_BAYER)
        add(main, 50778, SHORT, 1, 21); /* CalibrationIlluminant1: D65 */
    const uint32_t area[4] = {0, 0, (uint32_t)head->height, (uint32_t)head->width};
    add_numbers(job, main, 50829, LONG, area, 4); /* ActiveArea: what of a row is no padding */
}

/* TIFF 6.0, section 21. */
static void describe_ycbcr(struct job *job, const struct lumi_head *head)
{
    /* ITU-R BT.601-7, section 2.5.1; BT.709-6, section 3.2 */
    static const double bt601[3] = {0.299, 0.587, 0.114}, bt709[3] = {0.2126, 0.7152, 0.0722};
    const double narrow[6] = {16, 235, 128, 240, 128, 240}, full[6] = {0, 255, 128, 255, 128, 255};

    add_fractions(job, &job->main, 529, RATIONAL, head->bt709 ? bt709 : bt601, 3);
    add(&job->main, 530, SHORT, 2, 2u | (head->kind == LUMI_HEAD_YCBCR_420 ? 2u : 1u) << 16);
    add(&job->main, 531, SHORT, 1, 1); /* colour samples lie amid their pixels */
    add_fractions(job, &job->main, 532, RATIONAL, head->narrow ? narrow : full, 6);
}

static void describe_strips(struct job *job, const struct lumi_head *head, int stride, bool padded)
{
    uint32_t height = (uint32_t)head->height;

    if (!padded) {
        add(&job->main, 273, LONG, 1, 0); /* StripOffsets: once the head's length is known */
        return;
    }
    begin_outside(job, &job->main, 273, LONG, height);
    for (uint32_t y = 0; y < height; y++)
        lumi_write_u32(&job->extra, y * (uint32_t)stride);
}

static void describe(struct job *job, const struct lumi_head *head, int stride)
{
    static const unsigned photometric[] = {[LUMI_HEAD_BAYER] = 32803,
                                           [LUMI_HEAD_GREY] = 34892,
                                           [LUMI_HEAD_RGB] = 2,
                                           [LUMI_HEAD_YCBCR_422] = 6,
                                           [LUMI_HEAD_YCBCR_420] = 6};
    bool raw = head->kind == LUMI_HEAD_BAYER || head->kind == LUMI_HEAD_GREY;
    bool padded = head->kind == LUMI_HEAD_RGB && stride != row_bytes(head);
    uint32_t samples = raw ? 1 : 3, height = (uint32_t)head->height;
    struct directory *main = &job->main;

    add(main, 254, LONG, 1, 0); /* NewSubfileType: the picture itself */
    /* The padding of raw rows is part of the sensor's picture that the active area leaves out. */
    add(main, 256, LONG, 1, raw ? (uint32_t)(stride / sample_bytes(head)) : (uint32_t)head->width);
    add(main, 257, LONG, 1, height);
    if (raw) {
        add(main, 258, SHORT, 1, 8u * (unsigned)sample_bytes(head));
    } else {
        const uint32_t bits[3] = {8, 8, 8};
        add_numbers(job, main, 258, SHORT, bits, 3);
    }
    add(main, 259, SHORT, 1, 1); /* not compressed */
    add(main, 262, SHORT, 1, photometric[head->kind]);
    add_text(job, main, 271, head->make);
    add_text(job, main, 272, head->model);
    describe_strips(job, head, stride, padded);
    add(main, 274, SHORT, 1, 1);
    add(main, 277, SHORT, 1, samples);
    add(main, 278, LONG, 1, padded ? 1 : height); /* RowsPerStrip */
    if (padded) {
        begin_outside(job, main, 279, LONG, height);
        for (uint32_t y = 0; y < height; y++)
            lumi_write_u32(&job->extra, (uint32_t)row_bytes(head));
    } else {
        add(main, 279, LONG, 1, (uint32_t)stride * height); /* StripByteCounts */
    }
    add(main, 284, SHORT, 1, 1);
    add_text(job, main, 305, head->software);
    if (head->kind == LUMI_HEAD_YCBCR_422 || head->kind == LUMI_HEAD_YCBCR_420)
        describe_ycbcr(job, head);
    if (raw)
        describe_raw(job, head);
    else
        add(main, 34665, LONG, 1, 0);
    describe_shot(job, head);
}

static void put_directory(struct lumi_writer *out, const struct directory *directory, uint32_t extra_at)
{
    lumi_write_u16(out, (uint16_t)directory->count);
    for (int i = 0; i < directory->count; i++) {
        const struct entry *entry = &directory->entries[i];
        lumi_write_u16(out, (uint16_t)entry->tag);
        lumi_write_u16(out, (uint16_t)entry->type);
        lumi_write_u32(out, entry->count);
        lumi_write_u32(out, entry->outside ? extra_at + entry->value : entry->value);
    }
    lumi_write_u32(out, 0); /* no further directory */
}

/* Where the strips lie is known when the rest is. */
static void place_strips(struct job *job, uint32_t head_size)
{
    for (int i = 0; i < job->main.count; i++) {
        struct entry *entry = &job->main.entries[i];
        if (entry->tag != 273)
            continue;
        if (!entry->outside) {
            entry->value = head_size;
            continue;
        }
        for (uint32_t y = 0; y < entry->count; y++) {
            uint8_t *at = job->extra.data + entry->value + 4 * (size_t)y;
            uint32_t offset =
                ((uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24) + head_size;
            for (int k = 0; k < 4; k++)
                at[k] = (uint8_t)(offset >> 8 * k);
        }
    }
}

void lumi_head_init(struct lumi_head *head)
{
    *head = (struct lumi_head){.bits = 8, .unix_us = INT64_MIN};
}

int lumi_head_make(const struct lumi_head *head, uint8_t **data, size_t *size, struct lumi_error *error)
{
    int stride = head->stride ? head->stride : row_bytes(head);
    struct lumi_writer out;
    struct job job = {0};
    int code = LUMI_OK;

    *data = NULL;
    *size = 0;
    LUMI_TRY(check(head, stride, error));
    lumi_writer_init(&job.extra);
    lumi_writer_init(&out);
    describe(&job, head, stride);
    uint32_t exif_at = 8 + 2 + 12 * (uint32_t)job.main.count + 4;
    uint32_t extra_at = exif_at + 2 + 12 * (uint32_t)job.exif.count + 4;
    uint32_t end = extra_at + (uint32_t)job.extra.size;
    uint32_t total = (end + LUMI_HEAD_BLOCK - 1) / LUMI_HEAD_BLOCK * LUMI_HEAD_BLOCK;
    for (int i = 0; i < job.main.count; i++)
        if (job.main.entries[i].tag == 34665)
            job.main.entries[i].value = exif_at;
    if (!job.extra.failed)
        place_strips(&job, total);
    lumi_write_bytes(&out, "II*\0\10\0\0\0", 8);
    put_directory(&out, &job.main, extra_at);
    put_directory(&out, &job.exif, extra_at);
    lumi_write_bytes(&out, job.extra.data, job.extra.size);
    while (!out.failed && out.size < total)
        lumi_write_u8(&out, 0);
    if (out.failed || job.extra.failed) {
        lumi_writer_finish(&out);
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture's head");
    } else {
        *data = out.data;
        *size = out.size;
    }
    lumi_writer_finish(&job.extra);
    return code;
}
