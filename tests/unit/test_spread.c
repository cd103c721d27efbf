/* Even spacing on the sphere, and what fills the poles. */
#include "pipeline/subsample/poles.h"
#include "pipeline/subsample/spread.h"
#include "pipeline/subsample/stand.h"

#include <glib.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { COLUMNS = 72, ROWS = 25, COUNT = ROWS * COLUMNS };

/* Rows 6° apart from 72° above the equator to 72° below it, on a sphere of 0.5 m about (1, 2, 3), a little shaken. */
static void make_rig(struct lumi_vec3 *points)
{
    for (int i = 0; i < COUNT; i++) {
        const double shake = 1e-3 * ((i * 7919) % 13 - 6) / 6;
        const double up = (72 - i / COLUMNS * 6) * LUMI_PI / 180 + shake;
        const double turn = i % COLUMNS * 2 * LUMI_PI / COLUMNS - shake;
        points[i] = lumi_vec3(1 + 0.5 * cos(up) * cos(turn), 2 + 0.5 * cos(up) * sin(turn), 3 + 0.5 * sin(up));
    }
}

static const struct lumi_vec3 centre = {1, 2, 3};

static void nearest_range(int count, const struct lumi_vec3 *points, double *least, double *most)
{
    *least = INFINITY;
    *most = 0;
    for (int i = 0; i < count; i++) {
        double nearest = INFINITY;
        for (int j = 0; j < count; j++)
            if (i != j)
                nearest = fmin(nearest, lumi_length(lumi_sub(points[i], points[j])));
        *least = fmin(*least, nearest);
        *most = fmax(*most, nearest);
    }
}

static int keep(double density, struct lumi_vec3 *list, bool *kept)
{
    struct lumi_vec3 points[COUNT];
    int count = 0;

    make_rig(points);
    lumi_spread_keep(COUNT, points, centre, lumi_spacing_measure(COUNT, points, centre), density, kept);
    for (int i = 0; i < COUNT; i++)
        if (kept[i])
            list[count++] = points[i];
    return count;
}

static void the_spacing_is_that_of_the_equator(void **state)
{
    struct lumi_vec3 points[COUNT];

    (void)state;
    make_rig(points);
    struct lumi_spacing spacing = lumi_spacing_measure(COUNT, points, centre);
    assert_float_equal(spacing.east, 0.5 * 5 * LUMI_PI / 180, 0.003);
    assert_float_equal(spacing.north, 0.5 * 6 * LUMI_PI / 180, 0.003);
    spacing = lumi_spacing_measure(1, points, centre);
    assert_true(spacing.east == 0 && spacing.north == 0);
}

static void what_is_kept_is_evenly_spaced_everywhere(void **state)
{
    struct lumi_vec3 list[COUNT], points[COUNT];
    bool kept[COUNT];
    double least, most;
    int near_pole = 0, equator = 0;

    (void)state;
    const int count = keep(1, list, kept);
    nearest_range(count, list, &least, &most);
    assert_true(most / least < 2);
    make_rig(points);
    nearest_range(COUNT, points, &least, &most);
    assert_true(most / least > 2.5); /* it was not before */
    for (int i = 0; i < COLUMNS; i++) {
        near_pole += kept[i];
        equator += kept[ROWS / 2 * COLUMNS + i];
    }
    assert_int_equal(equator, COLUMNS);
    assert_in_range(near_pole, COLUMNS / 5, COLUMNS / 2); /* cos 72° = 0.31 */
}

static void density_is_views_an_area(void **state)
{
    struct lumi_vec3 list[COUNT];
    bool kept[COUNT];

    (void)state;
    const int once = keep(1, list, kept), quarter = keep(0.25, list, kept), all = keep(100, list, kept);
    assert_int_equal(all, COUNT);
    assert_true(quarter > once / 5 && quarter < 2 * once / 5);
}

static void the_order_of_the_pictures_does_not_matter(void **state)
{
    struct lumi_vec3 points[COUNT], turned[COUNT];
    bool kept[COUNT], again[COUNT];

    (void)state;
    make_rig(points);
    for (int i = 0; i < COUNT; i++)
        turned[i] = points[i * 1001 % COUNT];
    const struct lumi_spacing spacing = lumi_spacing_measure(COUNT, points, centre);
    lumi_spread_keep(COUNT, points, centre, spacing, 1, kept);
    lumi_spread_keep(COUNT, turned, centre, spacing, 1, again);
    for (int i = 0; i < COUNT; i++)
        assert_int_equal(again[i], kept[i * 1001 % COUNT]);
}

