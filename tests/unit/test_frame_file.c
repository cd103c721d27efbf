/* Frames become files that give back what the camera saw. */
#include "daemon/camera/frame_file.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "sim/camera.h"
#include "sim/place.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define WIDTH 320
#define HEIGHT 240

static struct lumi_raster room; /* linear light, rendered once */

static int render(void **state)
{
    struct sim_scene *scene;
    struct lumi_lens lens;
    const struct lumi_pose pose = {{0, 0, 1, -1, 0, 0, 0, -1, 0}, {0, 0, 0}};

    (void)state;
    lumi_lens_init_pinhole(&lens, WIDTH, HEIGHT, 1.2);
    assert_int_equal(sim_place_open("room", &scene, NULL), LUMI_OK);
    assert_int_equal(sim_camera_render(scene, &lens, &pose, 0, &room, NULL, NULL), LUMI_OK);
    sim_scene_destroy(scene);
    return 0;
}

static int forget(void **state)
{
    (void)state;
    lumi_raster_finish(&room);
    return 0;
}

/* What a sensor behind a colour filter gives: red and blue weaker than green, and some black. */
struct sensor {
    enum lumi_bayer bayer;
    int bits, padding; /* bytes at the end of every row */
    double black, red, blue;
};

static const int colours[4][4] = {{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}};

static void expose(const struct sensor *sensor, struct lumi_camera_frame *frame)
{
    int bytes = sensor->bits > 8 ? 2 : 1, stride = WIDTH * bytes + sensor->padding;
    double white = ldexp(1, sensor->bits) - 1, weight[3] = {sensor->red, 1, sensor->blue};
    uint8_t *data = lumi_calloc((size_t)stride * HEIGHT, 1);

    memset(data, 0x5a, (size_t)stride * HEIGHT);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            int colour = colours[sensor->bayer][y % 2 * 2 + x % 2];
            double light = (double)lumi_row_f32(&room, y)[3 * x + colour] * weight[colour];
            unsigned value = (unsigned)(sensor->black + (white - sensor->black) * fmin(light, 1) + 0.5);
            data[y * stride + x * bytes] = (uint8_t)value;
            if (bytes == 2)
                data[y * stride + x * bytes + 1] = (uint8_t)(value >> 8);
        }
    *frame =
        (struct lumi_camera_frame){.format = {LUMI_LAYOUT_BAYER, sensor->bayer, WIDTH, HEIGHT, sensor->bits, stride},
                                   .data = data,
                                   .size = (size_t)stride * HEIGHT,
                                   .exposure_s = 1.0 / 250,
                                   .gain = 2};
}

static void drop(struct lumi_camera_frame *frame)
{
    lumi_free((void *)(uintptr_t)frame->data);
}

/* The file's bytes, one after another. */
static uint8_t *join(const struct lumi_frame_file *file)
{
    uint8_t *all = lumi_alloc(file->bytes, 1), *at = all;

    for (int i = 0; i < file->count; i++) {
        memcpy(at, file->pieces[i].iov_base, file->pieces[i].iov_len);
        at += file->pieces[i].iov_len;
    }
    assert_int_equal(at - all, file->bytes);
    return all;
}

