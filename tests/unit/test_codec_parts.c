/* The parts of the codec: range coder, side information, YUV, windows, frame headers, shift search. */
#include "proto/base/memory.h"
#include "proto/lightfield/range_coder.h"
#include "proto/lightfield/side_info.h"
#include "proto/lightfield/tile_encoder.h"
#include "proto/lightfield/yuv.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static unsigned draw(unsigned *seed)
{
    *seed = *seed * 1664525 + 1013904223;
    return *seed >> 8;
}

enum { SYMBOLS = 20000 };

static void coded_numbers_come_back(void **state)
{
    struct lumi_number_model models[2];
    struct lumi_range_encoder encoder;
    struct lumi_range_decoder decoder;
    struct lumi_writer writer;
    unsigned seed = 7;

    (void)state;
    lumi_writer_init(&writer);
    lumi_range_encoder_init(&encoder, &writer);
    lumi_number_model_init(&models[0]);
    for (int i = 0; i < SYMBOLS; i++) {
        unsigned value = draw(&seed) % 65536 >> draw(&seed) % 17;
        lumi_range_encode_number(&encoder, &models[0], value);
        lumi_range_encode_raw(&encoder, value, 11);
    }
    lumi_range_encoder_finish(&encoder);
    seed = 7;
    lumi_range_decoder_init(&decoder, writer.data, writer.size);
    lumi_number_model_init(&models[1]);
    for (int i = 0; i < SYMBOLS; i++) {
        unsigned value = draw(&seed) % 65536 >> draw(&seed) % 17;
        assert_int_equal(lumi_range_decode_number(&decoder, &models[1]), value);
        assert_int_equal(lumi_range_decode_raw(&decoder, 11), value & 2047);
    }
    lumi_writer_finish(&writer);
}

/* Runs of likely ones make long chains of held-back 0xff bytes, and carries into them. */
static void carries_go_through(void **state)
{
    (void)state;
    for (unsigned round = 0; round < 300; round++) {
        struct lumi_range_encoder encoder;
        struct lumi_range_decoder decoder;
        struct lumi_bit_model model;
        struct lumi_writer writer;
        unsigned seed = round;
        int count = (int)(1 + round * 7);

        lumi_writer_init(&writer);
        lumi_range_encoder_init(&encoder, &writer);
        lumi_bit_models_init(&model, 1);
        for (int i = 0; i < count; i++)
            if (draw(&seed) % 3 == 0)
                lumi_range_encode_raw(&encoder, 0xffffff, 24);
            else
                lumi_range_encode(&encoder, &model, draw(&seed) % 50 != 0);
        lumi_range_encoder_finish(&encoder);
        seed = round;
        lumi_range_decoder_init(&decoder, writer.data, writer.size);
        lumi_bit_models_init(&model, 1);
        for (int i = 0; i < count; i++)
            if (draw(&seed) % 3 == 0)
                assert_int_equal(lumi_range_decode_raw(&decoder, 24), 0xffffff);
            else
                assert_int_equal(lumi_range_decode(&decoder, &model), draw(&seed) % 50 != 0);
        lumi_writer_finish(&writer);
    }
}

static void likely_bits_cost_little(void **state)
{
    struct lumi_range_encoder encoder;
    struct lumi_bit_model model;
    struct lumi_writer writer;

    (void)state;
    lumi_writer_init(&writer);
    lumi_range_encoder_init(&encoder, &writer);
    lumi_bit_models_init(&model, 1);
    for (int i = 0; i < 80000; i++)
        lumi_range_encode(&encoder, &model, i % 100 == 0);
    lumi_range_encoder_finish(&encoder);
    /* The entropy is 0.081 bits each, 808 bytes; adapting costs the rest. */
    assert_in_range(writer.size, 700, 1000);
    lumi_writer_finish(&writer);
}

enum { VIEWS = 3, COLS = 7, ROWS = 5, ENTRIES = VIEWS * COLS * ROWS };