static void a_pole_is_covered_at_the_same_spacing(void **state)
{
    struct lumi_vec3 points[COUNT], list[COUNT];
    bool kept[COUNT];
    int count = keep(1, list, kept);

    (void)state;
    make_rig(points);
    const struct lumi_spacing spacing = lumi_spacing_measure(COUNT, points, centre);
    for (int bottom = 0; bottom < 2; bottom++) {
        g_autofree struct lumi_pose *poses = NULL;
        const double gap = lumi_pole_gap(COUNT, points, centre, bottom);
        assert_float_equal(gap, 18 * LUMI_PI / 180, 0.003);
        const int added = lumi_pole_poses(centre, 0.5, gap, bottom, false, spacing, 1, &poses);
        assert_true(added > 5);
        for (int i = 0; i < added; i++) {
            const struct lumi_vec3 out = lumi_sub(poses[i].t, centre);
            assert_true(lumi_pose_valid(&poses[i], 1e-9));
            assert_float_equal(lumi_length(out), 0.5, 1e-9);
            assert_float_equal(lumi_dot(lumi_axis(&poses[i], 2), out), 0.5, 1e-9); /* looks outwards */
            list[count++] = poses[i].t;
        }
    }
    double least, most;
    nearest_range(count, list, &least, &most);
    assert_true(most / least < 2.2);
    /* No direction near the pole is farther from a view than in the middle of an even cell, and half again. */
    for (int i = 0; i < 400; i++) {
        const double angle = 18 * LUMI_PI / 180 * sqrt(i / 400.0), turn = 2.399963 * i;
        const struct lumi_vec3 at =
            lumi_add(centre, lumi_scale(lumi_vec3(sin(angle) * cos(turn), sin(angle) * sin(turn), cos(angle)), 0.5));
        double nearest = INFINITY;
        for (int k = 0; k < count; k++)
            nearest = fmin(nearest, lumi_length(lumi_sub(list[k], at)));
        assert_true(nearest < 0.75 * hypot(spacing.east, spacing.north));
    }
}

static void a_cap_that_is_hardly_a_hole_stays_as_it_is(void **state)
{
    struct lumi_vec3 points[COUNT];
    struct lumi_pose *poses;

    (void)state;
    make_rig(points);
    const struct lumi_spacing spacing = lumi_spacing_measure(COUNT, points, centre);
    assert_int_equal(lumi_pole_poses(centre, 0.5, 4 * LUMI_PI / 180, false, false, spacing, 1, &poses), 0);
    g_free(poses);
    /* Half a sphere has no lower pole, a part of a turn none at all. */
    assert_true(lumi_pole_gap(COUNT / 2, points, centre, false) > 0);
    assert_true(lumi_pole_gap(COUNT / 2, points, centre, true) == 0);
    for (int i = 0; i < COUNT; i++)
        points[i].x = centre.x + fabs(points[i].x - centre.x);
    assert_true(lumi_pole_gap(COUNT, points, centre, false) == 0);
}

static void the_stand_is_below_the_rig_and_seen_by_those_that_look_down(void **state)
{
    struct lumi_stand stand;
    struct lumi_lens lens;
    struct lumi_pose pose;

    (void)state;
    assert_true(lumi_stand_place(centre, 0.5, 18 * LUMI_PI / 180, 0.6, 1.6, &stand));
    assert_true(lumi_stand_holds(&stand, lumi_vec3(1, 2, 2), 0.02));
    assert_true(lumi_stand_holds(&stand, lumi_vec3(1.5, 2, 1.7), 0.02));
    assert_false(lumi_stand_holds(&stand, lumi_vec3(1.5, 2, 2.4), 0.02));
    assert_false(lumi_stand_holds(&stand, lumi_vec3(1, 2, 1.61), 0.02)); /* the floor */
    assert_false(lumi_stand_holds(&stand, lumi_vec3(1, 2, 3.2), 0.02));
    assert_false(lumi_stand_place(centre, 0.5, 0, 0.6, 1.6, &stand));
    lumi_stand_place(centre, 0.5, 18 * LUMI_PI / 180, 0.6, 1.6, &stand);
    lumi_lens_init_pinhole(&lens, 320, 256, 80 * LUMI_PI / 180);
    lumi_pose_look(lumi_vec3(1.5, 2, 3), lumi_vec3(1, 0, 0), lumi_vec3(0, 0, 1), &pose);
    assert_false(lumi_stand_seen(&stand, &lens, &pose));
    lumi_pose_look(lumi_vec3(1.2, 2, 2.55), lumi_vec3(0.4, 0, -0.9), lumi_vec3(0, 0, 1), &pose);
    assert_true(lumi_stand_seen(&stand, &lens, &pose));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spacing_is_that_of_the_equator),
        cmocka_unit_test(what_is_kept_is_evenly_spaced_everywhere),
        cmocka_unit_test(density_is_views_an_area),
        cmocka_unit_test(the_order_of_the_pictures_does_not_matter),
        cmocka_unit_test(a_pole_is_covered_at_the_same_spacing),
        cmocka_unit_test(a_cap_that_is_hardly_a_hole_stays_as_it_is),
        cmocka_unit_test(the_stand_is_below_the_rig_and_seen_by_those_that_look_down),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
