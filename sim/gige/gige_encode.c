/* What comes out of the sensor, and how it is packed. */
#include "sim/gige/gige_encode.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "sim/gige/gige_registers.h"

#include <math.h>
#include <string.h>

static int make_grey(const struct gige_shot *shot, const struct lumi_raster *picture, struct lumi_raster *raw)
{
    LUMI_TRY(lumi_raster_create(raw, shot->width, shot->height, 1, LUMI_F32));
    for (int y = 0; y < shot->height; y++) {
        const float *from = lumi_row_f32(picture, y);
        float *to = lumi_row_f32(raw, y);

        for (int x = 0; x < shot->width; x++, from += 3)
            to[x] = 0.2126f * from[0] + 0.7152f * from[1] + 0.0722f * from[2];
    }
    return LUMI_OK;
}

static int bits_of(uint32_t format)
{
    switch (format) {
    case GIGE_RG10:
    case GIGE_RG10P:
        return 10;
    case GIGE_RG12:
    case GIGE_RG12P:
    case GIGE_RG12_PACKED:
        return 12;
    case GIGE_RG16:
        return 16;
    default:
        return 8;
    }
}

static void expose(const struct gige_shot *shot, struct lumi_raster *picture)
{
    struct sim_sensor sensor = shot->sensor;

    sensor.exposure += log2(fmax(shot->brightness, 1e-6));
    if (sensor.full_well > 0) { /* gain makes of fewer electrons a white */
        sensor.full_well = fmax(sensor.full_well / exp2(shot->gain_db / 6.0206), 10);
    }
    sim_sensor_apply(&sensor, shot->number, picture);
}

static void pack(uint32_t format, const struct lumi_raster *raw, uint8_t *to)
{
    const int bits = bits_of(format);
    const float white = (float)((1 << bits) - 1);
    unsigned held = 0, first = 0;
    int have = 0;
    size_t index = 0;

    for (int y = 0; y < raw->height; y++) {
        const float *row = lumi_row_f32(raw, y);

        for (int x = 0; x < raw->width; x++, index++) {
            const unsigned value = (unsigned)(fminf(fmaxf(row[x], 0), 1) * white + 0.5f);
            if (bits == 8) {
                *to++ = (uint8_t)value;
            } else if (format == GIGE_RG10P || format == GIGE_RG12P) {
                held |= value << have;
                for (have += bits; have >= 8; have -= 8, held >>= 8)
                    *to++ = (uint8_t)held;
            } else if (format == GIGE_RG12_PACKED) {
                *to++ = (uint8_t)(index % 2 ? (first & 15) | (value & 15) << 4 : value >> 4);
                if (index % 2)
                    *to++ = (uint8_t)(value >> 4);
                first = value;
            } else {
                *to++ = (uint8_t)value;
                *to++ = (uint8_t)(value >> 8);
            }
        }
    }
    if (have > 0)
        *to = (uint8_t)held;
    if (format == GIGE_RG12_PACKED && index % 2)
        *to = (uint8_t)(first & 15);
}

static int encode_raw(const struct gige_shot *shot, const struct lumi_raster *picture, uint8_t **data, size_t *size)
{
    struct lumi_raster raw = {0};
    int code;

    if (shot->format == GIGE_MONO8)
        LUMI_GOTO(code, done, make_grey(shot, picture, &raw));
    else
        LUMI_GOTO(code, done, sim_sensor_filter(picture, shot->width, shot->height, &raw));
    expose(shot, &raw);
    *size = gige_format_bytes(shot->format, shot->width, shot->height);
    *data = lumi_calloc(*size + 1, 1);
    code = *data ? LUMI_OK : LUMI_ERR_NOMEM;
    if (*data)
        pack(shot->format, &raw, *data);
done:
    lumi_raster_finish(&raw);
    return code;
}

static int encode_colour(const struct gige_shot *shot, struct lumi_raster *picture, uint8_t **data, size_t *size,
                         struct lumi_error *error)
{
    struct lumi_raster bytes = {0}, part = *picture;
    struct lumi_image_options options;
    int code;

