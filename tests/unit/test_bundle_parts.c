/* What bundle adjustment is made of: derivatives against differences, rotations, similarities. */
#include "pipeline/calibrate/align.h"
#include "pipeline/calibrate/bundle.h"
#include "pipeline/calibrate/ceres_shim.h"
#include "pipeline/calibrate/mechanism_residual.h"
#include "pipeline/calibrate/priors.h"
#include "pipeline/calibrate/reprojection.h"
#include "shaken_rig.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)
#define LARGEST 8

/* Every derivative of a residual against a difference. */
static void compare_slopes(shim_residual function, const void *context, int rows, int count, const int *sizes,
                           double *const *blocks, double step, double tolerance)
{
    double slopes[LARGEST][6 * 16], *jacobians[LARGEST], residuals[6], less[6], more[6];

    for (int i = 0; i < count; i++)
        jacobians[i] = slopes[i];
    assert_true(function(context, (const double *const *)blocks, residuals, jacobians));
    for (int b = 0; b < count; b++)
        for (int k = 0; k < sizes[b]; k++) {
            double was = blocks[b][k];
            blocks[b][k] = was - step;
            assert_true(function(context, (const double *const *)blocks, less, NULL));
            blocks[b][k] = was + step;
            assert_true(function(context, (const double *const *)blocks, more, NULL));
            blocks[b][k] = was;
            for (int row = 0; row < rows; row++) {
                double difference = (more[row] - less[row]) / (2 * step), slope = slopes[b][row * sizes[b] + k];
                if (fabs(difference - slope) > tolerance * (1 + fabs(slope)))
                    fail_msg("block %d number %d row %d: %.9g, by differences %.9g", b, k, row, slope, difference);
            }
        }
}

static void small_bundle(struct lumi_bundle *b, enum lumi_lens_model model)
{
    const double w[3] = {0.2, -0.1, 0.3};

    assert_int_equal(lumi_bundle_init(b, 1, 2, 1, 2, NULL), LUMI_OK);
    b->lenses[0].lens = (struct lumi_lens){.model = model,
                                           .width = 640,
                                           .height = 480,
                                           .fx = 330,
                                           .fy = 335,
                                           .cx = 321,
                                           .cy = 238,
                                           .k1 = -0.05,
                                           .k2 = 0.01,
                                           .k3 = 0.002,
                                           .p1 = model == LUMI_LENS_BROWN ? 0.001 : 0,
                                           .p2 = model == LUMI_LENS_BROWN ? -0.002 : 0,
                                           .k4 = model == LUMI_LENS_FISHEYE ? -0.0005 : 0};
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++) {
        b->lenses[0].sigma[i] = lumi_lens_has(&b->lenses[0].lens, (enum lumi_lens_number)i) ? (i < 4 ? 1 : 0.001) : 0;
        b->lenses[0].block[i] = 0.1 * i;
    }
    for (int i = 0; i < 2; i++) {
        struct lumi_bundle_camera *c = &b->cameras[i];
        lumi_rotation_exp(w, c->pose.r);
        c->pose.t = lumi_vec3(0.1 * i, 0.05, -0.1);
        c->prior = c->pose;
        c->prior.t.x += 0.003;
        for (int k = 0; k < 3; k++)
            c->prior_position[k] = 0.005 + 0.001 * k;
        c->prior_rotation = 0.01;
        c->used = true;
        const double block[6] = {0.01, -0.02, 0.03, c->pose.t.x, c->pose.t.y, c->pose.t.z};
        memcpy(c->block, block, sizeof block);
    }
    struct lumi_vec3 d = lumi_rotate(b->cameras[0].pose.r, lumi_normalize(lumi_vec3(0.5, -0.3, 1)));
    b->points[0] = (struct lumi_bundle_point){.direction = d, .anchor = {0.05, 0.04, -0.1}, .used = true};
    b->points[0].e1 = lumi_normalize(lumi_cross(d, lumi_vec3(0, 0, 1)));
    b->points[0].e2 = lumi_cross(d, b->points[0].e1);
    b->points[0].block[0] = 0.02;
    b->points[0].block[1] = -0.01;
    b->points[0].block[2] = 0.4;
    b->observations[0] = (struct lumi_bundle_observation){.x = 400, .y = 120, .sigma = 0.7};
    b->first[1] = b->observation_count = 1;
    b->shutter = 0.02;
    b->shutter_sigma = 0.01;
}

