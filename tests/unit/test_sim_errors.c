/* Rigs that are not where they believe to be. */
#include "sim/errors.h"

#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)

static void make(struct sim_rig *rig, const char *name, const struct sim_errors *errors)
{
    struct sim_rig_options options;

    sim_rig_options_init(&options);
    options.scale = 0.25;
    assert_int_equal(sim_rig_init(rig, name, &options, NULL), LUMI_OK);
    assert_int_equal(sim_errors_apply(errors, rig, NULL), LUMI_OK);
}

/* Of view i, in the frame of its prior: where it truly is, and how far it is turned about each axis (small angles). */
static void beside(const struct sim_rig *rig, int i, double v[6])
{
    const struct lumi_pose *prior = &rig->views[i].prior, *pose = &rig->views[i].pose;
    struct lumi_vec3 t = lumi_to_camera(prior, pose->t);
    double back[9], r[9];

    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            back[3 * a + b] = prior->r[3 * b + a];
    lumi_rotation_multiply(back, pose->r, r);
    memcpy(v, (double[]){t.x, t.y, t.z, (r[7] - r[5]) / 2, (r[2] - r[6]) / 2, (r[3] - r[1]) / 2}, 6 * sizeof *v);
}

static void a_frames_errors_have_the_size_that_was_asked_for_along_every_axis(void **state)
{
    const struct sim_errors errors = {.position_m = 0.005, .rotation = 0.5 * DEGREE, .seed = 7};
    double sum[6] = {0}, square[6] = {0}, v[6];
    struct sim_rig rig;

    (void)state;
    make(&rig, "bar2", &errors);
    assert_true(rig.shaken && rig.count > 100);
    for (int i = 0; i < rig.count; i++) {
        beside(&rig, i, v);
        for (int k = 0; k < 6; k++) {
            sum[k] += v[k] / rig.count;
            square[k] += v[k] * v[k] / rig.count;
        }
    }
    for (int k = 0; k < 6; k++) {
        const double size = k < 3 ? errors.position_m : errors.rotation;
        assert_true(fabs(sum[k]) < 0.25 * size);
        assert_true(sqrt(square[k]) > 0.85 * size && sqrt(square[k]) < 1.15 * size);
    }
    sim_rig_finish(&rig);
}

static void errors_follow_the_seed_and_nothing_else(void **state)
{
    struct sim_errors errors = {.position_m = 0.005, .rotation = 0.5 * DEGREE, .seed = 7};
    struct sim_rig first, same, other;

    (void)state;
    assert_int_equal(sim_errors_parse("yes", &errors.mechanism, NULL), LUMI_OK);
    make(&first, "arc16", &errors);
    make(&same, "arc16", &errors);
    errors.seed = 8;
    make(&other, "arc16", &errors);
    assert_memory_equal(first.views, same.views, (size_t)first.count * sizeof *first.views);
    assert_memory_equal(&first.views[3].prior, &other.views[3].prior, sizeof(struct lumi_pose));
    assert_true(lumi_length(lumi_sub(first.views[3].pose.t, other.views[3].pose.t)) > 1e-4);
    sim_rig_finish(&first);
    sim_rig_finish(&same);
    sim_rig_finish(&other);
}

static void mountings_are_the_same_in_every_frame_of_a_camera(void **state)
{
    struct sim_errors errors = {.seed = 3};
    double first[6], other[6], v[6];
    struct sim_rig rig;

    (void)state;
    assert_int_equal(sim_errors_parse("pan=0.4,tilt=0.4,roll=0.4,radius=3", &errors.mechanism, NULL), LUMI_OK);
    make(&rig, "arc16", &errors);
    beside(&rig, 0, first);
    beside(&rig, 1, other);
    assert_true(fabs(first[3] - other[3]) > 1e-4);
    assert_true(first[2] > 0.001 || first[2] < -0.001);
    assert_true(first[2] * other[2] > 0); /* the radius is wrong for all */
    for (int i = 0; i < rig.count; i += rig.cameras) {
        assert_int_equal(rig.views[i].camera, 0);
        beside(&rig, i, v);
        for (int k = 0; k < 6; k++)
            assert_true(fabs(v[k] - first[k]) < 1e-9);
    }
    sim_rig_finish(&rig);
}