static void read_back(const struct lumi_frame_file *file, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    struct lumi_error error = {0};
    uint8_t *all = join(file);
    struct lumi_image_meta own;

    if (lumi_image_read_memory(all, file->bytes, "file", 0, raster, &own, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    if (meta)
        *meta = own;
    lumi_image_meta_finish(&own);
    lumi_free(all);
}

/* Of linear light, encoded as it will be seen. */
static double psnr(const struct lumi_raster *a, const struct lumi_raster *b, int border)
{
    double sum = 0;
    int count = 0;

    for (int y = border; y < HEIGHT - border; y++)
        for (int x = 3 * border; x < 3 * (WIDTH - border); x++, count++) {
            double d = (double)lumi_srgb_encode(fminf(lumi_row_f32(a, y)[x], 1)) -
                       (double)lumi_srgb_encode(fminf(lumi_row_f32(b, y)[x], 1));
            sum += d * d;
        }
    return -10 * log10(sum / count);
}

static bool told_by_frame; /* black level and white balance: by the frame, not by what is known besides */

static double developed(const struct sensor *sensor, struct lumi_image_meta *meta)
{
    struct lumi_camera_frame frame;
    struct lumi_frame_about about;
    struct lumi_frame_file file;
    struct lumi_raster back;
    struct lumi_error error = {0};

    expose(sensor, &frame);
    lumi_frame_about_init(&about, NULL);
    about.make = "Example";
    about.model = "Example 5M";
    about.serial = "20-117";
    *(told_by_frame ? &frame.black : &about.black) = sensor->black;
    (told_by_frame ? frame.white : about.white)[0] = 1 / sensor->red;
    (told_by_frame ? frame.white : about.white)[1] = 1 / sensor->blue;
    about.unix_us = 1795428318250000;
    if (lumi_frame_file_make(&frame, &about, &file, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_string_equal(file.extension, ".dng");
    assert_ptr_equal(file.pieces[1].iov_base, frame.data); /* nothing was copied */
    assert_int_equal(file.pieces[0].iov_len % 4096, 0);
    read_back(&file, &back, meta);
    assert_int_equal(back.width, WIDTH);
    assert_int_equal(back.height, HEIGHT);
    assert_int_equal(back.channels, 3);
    assert_int_equal(back.sample, LUMI_F32);
    double found = psnr(&room, &back, 4);
    if (getenv("LUMI_SHOW")) {
        char name[256];
        snprintf(name, sizeof name, "%s-%d-%d.png", getenv("LUMI_SHOW"), sensor->bits, sensor->bayer);
        lumi_image_write(name, &back, NULL, NULL);
    }
    lumi_raster_finish(&back);
    lumi_frame_file_finish(&file);
    drop(&frame);
    return found;
}

static void a_bayer_frame_kept_as_dng_is_developed_to_what_the_camera_saw(void **state)
{
    static const struct {
        int bits;
        double least;
    } depths[] = {{8, 35.5}, {10, 36}, {12, 36}, {16, 36}};

    (void)state;
    for (int bayer = 0; bayer < 4; bayer++)
        for (size_t i = 0; i < 4; i++) {
            struct sensor sensor = {(enum lumi_bayer)bayer, depths[i].bits, 0, ldexp(1, depths[i].bits - 5), 0.6, 0.75};
            double found = developed(&sensor, NULL);
            if (found < depths[i].least)
                fail_msg("filter %d, %d bits: %.2f dB", bayer, depths[i].bits, found);
        }
}

static void black_level_and_white_balance_are_the_frames_own_where_nobody_says_otherwise(void **state)
{
    const struct sensor sensor = {LUMI_BAYER_BGGR, 12, 0, 128, 0.6, 0.75};

    (void)state;
    double told = developed(&sensor, NULL);
    told_by_frame = true;
    double own = developed(&sensor, NULL);
    told_by_frame = false;
    assert_true(told > 36 && fabs(own - told) < 1e-6);
}

static void mean_of(const char *path, const struct lumi_image_development *development, double mean[3],
                    struct lumi_image_meta *meta)
{
    struct lumi_error error = {0};
    struct lumi_raster raster;

    memset(mean, 0, 3 * sizeof *mean);
    if (lumi_image_read_developed(path, 3, development, &raster, meta, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < 3 * WIDTH; x++)
            mean[x % 3] += (double)lumi_row_f32(&raster, y)[x] / (WIDTH * HEIGHT);
    lumi_raster_finish(&raster);
}

/* Of a grey card before a sensor whose red sees 0.6 of it, and blue 0.75. */
static void a_raw_file_is_developed_with_the_white_balance_that_is_asked_for(void **state)
{
    const struct sensor sensor = {LUMI_BAYER_RGGB, 12, 0, 0, 0.6, 0.75};
    struct lumi_image_development development = {{1, 1, 1}, false};
    const char path[] = "test_frame_file_white.dng";
    struct lumi_camera_frame frame;
    struct lumi_frame_about about;
    struct lumi_frame_file file;
    struct lumi_image_meta meta;
    struct lumi_error error = {0};
    double mean[3], plain[3];

    (void)state;
    expose(&sensor, &frame);
    uint16_t *samples = (uint16_t *)(uintptr_t)frame.data;
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        samples[i] = (uint16_t)(1000 * (i / WIDTH % 2 == 0 && i % 2 == 0 ? 0.6 : i / WIDTH % 2 && i % 2 ? 0.75 : 1));
    lumi_frame_about_init(&about, NULL);
    about.white[0] = 1 / 0.6;
    about.white[1] = 1 / 0.75;
    assert_int_equal(lumi_frame_file_make(&frame, &about, &file, &error), LUMI_OK);
    uint8_t *all = join(&file);
    assert_int_equal(lumi_file_write(path, all, file.bytes, false, &error), LUMI_OK);
    lumi_free(all);

    mean_of(path, NULL, mean, &meta);
    assert_true(fabs(meta.white[0] - 1 / 0.6) < 1e-3 && meta.white[1] == 1 && fabs(meta.white[2] - 1 / 0.75) < 1e-3);
    assert_true(fabs(mean[0] / mean[1] - 1) < 0.01 && fabs(mean[2] / mean[1] - 1) < 0.01);
    lumi_image_meta_finish(&meta);
    mean_of(path, &development, plain, NULL);
    assert_true(fabs(plain[0] / plain[1] - 0.6) < 0.01 && fabs(plain[2] / plain[1] - 0.75) < 0.01);
    development.white[0] = 2 / 0.6;
    development.white[1] = 2;
    development.white[2] = 2 / 0.75;
    mean_of(path, &development, plain, NULL);
    assert_true(fabs(plain[0] / mean[0] - 1) < 0.01 && fabs(plain[2] / plain[1] - 1) < 0.01);
    development.automatic = true;
    mean_of(path, &development, mean, &meta);
    assert_true(fabs(mean[0] / mean[1] - 1) < 0.03 && fabs(mean[2] / mean[1] - 1) < 0.03);
    assert_true(fabs(meta.white[0] - 1 / 0.6) < 0.05 && fabs(meta.white[2] - 1 / 0.75) < 0.05);
    lumi_image_meta_finish(&meta);
    remove(path);
    lumi_frame_file_finish(&file);
    drop(&frame);
}

static void padding_of_rows_is_left_out(void **state)
{
    (void)state;
    const struct sensor plain = {LUMI_BAYER_GRBG, 12, 0, 128, 0.6, 0.75},
                        padded = {LUMI_BAYER_GRBG, 12, 64, 128, 0.6, 0.75};

    assert_true(fabs(developed(&plain, NULL) - developed(&padded, NULL)) < 1e-6);
}

static void a_raw_file_tells_exposure_time_camera_and_serial_number(void **state)
{
    struct lumi_image_meta meta;
    const struct sensor sensor = {LUMI_BAYER_RGGB, 12, 0, 0, 1, 1};

    (void)state;
    developed(&sensor, &meta);
    assert_int_equal(meta.info.format, LUMI_IMAGE_RAW);
    assert_true(fabs(meta.exposure_s - 1.0 / 250) < 1e-9);
    assert_true(fabs(meta.iso - 200) < 1e-9);
    assert_int_equal(meta.taken_us, 1795428318250000);
    assert_string_equal(meta.serial, "20-117");
    assert_string_equal(meta.model, "Example 5M");
}

static void brightness_does_not_depend_on_what_else_is_in_the_picture(void **state)
{
    struct lumi_camera_frame frame;
    struct lumi_frame_file file;
    struct lumi_raster back[2];
    const struct sensor sensor = {LUMI_BAYER_RGGB, 12, 0, 0, 1, 1};

    (void)state;
    for (int i = 0; i < 2; i++) {
        expose(&sensor, &frame);
        uint8_t *data = (uint8_t *)(uintptr_t)frame.data;
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) { /* a grey card on the left; the rest black, or white */
                unsigned value = x < WIDTH / 2 ? 1000 : i ? 4095 : 0;
                data[y * frame.format.stride + 2 * x] = (uint8_t)value;
                data[y * frame.format.stride + 2 * x + 1] = (uint8_t)(value >> 8);
            }
        assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
        read_back(&file, &back[i], NULL);
        lumi_frame_file_finish(&file);
        drop(&frame);
    }
    for (int c = 0; c < 3; c++) {
        float a = lumi_row_f32(&back[0], 100)[3 * 50 + c], b = lumi_row_f32(&back[1], 100)[3 * 50 + c];
        assert_true(fabs((double)(a - 1000.0f / 4095)) < 0.002);
        assert_true(fabs((double)(a - b)) < 1e-6);
    }
    lumi_raster_finish(&back[0]);
    lumi_raster_finish(&back[1]);
}

static void a_grey_sensor_gives_one_linear_channel(void **state)
{
    uint8_t data[100 * 60];
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 100, 60, 8, 100}, .data = data, .size = sizeof data};
    struct lumi_frame_file file;
    struct lumi_raster back;

    (void)state;
    for (int i = 0; i < 6000; i++)
        data[i] = (uint8_t)(i % 100 * 2 + i / 100 % 2);
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    assert_string_equal(file.extension, ".dng");
    read_back(&file, &back, NULL);
    assert_int_equal(back.channels, 1);
    for (int i = 0; i < 6000; i++)
        assert_true(fabs((double)lumi_row_f32(&back, i / 100)[i % 100] - data[i] / 255.0) < 1e-4);
    lumi_raster_finish(&back);
    lumi_frame_file_finish(&file);
}

static void rgb_with_padded_rows_comes_back_exactly(void **state)
{
    uint8_t data[40 * (3 * 70 + 10)];
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_RGB, LUMI_BAYER_RGGB, 70, 40, 8, 220}, .data = data, .size = sizeof data - 10};
    struct lumi_frame_file file;
    struct lumi_raster back;

    (void)state;
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (uint8_t)(i * 7 + i / 220);
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    assert_string_equal(file.extension, ".tif");
    read_back(&file, &back, NULL);
    assert_int_equal(back.sample, LUMI_U8);
    for (int y = 0; y < 40; y++)
        assert_memory_equal(lumi_row_u8(&back, y), data + y * 220, 210);
    lumi_raster_finish(&back);
    lumi_frame_file_finish(&file);
}

