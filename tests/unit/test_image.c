/* Images survive being written and read. */
#include "image_samples.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const uint8_t exif_block[] = {'I',  'I', '*', 0, 8, 0, 0, 0, 1, 0, /* one entry */
                                     0x12, 1,   3,   0, 1, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0};

static void assert_same(const struct lumi_raster *a, const struct lumi_raster *b)
{
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    assert_int_equal(a->channels, b->channels);
    assert_int_equal(a->sample, b->sample);
    for (int y = 0; y < a->height; y++)
        assert_memory_equal(lumi_row_u8(a, y), lumi_row_u8(b, y),
                            (size_t)a->width * (size_t)a->channels * (size_t)a->sample);
}

static void round_trip(const struct lumi_raster *raster, const struct lumi_image_options *options,
                       struct lumi_raster *back)
{
    struct lumi_error error = {0};
    struct lumi_image_info info;
    uint8_t *data;
    size_t size;

    if (lumi_image_encode(raster, options, &data, &size, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    if (lumi_image_read_memory(data, size, "memory", 0, back, NULL, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lumi_image_info_memory(data, size, "memory", &info, &error), LUMI_OK);
    assert_int_equal(info.format, options->format);
    assert_int_equal(info.width, back->width);
    assert_int_equal(info.height, back->height);
    assert_int_equal(info.channels, back->channels);
    assert_int_equal(info.sample, back->sample);
    lumi_free(data);
}

static void lossless(enum lumi_image_format format, enum lumi_sample sample, int level)
{
    static const int sizes[][2] = {{1, 1}, {7, 5}, {130, 67}};

    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int channels = 1; channels <= 4; channels += channels == 1 ? 2 : 1) {
            struct lumi_image_options options;
            struct lumi_raster raster, back;

            lumi_image_options_init(&options);
            options.format = format;
            options.level = level;
            options.half = false;
            make_picture(&raster, sizes[i][0], sizes[i][1], channels, sample);
            round_trip(&raster, &options, &back);
            assert_same(&raster, &back);
            lumi_raster_finish(&raster);
            lumi_raster_finish(&back);
        }
}

static void png_of_8_and_16_bits_comes_back_exactly(void **state)
{
    (void)state;
    for (int level = -1; level <= 9; level += level < 1 ? 1 : 8) {
        lossless(LUMI_IMAGE_PNG, LUMI_U8, level);
        lossless(LUMI_IMAGE_PNG, LUMI_U16, level);
    }
}

static void tiff_of_8_and_16_bits_and_floats_comes_back_exactly(void **state)
{
    (void)state;
    for (int level = -1; level <= 9; level += level < 1 ? 1 : 8) {
        lossless(LUMI_IMAGE_TIFF, LUMI_U8, level);
        lossless(LUMI_IMAGE_TIFF, LUMI_U16, level);
        lossless(LUMI_IMAGE_TIFF, LUMI_F32, level);
    }
}

static void openexr_floats_come_back_exactly(void **state)
{
    (void)state;
    for (int level = -1; level <= 9; level += level < 1 ? 1 : 8)
        lossless(LUMI_IMAGE_EXR, LUMI_F32, level);
}

static void openexr_halves_are_within_half_a_unit_in_the_last_place(void **state)
{
    struct lumi_image_options options;
    struct lumi_raster raster, back;

    (void)state;
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    make_picture(&raster, 130, 67, 3, LUMI_F32);
    round_trip(&raster, &options, &back);
    for (int y = 0; y < raster.height; y++)
        for (int x = 0; x < raster.width * 3; x++) {
            float in = lumi_row_f32(&raster, y)[x], out = lumi_row_f32(&back, y)[x];
            assert_true(fabsf(in - out) <= in / 2048 + 3e-8f);
        }
    lumi_raster_finish(&raster);
    lumi_raster_finish(&back);
}

static void a_named_openexr_channel_is_found_by_its_name_alone(void **state)
{
    char path[] = "lumi-test-image-XXXXXX";
    struct lumi_image_options options;
    struct lumi_raster raster, back;
    struct lumi_error error = {0};

    (void)state;
    close(mkstemp(path));
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = false;
    options.channel = "W";
    make_picture(&raster, 70, 40, 1, LUMI_F32);
    lumi_row_f32(&raster, 3)[5] = INFINITY;
    assert_int_equal(lumi_image_write(path, &raster, &options, &error), LUMI_OK);
    assert_int_equal(lumi_image_read_channel(path, "W", &back, &error), LUMI_OK);
    assert_same(&raster, &back);
    lumi_raster_finish(&back);
    assert_int_equal(lumi_image_read_channel(path, "Z", &back, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, path));
    lumi_raster_finish(&raster);
    unlink(path);
}

/* Of floats and of halves: OpenEXR unpacks the two in different ways. */
static void colour_and_a_named_fourth_channel_share_an_openexr_file(void **state)
{
    struct lumi_image_options options;
    struct lumi_raster raster, colour, depth;
    struct lumi_error error;
    const char *path = "test_image_fourth.exr";

    (void)state;
    assert_int_equal(lumi_raster_create(&raster, 9, 5, 4, LUMI_F32), LUMI_OK);
    for (int y = 0; y < 5; y++)
        for (int x = 0; x < 36; x++)
            lumi_row_f32(&raster, y)[x] = x % 4 == 3 ? 1.0f / 3 + (float)(x + y) : (float)(x + 40 * y) / 256;
    lumi_image_options_init(&options);
    options.channel = "W";
    assert_int_equal(lumi_image_write(path, &raster, &options, &error), LUMI_OK);
    assert_int_equal(lumi_image_read(path, 3, &colour, NULL, &error), LUMI_OK);
    assert_int_equal(lumi_image_read_channel(path, "W", &depth, &error), LUMI_OK);
    for (int y = 0; y < 5; y++)
        for (int x = 0; x < 9; x++) {
            const float *in = lumi_row_f32(&raster, y) + 4 * x, *out = lumi_row_f32(&colour, y) + 3 * x;
            assert_true(out[0] == in[0] && out[1] == in[1] && out[2] == in[2]);
            assert_true(lumi_row_f32(&depth, y)[x] == in[3]); /* no half: every bit is there */
        }
    lumi_raster_finish(&depth);
    assert_int_equal(lumi_image_read_channel(path, "A", &depth, &error), LUMI_ERR_NOTFOUND);
    lumi_raster_finish(&raster);
    lumi_raster_finish(&colour);
    unlink(path);
}

static void channels_of_colour_openexr_can_be_read_one_by_one(void **state)
{
    static const char *const names[] = {"R", "G", "B"};
    char path[] = "lumi-test-image-XXXXXX";
    struct lumi_image_options options;
    struct lumi_raster raster, back, one;
    struct lumi_error error = {0};

    (void)state;
    close(mkstemp(path));
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    make_picture(&raster, 33, 40, 3, LUMI_F32);
    for (int half = 0; half < 2; half++) {
        options.half = half;
        assert_int_equal(lumi_image_write(path, &raster, &options, &error), LUMI_OK);
        assert_int_equal(lumi_image_read(path, 0, &back, NULL, &error), LUMI_OK);
        for (int c = 0; c < 3; c++) {
            assert_int_equal(lumi_image_read_channel(path, names[c], &one, &error), LUMI_OK);
            assert_int_equal(one.channels, 1);
            for (int y = 0; y < 40; y++)
                for (int x = 0; x < 33; x++)
                    assert_true(lumi_row_f32(&one, y)[x] == lumi_row_f32(&back, y)[3 * x + c]);
            lumi_raster_finish(&one);
        }
        lumi_raster_finish(&back);
    }
    lumi_raster_finish(&raster);
    unlink(path);
}

static double jpeg_error(const struct lumi_raster *raster, int quality, bool subsample, size_t *size)
{
    struct lumi_image_options options;
    struct lumi_error error = {0};
    struct lumi_raster back;
    uint8_t *data;
    double sum = 0;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.quality = quality;
    options.subsample = subsample;
    assert_int_equal(lumi_image_encode(raster, &options, &data, size, &error), LUMI_OK);
    assert_int_equal(lumi_image_read_memory(data, *size, "memory", 0, &back, NULL, &error), LUMI_OK);
    assert_int_equal(back.channels, raster->channels);
    for (int y = 0; y < raster->height; y++)
        for (int x = 0; x < raster->width * raster->channels; x++) {
            double d = (double)lumi_row_u8(raster, y)[x] - lumi_row_u8(&back, y)[x];
            sum += d * d;
        }
    lumi_raster_finish(&back);
    lumi_free(data);
    return sum / (raster->width * raster->height * raster->channels);
}

static void jpeg_obeys_quality_and_chroma_options(void **state)
{
    struct lumi_raster colour, grey;
    size_t small, large, half, size;

    (void)state;
    make_picture(&colour, 131, 67, 3, LUMI_U8);
    double coarse = jpeg_error(&colour, 30, false, &small);
    double fine = jpeg_error(&colour, 98, false, &large);
    double halved = jpeg_error(&colour, 98, true, &half);
    assert_true(small < large && coarse > fine && fine < 20);
    assert_true(half < large && halved > fine);
    make_picture(&grey, 131, 67, 1, LUMI_U8);
    assert_true(jpeg_error(&grey, 98, false, &size) < 20);
    lumi_raster_finish(&colour);
    lumi_raster_finish(&grey);
}

static void grey_and_alpha_become_rgb_when_asked(void **state)
{
    struct lumi_image_options options;
    struct lumi_raster raster, rgb;
    struct lumi_error error = {0};
    uint8_t *data;
    size_t size;

    (void)state;
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_PNG;
    for (int channels = 1; channels <= 4; channels += 3) {
        make_picture(&raster, 9, 4, channels, LUMI_U16);
        assert_int_equal(lumi_image_encode(&raster, &options, &data, &size, &error), LUMI_OK);
        assert_int_equal(lumi_image_read_memory(data, size, "memory", 3, &rgb, NULL, &error), LUMI_OK);
        assert_int_equal(rgb.channels, 3);
        for (int y = 0; y < 4; y++)
            for (int i = 0; i < 27; i++)
                assert_int_equal(lumi_row_u16(&rgb, y)[i],
                                 lumi_row_u16(&raster, y)[channels == 1 ? i / 3 : i / 3 * 4 + i % 3]);
        lumi_free(data);
        lumi_raster_finish(&raster);
        lumi_raster_finish(&rgb);
    }
}

static void exif_is_kept_and_its_orientation_reported(void **state)
{
    static const enum lumi_image_format formats[] = {LUMI_IMAGE_JPEG, LUMI_IMAGE_PNG};

    (void)state;
    for (int i = 0; i < 2; i++) {
        struct lumi_image_options options;
        struct lumi_image_meta meta;
        struct lumi_image_info info;
        struct lumi_raster raster, back;
        struct lumi_error error = {0};
        uint8_t *data;
        size_t size;

        lumi_image_options_init(&options);
        options.format = formats[i];
        options.exif = exif_block;
        options.exif_size = sizeof exif_block;
        make_picture(&raster, 20, 10, 3, LUMI_U8);
        assert_int_equal(lumi_image_encode(&raster, &options, &data, &size, &error), LUMI_OK);
        assert_int_equal(lumi_image_read_memory(data, size, "memory", 0, &back, &meta, &error), LUMI_OK);
        assert_int_equal(meta.exif_size, sizeof exif_block);
        assert_memory_equal(meta.exif, exif_block, sizeof exif_block);
        assert_int_equal(meta.info.orientation, 6);
        assert_int_equal(back.width, 20);
        assert_int_equal(lumi_image_info_memory(data, size, "memory", &info, &error), LUMI_OK);
        assert_int_equal(info.orientation, 6);
        lumi_image_meta_finish(&meta);
        lumi_raster_finish(&raster);
        lumi_raster_finish(&back);
        lumi_free(data);
    }
}

static void content_not_name_tells_the_format(void **state)
{
    const char *path = "lumi-test-content.jpg";
    struct lumi_image_options options;
    struct lumi_image_info info;
    struct lumi_raster raster, back;
    struct lumi_error error = {0};

    (void)state;
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_PNG;
    make_picture(&raster, 12, 8, 3, LUMI_U16);
    assert_int_equal(lumi_image_write(path, &raster, &options, &error), LUMI_OK);
    assert_int_equal(lumi_image_info(path, &info, &error), LUMI_OK);
    assert_int_equal(info.format, LUMI_IMAGE_PNG);
    assert_int_equal(lumi_image_read(path, 0, &back, NULL, &error), LUMI_OK);
    assert_same(&raster, &back);
    lumi_raster_finish(&raster);
    lumi_raster_finish(&back);
    unlink(path);
}

static void the_name_chooses_the_format_when_nothing_else_does(void **state)
{
    (void)state;
    assert_int_equal(lumi_image_format_of_name("a.b/photo.JPEG"), LUMI_IMAGE_JPEG);
    assert_int_equal(lumi_image_format_of_name("photo.exr"), LUMI_IMAGE_EXR);
    assert_int_equal(lumi_image_format_of_name("photo.png/none"), LUMI_IMAGE_AUTO);
    assert_int_equal(lumi_image_format_of_name("photo"), LUMI_IMAGE_AUTO);
}

static void what_cannot_be_written_leaves_nothing_behind(void **state)
{
    struct lumi_raster raster;
    struct lumi_error error = {0};

    (void)state;
    make_picture(&raster, 12, 8, 4, LUMI_U8);
    assert_int_equal(lumi_image_write("no-such-folder/x.png", &raster, NULL, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "no-such-folder/x.png"));
    assert_int_equal(lumi_image_write("lumi-test-x.jpg", &raster, NULL, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_image_write("lumi-test-x.gif", &raster, NULL, &error), LUMI_ERR_ARG);
    assert_true(access("lumi-test-x.jpg", F_OK) != 0);
    lumi_raster_finish(&raster);
}

static void encoding_twice_gives_the_same_bytes(void **state)
{
    (void)state;
    for (int format = LUMI_IMAGE_JPEG; format <= LUMI_IMAGE_EXR; format++) {
        struct lumi_image_options options;
        struct lumi_error error = {0};
        struct lumi_raster raster;
        uint8_t *data[2];
        size_t size[2];

        lumi_image_options_init(&options);
        options.format = (enum lumi_image_format)format;
        for (int i = 0; i < 2; i++) {
            make_picture(&raster, 90, 50, 3, LUMI_F32);
            assert_int_equal(lumi_image_encode(&raster, &options, &data[i], &size[i], &error), LUMI_OK);
            lumi_raster_finish(&raster);
        }
        assert_int_equal(size[0], size[1]);
        assert_memory_equal(data[0], data[1], size[0]);
        lumi_free(data[0]);
        lumi_free(data[1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_of_8_and_16_bits_comes_back_exactly),
        cmocka_unit_test(tiff_of_8_and_16_bits_and_floats_comes_back_exactly),
        cmocka_unit_test(openexr_floats_come_back_exactly),
        cmocka_unit_test(openexr_halves_are_within_half_a_unit_in_the_last_place),
        cmocka_unit_test(a_named_openexr_channel_is_found_by_its_name_alone),
        cmocka_unit_test(colour_and_a_named_fourth_channel_share_an_openexr_file),
        cmocka_unit_test(channels_of_colour_openexr_can_be_read_one_by_one),
        cmocka_unit_test(jpeg_obeys_quality_and_chroma_options),
        cmocka_unit_test(grey_and_alpha_become_rgb_when_asked),
        cmocka_unit_test(exif_is_kept_and_its_orientation_reported),
        cmocka_unit_test(content_not_name_tells_the_format),
        cmocka_unit_test(the_name_chooses_the_format_when_nothing_else_does),
        cmocka_unit_test(what_cannot_be_written_leaves_nothing_behind),
        cmocka_unit_test(encoding_twice_gives_the_same_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
