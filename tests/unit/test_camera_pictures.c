/* daemon/preview: the cameras' pictures: what they show, what their figures say, whose turn it is and what is shed. */
#include "daemon/preview/pictures_priv.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "tests/unit/preview_frame.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <unistd.h>

#define SECOND 1000000000LL

static atomic_int out;

static struct lumi_pictures *make(int cameras)
{
    struct lumi_pictures_options options;
    struct lumi_pictures *pictures;
    struct lumi_error error;

    lumi_pictures_options_init(&options);
    options.cameras = cameras;
    options.synchronous = true;
    for (int c = 0; c < cameras; c++)
        snprintf(options.names[c], sizeof options.names[c], "c%02d", c);
    assert_int_equal(lumi_pictures_create(&options, &pictures, &error), LUMI_OK);
    return pictures;
}

/* The frame is the pictures' alone afterwards. */
static bool offer(struct lumi_pictures *pictures, int64_t now, int camera, int shot, bool spare,
                  struct preview_frame *frame)
{
    const struct lumi_picture_offer offered = {
        .camera = camera, .frame = &frame->frame, .name = "frame", .shot = shot, .unix_us = now / 1000, .spare = spare};
    const bool taken = lumi_pictures_offer(pictures, now, &offered);

    lumi_camera_frame_release(&frame->frame);
    return taken;
}

static struct preview_frame *grey(int width, int height)
{
    return preview_frame_new(LUMI_LAYOUT_GREY, width, height, 8, 0, &out);
}

/* Its picture, made at once, by itself. */
static struct lumi_picture *picture_of(struct preview_frame *frame)
{
    struct lumi_pictures *pictures = make(1);
    struct lumi_picture *picture;

    assert_true(offer(pictures, SECOND, 0, 3, true, frame));
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    lumi_pictures_destroy(pictures);
    assert_non_null(picture);
    assert_int_equal(out, 0);
    return picture;
}

/* The middle pixel of what the picture shows, and that it is as large as it says. */
static void middle(const struct lumi_picture *picture, uint8_t rgb[3])
{
    struct lumi_raster raster;
    struct lumi_error error;

    assert_int_equal(lumi_image_read_memory(picture->jpeg, picture->size, "p", 3, &raster, NULL, &error), LUMI_OK);
    assert_int_equal(raster.width, picture->small_width);
    assert_int_equal(raster.height, picture->small_height);
    memcpy(rgb, lumi_row_u8(&raster, raster.height / 2) + (ptrdiff_t)3 * (raster.width / 2), 3);
    lumi_raster_finish(&raster);
}

static void assert_shows(const struct lumi_picture *picture, int red, int green, int blue)
{
    const int wanted[3] = {red, green, blue};
    uint8_t rgb[3];

    middle(picture, rgb);
    for (int i = 0; i < 3; i++)
        if (abs(rgb[i] - wanted[i]) > 4)
            fail_msg("it shows %d %d %d, not %d %d %d", rgb[0], rgb[1], rgb[2], red, green, blue);
}

/* ---- what is shown ---- */

static unsigned sensor(int srgb, int bits)
{
    return (unsigned)((double)lumi_srgb_decode((float)srgb / 255) * ((1 << bits) - 1) + 0.5);
}

static void raw_of_every_filter_and_depth_shows_its_colour(void **state)
{
    static const char *const filters[] = {"RGGB", "GRBG", "GBRG", "BGGR"};
    static const int depths[] = {8, 10, 12, 16};

    (void)state;
    for (int f = 0; f < 4; f++)
        for (int d = 0; d < 4; d++) {
            struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_BAYER, 1302, 130, depths[d], 0, &out);
            frame->frame.format.bayer = (enum lumi_bayer)f;
            for (int y = 0; y < 130; y++)
                for (int x = 0; x < 1302; x++) {
                    const char filter = filters[f][y % 2 * 2 + x % 2];
                    preview_put(frame, x, y, sensor(filter == 'R' ? 200 : filter == 'G' ? 120 : 60, depths[d]));
                }
            struct lumi_picture *picture = picture_of(frame);
            assert_shows(picture, 200, 120, 60);
            assert_int_equal(picture->width, 1302);
            assert_int_equal(picture->small_width, 325); /* 651 cells are too many, so they are taken in twos */
            assert_int_equal(picture->small_height, 32);
            lumi_picture_release(picture);
        }
}

