/* A lens from a board: true corners give the true lens; a drawn board is found; what tells nothing is refused. */
#include "pipeline/calibrate/board_lens.h"
#include "pipeline/calibrate/rotation.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/mechanism/rig.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { COLUMNS = 9, ROWS = 6, CORNERS = COLUMNS * ROWS, VIEWS = 12 };

static uint64_t state = 1;

static double noise(double size)
{
    double sum = 0;

    for (int i = 0; i < 12; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        sum += (double)(state >> 11) / 9007199254740992.0 - 0.5;
    }
    return size * sum;
}

/* Board i to camera: before it, tilted and moved to another side each time; `flat`: never tilted. */
static void place(int i, double reach, bool flat, double r[9], struct lumi_vec3 *t)
{
    const double w[3] = {flat ? 0 : 0.5 * sin(1.7 * i + 0.4), flat ? 0 : 0.5 * cos(2.3 * i), 0.2 * sin(i)};
    const double centre[2] = {(COLUMNS - 1) / 2.0, (ROWS - 1) / 2.0};

    lumi_rotation_exp(w, r);
    *t = lumi_vec3(reach * cos(2.4 * i), reach * sin(2.4 * i), 9 + i % 3);
    *t = lumi_sub(*t, lumi_rotate(r, lumi_vec3(centre[0], centre[1], 0)));
}

static int solve(const struct lumi_lens *truth, double reach, bool flat, double size, struct lumi_board_lens *result)
{
    static float corners[VIEWS][2 * CORNERS];
    struct lumi_board_view views[VIEWS] = {{0}};
    struct lumi_error error = {0};

    for (int v = 0; v < VIEWS; v++) {
        double r[9], x, y;
        struct lumi_vec3 t;
        place(v, reach, flat, r, &t);
        for (int i = 0; i < CORNERS; i++) {
            const struct lumi_vec3 at = lumi_vec3(i % COLUMNS, i / COLUMNS, 0);
            assert_true(lumi_lens_project(truth, lumi_add(lumi_rotate(r, at), t), &x, &y));
            corners[v][2 * i] = (float)(x + noise(size));
            corners[v][2 * i + 1] = (float)(y + noise(size));
        }
        views[v].corners = corners[v];
    }
    int code = lumi_board_solve(truth->model, truth->width, truth->height, COLUMNS, ROWS, VIEWS, views, result, &error);
    assert_int_equal(code, error.code);
    return code;
}

static void near_truth(const struct lumi_lens *truth, const struct lumi_board_lens *found)
{
    double a[LUMI_LENS_NUMBERS], b[LUMI_LENS_NUMBERS];

    lumi_lens_numbers(truth, a);
    lumi_lens_numbers(&found->lens, b);
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        if (found->sigma[i] > 0)
            assert_true(fabs(a[i] - b[i]) < 4 * found->sigma[i]);
    assert_true(found->sigma[LUMI_LENS_FX] > 0 && found->sigma[LUMI_LENS_FX] < 0.002 * truth->fx);
    assert_true(found->error > 0.08 && found->error < 0.2);
}

static void a_pinhole_with_distortion_is_found_as_near_as_it_says(void **unused)
{
    const struct lumi_lens truth = {LUMI_LENS_BROWN, 640, 480, 530, 531, 325, 236, -0.12, 0.03, 0, 0, 5e-4, -3e-4};
    struct lumi_board_lens found;

    (void)unused;
    assert_int_equal(solve(&truth, 2, false, 0.1, &found), LUMI_OK);
    near_truth(&truth, &found);
}

static void a_fisheye_is_found_as_near_as_it_says(void **unused)
{
    const struct lumi_lens truth = {LUMI_LENS_FISHEYE, 1280, 1024, 610, 611, 645, 508, 0.02, -0.006, 0, 0, 0, 0};
    struct lumi_board_lens found;

    (void)unused;
    assert_int_equal(solve(&truth, 5, false, 0.1, &found), LUMI_OK);
    near_truth(&truth, &found);
    assert_true(found.reach > 0.7);
}

static void boards_that_are_never_tilted_do_not_tell_the_lens(void **unused)
{
    const struct lumi_lens truth = {LUMI_LENS_BROWN, 640, 480, 530, 530, 320, 240, 0, 0, 0, 0, 0, 0};
    struct lumi_board_lens found;

    (void)unused;
    assert_int_equal(solve(&truth, 0, true, 0.1, &found), LUMI_ERR_FORMAT);
}

