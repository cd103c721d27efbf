/* Bundle adjustment and the mechanism on points that nobody photographed. */
#include "pipeline/calibrate/align.h"
#include "pipeline/calibrate/solve.h"
#include "shaken_rig.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)

static struct lumi_pose_distance distance_to_truth(const struct shaken *s)
{
    int count = s->bundle.camera_count;
    struct lumi_pose *found = calloc((size_t)count, sizeof *found);
    struct lumi_similarity similarity;
    struct lumi_pose_distance d;

    for (int i = 0; i < count; i++)
        found[i] = s->bundle.cameras[i].pose;
    assert_int_equal(lumi_align(count, found, s->truth, &similarity, NULL), LUMI_OK);
    assert_int_equal(lumi_pose_compare(count, found, s->truth, &similarity, &d, NULL), LUMI_OK);
    free(found);
    print_message("%d cameras, %d points, %d observations: median %.3f mm %.4f°, worst %.2f mm %.3f°\n", count,
                  s->bundle.point_count, s->bundle.observation_count, 1e3 * d.median_m, d.median_rotation / DEGREE,
                  1e3 * d.worst_m, d.worst_rotation / DEGREE);
    return d;
}

static void solves(const struct lumi_rig *rig, const struct shaken_settings *settings)
{
    const struct lumi_solve_settings rounds = {.lenses = false};
    struct lumi_solve_result result;
    struct lumi_error error = {0};
    struct shaken s;

    shaken_init(&s, rig, settings);
    distance_to_truth(&s);
    assert_int_equal(lumi_solve(&s.bundle, &s.mechanism, &rounds, &result, &error), LUMI_OK);
    print_message("spread %.2f after the mechanism's %.2f, %d outliers, cameras beside the mechanism %.2f mm %.3f°\n",
                  result.spread, result.mechanism_spread, result.outliers, 1e3 * result.position_spread,
                  result.rotation_spread / DEGREE);
    struct lumi_pose_distance d = distance_to_truth(&s);
    assert_true(d.median_m <= 0.0005);
    assert_true(d.median_rotation <= 0.02 * DEGREE);
    assert_true(d.worst_m <= 0.005);
    shaken_finish(&s);
}

static void a_shaken_arc_is_found_to_half_a_millimetre(void **state)
{
    const struct shaken_settings settings = {1, 0.005, 0.5 * DEGREE, 0.3, 0.03, 9000, 200};
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_arc(&rig, 8, 24, 1, 0.7, 640, 512, 110 * DEGREE, 88 * DEGREE, NULL), LUMI_OK);
    solves(&rig, &settings);
}

static void a_shaken_bar_is_found_to_half_a_millimetre(void **state)
{
    const struct shaken_settings settings = {1, 0.005, 0.5 * DEGREE, 0.3, 0.03, 9000, 200};
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_bar(&rig, 24, 4, 0.4, 0.15, 640, 512, 120 * DEGREE, 96 * DEGREE, NULL), LUMI_OK);
    solves(&rig, &settings);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_shaken_arc_is_found_to_half_a_millimetre),
        cmocka_unit_test(a_shaken_bar_is_found_to_half_a_millimetre),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