    part.width = shot->width;
    part.height = shot->height;
    expose(shot, &part);
    LUMI_GOTO(code, done, lumi_raster_convert(&part, LUMI_U8, &bytes));
    if (shot->format == GIGE_JPEG) {
        lumi_image_options_init(&options);
        options.format = LUMI_IMAGE_JPEG;
        options.quality = shot->jpeg_quality;
        options.subsample = false;
        code = lumi_image_encode(&bytes, &options, data, size, error);
        goto done;
    }
    *size = gige_format_bytes(shot->format, shot->width, shot->height);
    *data = lumi_alloc(*size, 1);
    code = *data ? LUMI_OK : LUMI_ERR_NOMEM;
    for (int y = 0; *data && y < shot->height; y++)
        memcpy(*data + (size_t)y * 3 * (size_t)shot->width, lumi_row_u8(&bytes, y), 3 * (size_t)shot->width);
done:
    lumi_raster_finish(&bytes);
    return code;
}

/* ---- chunks: GigE Vision 2.0, 25.4: data, then id and length, big-endian; read from the end ---- */

struct writer {
    uint8_t *data;
    size_t size;
};

static void put32(struct writer *w, uint32_t value)
{
    for (int i = 24; i >= 0; i -= 8)
        w->data[w->size++] = (uint8_t)(value >> i);
}

static void put_chunk(struct writer *w, unsigned chunk, uint64_t bits)
{
    put32(w, (uint32_t)(bits >> 32));
    put32(w, (uint32_t)bits);
    put32(w, GIGE_CHUNK_ID(chunk));
    put32(w, 8);
}

static uint64_t real_bits(double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static int add_chunks(const struct gige_shot *shot, uint8_t **data, size_t *size)
{
    const uint64_t values[GIGE_CHUNKS] = {[GIGE_CHUNK_EXPOSURE] = real_bits(shot->exposure_us),
                                          [GIGE_CHUNK_GAIN] = real_bits(shot->gain_db),
                                          [GIGE_CHUNK_TIMESTAMP] = shot->timestamp,
                                          [GIGE_CHUNK_FRAME_ID] = shot->frame_id,
                                          [GIGE_CHUNK_COUNTER] = shot->counter};
    struct writer w = {lumi_calloc(*size + 4 + 8 + GIGE_CHUNKS * 16, 1), *size};

    if (!w.data)
        return LUMI_ERR_NOMEM;
    memcpy(w.data, *data, *size);
    w.size = (w.size + 3) / 4 * 4;
    const size_t image = w.size;
    put32(&w, GIGE_CHUNK_ID(GIGE_CHUNK_IMAGE));
    put32(&w, (uint32_t)image);
    for (unsigned i = 1; i < GIGE_CHUNKS; i++)
        if (shot->chunks >> i & 1)
            put_chunk(&w, i, values[i]);
    lumi_free(*data);
    *data = w.data;
    *size = w.size;
    return LUMI_OK;
}

int gige_encode(const struct gige_shot *shot, struct lumi_raster *picture, uint8_t **data, size_t *size,
                struct lumi_error *error)
{
    const bool colour = shot->format == GIGE_RGB8 || shot->format == GIGE_JPEG;
    int code;

    *data = NULL;
    *size = 0;
    if (picture->width < shot->width || picture->height < shot->height || picture->channels != 3)
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of %d × %d for a frame of %d × %d", picture->width,
                         picture->height, shot->width, shot->height);
    code = colour ? encode_colour(shot, picture, data, size, error) : encode_raw(shot, picture, data, size);
    if (code == LUMI_OK && shot->chunks)
        code = add_chunks(shot, data, size);
    if (code != LUMI_OK) {
        lumi_free(*data);
        *data = NULL;
        if (code == LUMI_ERR_NOMEM)
            lumi_fail(error, code, "no memory for a frame");
    }
    return code;
}