static void a_falling_arm_falls_unevenly_and_a_tilted_axis_tilts_the_world(void **state)
{
    struct sim_errors errors = {.seed = 3};
    struct sim_rig rig;
    double least = 1, most = -1, v[6], w[6];

    (void)state;
    assert_int_equal(sim_errors_parse("drop=0.5", &errors.mechanism, NULL), LUMI_OK);
    make(&rig, "bar2", &errors);
    for (int i = 0; i < rig.count; i += 2) {
        beside(&rig, i, v);
        least = fmin(least, v[3]);
        most = fmax(most, v[3]);
    }
    assert_true(most - least > 0.2 * DEGREE && most - least < 1.0 * DEGREE);
    sim_rig_finish(&rig);

    assert_int_equal(sim_errors_parse("axis=0.5", &errors.mechanism, NULL), LUMI_OK);
    make(&rig, "bar2", &errors);
    /* Distances between cameras stay. */
    beside(&rig, 0, v);
    beside(&rig, rig.count / 2, w);
    assert_true(fabs(v[3] - w[3]) > 1e-4);
    const struct sim_view *a = &rig.views[0], *b = &rig.views[rig.count / 2];
    assert_true(fabs(lumi_length(lumi_sub(a->pose.t, b->pose.t)) - lumi_length(lumi_sub(a->prior.t, b->prior.t))) <
                1e-9);
    assert_true(lumi_length(lumi_sub(a->pose.t, a->prior.t)) > 1e-4);
    sim_rig_finish(&rig);
}

static void the_usual_errors_are_what_the_profile_calls_its_uncertainty(void **state)
{
    struct sim_errors errors = {.seed = 1};
    struct sim_rig rig;
    double place = 0, turn = 0, v[6];

    (void)state;
    assert_int_equal(sim_errors_parse("yes", &errors.mechanism, NULL), LUMI_OK);
    make(&rig, "bar2", &errors);
    for (int i = 0; i < rig.count; i++) {
        beside(&rig, i, v);
        place += (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / (3 * rig.count);
        turn += (v[3] * v[3] + v[4] * v[4] + v[5] * v[5]) / (3 * rig.count);
    }
    const struct lumi_rig_uncertainty *u = &rig.profile.uncertainty;
    assert_true(sqrt(place) > 0.2 * u->position_m && sqrt(place) < 1.5 * u->position_m);
    assert_true(sqrt(turn) > 0.2 * u->rotation && sqrt(turn) < 1.5 * u->rotation);
    sim_rig_finish(&rig);
}

static void what_is_no_error_is_refused(void **state)
{
    static const char *const wrong[] = {"", "no", "axis", "axis=", "axis=-1", "axis=1,", "axis=1x", "tall=1", "axi=1"};
    struct sim_errors errors = {.seed = 1};
    struct lumi_error error = {0};
    struct sim_rig_options options;
    struct sim_rig rig;

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_int_equal(sim_errors_parse(wrong[i], &errors.mechanism, &error), LUMI_ERR_ARG);
    assert_int_equal(sim_errors_parse("roll=1", &errors.mechanism, &error), LUMI_OK);
    sim_rig_options_init(&options);
    assert_int_equal(sim_rig_init(&rig, "planar:2x2:0.1", &options, NULL), LUMI_OK);
    assert_int_equal(sim_errors_apply(&errors, &rig, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "rig that turns"));
    errors = (struct sim_errors){.position_m = NAN};
    assert_int_equal(sim_errors_apply(&errors, &rig, &error), LUMI_ERR_ARG);
    sim_rig_finish(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_frames_errors_have_the_size_that_was_asked_for_along_every_axis),
        cmocka_unit_test(errors_follow_the_seed_and_nothing_else),
        cmocka_unit_test(mountings_are_the_same_in_every_frame_of_a_camera),
        cmocka_unit_test(a_falling_arm_falls_unevenly_and_a_tilted_axis_tilts_the_world),
        cmocka_unit_test(the_usual_errors_are_what_the_profile_calls_its_uncertainty),
        cmocka_unit_test(what_is_no_error_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
