/* pipeline/equiangular: the choice of the views' lens, and resampling to it. */
#include "pipeline/equiangular/plan.h"
#include "pipeline/equiangular/warp.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)

static struct lumi_lens fisheye(int width, int height, double fov_x)
{
    return (struct lumi_lens){.model = LUMI_LENS_FISHEYE,
                              .width = width,
                              .height = height,
                              .fx = width / fov_x,
                              .fy = width / fov_x,
                              .cx = width / 2.0,
                              .cy = height / 2.0};
}

static int choose(const struct lumi_lens *lenses, int count, struct lumi_grid *grid)
{
    struct lumi_error error;

    return lumi_equiangular_choose(lenses, count, LUMI_PROJECTION_AUTO, 0, 0, 0, grid, &error);
}

static double fov(const double *tangents, int tiles)
{
    return atan(tangents[tiles]) - atan(tangents[0]);
}

static void a_narrow_pinhole_keeps_its_pixels(void **state)
{
    const struct lumi_lens lens = {
        .model = LUMI_LENS_BROWN, .width = 970, .height = 640, .fx = 800, .fy = 790, .cx = 480, .cy = 322};
    struct lumi_lens other = lens;
    struct lumi_grid grid;
    double x, y;

    (void)state;
    assert_int_equal(choose(&lens, 1, &grid), LUMI_OK);
    assert_int_equal(grid.width, 970);
    assert_int_equal(grid.cols, 16);
    assert_true(lumi_warp_is_copy(&lens, &grid));
    assert_true(lumi_grid_project(&grid, lumi_vec3(0.1, -0.2, 1), &x, &y));
    assert_true(fabs(x - 560) < 1e-9 && fabs(y - 164) < 1e-9);
    other.k1 = 0.01;
    assert_false(lumi_warp_is_copy(&other, &grid));
    assert_int_equal(choose(&other, 1, &grid), LUMI_OK);
    assert_int_equal(grid.width % 64, 0); /* resampled */
}

static void fisheyes_become_equiangular_views_as_wide_as_they_see(void **state)
{
    const struct lumi_lens arc = fisheye(1280, 1024, 110 * DEGREE), bar = fisheye(1600, 1280, 120 * DEGREE);
    struct lumi_grid grid;

    (void)state;
    assert_int_equal(choose(&arc, 1, &grid), LUMI_OK);
    assert_int_equal(grid.width, 1280);
    assert_int_equal(grid.height, 1024);
    assert_true(fabs(fov(grid.tan_x, grid.cols) - 110 * DEGREE) < 0.1 * DEGREE);
    assert_true(fabs(fov(grid.tan_y, grid.rows) - 88 * DEGREE) < 0.1 * DEGREE);
    assert_int_equal(choose(&bar, 1, &grid), LUMI_OK);
    assert_int_equal(grid.width, 1600);
    assert_true(fabs(fov(grid.tan_y, grid.rows) - 96 * DEGREE) < 0.1 * DEGREE);
}

static void cameras_with_different_lenses_share_what_all_cover(void **state)
{
    struct lumi_lens lenses[] = {fisheye(1280, 1024, 110 * DEGREE), fisheye(1280, 1024, 100 * DEGREE)};
    struct lumi_grid grid;

    (void)state;
    lenses[0].cx += 30; /* the right side sees less */
    assert_int_equal(choose(lenses, 2, &grid), LUMI_OK);
    assert_true(fov(grid.tan_x, grid.cols) <= 100.2 * DEGREE);
    assert_true(fov(grid.tan_x, grid.cols) > 98 * DEGREE);
    for (int i = 0; i < 2; i++)
        for (int corner = 0; corner < 4; corner++) {
            double x, y;
            assert_true(lumi_lens_project(
                &lenses[i],
                lumi_vec3(grid.tan_x[corner & 1 ? grid.cols : 0], grid.tan_y[corner & 2 ? grid.rows : 0], 1), &x, &y));
            assert_true(x >= -0.6 && y >= -0.6 && x <= 1280.6 && y <= 1024.6);
        }
}

static void lenses_that_see_nothing_straight_ahead_are_bad_input(void **state)
{
    struct lumi_lens folded = fisheye(1280, 1024, 110 * DEGREE), aside = folded;
    struct lumi_grid grid;
    struct lumi_error error;

    (void)state;
    folded.model = LUMI_LENS_BROWN;
    folded.k1 = -1e12;
    aside.cx = -300;
    assert_int_equal(lumi_equiangular_choose(&folded, 1, LUMI_PROJECTION_AUTO, 0, 0, 0, &grid, &error),
                     LUMI_ERR_FORMAT);
    assert_int_equal(lumi_equiangular_choose(&aside, 1, LUMI_PROJECTION_AUTO, 0, 0, 0, &grid, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "outside the image"));
}

