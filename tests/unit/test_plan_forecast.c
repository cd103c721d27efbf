/* What a plan comes to: the paper's own figures, and every problem of a plan with its line. */
#include "proto/mechanism/plan_forecast.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

static void forecast(const char *rig_name, struct lumi_rig *rig, struct lumi_plan_forecast *f)
{
    struct lumi_plan plan;

    assert_int_equal(lumi_rig_builtin(rig_name, rig, NULL), LUMI_OK);
    assert_int_equal(lumi_plan_builtin("turn", rig, &plan, NULL), LUMI_OK);
    lumi_plan_forecast(&plan, rig, NULL, f);
}

/* Overbeck et al. 2018, section 3: "a light field viewing volume 60cm in diameter, and slightly smaller in height"; of
 * the other rig "slightly greater at 70cm". */
static void the_view_volume_is_the_paper_s(void **state)
{
    struct lumi_plan_forecast f;
    struct lumi_rig rig;

    (void)state;
    forecast("arc16", &rig, &f);
    assert_float_equal(f.volume, 0.35 * sin(55 * LUMI_PI / 180), 1e-3);
    assert_float_equal(f.volume_height, 0.35 * sin(44 * LUMI_PI / 180), 1e-3);
    forecast("bar2", &rig, &f);
    assert_float_equal(f.volume, 0.4 * sin(60 * LUMI_PI / 180), 1e-3);
}

static void a_camera_that_looks_aside_makes_the_volume_smaller(void **state)
{
    struct lumi_plan_forecast f;
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    rig.cameras[3].pan = 10 * LUMI_PI / 180;
    lumi_plan_init(&plan, &rig);
    lumi_plan_forecast(&plan, &rig, NULL, &f);
    assert_float_equal(f.volume, 0.35 * sin(45 * LUMI_PI / 180), 1e-3);
    rig.cameras[3].pan = 0;
    for (int i = 0; i < rig.camera_count; i++)
        rig.cameras[i].roll = LUMI_PI / 2; /* all on their sides */
    lumi_plan_forecast(&plan, &rig, NULL, &f);
    assert_float_equal(f.volume, 0.35 * sin(44 * LUMI_PI / 180), 1e-3);
    assert_float_equal(f.volume_height, 0.35 * sin(55 * LUMI_PI / 180), 1e-3);
}

static void twice_the_rows_are_sharp_twice_as_near(void **state)
{
    struct lumi_plan_forecast once, twice;
    struct lumi_rig rig;

    (void)state;
    forecast("arc16", &rig, &once);
    forecast("arc16x2", &rig, &twice);
    assert_float_equal(once.spacing, 0.35 * LUMI_PI / 16, 2e-3);
    assert_float_equal(twice.nearest / once.nearest, 0.5, 0.03);
    const struct lumi_lens *lens = &rig.lenses[0].lens;
    assert_float_equal(once.nearest, once.spacing * lens->fy / (192 * 0.6), 1e-9);
    assert_int_equal(once.rows, 16);
    assert_int_equal(twice.rows, 32);
    assert_int_equal(once.columns, 72);
}

static void bytes_are_the_cameras_pixels(void **state)
{
    double bytes[LUMI_RIG_CAMERAS] = {2};
    struct lumi_plan_forecast one, other;
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    lumi_plan_init(&plan, &rig);
    lumi_plan_forecast(&plan, &rig, NULL, &one);
    bytes[1] = 2;
    lumi_plan_forecast(&plan, &rig, bytes, &other);
    assert_float_equal(one.bytes, 2592.0 * rig.lenses[0].lens.width * rig.lenses[0].lens.height, 1);
    assert_float_equal(other.bytes, 2 * one.bytes, 1);
    assert_float_equal(one.bytes_per_second, one.bytes / one.seconds, 1);
    assert_true(one.blur > 0 && one.blur_near > one.blur);
}

static int problems(const char *text, struct lumi_plan_problem *list)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    return lumi_plan_problems(text, strlen(text), &rig, &plan, list, 4);
}

static void every_line_that_is_wrong_is_named(void **state)
{
    struct lumi_plan_problem list[4];

    (void)state;
    assert_int_equal(problems("[sweep]\nturns = 1\n", list), 0);
    assert_int_equal(problems("[sweep]\nturns = many\n# well\nmode = fast\nname = a\nspeed = 3\n", list), 3);
    assert_int_equal(list[0].line, 2);
    assert_int_equal(list[1].line, 4);
    assert_int_equal(list[2].line, 6);
    assert_null(strstr(list[2].text, ":6")); /* the line is told beside */
    assert_non_null(strstr(list[2].text, "speed"));
    assert_int_equal(problems("turns = 1\n", list), 1);
    assert_int_equal(problems("", list), 1);
    assert_int_equal(list[0].line, 0);
    assert_int_equal(problems("[sweep]\na\nb\nc\nd\ne\n", list), 5); /* four have room */
}

static void what_the_rig_cannot_do_is_named_with_the_line_that_wants_it(void **state)
{
    struct lumi_plan_problem list[4];

    (void)state;
    assert_int_equal(problems("[sweep]\npositions = 72\nexposure_s = 1/30\nname = hall\n", list), 1);
    assert_int_equal(list[0].line, 3);
    assert_non_null(strstr(list[0].text, "smears"));
    assert_int_equal(problems("[sweep]\nturns = 2\n", list), 1);
    assert_int_equal(list[0].line, 2);
    assert_int_equal(problems("[sweep]\nstops = -2 0 2\n", list), 1);
    assert_int_equal(list[0].line, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_view_volume_is_the_paper_s),
        cmocka_unit_test(a_camera_that_looks_aside_makes_the_volume_smaller),
        cmocka_unit_test(twice_the_rows_are_sharp_twice_as_near),
        cmocka_unit_test(bytes_are_the_cameras_pixels),
        cmocka_unit_test(every_line_that_is_wrong_is_named),
        cmocka_unit_test(what_the_rig_cannot_do_is_named_with_the_line_that_wants_it),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
