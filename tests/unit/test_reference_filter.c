/* Filtering reference images. */
#include "pipeline/compress/reference_filter.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { WIDTH = 150, HEIGHT = 101, VIEWS = 12, RANGE = 16 }; /* an odd height, and tiles cut by the edges */

/* A picture of waves, seen from aside: moved by (x, y) pixels. `other`: waves that have nothing to do with them. */
static void draw(struct lumi_yuv *image, double x, double y, int other)
{
    assert_int_equal(lumi_yuv_create(image, WIDTH, HEIGHT), LUMI_OK);
    for (int p = 0; p < 3; p++)
        for (int v = 0; v < lumi_yuv_height(image, p); v++)
            for (int u = 0; u < lumi_yuv_width(image, p); u++) {
                double s = (p ? 2 * u + 0.5 : u) - x, t = (p ? 2 * v + 0.5 : v) - y;
                double wave =
                    sin(s / (5.3 + p) + 0.3 * sin(t / 9)) + sin(t / 4.1 - s / 13) + sin((s + t) * (s - t) / 900);
                if (other)
                    wave = sin(s / 3.1 + t / 2.7 + other) + cos(t / (2.9 + other)) + sin(s * t / 170);
                image->plane[p][v * lumi_yuv_width(image, p) + u] = (uint8_t)lrint(128 + 25 * wave);
            }
}

/* Adds noise of about `amplitude` · 0.7 standard deviation to luma. */
static void add_noise(struct lumi_yuv *image, int amplitude, unsigned seed)
{
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        int sum = 0;
        for (int k = 0; k < 2; k++) {
            seed = seed * 1664525 + 1013904223;
            sum += (int)((seed >> 16) % (unsigned)(2 * amplitude + 1)) - amplitude;
        }
        image->plane[0][i] = (uint8_t)(image->plane[0][i] + sum);
    }
}

static double mean_square(const struct lumi_yuv *a, const struct lumi_yuv *b, int plane)
{
    int count = lumi_yuv_width(a, plane) * lumi_yuv_height(a, plane);
    double sum = 0;

    for (int i = 0; i < count; i++)
        sum += pow(a->plane[plane][i] - b->plane[plane][i], 2);
    return sum / count;
}

struct scene {
    struct lumi_yuv truth, reference, images[VIEWS], filtered;
    struct lumi_filter_view views[VIEWS];
};

static void make_scene(struct scene *scene, int amplitude, int other)
{
    draw(&scene->truth, 0, 0, 0);
    draw(&scene->reference, 0, 0, 0);
    add_noise(&scene->reference, amplitude, 99);
    for (int i = 0; i < VIEWS; i++) {
        draw(&scene->images[i], 2.5 * (i % 5 - 2), 1.75 * (i / 5 - 1) + 1, other ? other + i : 0);
        add_noise(&scene->images[i], amplitude, (unsigned)i);
        scene->views[i] = (struct lumi_filter_view){&scene->images[i], NULL};
    }
}

static void finish_scene(struct scene *scene)
{
    lumi_yuv_finish(&scene->truth);
    lumi_yuv_finish(&scene->reference);
    lumi_yuv_finish(&scene->filtered);
    for (int i = 0; i < VIEWS; i++)
        lumi_yuv_finish(&scene->images[i]);
}

static void filter(struct scene *scene, int count)
{
    assert_int_equal(lumi_reference_filter(&scene->reference, scene->views, count, RANGE, 1, &scene->filtered, NULL),
                     LUMI_OK);
}

static void noise_is_averaged_away_over_views_that_are_moved_by_fractions_of_a_pixel(void **state)
{
    struct scene scene;

    (void)state;
    make_scene(&scene, 6, 0);
    filter(&scene, VIEWS);
    double before = mean_square(&scene.truth, &scene.reference, 0);
    double after = mean_square(&scene.truth, &scene.filtered, 0);
    assert_true(before > 15);
    assert_true(after < before / 4);
    assert_true(mean_square(&scene.truth, &scene.filtered, 1) < 2);
    assert_true(mean_square(&scene.truth, &scene.filtered, 2) < 2);
    finish_scene(&scene);
}