static void check_reprojection(enum lumi_lens_model model)
{
    static const int sizes[4] = {6, LUMI_LENS_NUMBERS, 3, 1};
    struct lumi_bundle b;

    small_bundle(&b, model);
    double *blocks[4] = {b.cameras[0].block, b.lenses[0].block, b.points[0].block, &b.shutter};
    const struct lumi_measured measured = {&b, 0};
    compare_slopes(lumi_reprojection_residual, &measured, 2, 4, sizes, blocks, 1e-6, 1e-5);
    lumi_bundle_finish(&b);
}

static void where_a_point_is_seen_has_the_right_derivatives_with_both_lenses(void **state)
{
    (void)state;
    check_reprojection(LUMI_LENS_BROWN);
    check_reprojection(LUMI_LENS_FISHEYE);
}

static void a_lens_with_derivatives_projects_as_the_lens_does(void **state)
{
    const enum lumi_lens_model models[2] = {LUMI_LENS_BROWN, LUMI_LENS_FISHEYE};
    struct lumi_bundle b;

    (void)state;
    for (int m = 0; m < 2; m++) {
        small_bundle(&b, models[m]);
        for (int i = 0; i < 200; i++) {
            struct lumi_vec3 d = lumi_vec3(sin(1.1 * i), cos(2.3 * i), 0.9 + 0.5 * sin(0.7 * i));
            double xy[2], x, y;
            assert_true(lumi_lens_project(&b.lenses[0].lens, d, &x, &y));
            assert_true(lumi_lens_project_slope(&b.lenses[0].lens, d, xy, NULL, NULL));
            assert_true(fabs(xy[0] - x) < 1e-9 && fabs(xy[1] - y) < 1e-9);
        }
        lumi_bundle_finish(&b);
    }
}

static void a_point_on_the_optical_axis_has_derivatives(void **state)
{
    struct lumi_bundle b;
    double xy[2], slope[6];

    (void)state;
    small_bundle(&b, LUMI_LENS_FISHEYE);
    assert_true(lumi_lens_project_slope(&b.lenses[0].lens, lumi_vec3(0, 0, 2), xy, slope, NULL));
    assert_true(fabs(slope[0] - 165) < 1e-9 && fabs(slope[4] - 167.5) < 1e-9 && slope[2] == 0 && slope[5] == 0);
    lumi_bundle_finish(&b);
}

static void a_poses_prior_has_the_right_derivatives(void **state)
{
    static const int six = 6;
    struct lumi_bundle b;

    (void)state;
    small_bundle(&b, LUMI_LENS_FISHEYE);
    b.cameras[0].block[1] = 0.4;
    double *block = b.cameras[0].block;
    compare_slopes(lumi_pose_prior_residual, &b.cameras[0], 6, 1, &six, &block, 1e-6, 1e-5);
    lumi_bundle_finish(&b);
}

static void the_mechanism_has_the_right_derivatives(void **state)
{
    const int sizes[6] = {LUMI_MOUNT_NUMBERS, LUMI_PLATFORM_NUMBERS, 1, 1, 1, 3};
    const struct shaken_settings settings = {1, 0, 0, 0, 0, 60, 20};
    struct lumi_rig rig;
    struct shaken s;

    (void)state;
    assert_int_equal(lumi_rig_bar(&rig, 12, 2, 0.4, 0.15, 320, 256, 120 * DEGREE, 96 * DEGREE, NULL), LUMI_OK);
    shaken_init(&s, &rig, &settings);
    lumi_bundle_triangulate(&s.bundle, 2);
    int at = s.bundle.observation_count / 2;
    const struct lumi_bundle_observation *o = &s.bundle.observations[at];
    const struct lumi_mechanism_frame *f = &s.mechanism.frames[o->camera];
    int knot = (int)(f->turns / s.mechanism.knot_step);
    double *blocks[6] = {s.mechanism.mount[f->camera], s.mechanism.platform,        &s.mechanism.turn[f->shot],
                         &s.mechanism.drop[knot],      &s.mechanism.drop[knot + 1], s.bundle.points[o->point].block};
    for (int i = 0; i < LUMI_MOUNT_NUMBERS; i++)
        blocks[0][i] = 0.01 * (i + 1);
    struct mechanism_memo memo = {0};
    const struct mechanism_measured seen = {&s.mechanism, &s.bundle, at, &memo};
    compare_slopes(mechanism_seen_residual, &seen, 2, 6, sizes, blocks, 1e-6, 1e-5);
    const struct mechanism_found found = {&s.mechanism, &s.truth[o->camera], o->camera, 0.005, 0.01};
    compare_slopes(mechanism_found_residual, &found, 6, 5, sizes, blocks, 1e-6, 1e-5);
    shaken_finish(&s);
}