static void a_field_of_view_nobody_photographed_is_refused(void **state)
{
    const struct lumi_lens lens = fisheye(1280, 1024, 110 * DEGREE);
    struct lumi_grid grid;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_equiangular_choose(&lens, 1, LUMI_PROJECTION_AUTO, 118 * DEGREE, 0, 0, &grid, &error),
                     LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "110"));
    assert_int_equal(
        lumi_equiangular_choose(&lens, 1, LUMI_PROJECTION_AUTO, 90 * DEGREE, 60 * DEGREE, 10, &grid, &error), LUMI_OK);
    assert_int_equal(grid.width, 896);
    assert_int_equal(grid.height, 576); /* 600 to the nearest multiple of 64 */
    assert_int_equal(lumi_equiangular_choose(&lens, 1, LUMI_PROJECTION_AUTO, 0, 0, 1000, &grid, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_equiangular_choose(&lens, 1, LUMI_PROJECTION_AUTO, NAN, 0, 0, &grid, &error), LUMI_ERR_ARG);
}

/* A smooth pattern of directions. */
static float pattern(double tan_x, double tan_y, int channel)
{
    return (float)(0.5 + 0.4 * sin(12 * tan_x + channel) * cos(9 * tan_y - channel));
}

static void paint(const struct lumi_lens *lens, struct lumi_raster *image)
{
    assert_int_equal(lumi_raster_create(image, lens->width, lens->height, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < lens->height; y++)
        for (int x = 0; x < lens->width; x++) {
            struct lumi_vec3 d = {0, 0, 1};
            if (!lumi_lens_unproject(lens, x + 0.5, y + 0.5, &d) || d.z < 0.1)
                continue;
            for (int c = 0; c < 3; c++)
                lumi_row_f32(image, y)[3 * x + c] = pattern(d.x / d.z, d.y / d.z, c);
        }
}

/* Largest difference to the pattern, `margin` pixels from the edge. */
static double worst(const struct lumi_grid *grid, const struct lumi_raster *view, int margin)
{
    double largest = 0;

    for (int y = margin; y < grid->height - margin; y++)
        for (int x = margin; x < grid->width - margin; x++) {
            double tan_x, tan_y;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            for (int c = 0; c < 3; c++)
                largest = fmax(largest, fabs(lumi_row_f32(view, y)[3 * x + c] - pattern(tan_x, tan_y, c)));
        }
    return largest;
}

static void resampling_finds_every_direction_again(void **state)
{
    struct lumi_lens lens = fisheye(640, 512, 110 * DEGREE);
    struct lumi_grid grid;
    struct lumi_raster image, view;
    struct lumi_warp *warp;
    struct lumi_error error;

    (void)state;
    lens.k1 = -0.02, lens.k2 = 0.003;
    assert_int_equal(choose(&lens, 1, &grid), LUMI_OK);
    paint(&lens, &image);
    assert_int_equal(lumi_warp_create(&lens, &grid, &warp, &error), LUMI_OK);
    assert_int_equal(lumi_warp_apply(warp, &image, &view, &error), LUMI_OK);
    assert_true(worst(&grid, &view, 4) < 0.004);
    lumi_warp_destroy(warp);
    lumi_raster_finish(&image);
    lumi_raster_finish(&view);
}

static void a_coarser_view_averages_instead_of_aliasing(void **state)
{
    const struct lumi_lens lens = {
        .model = LUMI_LENS_BROWN, .width = 768, .height = 768, .fx = 768, .fy = 768, .cx = 384, .cy = 384};
    struct lumi_grid grid;
    struct lumi_raster image, view;
    struct lumi_warp *warp;
    struct lumi_error error;

    (void)state;
    /* Stripes one pixel wide, at a third of the resolution: they must melt into grey. */
    assert_int_equal(lumi_raster_create(&image, 768, 768, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < 768; y++)
        for (int i = 0; i < 3 * 768; i++)
            lumi_row_f32(&image, y)[i] = (float)(i / 3 % 2);
    assert_true(lumi_grid_init_pinhole(&grid, 256, 256, 256, 256, 128, 128));
    assert_int_equal(lumi_warp_create(&lens, &grid, &warp, &error), LUMI_OK);
    assert_int_equal(lumi_warp_apply(warp, &image, &view, &error), LUMI_OK);
    for (int y = 8; y < 248; y++)
        for (int i = 24; i < 3 * 248; i++)
            assert_true(fabsf(lumi_row_f32(&view, y)[i] - 0.5f) < 0.02f);
    lumi_raster_finish(&image);
    lumi_raster_finish(&view);
    image.width = 3;
    assert_int_equal(lumi_warp_apply(warp, &image, &view, &error), LUMI_ERR_ARG);
    lumi_warp_destroy(warp);
    lumi_raster_finish(&view);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_narrow_pinhole_keeps_its_pixels),
        cmocka_unit_test(fisheyes_become_equiangular_views_as_wide_as_they_see),
        cmocka_unit_test(cameras_with_different_lenses_share_what_all_cover),
        cmocka_unit_test(lenses_that_see_nothing_straight_ahead_are_bad_input),
        cmocka_unit_test(a_field_of_view_nobody_photographed_is_refused),
        cmocka_unit_test(resampling_finds_every_direction_again),
        cmocka_unit_test(a_coarser_view_averages_instead_of_aliasing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