static void black_level_and_white_balance_are_taken_into_account(void **state)
{
    struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_BAYER, 64, 64, 12, 0, &out);
    struct lumi_picture *picture;

    (void)state;
    frame->frame.black = 256;
    frame->frame.white[0] = 2;
    frame->frame.white[1] = 4;
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            preview_put(frame, x, y, 256 + (4095 - 256) / (y % 2 == 0 && x % 2 == 0 ? 8 : x % 2 && y % 2 ? 16 : 4));
    picture = picture_of(frame);
    assert_shows(picture, 137, 137, 137); /* a quarter of full light */
    lumi_picture_release(picture);
}

static void rgb_and_yuv_show_their_colour(void **state)
{
    struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_RGB, 700, 60, 8, 0, &out);
    struct lumi_picture *picture;

    (void)state;
    for (int y = 0; y < 60; y++)
        for (int x = 0; x < 2100; x++)
            preview_put(frame, x, y, x % 3 == 0 ? 10 : x % 3 == 1 ? 90 : 170);
    picture = picture_of(frame);
    assert_shows(picture, 10, 90, 170);
    assert_int_equal(picture->small_width, 350);
    lumi_picture_release(picture);
    /* Pure red of BT.601: Y 81, U 90, V 240. */
    frame = preview_frame_new(LUMI_LAYOUT_YUYV, 64, 32, 8, 0, &out);
    for (int y = 0; y < 32; y++)
        for (int x = 0; x < 128; x++)
            preview_put(frame, x, y, x % 2 == 0 ? 81 : x % 4 == 1 ? 90 : 240);
    picture = picture_of(frame);
    assert_shows(picture, 255, 0, 0);
    lumi_picture_release(picture);
    frame = preview_frame_new(LUMI_LAYOUT_NV12, 64, 32, 8, 0, &out);
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 64; x++)
            preview_put(frame, x, y, y < 32 ? 81 : x % 2 ? 240 : 90);
    picture = picture_of(frame);
    assert_shows(picture, 255, 0, 0);
    lumi_picture_release(picture);
    /* And of BT.709 in full range: Y 54, U 99, V 255. */
    frame = preview_frame_new(LUMI_LAYOUT_NV12, 64, 32, 8, 0, &out);
    frame->frame.format.bt709 = frame->frame.format.full_range = true;
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 64; x++)
            preview_put(frame, x, y, y < 32 ? 54 : x % 2 ? 255 : 99);
    picture = picture_of(frame);
    assert_shows(picture, 254, 0, 0);
    lumi_picture_release(picture);
}

/* As many rows as an image's width allows. */
static void jpeg_of(int width, int height, uint8_t **data, size_t *size)
{
    struct lumi_image_options options;
    struct lumi_raster raster;
    struct lumi_error error;

    assert_int_equal(lumi_raster_create(&raster, width, height, 3, LUMI_U8), LUMI_OK);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            memcpy(lumi_row_u8(&raster, y) + (ptrdiff_t)3 * x, (uint8_t[]){40, 160, 220}, 3);
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    assert_int_equal(lumi_image_encode(&raster, &options, data, size, &error), LUMI_OK);
    lumi_raster_finish(&raster);
}

static void jpeg_of_any_width_becomes_a_small_one(void **state)
{
    static const struct {
        int width, small;
    } sizes[] = {{320, 320}, {640, 640}, {641, 561}, {1280, 640}, {1600, 600}, {5120, 640}, {5472, 342}};

    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        uint8_t *data;
        size_t size;
        jpeg_of(sizes[i].width, 80, &data, &size);
        struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_JPEG, 0, 0, 8, size, &out);
        memcpy(frame->bytes, data, size);
        lumi_free(data);
        struct lumi_picture *picture = picture_of(frame);
        assert_int_equal(picture->width, sizes[i].width); /* as the file says */
        assert_int_equal(picture->height, 80);
        assert_int_equal(picture->small_width, sizes[i].small);
        assert_shows(picture, 40, 160, 220);
        lumi_picture_release(picture);
    }
}

