/* Where the cameras of every rig stand. */
#include "sim/rigs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void make(struct sim_rig *rig, const char *text, double scale)
{
    struct sim_rig_options options;

    sim_rig_options_init(&options);
    options.scale = scale;
    assert_int_equal(sim_rig_init(rig, text, &options, NULL), LUMI_OK);
    for (int i = 0; i < rig->count; i++)
        assert_true(lumi_pose_valid(&rig->views[i].pose, 1e-9) && lumi_lens_valid(&rig->views[i].lens));
}

/* Every place of the grid is taken once. */
static void check_grid(const struct sim_rig *rig)
{
    char seen[4096] = {0};

    assert_int_equal(rig->rows * rig->columns, rig->count);
    assert_true(rig->count <= 4096);
    for (int i = 0; i < rig->count; i++) {
        int at = rig->views[i].row * rig->columns + rig->views[i].column;
        assert_true(at >= 0 && at < rig->count && !seen[at]);
        seen[at] = 1;
    }
}

static void arc16_is_16_cameras_at_72_positions_on_70_cm(void **state)
{
    struct sim_rig rig;

    (void)state;
    make(&rig, "arc16", 1);
    assert_int_equal(rig.count, 1152);
    check_grid(&rig);
    for (int i = 0; i < rig.count; i++) {
        struct lumi_vec3 eye = rig.views[i].pose.t;
        assert_true(fabs(lumi_length(eye) - 0.35) < 1e-9);
        assert_true(lumi_dot(lumi_axis(&rig.views[i].pose, 2), eye) > 0.349);
    }
    const struct lumi_lens *lens = &rig.views[0].lens;
    assert_int_equal(lens->width, 1280);
    assert_int_equal(lens->height, 1024);
    assert_true(fabs(lens->width / lens->fx - 110 * LUMI_PI / 180) < 1e-9);
    assert_true(fabs(lens->height / lens->fy - 88 * LUMI_PI / 180) < 1e-9);
    sim_rig_finish(&rig);
}

static void an_arc_in_other_numbers_stands_where_it_says(void **state)
{
    struct sim_rig rig;

    (void)state;
    make(&rig, "arc:5x12:0.3", 1);
    assert_int_equal(rig.count, 60);
    assert_int_equal(rig.cameras, 5);
    assert_true(rig.mechanism);
    for (int i = 0; i < rig.count; i++)
        assert_float_equal(lumi_length(rig.views[i].pose.t), 0.3, 1e-9);
    sim_rig_finish(&rig);
}

static void bar2_is_2592_frames_on_80_cm(void **state)
{
    struct sim_rig rig;

    (void)state;
    make(&rig, "bar2", 1);
    assert_int_equal(rig.count, 2592);
    assert_int_equal(rig.rows, 36);
    check_grid(&rig);
    for (int i = 0; i < rig.count; i++)
        assert_true(fabs(lumi_length(rig.views[i].pose.t) - 0.4) < 1e-9);
    assert_true(fabs(rig.views[0].lens.width / rig.views[0].lens.fx - 120 * LUMI_PI / 180) < 1e-9);
    sim_rig_finish(&rig);
}

static void a_scale_keeps_the_parallax_between_neighbours(void **state)
{
    struct sim_rig whole, part;

    (void)state;
    make(&whole, "arc16", 1);
    make(&part, "arc16", 0.25);
    assert_int_equal(part.count, 4 * 18);
    check_grid(&part);
    assert_int_equal(part.views[0].lens.width, 320);
    assert_true(fabs(part.views[0].lens.fx / part.columns - whole.views[0].lens.fx / whole.columns) < 1);
    sim_rig_finish(&whole);
    sim_rig_finish(&part);
    make(&part, "bar2", 0.25);
    check_grid(&part);
    sim_rig_finish(&part);
}

static void a_planar_grid_spans_the_plane_and_looks_along_y(void **state)
{
    struct sim_rig rig;

    (void)state;
    make(&rig, "planar:5x7:0.05", 1);
    assert_int_equal(rig.count, 35);
    check_grid(&rig);
    assert_true(rig.plane);
    struct lumi_vec3 first = rig.views[0].pose.t, last = rig.views[34].pose.t;
    assert_true(fabs(first.x + 0.15) < 1e-12 && fabs(first.z - 0.10) < 1e-12 && first.y == 0);
    assert_true(fabs(last.x - 0.15) < 1e-12 && fabs(last.z + 0.10) < 1e-12);
    for (int i = 0; i < rig.count; i++) {
        struct lumi_vec3 forward = lumi_axis(&rig.views[i].pose, 2), right = lumi_axis(&rig.views[i].pose, 0);
        assert_true(fabs(forward.y - 1) < 1e-12 && fabs(right.x - 1) < 1e-12);
    }
    sim_rig_finish(&rig);
}

static void a_sphere_looks_out_or_in(void **state)
{
    struct sim_rig rig;
    struct sim_rig_options options;

    (void)state;
    make(&rig, "sphere:6x12:0.4", 1);
    check_grid(&rig);
    for (int i = 0; i < rig.count; i++)
        assert_true(lumi_dot(lumi_axis(&rig.views[i].pose, 2), rig.views[i].pose.t) > 0.3999);
    assert_true(rig.views[0].pose.t.z > 0 && fabs(rig.views[0].pose.t.y) < 1e-12 && rig.views[0].pose.t.x > 0);
    sim_rig_finish(&rig);
    sim_rig_options_init(&options);
    options.inward = true;
    assert_int_equal(sim_rig_init(&rig, "sphere:6x12:0.4", &options, NULL), LUMI_OK);
    for (int i = 0; i < rig.count; i++)
        assert_true(lumi_dot(lumi_axis(&rig.views[i].pose, 2), rig.views[i].pose.t) < -0.3999);
    sim_rig_finish(&rig);
}