static void a_picture_without_noise_keeps_its_detail(void **state)
{
    struct scene scene;

    (void)state;
    make_scene(&scene, 0, 0);
    filter(&scene, VIEWS);
    for (int p = 0; p < 3; p++)
        assert_true(mean_square(&scene.truth, &scene.filtered, p) < 1);
    finish_scene(&scene);
}

/* As few views as a quarter may show it: noise is judged by the best quarter. */
static void views_of_something_else_are_left_out(void **state)
{
    struct scene scene, alien;

    (void)state;
    make_scene(&scene, 3, 0);
    make_scene(&alien, 3, 1);
    for (int i = 4; i < VIEWS; i++)
        scene.views[i] = alien.views[i];
    filter(&scene, VIEWS);
    assert_true(mean_square(&scene.truth, &scene.filtered, 0) < mean_square(&scene.truth, &scene.reference, 0));
    finish_scene(&alien);
    finish_scene(&scene);
}

static void a_picture_that_no_other_view_shows_stays_as_it_is(void **state)
{
    struct scene scene;

    (void)state;
    make_scene(&scene, 0, 1);
    filter(&scene, VIEWS);
    assert_true(mean_square(&scene.truth, &scene.images[0], 0) > 500);
    assert_true(mean_square(&scene.truth, &scene.filtered, 0) <= 0);
    finish_scene(&scene);
}

static void without_other_views_a_picture_stays_as_it_is(void **state)
{
    struct scene scene;

    (void)state;
    make_scene(&scene, 6, 0);
    filter(&scene, 0);
    for (int p = 0; p < 3; p++)
        assert_true(mean_square(&scene.reference, &scene.filtered, p) <= 0);
    finish_scene(&scene);
}

static void seeds_say_where_a_tile_is_found_far_away(void **state)
{
    enum { COLS = 3, ROWS = 2, FAR = 40 };
    struct lumi_shift seeds[COLS * ROWS];
    struct scene scene;

    (void)state;
    make_scene(&scene, 6, 0);
    for (int i = 0; i < VIEWS; i++) {
        lumi_yuv_finish(&scene.images[i]);
        draw(&scene.images[i], FAR, 0, 0);
        add_noise(&scene.images[i], 6, (unsigned)i);
    }
    filter(&scene, VIEWS);
    double lost = mean_square(&scene.truth, &scene.filtered, 0);
    lumi_yuv_finish(&scene.filtered);
    for (int i = 0; i < COLS * ROWS; i++)
        seeds[i] = (struct lumi_shift){FAR, 0};
    for (int i = 0; i < VIEWS; i++)
        scene.views[i].seeds = seeds;
    filter(&scene, VIEWS);
    assert_true(mean_square(&scene.truth, &scene.filtered, 0) < lost / 1.5);
    finish_scene(&scene);
}

static void finer_tiles_filter_less_and_the_finest_not_at_all(void **state)
{
    (void)state;
    assert_int_equal(lumi_filter_own_weight(63), 1);
    for (int quantizer = 62; quantizer >= 10; quantizer--)
        assert_true(lumi_filter_own_weight(quantizer) >= lumi_filter_own_weight(quantizer + 1));
    assert_int_equal(lumi_filter_own_weight(0), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_averaged_away_over_views_that_are_moved_by_fractions_of_a_pixel),
        cmocka_unit_test(a_picture_without_noise_keeps_its_detail),
        cmocka_unit_test(views_of_something_else_are_left_out),
        cmocka_unit_test(a_picture_that_no_other_view_shows_stays_as_it_is),
        cmocka_unit_test(without_other_views_a_picture_stays_as_it_is),
        cmocka_unit_test(seeds_say_where_a_tile_is_found_far_away),
        cmocka_unit_test(finer_tiles_filter_less_and_the_finest_not_at_all),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