static void a_file_may_be_taken_away_once_its_frame_was_copied(void **state)
{
    char path[] = "/tmp/lumi-pictures-XXXXXX";
    struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_FILE, 0, 0, 0, 1, &out);
    struct lumi_pictures *pictures = make(1);
    struct lumi_picture *picture;
    int fd = mkstemp(path);
    uint8_t *data;
    size_t size;

    (void)state;
    jpeg_of(800, 80, &data, &size);
    assert_int_equal(write(fd, data, size), (ssize_t)size);
    close(fd);
    lumi_free(data);
    frame->frame.path = path;
    assert_true(offer(pictures, SECOND, 0, 3, true, frame));
    lumi_pictures_work(pictures, false);
    assert_int_equal(out, 0);
    unlink(path);
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    assert_non_null(picture);
    assert_int_equal(picture->small_width, 600);
    lumi_picture_release(picture);
    lumi_pictures_destroy(pictures);
}

/* ---- figures ---- */

static void figures_are_those_of_the_frame(void **state)
{
    struct preview_frame *frame = grey(512, 64);
    struct lumi_picture *picture;
    uint64_t all = 0;

    (void)state;
    /* A quarter black, a quarter white, half of it at a luma of 100. */
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 512; x++)
            preview_put(frame, x, y, x < 128 ? 0 : x < 256 ? 255 : sensor(100, 8));
    picture = picture_of(frame);
    assert_float_equal(picture->clipped_low, 0.25, 1e-9);
    assert_float_equal(picture->clipped_high, 0.25, 1e-9);
    for (int i = 0; i < LUMI_PICTURE_BINS; i++)
        all += picture->histogram[i];
    assert_int_equal(all, 512 * 64);
    assert_int_equal(picture->histogram[0], 128 * 64);
    assert_int_equal(picture->histogram[63], 128 * 64);
    assert_int_equal(picture->histogram[24] + picture->histogram[25], 256 * 64);
    assert_float_equal(picture->mean, (0.25 * 255 + 0.5 * 100) / 255, 0.005);
    assert_int_equal(picture->shot, 3);
    assert_string_equal(picture->frame, "frame");
    assert_int_equal(picture->unix_us, SECOND / 1000);
    lumi_picture_release(picture);
}

/* A single white sample, as a lamp's glint is: a mean would hide it. */
static void one_clipped_sample_of_a_raw_frame_counts(void **state)
{
    struct preview_frame *frame = grey(1280, 1000);
    struct lumi_picture *picture;

    (void)state;
    memset(frame->bytes, 90, frame->frame.size);
    preview_put(frame, 77, 501, 255);
    picture = picture_of(frame);
    assert_float_equal(picture->clipped_high, 1.0 / (1280 * 1000), 1e-12);
    assert_float_equal(picture->clipped_low, 0, 0);
    lumi_picture_release(picture);
}

static void what_the_judge_says_is_known_whenever_it_comes(void **state)
{
    struct lumi_pictures *pictures = make(1);
    struct lumi_picture *picture;

    (void)state;
    lumi_pictures_sharpness(pictures, 0, 7, 0.5); /* before */
    assert_true(offer(pictures, SECOND, 0, 7, true, grey(64, 64)));
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    assert_float_equal(lumi_pictures_sharpness_of(pictures, picture), 0.5, 0);
    lumi_picture_release(picture);
    assert_true(offer(pictures, 3 * SECOND, 0, 8, true, grey(64, 64)));
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    assert_true(isnan(lumi_pictures_sharpness_of(pictures, picture)));
    lumi_pictures_sharpness(pictures, 0, 8, 0.25); /* after */
    assert_float_equal(lumi_pictures_sharpness_of(pictures, picture), 0.25, 0);
    lumi_pictures_sharpness(pictures, 0, 8, 0.75); /* a retake's */
    assert_float_equal(lumi_pictures_sharpness_of(pictures, picture), 0.75, 0);
    lumi_picture_release(picture);
    lumi_pictures_destroy(pictures);
}