/* The board as the lens shows it, each pixel the mean of 4 × 4 rays. */
static void draw(const struct lumi_lens *lens, int view, struct lumi_raster *raster)
{
    double r[9];
    struct lumi_vec3 t, d;

    place(view, 1, false, r, &t);
    assert_int_equal(lumi_raster_create(raster, lens->width, lens->height, 1, LUMI_U8), LUMI_OK);
    const struct lumi_vec3 normal = lumi_vec3(r[2], r[5], r[8]);
    for (int p = 0; p < lens->width * lens->height; p++) {
        double light = 0;
        for (int s = 0; s < 16; s++) {
            assert_true(lumi_lens_unproject(lens, p % lens->width + (s % 4 + 0.5) / 4,
                                            p / lens->width + (s / 4 + 0.5) / 4, &d));
            const struct lumi_vec3 on =
                lumi_rotate_back(r, lumi_sub(lumi_scale(d, lumi_dot(t, normal) / lumi_dot(d, normal)), t));
            const bool inside = on.x > -1 && on.y > -1 && on.x < COLUMNS && on.y < ROWS;
            light += inside && ((int)floor(on.x) + (int)floor(on.y)) % 2 != 0 ? 30 : 220;
        }
        lumi_row_u8(raster, p / lens->width)[p % lens->width] = (uint8_t)(light / 16 + 0.5);
    }
}

static void a_drawn_board_is_found_to_a_quarter_of_a_pixel(void **unused)
{
    const struct lumi_lens lens = {LUMI_LENS_FISHEYE, 400, 320, 260, 260, 200, 160, 0, 0, 0, 0, 0, 0};
    char folder[] = "/tmp/test_boardXXXXXX", path[64];
    struct lumi_raster raster;
    float corners[2 * CORNERS];
    double r[9], off = 0, turned = 0, x, y;
    struct lumi_vec3 t;
    int width, height;

    (void)unused;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/board.png", folder);
    draw(&lens, 1, &raster);
    assert_int_equal(lumi_image_write(path, &raster, NULL, NULL), LUMI_OK);
    lumi_raster_finish(&raster);
    assert_int_equal(lumi_board_find(path, COLUMNS, ROWS, corners, &width, &height, NULL), LUMI_OK);
    assert_int_equal(lumi_board_find(path, COLUMNS + 2, ROWS, corners, &width, &height, NULL), LUMI_ERR_NOTFOUND);
    assert_int_equal(lumi_board_find(path, COLUMNS, ROWS, corners, &width, &height, NULL), LUMI_OK);
    place(1, 1, false, r, &t);
    for (int i = 0; i < CORNERS; i++) {
        const struct lumi_vec3 at = lumi_vec3(i % COLUMNS, i / COLUMNS, 0);
        assert_true(lumi_lens_project(&lens, lumi_add(lumi_rotate(r, at), t), &x, &y));
        off = fmax(off, hypot(corners[2 * i] - x, corners[2 * i + 1] - y));
        const int k = CORNERS - 1 - i; /* a board has two beginnings */
        turned = fmax(turned, hypot(corners[2 * k] - x, corners[2 * k + 1] - y));
    }
    assert_true(fmin(off, turned) < 0.25);
    unlink(path);
    rmdir(folder);
}

static void a_lens_is_printed_as_a_section_of_a_profile(void **unused)
{
    const struct lumi_lens lens = {
        LUMI_LENS_FISHEYE, 1280, 1024, 610.123456789, 611, 645, 508, 0.02, -0.006, 0, 0, 0, 0};
    struct lumi_rig rig, back;
    char text[LUMI_RIG_TEXT_MAX], section[1024];

    (void)unused;
    assert_int_equal(lumi_rig_arc(&rig, 2, 8, 1, 0.3, 1280, 1024, 1.9, 1.5, NULL), LUMI_OK);
    lumi_rig_print(&rig, text, sizeof text);
    /* Its own lens makes room for this one. */
    char *from = strstr(text, "[lens "), *until = strstr(from, "\n[");
    assert_non_null(until);
    assert_in_range(lumi_board_print(&lens, rig.lenses[0].name, section, sizeof section), 50, sizeof section - 1);
    char whole[LUMI_RIG_TEXT_MAX];
    const int size = snprintf(whole, sizeof whole, "%.*s%s%s", (int)(from - text), text, section, until);
    struct lumi_error error = {0};
    assert_int_equal(lumi_rig_parse(whole, (size_t)size, "profile", &back, &error), LUMI_OK);
    assert_true(lumi_lens_equal(&back.lenses[0].lens, &lens));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pinhole_with_distortion_is_found_as_near_as_it_says),
        cmocka_unit_test(a_fisheye_is_found_as_near_as_it_says),
        cmocka_unit_test(boards_that_are_never_tilted_do_not_tell_the_lens),
        cmocka_unit_test(a_drawn_board_is_found_to_a_quarter_of_a_pixel),
        cmocka_unit_test(a_lens_is_printed_as_a_section_of_a_profile),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