static void a_rotation_comes_back_from_its_vector(void **state)
{
    const double vectors[4][3] = {{0, 0, 0}, {1e-7, 0, -2e-7}, {0.3, -0.2, 0.1}, {1.5, 1.5, -1.5}};

    (void)state;
    for (int i = 0; i < 4; i++) {
        double r[9], w[3];
        lumi_rotation_exp(vectors[i], r);
        lumi_rotation_log(r, w);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(w[k] - vectors[i][k]) < 1e-9);
    }
}

static void fill_poses(int count, struct lumi_pose *poses)
{
    for (int i = 0; i < count; i++) {
        const double w[3] = {sin(i), cos(2.0 * i), 0.1 * i};
        lumi_rotation_exp(w, poses[i].r);
        poses[i].t = lumi_vec3(cos(1.3 * i), sin(2.1 * i), cos(0.7 * i + 1));
    }
}

static void a_similarity_is_found_again(void **state)
{
    const double w[3] = {0.5, -1, 2};
    struct lumi_similarity s = {.scale = 1.7, .shift = {3, -2, 1}}, found;
    struct lumi_pose from[20], to[20];
    struct lumi_pose_distance d;

    (void)state;
    lumi_rotation_exp(w, s.rotation);
    fill_poses(20, from);
    for (int i = 0; i < 20; i++)
        lumi_similarity_apply(&s, &from[i], &to[i]);
    assert_int_equal(lumi_align(20, from, to, &found, NULL), LUMI_OK);
    assert_true(fabs(found.scale - 1.7) < 1e-9);
    assert_int_equal(lumi_pose_compare(20, from, to, &found, &d, NULL), LUMI_OK);
    assert_true(d.worst_m < 1e-9 && d.worst_rotation < 1e-7);
    /* One that is far beside does not bend the rest. */
    to[7].t.x += 1;
    assert_int_equal(lumi_align_robust(20, from, to, &found, NULL), LUMI_OK);
    assert_int_equal(lumi_pose_compare(20, from, to, &found, &d, NULL), LUMI_OK);
    assert_true(d.median_m < 1e-9 && d.worst == 7 && fabs(d.worst_m - 1) < 1e-9);
}

static void cameras_on_a_line_are_not_laid_over_one_another(void **state)
{
    struct lumi_similarity found;
    struct lumi_error error;
    struct lumi_pose from[5];

    (void)state;
    fill_poses(5, from);
    for (int i = 0; i < 5; i++)
        from[i].t = lumi_vec3(i, 2 * i, 0);
    assert_int_equal(lumi_align(5, from, from, &found, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_align(2, from, from, &found, &error), LUMI_ERR_FORMAT);
}

static void a_point_at_infinity_is_triangulated(void **state)
{
    struct lumi_bundle b;

    (void)state;
    small_bundle(&b, LUMI_LENS_FISHEYE);
    b.first[1] = b.observation_count = 2;
    for (int i = 0; i < 2; i++) {
        struct lumi_bundle_observation *o = &b.observations[i];
        *o = (struct lumi_bundle_observation){.camera = i, .sigma = 1};
        assert_true(lumi_lens_project(&b.lenses[0].lens, lumi_vec3(0.2, 0.1, 1), &o->x, &o->y));
    }
    lumi_bundle_triangulate(&b, 2);
    assert_true(b.points[0].used);
    assert_true(fabs(b.points[0].block[2]) < 1e-6);
    /* Seen by one camera alone it is nothing. */
    b.cameras[1].used = false;
    lumi_bundle_triangulate(&b, 2);
    assert_false(b.points[0].used);
    lumi_bundle_finish(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(where_a_point_is_seen_has_the_right_derivatives_with_both_lenses),
        cmocka_unit_test(a_lens_with_derivatives_projects_as_the_lens_does),
        cmocka_unit_test(a_point_on_the_optical_axis_has_derivatives),
        cmocka_unit_test(a_poses_prior_has_the_right_derivatives),
        cmocka_unit_test(the_mechanism_has_the_right_derivatives),
        cmocka_unit_test(a_rotation_comes_back_from_its_vector),
        cmocka_unit_test(a_similarity_is_found_again),
        cmocka_unit_test(cameras_on_a_line_are_not_laid_over_one_another),
        cmocka_unit_test(a_point_at_infinity_is_triangulated),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