/* ---- whose turn it is ---- */

static void every_camera_has_its_turn_once_a_second_and_twice_if_it_is_watched(void **state)
{
    struct lumi_pictures *pictures = make(2);
    int taken[2] = {0};

    (void)state;
    lumi_pictures_watch(pictures, 1, true);
    for (int i = 0; i < 100; i++)
        for (int c = 0; c < 2; c++) { /* 20 frames a second */
            taken[c] += offer(pictures, SECOND + i * SECOND / 20, c, i, true, grey(64, 64));
            lumi_pictures_work(pictures, true);
        }
    assert_int_equal(taken[0], 5);
    assert_int_equal(taken[1], 10);
    assert_int_equal(lumi_pictures_watchers(pictures, 1), 1);
    lumi_pictures_watch(pictures, 1, false);
    assert_int_equal(lumi_pictures_watchers(pictures, 1), 0);
    lumi_pictures_destroy(pictures);
    assert_int_equal(out, 0);
}

static void where_there_is_nothing_to_spare_nothing_is_taken(void **state)
{
    struct lumi_pictures *pictures = make(1);
    struct lumi_pictures_figures figures;

    (void)state;
    for (int i = 0; i < 10; i++)
        assert_false(offer(pictures, SECOND + i * SECOND, 0, i, false, grey(64, 64)));
    assert_int_equal(out, 0);
    lumi_pictures_work(pictures, true);
    assert_null(lumi_pictures_last(pictures, 0));
    lumi_pictures_figures(pictures, &figures);
    assert_int_equal(figures.offered, 10);
    assert_int_equal(figures.shed, 10);
    assert_int_equal(figures.taken, 0);
    /* And as soon as there is, the next. */
    assert_true(offer(pictures, 11 * SECOND, 0, 10, true, grey(64, 64)));
    lumi_pictures_destroy(pictures);
    assert_int_equal(out, 0);
}

static void of_frames_that_wait_to_be_copied_the_newest_stays(void **state)
{
    struct lumi_pictures *pictures = make(1);
    struct lumi_picture *picture;

    (void)state;
    for (int i = 0; i < 5; i++) {
        assert_true(offer(pictures, SECOND + i * SECOND, 0, i, true, grey(64, 64)));
        assert_int_equal(out, 1); /* never more than one is held */
    }
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    assert_int_equal(picture->shot, 4);
    assert_int_equal(picture->number, 1);
    lumi_picture_release(picture);
    lumi_pictures_destroy(pictures);
}

/* The processor is busy: copies are not begun, so frames are left alone, but for one every two seconds. */
static void copies_that_nobody_makes_pictures_of_are_not_piled_up(void **state)
{
    struct lumi_pictures *pictures = make(1);
    struct lumi_picture *picture;
    int taken = 0;

    (void)state;
    for (int i = 0; i < 20; i++) {
        taken += offer(pictures, SECOND + i * SECOND, 0, i, true, grey(64, 64));
        lumi_pictures_work(pictures, false);
        assert_int_equal(out, 0);
    }
    assert_int_equal(taken, 10);
    lumi_pictures_work(pictures, true);
    picture = lumi_pictures_last(pictures, 0);
    assert_int_equal(picture->shot, 18);
    lumi_picture_release(picture);
    lumi_pictures_destroy(pictures);
}