static void draw_entries(struct lumi_tile_entry *entries, unsigned seed)
{
    memset(entries, 0, ENTRIES * sizeof *entries);
    for (int i = 0; i < ENTRIES; i++) {
        struct lumi_tile_entry *entry = &entries[i];
        entry->size = (uint16_t)(draw(&seed) % 32768 >> draw(&seed) % 15);
        entry->check = (uint16_t)(draw(&seed) & ((1u << LUMI_CHECK_BITS) - 1));
        for (int k = 0; k < LUMI_WINDOWS; k++) {
            entry->shift[k].x = (int16_t)(2 * ((int)(draw(&seed) % 8191) - 4095));
            entry->shift[k].y = (int16_t)(2 * ((int)(draw(&seed) % 8191) - 4095));
        }
        if (draw(&seed) % 2)
            entry->shift[1] = entry->shift[0];
        entry->fields = (struct lumi_tile_fields){(uint8_t)(draw(&seed) % 5), (uint8_t)(draw(&seed) % 64),
                                                  (uint8_t)(draw(&seed) % 2)};
        entry->quantizer = (uint8_t)(draw(&seed) % 8 ? 90 : draw(&seed) % 256);
        entry->dictionary = (uint8_t)(draw(&seed) % 33);
    }
}

static void side_information_comes_back(void **state)
{
    struct lumi_tile_entry entries[ENTRIES], read[ENTRIES];
    struct lumi_writer writer;
    uint64_t total;

    (void)state;
    for (unsigned seed = 0; seed < 50; seed++) {
        draw_entries(entries, seed);
        lumi_writer_init(&writer);
        lumi_side_encode(entries, VIEWS, COLS, ROWS, 90, &writer);
        assert_int_equal(lumi_side_decode(writer.data, writer.size, VIEWS, COLS, ROWS, 90, 32, read, &total), LUMI_OK);
        assert_int_equal(lumi_side_offsets(entries, VIEWS, COLS * ROWS), total);
        for (int i = 0; i < ENTRIES; i++) {
            assert_memory_equal(entries[i].shift, read[i].shift, sizeof read[i].shift);
            assert_memory_equal(&entries[i].fields, &read[i].fields, sizeof read[i].fields);
            assert_int_equal(entries[i].offset, read[i].offset);
            assert_int_equal(entries[i].size, read[i].size);
            assert_int_equal(entries[i].check, read[i].check);
            assert_int_equal(entries[i].quantizer, read[i].quantizer);
            assert_int_equal(entries[i].dictionary, read[i].dictionary);
        }
        lumi_writer_finish(&writer);
    }
}

static void noise_is_no_side_information_or_is_in_range(void **state)
{
    struct lumi_tile_entry read[ENTRIES];
    unsigned seed = 3;
    uint8_t noise[400];
    uint64_t total;

    (void)state;
    for (int round = 0; round < 2000; round++) {
        for (size_t i = 0; i < sizeof noise; i++)
            noise[i] = (uint8_t)draw(&seed);
        if (lumi_side_decode(noise, draw(&seed) % sizeof noise, VIEWS, COLS, ROWS, 90, 4, read, &total) != LUMI_OK)
            continue;
        for (int i = 0; i < ENTRIES; i++) {
            assert_true(read[i].dictionary < 4 || read[i].dictionary == LUMI_DICTIONARY_NONE);
            assert_true(read[i].fields.interpolation <= 4 && read[i].fields.filter_level <= 63);
            assert_true(abs(read[i].shift[1].x) <= LUMI_SHIFT_MAX && (read[i].shift[1].x & 1) == 0);
        }
    }
}

static void smooth_colour_survives_yuv(void **state)
{
    const int sizes[3][2] = {{64, 48}, {65, 47}, {1, 1}};

    (void)state;
    for (int s = 0; s < 3; s++) {
        struct lumi_raster from, to;
        struct lumi_yuv image;
        assert_int_equal(lumi_raster_create(&from, sizes[s][0], sizes[s][1], 3, LUMI_U8), LUMI_OK);
        assert_int_equal(lumi_raster_create(&to, sizes[s][0], sizes[s][1], 3, LUMI_U8), LUMI_OK);
        for (int y = 0; y < from.height; y++)
            for (int x = 0; x < from.width; x++) {
                uint8_t *p = lumi_row_u8(&from, y) + 3 * x;
                p[0] = (uint8_t)(128 + 90 * sin(x * 0.1));
                p[1] = (uint8_t)(128 + 90 * sin(y * 0.08 + 1));
                p[2] = (uint8_t)(128 + 90 * sin((x + y) * 0.05));
            }
        assert_int_equal(lumi_yuv_from_raster(&from, &image), LUMI_OK);
        assert_int_equal(lumi_yuv_to_raster(&image, &to), LUMI_OK);
        for (int y = 0; y < from.height; y++)
            for (int x = 0; x < 3 * from.width; x++)
                assert_in_range(lumi_row_u8(&to, y)[x] - lumi_row_u8(&from, y)[x] + 8, 0, 16);
        lumi_yuv_finish(&image);
        lumi_raster_finish(&from);
        lumi_raster_finish(&to);
    }
}