static void random_views_are_inside_the_volume_and_follow_the_seed(void **state)
{
    struct sim_rig rig, a, b, c;
    struct sim_random_options options = {.count = 200, .width = 64, .height = 48, .fov = 75, .seed = 5};

    (void)state;
    make(&rig, "arc16", 0.25);
    assert_int_equal(sim_rig_random(&rig, &options, &a, NULL), LUMI_OK);
    assert_int_equal(sim_rig_random(&rig, &options, &b, NULL), LUMI_OK);
    options.seed = 6;
    assert_int_equal(sim_rig_random(&rig, &options, &c, NULL), LUMI_OK);
    double farthest = 0;
    for (int i = 0; i < 200; i++) {
        double r = lumi_length(a.views[i].pose.t);
        farthest = fmax(farthest, r);
        assert_true(r <= 0.6 * 0.35 + 1e-12);
        assert_true(fabs(lumi_axis(&a.views[i].pose, 2).z) <= sin(LUMI_PI / 4) + 1e-12);
        assert_memory_equal(&a.views[i].pose, &b.views[i].pose, sizeof a.views[i].pose);
    }
    assert_true(farthest > 0.18);
    assert_true(memcmp(&a.views[0].pose, &c.views[0].pose, sizeof a.views[0].pose) != 0);
    sim_rig_finish(&rig);
    sim_rig_finish(&a);
    sim_rig_finish(&b);
    sim_rig_finish(&c);
    make(&rig, "planar:5x5:0.05", 1);
    assert_int_equal(sim_rig_random(&rig, &options, &a, NULL), LUMI_OK);
    for (int i = 0; i < 200; i++)
        assert_true(fabs(a.views[i].pose.t.x) < 0.1 && fabs(a.views[i].pose.t.z) < 0.1);
    sim_rig_finish(&rig);
    sim_rig_finish(&a);
}

static void random_views_are_as_fine_as_the_pictures_and_the_second_eye_is_to_the_right(void **state)
{
    struct sim_rig rig, alone, pair;
    struct sim_random_options options = {.count = 3, .fov = 90, .seed = 5};

    (void)state;
    make(&rig, "arc16", 0.25);
    assert_int_equal(sim_rig_random(&rig, &options, &alone, NULL), LUMI_OK);
    options.eye_distance = 0.064;
    assert_int_equal(sim_rig_random(&rig, &options, &pair, NULL), LUMI_OK);
    assert_int_equal(alone.count, 3);
    assert_int_equal(pair.count, 4);
    double ratio = alone.views[0].lens.fx / rig.views[0].lens.fx;
    assert_true(ratio > 0.99 && ratio < 1.01);
    assert_true(abs(4 * alone.views[0].lens.height - 3 * alone.views[0].lens.width) <= 8);
    const struct lumi_pose *left = &pair.views[0].pose, *right = &pair.views[1].pose;
    assert_memory_equal(left, &alone.views[0].pose, sizeof *left);
    assert_memory_equal(left->r, right->r, sizeof left->r);
    struct lumi_vec3 apart = lumi_sub(right->t, left->t);
    assert_true(fabs(lumi_dot(apart, lumi_axis(left, 0)) - 0.064) < 1e-12 && lumi_length(apart) < 0.064 + 1e-12);
    assert_memory_equal(&pair.views[2].pose, &alone.views[1].pose, sizeof *left);
    assert_memory_equal(&pair.views[3].pose, &alone.views[2].pose, sizeof *left);
    sim_rig_finish(&rig);
    sim_rig_finish(&alone);
    sim_rig_finish(&pair);
}

static void what_is_no_rig_is_refused(void **state)
{
    static const char *const wrong[] = {"",           "arc17",         "planar:3:0.1",         "planar:0x3:0.1",
                                        "planar:3x3", "planar:3x3:0",  "planar:3x3:0.1m",      "sphere:3x3:nan",
                                        "sphere:",    "sphere:9x9:-1", "planar:99999x99999:1", "arc:17x24:1",
                                        "arc:8x24",   "arc:8x24:0"};
    struct sim_rig_options options;
    struct sim_rig rig;
    struct lumi_error error;

    (void)state;
    sim_rig_options_init(&options);
    for (unsigned i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        error.text[0] = 0;
        assert_int_equal(sim_rig_init(&rig, wrong[i], &options, &error), LUMI_ERR_ARG);
        assert_true(error.text[0] != 0);
        assert_null(rig.views);
    }
    options.scale = 0;
    assert_int_equal(sim_rig_init(&rig, "arc16", &options, &error), LUMI_ERR_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arc16_is_16_cameras_at_72_positions_on_70_cm),
        cmocka_unit_test(an_arc_in_other_numbers_stands_where_it_says),
        cmocka_unit_test(bar2_is_2592_frames_on_80_cm),
        cmocka_unit_test(a_scale_keeps_the_parallax_between_neighbours),
        cmocka_unit_test(a_planar_grid_spans_the_plane_and_looks_along_y),
        cmocka_unit_test(a_sphere_looks_out_or_in),
        cmocka_unit_test(random_views_are_inside_the_volume_and_follow_the_seed),
        cmocka_unit_test(random_views_are_as_fine_as_the_pictures_and_the_second_eye_is_to_the_right),
        cmocka_unit_test(what_is_no_rig_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