/* ITU-R BT.601 or BT.709, narrow or full range, as the frame's format says. */
static void expect_colour(const struct lumi_frame_format *format, const uint8_t *rgb, double y, double u, double v)
{
    const double red = format->bt709 ? 0.2126 : 0.299, blue = format->bt709 ? 0.0722 : 0.114;
    const double green = 1 - red - blue;
    double luma = format->full_range ? y / 255 : (y - 16) / 219, colour = format->full_range ? 255 : 224;
    double b = (u - 128) / colour, r = (v - 128) / colour;
    const double want[3] = {luma + 2 * (1 - red) * r,
                            luma - 2 * (1 - blue) * blue / green * b - 2 * (1 - red) * red / green * r,
                            luma + 2 * (1 - blue) * b};

    for (int c = 0; c < 3; c++) {
        double clamped = fmin(fmax(255 * want[c], 0), 255);
        if (fabs(rgb[c] - clamped) > 3) /* libtiff spreads the colour differences over 254 steps, not 255 */
            fail_msg("channel %d is %d, %.1f wanted (Y %g U %g V %g, %s, %s range)", c, rgb[c], clamped, y, u, v,
                     format->bt709 ? "BT.709" : "BT.601", format->full_range ? "full" : "narrow");
    }
}

static void keep_yuyv(bool bt709, bool full_range)
{
    uint8_t data[30 * 160];
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_YUYV, LUMI_BAYER_RGGB, 64, 30, 8, 160}, .data = data, .size = sizeof data};
    struct lumi_frame_file file;
    struct lumi_raster back;

    frame.format.bt709 = bt709;
    frame.format.full_range = full_range;
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (uint8_t)(i % 2 ? 98 + 60 * (i / 2 % 2) : 60 + i % 160);
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    const uint8_t *kept = file.pieces[1].iov_base;
    assert_int_equal(file.pieces[1].iov_len, 64 * 30 * 2);
    for (int i = 0; i < 32; i++) {
        assert_int_equal(kept[4 * i], data[4 * i]);
        assert_int_equal(kept[4 * i + 1], data[4 * i + 2]);
        assert_int_equal(kept[4 * i + 2], data[4 * i + 1]);
        assert_int_equal(kept[4 * i + 3], data[4 * i + 3]);
    }
    read_back(&file, &back, NULL);
    for (int y = 0; y < 30; y++)
        for (int x = 0; x < 64; x++)
            expect_colour(&frame.format, lumi_row_u8(&back, y) + 3 * x, data[160 * y + 2 * x],
                          data[160 * y + 4 * (x / 2) + 1], data[160 * y + 4 * (x / 2) + 3]);
    lumi_raster_finish(&back);
    lumi_frame_file_finish(&file);
}