static void primaries_have_their_bt709_values(void **state)
{
    static const uint8_t colours[4][6] = {
        {255, 255, 255, 255, 128, 128}, {0, 0, 0, 0, 128, 128}, {255, 0, 0, 54, 99, 255}, {0, 0, 255, 18, 255, 116}};

    (void)state;
    for (int c = 0; c < 4; c++)
        for (int kind = 0; kind < 2; kind++) {
            struct lumi_raster raster;
            struct lumi_yuv image;
            assert_int_equal(lumi_raster_create(&raster, 4, 4, 3, kind ? LUMI_F32 : LUMI_U8), LUMI_OK);
            for (int i = 0; i < 48; i++) {
                int y = i / 12, x = i % 12;
                if (kind)
                    lumi_row_f32(&raster, y)[x] = colours[c][i % 3] / 255.0f;
                else
                    lumi_row_u8(&raster, y)[x] = colours[c][i % 3];
            }
            assert_int_equal(lumi_yuv_from_raster(&raster, &image), LUMI_OK);
            for (int p = 0; p < 3; p++)
                assert_int_equal(image.plane[p][0], colours[c][3 + p]);
            lumi_yuv_finish(&image);
            lumi_raster_finish(&raster);
        }
}

static void windows_repeat_the_edge(void **state)
{
    struct lumi_tile_pixels window;
    struct lumi_yuv image;

    (void)state;
    assert_int_equal(lumi_yuv_create(&image, 71, 33), LUMI_OK);
    for (int p = 0; p < 3; p++)
        for (int y = 0; y < lumi_yuv_height(&image, p); y++)
            for (int x = 0; x < lumi_yuv_width(&image, p); x++)
                image.plane[p][y * lumi_yuv_width(&image, p) + x] = (uint8_t)(x + 3 * y + 40 * p);
    for (int x0 = -130; x0 <= 130; x0 += 26)
        for (int y0 = -70; y0 <= 70; y0 += 14) {
            lumi_window_copy(&image, x0, y0, &window);
            for (int y = 0; y < LUMI_TILE; y++)
                for (int x = 0; x < LUMI_TILE; x++) {
                    int u = x0 + x < 0 ? 0 : x0 + x > 70 ? 70 : x0 + x, v = y0 + y < 0 ? 0 : y0 + y > 32 ? 32 : y0 + y;
                    assert_int_equal(window.y[y * LUMI_TILE + x], (uint8_t)(u + 3 * v));
                    u = x0 / 2 + x / 2 < 0 ? 0 : x0 / 2 + x / 2 > 35 ? 35 : x0 / 2 + x / 2;
                    v = y0 / 2 + y / 2 < 0 ? 0 : y0 / 2 + y / 2 > 16 ? 16 : y0 / 2 + y / 2;
                    assert_int_equal(window.v[y / 2 * LUMI_TILE / 2 + x / 2], (uint8_t)(u + 3 * v + 80));
                }
        }
    lumi_yuv_finish(&image);
}

