/* The coded tiles of one cluster between encoder and file. */
#include "proto/lightfield/cluster_code.h"

static void write_tile(struct lumi_writer *writer, const struct lumi_tile_code *code)
{
    for (int k = 0; k < LUMI_WINDOWS; k++) {
        lumi_write_u16(writer, (uint16_t)code->shift[k].x);
        lumi_write_u16(writer, (uint16_t)code->shift[k].y);
    }
    lumi_write_u8(writer, code->fields.interpolation);
    lumi_write_u8(writer, code->fields.filter_level);
    lumi_write_u8(writer, code->fields.precise);
    lumi_write_u8(writer, code->quantizer);
    lumi_write_u16(writer, code->check);
    lumi_write_u16(writer, code->compressed_size);
    lumi_write_u16(writer, code->size);
    lumi_write_bytes(writer, code->compressed, code->compressed_size);
    lumi_write_bytes(writer, code->data, code->size);
}

int lumi_cluster_read_tile(struct lumi_reader *reader, struct lumi_tile_code *code)
{
    for (int k = 0; k < LUMI_WINDOWS; k++) {
        code->shift[k].x = (int16_t)lumi_read_u16(reader);
        code->shift[k].y = (int16_t)lumi_read_u16(reader);
    }
    code->fields.interpolation = lumi_read_u8(reader);
    code->fields.filter_level = lumi_read_u8(reader);
    code->fields.precise = lumi_read_u8(reader);
    code->quantizer = lumi_read_u8(reader);
    code->check = lumi_read_u16(reader);
    code->compressed_size = lumi_read_u16(reader);
    code->size = lumi_read_u16(reader);
    code->compressed = lumi_read_bytes(reader, code->compressed_size);
    code->data = lumi_read_bytes(reader, code->size);
    return reader->failed || code->compressed_size < 1 || code->compressed_size > LUMI_TILE_COMPRESSED_MAX ||
                   code->size > LUMI_TILE_DATA_MAX
               ? LUMI_ERR_FORMAT
               : LUMI_OK;
}

/* Squared differences of a plane of a tile, inside the image. */
static double plane_error(const struct lumi_yuv *image, int plane, int x0, int y0, const uint8_t *decoded, int size)
{
    int width = lumi_yuv_width(image, plane), height = lumi_yuv_height(image, plane);
    long sum = 0;

    for (int y = 0; y < size && y0 + y < height; y++) {
        const uint8_t *row = image->plane[plane] + (size_t)(y0 + y) * (size_t)width;
        for (int x = 0; x < size && x0 + x < width; x++) {
            int difference = row[x0 + x] - decoded[y * size + x];
            sum += difference * difference;
        }
    }
    return (double)sum;
}

int lumi_cluster_encode_image(struct lumi_tile_encoder *encoder, const struct lumi_yuv *reference,
                              const struct lumi_yuv *image, const struct lumi_shift *seeds, int range,
                              struct lumi_writer *writer, double *squared_error, struct lumi_error *error)
{
    struct lumi_tile_pixels source, decoded;
    struct lumi_shift shift[LUMI_WINDOWS];
    struct lumi_tile_code code;
    int tile = 0;

    for (int y = 0; y < image->height; y += LUMI_TILE)
        for (int x = 0; x < image->width; x += LUMI_TILE, tile++) {
            lumi_window_copy(image, x, y, &source);
            LUMI_TRY(lumi_shift_search(reference, x, y, &source, seeds ? seeds[tile] : (struct lumi_shift){0, 0}, range,
                                       shift, error));
            LUMI_TRY(lumi_tile_encode(encoder, reference, x, y, shift, &source, &code, &decoded, error));
            write_tile(writer, &code);
            if (squared_error)
                *squared_error += plane_error(image, 0, x, y, decoded.y, LUMI_TILE) +
                                  plane_error(image, 1, x / 2, y / 2, decoded.u, LUMI_TILE / 2) +
                                  plane_error(image, 2, x / 2, y / 2, decoded.v, LUMI_TILE / 2);
        }
    return writer->failed ? lumi_fail(error, LUMI_ERR_NOMEM, "no memory for coded tiles") : LUMI_OK;
}
