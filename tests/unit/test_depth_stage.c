/* The stages "match" and "depth" on a capture of a wall: what they leave, what makes them run again. */
#include "pipeline/depth/depth.h"
#include "proto/image/image.h"
#include "tests/unit/run_fixture.h"

#include <glib.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 3, IMAGES = SIDE * SIDE, WIDTH = 128, HEIGHT = 96, FOCAL = 120 };

#define WALL 2.0    /* metres from the cameras */
#define SPACING 0.1 /* between them */

static char *folder;
static int version_of_last = 0; /* raised, it changes the last view's key */

static struct lumi_pose pose_of(int row, int column)
{
    return (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {SPACING * column, SPACING * row, 0}};
}

static int make_capture(void **state)
{
    static const struct run_fixture fixture = {WIDTH, HEIGHT, IMAGES, SIDE, IMAGES, pose_of};

    (void)state;
    folder = make_run_fixture(&fixture);
    return 0;
}

static int remove_capture(void **state)
{
    (void)state;
    return remove_run_fixture(folder);
}

/* Stands in for the stage before: the wall as each camera sees it. */
static int view_key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)run;
    (void)error;
    lumi_key_int(key, index == IMAGES - 1 ? version_of_last : 0);
    return LUMI_OK;
}

static int view_make(struct lumi_run *run, void *state, int index, int thread, const char *path,
                     struct lumi_error *error)
{
    struct lumi_raster image;

    (void)state;
    (void)thread;
    LUMI_TRY(lumi_raster_create(&image, WIDTH, HEIGHT, 3, LUMI_F32));
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                double u = (x - WIDTH / 2) * WALL / FOCAL + run->sources[index].pose.t.x;
                double v = (y - HEIGHT / 2) * WALL / FOCAL + run->sources[index].pose.t.y;
                lumi_row_f32(&image, y)[3 * x + c] = (float)(0.3 + 0.1 * sin(13 * u + 5 * v + c) +
                                                             0.1 * sin(29 * v - 7 * u) + 0.1 * sin(41 * u + 37 * v));
            }
    int code = lumi_image_write(path, &image, NULL, error);
    lumi_raster_finish(&image);
    return code;
}

static const struct lumi_stage views = {
    .name = "equiangular", .title = "views", .version = 1, .extension = ".exr", .key = view_key, .make = view_make};

static struct lumi_run *open_run(double near_m)
{
    g_autofree char *path = g_build_filename(folder, "capture", NULL);
    struct lumi_parameters parameters;
    struct lumi_run *run;
    struct lumi_error error = {0};

    lumi_run_defaults(&parameters);
    parameters.near_m = near_m;
    if (lumi_run_open(path, NULL, &parameters, 2, true, &run, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_true(lumi_grid_init_pinhole(&run->grid, WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2));
    return run;
}

/* Runs a stage for all images; returns how many were there already. */
static int run_stage(struct lumi_run *run, const struct lumi_stage *stage)
{
    struct lumi_error error = {0};
    int skipped = -1;

    if (lumi_run_stage(run, stage, 0, run->count, &skipped, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return skipped;
}

static void the_stages_leave_the_inverse_depth_of_every_view(void **state)
{
    struct lumi_run *run = open_run(0);

    (void)state;
    assert_int_equal(run->count, IMAGES);
    run_stage(run, &views);
    assert_int_equal(run_stage(run, &lumi_stage_match), 0);
    assert_int_equal(run_stage(run, &lumi_stage_depth), 0);
    for (int i = 0; i < IMAGES; i++) {
        g_autofree char *path = lumi_run_path(run, "depth", i, ".exr");
        struct lumi_raster map;
        int right = 0;
        assert_int_equal(lumi_image_read_channel(path, "W", &map, NULL), LUMI_OK);
        assert_int_equal(map.width, WIDTH);
        assert_int_equal(map.height, HEIGHT);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                right += fabs(lumi_row_f32(&map, y)[x] - 1 / WALL) < 0.03;
        assert_true(right > 0.95 * WIDTH * HEIGHT);
        lumi_raster_finish(&map);
    }
    lumi_run_close(run);
}

static void depth_is_made_once(void **state)
{
    struct lumi_run *run = open_run(0);

    (void)state;
    assert_int_equal(run_stage(run, &views), IMAGES);
    assert_int_equal(run_stage(run, &lumi_stage_match), IMAGES);
    assert_int_equal(run_stage(run, &lumi_stage_depth), IMAGES);
    lumi_run_close(run);
}

static void a_changed_view_is_matched_again_with_those_that_look_at_it(void **state)
{
    struct lumi_run *run = open_run(0);

    (void)state;
    version_of_last = 1; /* the corner: itself, and every view that has it for a neighbour */
    assert_int_equal(run_stage(run, &views), IMAGES - 1);
    int skipped = run_stage(run, &lumi_stage_match);
    assert_true(skipped >= 3 && skipped <= IMAGES - 4);
    assert_true(run_stage(run, &lumi_stage_depth) <= skipped);
    lumi_run_close(run);
}

static void another_nearest_distance_matches_all_again(void **state)
{
    struct lumi_run *run = open_run(1);

    (void)state;
    run_stage(run, &views);
    assert_int_equal(run_stage(run, &lumi_stage_match), 0);
    lumi_run_close(run);
}

static void a_view_of_another_size_is_named(void **state)
{
    struct lumi_run *run = open_run(0.9);
    struct lumi_error error = {0};

    (void)state;
    run_stage(run, &views);
    assert_true(lumi_grid_init_pinhole(&run->grid, WIDTH + 1, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2));
    assert_int_equal(lumi_run_stage(run, &lumi_stage_match, 0, 1, NULL, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "equiangular/"));
    assert_non_null(strstr(error.text, "128"));
    lumi_run_close(run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_stages_leave_the_inverse_depth_of_every_view),
        cmocka_unit_test(depth_is_made_once),
        cmocka_unit_test(a_changed_view_is_matched_again_with_those_that_look_at_it),
        cmocka_unit_test(another_nearest_distance_matches_all_again),
        cmocka_unit_test(a_view_of_another_size_is_named),
    };

    return cmocka_run_group_tests(tests, make_capture, remove_capture);
}
