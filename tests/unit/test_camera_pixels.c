/* Pixel formats of drivers: which one a setting gets, packed rows, names of controls. */
#include "daemon/camera/camera_unpack.h"
#include "daemon/camera/camera_v4l2_priv.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>

static const uint32_t webcam[] = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
static const uint32_t sensor[] = {V4L2_PIX_FMT_SGBRG8, V4L2_PIX_FMT_SGBRG10P, V4L2_PIX_FMT_SGBRG12, V4L2_PIX_FMT_NV12,
                                  V4L2_PIX_FMT_NV12M};

static const struct v4l2_pixel *choose(const uint32_t *fourccs, int count, enum lumi_frame_layout layout, int bits,
                                       bool dmabuf, const char *options)
{
    struct lumi_camera_setting setting;
    struct lumi_error error;

    lumi_camera_setting_init(&setting);
    setting.layout = layout;
    setting.bits = bits;
    setting.dmabuf = dmabuf;
    snprintf(setting.options, sizeof setting.options, "%s", options);
    return v4l2_pixel_choose(fourccs, count, &setting, &error);
}

static void raw_is_preferred_then_jpeg_then_what_there_is(void **state)
{
    (void)state;
    assert_int_equal(choose(sensor, 5, LUMI_LAYOUT_NONE, 0, false, "")->fourcc, V4L2_PIX_FMT_SGBRG12);
    assert_int_equal(choose(webcam, 2, LUMI_LAYOUT_NONE, 0, false, "")->fourcc, V4L2_PIX_FMT_MJPEG);
    assert_int_equal(choose(webcam, 1, LUMI_LAYOUT_NONE, 0, false, "")->fourcc, V4L2_PIX_FMT_YUYV);
}

static void a_setting_gets_the_layout_and_the_bits_it_asks_for(void **state)
{
    const struct v4l2_pixel *pixel;

    (void)state;
    assert_int_equal(choose(webcam, 2, LUMI_LAYOUT_YUYV, 0, false, "")->fourcc, V4L2_PIX_FMT_YUYV);
    pixel = choose(sensor, 5, LUMI_LAYOUT_BAYER, 10, false, "");
    assert_int_equal(pixel->fourcc, V4L2_PIX_FMT_SGBRG10P);
    assert_true(pixel->packed);
    assert_int_equal(pixel->bayer, LUMI_BAYER_GBRG);
    assert_null(choose(sensor, 5, LUMI_LAYOUT_BAYER, 16, false, ""));
    assert_null(choose(sensor, 5, LUMI_LAYOUT_JPEG, 0, false, ""));
}

static void frames_that_are_lent_lie_in_one_plane_as_they_are(void **state)
{
    (void)state;
    assert_null(choose(sensor, 5, LUMI_LAYOUT_BAYER, 10, true, ""));
    assert_null(choose(sensor + 4, 1, LUMI_LAYOUT_NV12, 0, true, ""));
    assert_int_equal(choose(sensor, 5, LUMI_LAYOUT_NV12, 0, true, "")->planes, 1);
}

static void an_option_names_the_pixel_format(void **state)
{
    (void)state;
    assert_int_equal(choose(sensor, 5, LUMI_LAYOUT_NV12, 0, false, "PixelFormat=NM12")->planes, 2);
    assert_int_equal(choose(sensor, 5, LUMI_LAYOUT_NONE, 0, false, "a=1 PixelFormat=GBRG")->bits, 8);
    assert_null(choose(sensor, 5, LUMI_LAYOUT_NONE, 0, false, "PixelFormat=H264"));
    assert_null(choose(webcam, 2, LUMI_LAYOUT_NONE, 0, false, "PixelFormat=NM12"));
}

static void packed_pixels_become_words(void **state)
{
    /* 0x3ff, 0x001, 0x2aa, 0x155 and a fifth; then 0xabc, 0x123 */
    static const uint8_t ten[10] = {0xff, 0x00, 0xaa, 0x55, 0x01 << 6 | 0x02 << 4 | 0x01 << 2 | 0x03,
                                    0x80, 0,    0,    0,    0x02};
    static const uint8_t twelve[3] = {0xab, 0x12, 0x3c};
    uint8_t out[10];

    (void)state;
    assert_int_equal(camera_packed_row(5, 10), 10);
    assert_int_equal(camera_packed_row(3, 12), 6);
    assert_int_equal(camera_packed_row(4, 8), 0);
    camera_unpack_row(ten, out, 5, 10);
    assert_memory_equal(out, ((uint8_t[10]){0xff, 3, 0x01, 0, 0xaa, 2, 0x55, 1, 0x02, 2}), 10);
    camera_unpack_row(twelve, out, 2, 12);
    assert_memory_equal(out, ((uint8_t[4]){0xbc, 0x0a, 0x23, 0x01}), 4);
}

static void rows_that_are_not_there_are_black_and_told(void **state)
{
    static const uint8_t in[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    struct camera_rows rows = {.bytes = in, .size = 12, .stride = 4, .count = 3};
    uint8_t out[9];

    (void)state;
    assert_true(camera_copy_rows(&rows, out, 3));
    assert_memory_equal(out, ((uint8_t[9]){1, 2, 3, 5, 6, 7, 9, 10, 11}), 9);
    rows.size = 10;
    assert_false(camera_copy_rows(&rows, out, 3));
    assert_memory_equal(out, ((uint8_t[9]){1, 2, 3, 5, 6, 7, 0, 0, 0}), 9);
}

static void a_control_is_named_as_options_write_it(void **state)
{
    char name[40];

    (void)state;
    v4l2_control_name("White Balance, Automatic", name, sizeof name);
    assert_string_equal(name, "white_balance_automatic");
    v4l2_control_name("  Gain (dB)  ", name, sizeof name);
    assert_string_equal(name, "gain_db");
    v4l2_control_name("Gain", name, 4);
    assert_int_equal(strlen(name) < 4, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(raw_is_preferred_then_jpeg_then_what_there_is),
        cmocka_unit_test(a_setting_gets_the_layout_and_the_bits_it_asks_for),
        cmocka_unit_test(frames_that_are_lent_lie_in_one_plane_as_they_are),
        cmocka_unit_test(an_option_names_the_pixel_format),
        cmocka_unit_test(packed_pixels_become_words),
        cmocka_unit_test(rows_that_are_not_there_are_black_and_told),
        cmocka_unit_test(a_control_is_named_as_options_write_it),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