static void keep_nv12(bool bt709, bool full_range)
{
    uint8_t data[80 * 45];
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_NV12, LUMI_BAYER_RGGB, 64, 30, 8, 80}, .data = data, .size = sizeof data};
    struct lumi_frame_file file;
    struct lumi_raster back;

    frame.format.bt709 = bt709;
    frame.format.full_range = full_range;
    for (int i = 0; i < 80 * 45; i++)
        data[i] = (uint8_t)(i < 80 * 30 ? 40 + i % 80 + i / 80 * 3 : 128 + (i % 80) - 30);
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    assert_int_equal(file.pieces[1].iov_len, 64 * 30 * 3 / 2);
    read_back(&file, &back, NULL);
    for (int y = 0; y < 30; y++)
        for (int x = 0; x < 64; x++) {
            const uint8_t *colour = data + 80 * 30 + 80 * (y / 2) + x / 2 * 2;
            expect_colour(&frame.format, lumi_row_u8(&back, y) + 3 * x, data[80 * y + x], colour[0], colour[1]);
        }
    lumi_raster_finish(&back);
    lumi_frame_file_finish(&file);
}

static void yuyv_keeps_its_numbers_and_is_read_as_colour_of_its_matrix_and_range(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++)
        keep_yuyv(i & 1, i & 2);
}