static void a_frame_that_is_no_picture_is_counted_and_the_last_one_stays(void **state)
{
    struct lumi_pictures *pictures = make(1);
    struct preview_frame *frame;
    struct lumi_pictures_figures figures;
    struct lumi_picture *picture;

    (void)state;
    assert_true(offer(pictures, SECOND, 0, 1, true, grey(64, 64)));
    lumi_pictures_work(pictures, true);
    frame = grey(64, 64);
    frame->frame.damaged = true;
    assert_false(offer(pictures, 3 * SECOND, 0, 2, true, frame));
    frame = grey(64, 64);
    frame->frame.size = 100; /* too few bytes */
    assert_true(offer(pictures, 5 * SECOND, 0, 3, true, frame));
    lumi_pictures_work(pictures, true);
    frame = preview_frame_new(LUMI_LAYOUT_JPEG, 64, 64, 8, 1000, &out); /* zeros */
    assert_true(offer(pictures, 7 * SECOND, 0, 4, true, frame));
    lumi_pictures_work(pictures, true);
    lumi_pictures_figures(pictures, &figures);
    assert_int_equal(figures.failed, 2);
    assert_int_equal(figures.made, 1);
    picture = lumi_pictures_last(pictures, 0);
    assert_int_equal(picture->shot, 1);
    lumi_picture_release(picture);
    lumi_pictures_destroy(pictures);
    assert_int_equal(out, 0);
}

/* ---- threads ---- */

static void on_made(void *context, int camera)
{
    (void)camera;
    sem_post(context);
}

static void *look_at_them(void *context)
{
    struct lumi_pictures *pictures = context;

    for (int i = 0; i < 2000; i++) {
        struct lumi_picture *picture = lumi_pictures_last(pictures, i % 4);
        if (picture)
            (void)lumi_pictures_sharpness_of(pictures, picture);
        lumi_picture_release(picture);
    }
    return NULL;
}

static void with_threads_every_camera_gets_its_pictures(void **state)
{
    struct lumi_pictures_options options;
    struct lumi_pictures *pictures;
    struct lumi_error error;
    pthread_t reader;
    sem_t made;

    (void)state;
    lumi_pictures_options_init(&options);
    options.cameras = 4;
    sem_init(&made, 0, 0);
    assert_int_equal(lumi_pictures_create(&options, &pictures, &error), LUMI_OK);
    lumi_pictures_listen(pictures, on_made, &made);
    assert_int_equal(pthread_create(&reader, NULL, look_at_them, pictures), 0);
    for (int i = 0; i < 40; i++) {
        /* Time goes on until it is taken: what is in the way is on its way. */
        for (int64_t at = (i / 4 + 1) * 1000 * SECOND; !offer(pictures, at, i % 4, i, true, grey(200, 100)); at++)
            ;
        lumi_pictures_sharpness(pictures, i % 4, i, 0.5);
        if (i % 4 == 3)
            for (int k = 0; k < 4; k++)
                sem_wait(&made);
    }
    pthread_join(reader, NULL);
    lumi_pictures_listen(pictures, NULL, NULL);
    for (int c = 0; c < 4; c++) {
        struct lumi_picture *picture = lumi_pictures_last(pictures, c);
        assert_non_null(picture);
        lumi_picture_release(picture);
    }
    lumi_pictures_destroy(pictures);
    sem_destroy(&made);
    assert_int_equal(out, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(raw_of_every_filter_and_depth_shows_its_colour),
        cmocka_unit_test(black_level_and_white_balance_are_taken_into_account),
        cmocka_unit_test(rgb_and_yuv_show_their_colour),
        cmocka_unit_test(jpeg_of_any_width_becomes_a_small_one),
        cmocka_unit_test(a_file_may_be_taken_away_once_its_frame_was_copied),
        cmocka_unit_test(figures_are_those_of_the_frame),
        cmocka_unit_test(one_clipped_sample_of_a_raw_frame_counts),
        cmocka_unit_test(what_the_judge_says_is_known_whenever_it_comes),
        cmocka_unit_test(every_camera_has_its_turn_once_a_second_and_twice_if_it_is_watched),
        cmocka_unit_test(where_there_is_nothing_to_spare_nothing_is_taken),
        cmocka_unit_test(of_frames_that_wait_to_be_copied_the_newest_stays),
        cmocka_unit_test(copies_that_nobody_makes_pictures_of_are_not_piled_up),
        cmocka_unit_test(a_frame_that_is_no_picture_is_counted_and_the_last_one_stays),
        cmocka_unit_test(with_threads_every_camera_gets_its_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
