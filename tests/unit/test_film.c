/* Videos are read by their own time stamps, the lamp's code is found in what cameras see of it, and two recordings of
 * one thing are laid over each other. */
#include "firmware/core/lamp.h"
#include "pipeline/exchange/film.h"
#include "pipeline/exchange/film_lamp.h"
#include "pipeline/exchange/film_offset.h"
#include "pipeline/exchange/video.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct lumi_error error;

/* The lamp */

#define RATE 25
#define SECONDS 40
#define MOMENTS (RATE * SECONDS)

static double times[MOMENTS];
static float values[MOMENTS * 2];
static unsigned long long seed;

static double chance(void)
{
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(seed >> 33) / 2147483648.0 - 0.5;
}

/* Two curves: a scene that turns by, and one with the lamp in it that sends `numbers` at `marks`. */
static void make_curves(const double *marks, const int *numbers, int count, double bit, double light, double noise,
                        double jitter)
{
    seed = 11;
    for (int i = 0; i < MOMENTS; i++) {
        times[i] = (i + jitter * chance()) / RATE;
        double scene = 0.4 + 0.2 * sin(times[i] * 1.7) + 0.05 * sin(times[i] * 9) + noise * chance(), lit = 0;
        for (int m = 0; m < count; m++) {
            double half = floor((times[i] - marks[m]) / (bit / 2));
            if (half >= 0 && half < LAMP_HALF_BITS && lamp_code((unsigned)numbers[m]) >> (int)half & 1)
                lit = light;
        }
        values[2 * i] = (float)scene;
        values[2 * i + 1] = (float)(scene * 0.5 + lit);
    }
}

static const struct lumi_lamp_curves curves = {times, values, MOMENTS, 2};

static void the_code_is_the_one_that_the_board_sends(void **state)
{
    (void)state;
    for (unsigned number = 0; number < 4096; number++)
        assert_true(lumi_lamp_code(number) == lamp_code(number));
}

static void turn_marks_are_found_to_half_a_picture(void **state)
{
    const double marks[] = {3.217, 14.031, 24.866};
    const int numbers[] = {5, 6, 7};
    struct lumi_lamp_mark found[4];

    (void)state;
    make_curves(marks, numbers, 3, 0.4, 0.2, 0.02, 0.3);
    assert_int_equal(lumi_lamp_find(&curves, 0.4, 4, 7, found, &error), LUMI_OK);
    assert_true(found[0].score == 0);
    for (int m = 0; m < 3; m++) {
        assert_int_equal(found[m + 1].number, numbers[m]);
        assert_true(fabs(found[m + 1].time - marks[m]) < 0.5 / RATE);
        assert_true(fabs(found[m + 1].light - 0.2) < 0.03);
    }
}

static void no_lamp_is_no_mark(void **state)
{
    struct lumi_lamp_mark found[19];

    (void)state;
    make_curves(NULL, NULL, 0, 0.4, 0, 0.1, 0);
    assert_int_equal(lumi_lamp_find(&curves, 0.4, 0, 18, found, &error), LUMI_OK);
    for (int m = 0; m < 19; m++)
        assert_true(found[m].score == 0);
    assert_int_equal(lumi_lamp_find(&curves, 0, 0, 18, found, &error), LUMI_ERR_ARG);
}

/* Offsets */

static void what_two_cameras_heard_lies_over_each_other(void **state)
{
    static float first[4000], second[3000];
    struct lumi_film_offset offset;

    (void)state;
    seed = 5;
    for (int i = 0; i < 4000; i++)
        first[i] = (float)(chance() > 0.45 ? 1 : 0.1 + 0.02 * chance());
    for (int i = 0; i < 3000; i++)
        second[i] = i + 617 < 4000 ? first[i + 617] * 0.3f + (float)(0.05 * chance()) : 0;
    assert_int_equal(lumi_film_find_offset(first, 4000, second, 3000, 100, &offset, &error), LUMI_OK);
    assert_true(fabs(offset.seconds + 6.17) < 0.005);
    assert_true(offset.correlation > 0.5 && offset.correlation > 2 * offset.next);
    /* Of different things nothing is sure. */
    for (int i = 0; i < 3000; i++)
        second[i] = (float)(chance() > 0.45 ? 1 : 0.1);
    assert_int_equal(lumi_film_find_offset(first, 4000, second, 3000, 100, &offset, &error), LUMI_OK);
    assert_true(offset.correlation < 0.25);
    assert_int_equal(lumi_film_find_offset(first, 0, second, 0, 100, &offset, &error), LUMI_OK);
}

/* Reading */

static char *folder;

static void make_picture(struct lumi_raster *raster, int number)
{
    assert_int_equal(lumi_raster_create(raster, 64, 48, 3, LUMI_U8), LUMI_OK);
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 64; x++) {
            uint8_t *pixel = lumi_row_u8(raster, y) + 3 * x;
            pixel[0] = (uint8_t)(x < 32 ? 200 : 40);
            pixel[1] = (uint8_t)(y < 24 ? 180 : 60);
            pixel[2] = (uint8_t)(50 + 10 * number);
        }
}