static void nv12_keeps_its_numbers_and_is_read_as_colour_of_its_matrix_and_range(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++)
        keep_nv12(i & 1, i & 2);
}

static void jpeg_stays_the_bytes_the_camera_sent(void **state)
{
    const uint8_t jpeg[] = {0xff, 0xd8, 0xff, 0xe0, 1, 2, 3};
    struct lumi_camera_frame frame = {
        .format = {.layout = LUMI_LAYOUT_JPEG, .width = 8, .height = 8}, .data = jpeg, .size = sizeof jpeg};
    struct lumi_frame_file file;

    (void)state;
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    assert_int_equal(file.count, 1);
    assert_ptr_equal(file.pieces[0].iov_base, jpeg);
    assert_int_equal(file.bytes, sizeof jpeg);
    assert_string_equal(file.extension, ".jpg");
    lumi_frame_file_finish(&file);
}

static void a_cameras_own_file_keeps_its_kind(void **state)
{
    struct lumi_camera_frame frame = {.format = {.layout = LUMI_LAYOUT_FILE}, .path = "/card/DCIM/DSC0001.ARW"};
    struct lumi_frame_file file;

    (void)state;
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_OK);
    assert_int_equal(file.count, 0);
    assert_string_equal(file.path, frame.path);
    assert_string_equal(file.extension, ".arw");
    frame.path = "/card/DCIM.X/DSC0001";
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, NULL), LUMI_ERR_FORMAT);
}

static void a_frame_that_lacks_bytes_becomes_no_file(void **state)
{
    const struct sensor sensor = {LUMI_BAYER_RGGB, 12, 0, 0, 1, 1};
    struct lumi_camera_frame frame;
    struct lumi_frame_file file;
    struct lumi_error error;

    (void)state;
    expose(&sensor, &frame);
    frame.size -= 1;
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, &error), LUMI_ERR_FORMAT);
    frame.size += 1;
    frame.format.stride = WIDTH;
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, &error), LUMI_ERR_ARG);
    frame.format.layout = LUMI_LAYOUT_NONE;
    assert_int_equal(lumi_frame_file_make(&frame, NULL, &file, &error), LUMI_ERR_UNSUPPORTED);
    drop(&frame);
}

static void every_lack_of_memory_is_told(void **state)
{
    const struct sensor sensor = {LUMI_BAYER_RGGB, 12, 0, 0, 1, 1};
    struct lumi_camera_frame frame;
    struct lumi_frame_file file;
    int code = LUMI_ERR_NOMEM;

    (void)state;
    expose(&sensor, &frame);
    for (int i = 0; i < 100 && code == LUMI_ERR_NOMEM; i++) {
        lumi_alloc_fail_after(i);
        code = lumi_frame_file_make(&frame, NULL, &file, NULL);
        lumi_alloc_fail_after(-1);
        lumi_frame_file_finish(&file);
    }
    assert_int_equal(code, LUMI_OK);
    drop(&frame);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bayer_frame_kept_as_dng_is_developed_to_what_the_camera_saw),
        cmocka_unit_test(black_level_and_white_balance_are_the_frames_own_where_nobody_says_otherwise),
        cmocka_unit_test(a_raw_file_is_developed_with_the_white_balance_that_is_asked_for),
        cmocka_unit_test(padding_of_rows_is_left_out),
        cmocka_unit_test(a_raw_file_tells_exposure_time_camera_and_serial_number),
        cmocka_unit_test(brightness_does_not_depend_on_what_else_is_in_the_picture),
        cmocka_unit_test(a_grey_sensor_gives_one_linear_channel),
        cmocka_unit_test(rgb_with_padded_rows_comes_back_exactly),
        cmocka_unit_test(yuyv_keeps_its_numbers_and_is_read_as_colour_of_its_matrix_and_range),
        cmocka_unit_test(nv12_keeps_its_numbers_and_is_read_as_colour_of_its_matrix_and_range),
        cmocka_unit_test(jpeg_stays_the_bytes_the_camera_sent),
        cmocka_unit_test(a_cameras_own_file_keeps_its_kind),
        cmocka_unit_test(a_frame_that_lacks_bytes_becomes_no_file),
        cmocka_unit_test(every_lack_of_memory_is_told),
    };
    return cmocka_run_group_tests(tests, render, forget);
}