/* The last column and row overhang the image, whose sides are odd. */
static void tiles_cut_out_and_put_back_are_the_image(void **state)
{
    struct lumi_yuv image, copy;
    struct lumi_tile_pixels tile;
    unsigned seed = 5;

    (void)state;
    assert_int_equal(lumi_yuv_create(&image, 131, 65), LUMI_OK);
    assert_int_equal(lumi_yuv_create(&copy, 131, 65), LUMI_OK);
    for (int p = 0; p < 3; p++)
        for (int i = 0; i < lumi_yuv_width(&image, p) * lumi_yuv_height(&image, p); i++)
            image.plane[p][i] = (uint8_t)draw(&seed);
    for (int i = 0; i < 6; i++) {
        lumi_window_copy(&image, i % 3 * LUMI_TILE, i / 3 * LUMI_TILE, &tile);
        lumi_tile_place(&tile, i % 3, i / 3, &copy);
    }
    for (int p = 0; p < 3; p++)
        assert_memory_equal(copy.plane[p], image.plane[p],
                            (size_t)(lumi_yuv_width(&image, p) * lumi_yuv_height(&image, p)));
    lumi_yuv_finish(&image);
    lumi_yuv_finish(&copy);
}

static void built_headers_are_parsed_back(void **state)
{
    unsigned seed = 11;

    (void)state;
    for (int i = 0; i < 500; i++) {
        struct lumi_tile_frame frame = {(uint8_t)draw(&seed), (uint8_t)(draw(&seed) % 8), (uint8_t)(draw(&seed) % 2),
                                        (uint8_t)(draw(&seed) % 2)};
        struct lumi_tile_fields fields = {(uint8_t)(draw(&seed) % 5), (uint8_t)(draw(&seed) % 64),
                                          (uint8_t)(draw(&seed) % 2)};
        struct lumi_tile_frame read_frame;
        struct lumi_tile_fields read_fields;
        uint8_t bytes[LUMI_TILE_HEADER_MAX + 200] = {0};
        size_t compressed = 1 + draw(&seed) % 200, header, read;
        bool key;
        size_t size = lumi_tile_header_build(&frame, &fields, compressed, bytes);
        assert_true(lumi_tile_header_parse(bytes, size + compressed, &read_frame, &read_fields, &header, &read));
        assert_memory_equal(&frame, &read_frame, sizeof frame);
        assert_memory_equal(&fields, &read_fields, sizeof fields);
        assert_int_equal(header, size);
        assert_int_equal(read, compressed);
        assert_false(lumi_tile_header_parse(bytes, size + compressed - 1, &read_frame, &read_fields, &header, &read));
        assert_true(lumi_vp9_frame_plain(bytes, size, 64, 64, &key));
        assert_false(key);
        bytes[0] ^= 0x80;
        assert_false(lumi_vp9_frame_plain(bytes, size, 64, 64, &key));
    }
}

static void a_shifted_tile_is_found(void **state)
{
    struct lumi_shift shift[LUMI_WINDOWS], seed = {38, -20};
    struct lumi_tile_pixels tile;
    struct lumi_yuv image;
    unsigned noise = 5;

    (void)state;
    assert_int_equal(lumi_yuv_create(&image, 320, 256), LUMI_OK);
    for (int i = 0; i < 320 * 256; i++)
        image.plane[0][i] = (uint8_t)draw(&noise);
    /* Three quarters of the tile from one place, one from another. */
    lumi_window_copy(&image, 64 + 46, 64 - 14, &tile);
    for (int y = 32; y < 64; y++)
        memcpy(tile.y + y * 64 + 32, image.plane[0] + (64 - 26 + y) * 320 + 64 + 32 + 32, 32);
    assert_int_equal(lumi_shift_search(&image, 64, 64, &tile, seed, 12, shift, NULL), LUMI_OK);
    assert_int_equal(shift[0].x, 46);
    assert_int_equal(shift[0].y, -14);
    assert_int_equal(shift[1].x, 32);
    assert_int_equal(shift[1].y, -26);
    lumi_yuv_finish(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coded_numbers_come_back),
        cmocka_unit_test(carries_go_through),
        cmocka_unit_test(likely_bits_cost_little),
        cmocka_unit_test(side_information_comes_back),
        cmocka_unit_test(noise_is_no_side_information_or_is_in_range),
        cmocka_unit_test(smooth_colour_survives_yuv),
        cmocka_unit_test(primaries_have_their_bt709_values),
        cmocka_unit_test(windows_repeat_the_edge),
        cmocka_unit_test(tiles_cut_out_and_put_back_are_the_image),
        cmocka_unit_test(built_headers_are_parsed_back),
        cmocka_unit_test(a_shifted_tile_is_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