static char *write_video(int pictures)
{
    char *path = g_build_filename(folder, "video.webm", NULL);
    struct lumi_video *video;
    struct lumi_raster raster;

    assert_int_equal(lumi_video_create(path, 64, 48, 25, 4, &video, &error), LUMI_OK);
    for (int i = 0; i < pictures; i++) {
        make_picture(&raster, i);
        assert_int_equal(lumi_video_add(video, &raster, &error), LUMI_OK);
        lumi_raster_finish(&raster);
    }
    assert_int_equal(lumi_video_finish(video, &error), LUMI_OK);
    return path;
}

static int worst_difference(const struct lumi_raster *a, const struct lumi_raster *b)
{
    int worst = 0;

    for (int y = 4; y < 44; y++)
        for (int x = 0; x < 64; x++)
            for (int c = 0; x % 32 > 3 && x % 32 < 28 && y % 24 > 3 && y % 24 < 20 && c < 3; c++)
                worst = MAX(worst, abs(lumi_row_u8(a, y)[3 * x + c] - lumi_row_u8(b, y)[3 * x + c]));
    return worst;
}

static void a_video_gives_back_its_pictures_and_times(void **state)
{
    g_autofree char *path = write_video(12);
    struct lumi_film_picture picture;
    struct lumi_raster raster, truth;
    struct lumi_film *film;
    float blocks[4], *sound;
    bool there;
    int count;

    (void)state;
    assert_int_equal(lumi_film_open(path, &film, &error), LUMI_OK);
    assert_int_equal(lumi_film_info(film)->width, 64);
    assert_int_equal(lumi_film_info(film)->height, 48);
    assert_string_equal(lumi_film_info(film)->codec, "vp9");
    assert_false(lumi_film_info(film)->sound);
    for (int i = 0; i < 12; i++) {
        assert_int_equal(lumi_film_next(film, &picture, &there, &error), LUMI_OK);
        assert_true(there && !picture.damaged && fabs(picture.time - i / 25.0) < 1e-3);
        make_picture(&truth, i);
        assert_int_equal(lumi_film_raster(film, &raster, &error), LUMI_OK);
        assert_int_equal(raster.sample, LUMI_U8);
        assert_true(worst_difference(&raster, &truth) <= 6);
        lumi_raster_finish(&raster);
        lumi_raster_finish(&truth);
        assert_int_equal(lumi_film_blocks(film, 2, 2, blocks, &error), LUMI_OK);
        assert_true(blocks[0] > blocks[1] && blocks[1] > blocks[3] && blocks[0] < 0.8f && blocks[3] > 0.1f);
    }
    assert_int_equal(lumi_film_next(film, &picture, &there, &error), LUMI_OK);
    assert_false(there);
    assert_null(lumi_film_damage(film));
    lumi_film_close(film);
    assert_int_equal(lumi_film_open(path, &film, &error), LUMI_OK);
    assert_int_equal(lumi_film_sound(film, 100, &sound, &count, &error), LUMI_OK);
    assert_true(!sound && count == 0);
    lumi_film_close(film);
}

static void what_is_cut_off_is_read_as_far_as_it_goes(void **state)
{
    g_autofree char *path = write_video(100);
    struct lumi_film_picture picture;
    struct lumi_film *film;
    uint8_t *data;
    size_t size;
    bool there = true;
    int count = 0;

    (void)state;
    assert_int_equal(lumi_file_read(path, 1 << 24, &data, &size, &error), LUMI_OK);
    assert_int_equal(lumi_film_open_memory(data, size / 2, "half", &film, &error), LUMI_OK);
    for (; there; count++)
        assert_int_equal(lumi_film_next(film, &picture, &there, &error), LUMI_OK);
    assert_true(count > 2 && count < 100);
    assert_non_null(lumi_film_damage(film));
    lumi_film_close(film);
    assert_int_equal(lumi_film_open_memory(data, 20, "twenty bytes", &film, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "twenty bytes: "));
    assert_null(film);
    lumi_free(data);
}

static void a_list_of_other_files_is_no_video(void **state)
{
    static const char list[] = "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n/etc/passwd\n#EXT-X-ENDLIST\n";
    static const char joined[] = "ffconcat version 1.0\nfile /etc/passwd\n";
    struct lumi_film *film;

    (void)state;
    assert_int_equal(lumi_film_open_memory(list, sizeof list - 1, "list", &film, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_film_open_memory(joined, sizeof joined - 1, "joined", &film, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_film_open("/nowhere.mp4", &film, &error), LUMI_ERR_NOTFOUND);
}

static int set_up(void **state)
{
    (void)state;
    folder = g_dir_make_tmp("lumi-film-XXXXXX", NULL);
    return folder ? 0 : -1;
}

static int tear_down(void **state)
{
    g_autofree char *path = g_build_filename(folder, "video.webm", NULL);

    (void)state;
    g_unlink(path);
    g_rmdir(folder);
    g_free(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_code_is_the_one_that_the_board_sends),
        cmocka_unit_test(turn_marks_are_found_to_half_a_picture),
        cmocka_unit_test(no_lamp_is_no_mark),
        cmocka_unit_test(what_two_cameras_heard_lies_over_each_other),
        cmocka_unit_test(a_video_gives_back_its_pictures_and_times),
        cmocka_unit_test(what_is_cut_off_is_read_as_far_as_it_goes),
        cmocka_unit_test(a_list_of_other_files_is_no_video),
    };

    return cmocka_run_group_tests(tests, set_up, tear_down);
}
