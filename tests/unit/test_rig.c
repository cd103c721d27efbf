/* proto/mechanism: the rigs of the paper stand where the paper says, and rigs that cannot be are refused. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/rig.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)

static struct lumi_rig builtin(const char *name)
{
    struct lumi_error error = {0};
    struct lumi_rig rig;

    if (lumi_rig_builtin(name, &rig, &error) != LUMI_OK)
        fail_msg("%s: %s", name, error.text);
    return rig;
}

static double elevation(const struct lumi_pose *pose)
{
    return asin(pose->t.z / lumi_length(pose->t));
}

/* Great-circle angle between two centres. */
static double between(struct lumi_vec3 a, struct lumi_vec3 b)
{
    return atan2(lumi_length(lumi_cross(a, b)), lumi_dot(a, b));
}

static void every_camera_lies_on_the_sphere_and_looks_outward(void **state)
{
    (void)state;
    for (int n = 0; lumi_rig_builtin_names[n]; n++) {
        struct lumi_rig rig = builtin(lumi_rig_builtin_names[n]);
        double radius = rig.cameras[0].radius;
        for (int i = 0; i < rig.positions * rig.turns; i++)
            for (int c = 0; c < rig.camera_count; c++) {
                struct lumi_pose pose;
                lumi_rig_camera_pose(&rig, c, (double)i / rig.positions, &pose);
                assert_true(lumi_pose_valid(&pose, 1e-12));
                assert_true(fabs(lumi_length(pose.t) - radius) < 1e-12);
                struct lumi_vec3 forward = lumi_axis(&pose, 2), out = lumi_scale(pose.t, 1 / radius);
                assert_true(lumi_length(lumi_sub(forward, out)) < 1e-12);
                assert_true(lumi_axis(&pose, 1).z < 1e-3);           /* image down is towards the tripod */
                assert_true(fabs(elevation(&pose)) < 89.9 * DEGREE); /* no camera at a pole */
                assert_true(fabs(lumi_axis(&pose, 0).z) < 1e-12);    /* the horizon is level */
            }
    }
}

static void arc16_has_16_even_rows_of_72_even_columns(void **state)
{
    struct lumi_rig rig = builtin("arc16");
    struct lumi_pose a, b;

    (void)state;
    assert_int_equal(rig.camera_count, 16);
    assert_int_equal(rig.positions * rig.turns, 72);
    assert_int_equal(lumi_rig_rows(&rig), 16);
    assert_true(rig.cameras[0].radius == 0.35);
    for (int c = 0; c < 16; c++) {
        lumi_rig_camera_pose(&rig, c, 0, &a);
        assert_true(fabs(elevation(&a) - (90 - 11.25 * (c + 0.5)) * DEGREE) < 1e-12);
        assert_int_equal(lumi_rig_row(&rig, c, 0), c);
        for (int i = 0; i < 72; i++) {
            lumi_rig_camera_pose(&rig, c, i / 72.0, &a);
            lumi_rig_camera_pose(&rig, c, (i + 1) / 72.0, &b);
            double step = atan2(b.t.y, b.t.x) - atan2(a.t.y, a.t.x);
            assert_true(fabs(remainder(step - 5 * DEGREE, 2 * LUMI_PI)) < 1e-9);
            assert_true(fabs(a.t.z - b.t.z) < 1e-12); /* the arm is held */
            assert_int_equal(lumi_rig_column(&rig, c, i), i);
        }
    }
    const struct lumi_lens *lens = &rig.lenses[0].lens;
    struct lumi_vec3 d;
    assert_true(lumi_lens_unproject(lens, 0, lens->height / 2.0, &d));
    assert_true(fabs(atan2(-d.x, d.z) - 55 * DEGREE) < 1e-9);
    assert_true(lumi_lens_unproject(lens, lens->width / 2.0, 0, &d));
    assert_true(fabs(atan2(-d.y, d.z) - 44 * DEGREE) < 1e-9);
}

static void two_turns_on_the_string_double_the_rows_of_the_arc(void **state)
{
    struct lumi_rig rig = builtin("arc16x2");
    struct lumi_pose a, b;
    double spacing = rig.cameras[0].angle - rig.cameras[1].angle;
    int seen[32] = {0};

    (void)state;
    assert_int_equal(lumi_rig_rows(&rig), 32);
    lumi_rig_camera_pose(&rig, 5, 0.25, &a);
    lumi_rig_camera_pose(&rig, 5, 1.25, &b);
    assert_true(fabs(elevation(&a) - elevation(&b) - spacing / 2) < 1e-12);
    lumi_rig_camera_pose(&rig, 6, 0.25, &a);
    assert_true(fabs(elevation(&b) - elevation(&a) - spacing / 2) < 1e-12);
    for (int c = 0; c < 16; c++)
        for (int t = 0; t < 2; t++)
            seen[lumi_rig_row(&rig, c, t)]++;
    for (int r = 0; r < 32; r++)
        assert_int_equal(seen[r], 1);
    assert_int_equal(lumi_rig_row(&rig, 0, 1), 1);
    assert_int_equal(lumi_rig_row(&rig, 1, 0), 2);
}

static void bar2_takes_2592_frames_on_two_spirals(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_pose a, b, next;
    int frames = rig.camera_count * rig.positions * rig.turns;

    (void)state;
    assert_int_equal(frames, 2592);
    assert_int_equal(rig.positions, 72);
    assert_int_equal(rig.turns, 18);
    for (int i = 0; i + 1 < 72 * 18; i++) {
        lumi_rig_camera_pose(&rig, 0, i / 72.0, &a);
        lumi_rig_camera_pose(&rig, 1, i / 72.0, &b);
        assert_true(lumi_length(lumi_add(a.t, b.t)) < 1e-12); /* opposite ends of the bar */
        assert_true(fabs(lumi_length(lumi_sub(a.t, b.t)) - 0.8) < 1e-12);
        lumi_rig_camera_pose(&rig, 0, (i + 1) / 72.0, &next);
        assert_true(next.t.z < a.t.z); /* down */
        lumi_rig_camera_pose(&rig, 1, (i + 1) / 72.0, &next);
        assert_true(next.t.z > b.t.z); /* up */
    }
    lumi_rig_camera_pose(&rig, 0, 3, &a);
    lumi_rig_camera_pose(&rig, 0, 4, &next);
    assert_true(fabs((elevation(&a) - elevation(&next)) * 0.4 - 0.03) < 1e-12); /* 3 cm of arc a turn */
    for (int t = 0; t < 18; t++) {
        assert_int_equal(lumi_rig_row(&rig, 0, t), t);
        assert_int_equal(lumi_rig_row(&rig, 1, t), 35 - t);
    }
    assert_int_equal(lumi_rig_column(&rig, 0, 10), 10);
    assert_int_equal(lumi_rig_column(&rig, 1, 10), 46);
}

/* No direction is farther from a camera's place than the grid's spacing says, but for the caps at the poles. */
static void the_cameras_cover_the_sphere(void **state)
{
    const struct {
        const char *name;
        double gap, cap; /* degrees */
    } wanted[] = {{"arc16", 6.3, 0}, {"arc16x2", 4.2, 0}, {"bar2", 5.0, 13.0}};

    (void)state;
    for (unsigned n = 0; n < 3; n++) {
        struct lumi_rig rig = builtin(wanted[n].name);
        int count = rig.positions * rig.turns * rig.camera_count, k = 0;
        struct lumi_vec3 *centres = malloc((size_t)count * sizeof *centres);
        for (int i = 0; i < rig.positions * rig.turns; i++)
            for (int c = 0; c < rig.camera_count; c++) {
                struct lumi_pose pose;
                lumi_rig_camera_pose(&rig, c, (double)i / rig.positions, &pose);
                centres[k++] = pose.t;
            }
        for (int i = 0; i < 500; i++) { /* a Fibonacci sphere */
            double z = 1 - (2 * i + 1) / 500.0, phi = i * LUMI_PI * (3 - sqrt(5)), r = sqrt(1 - z * z);
            struct lumi_vec3 d = lumi_vec3(r * cos(phi), r * sin(phi), z);
            double nearest = 10;
            if (90 - fabs(asin(z)) / DEGREE < wanted[n].cap)
                continue;
            for (int j = 0; j < count; j++)
                nearest = fmin(nearest, between(d, centres[j]));
            assert_true(nearest < wanted[n].gap * DEGREE);
        }
        free(centres);
    }
}

static void a_straight_string_follows_the_law_of_cosines(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    const struct lumi_rig_string *s = &rig.string;

    (void)state;
    rig.string = (struct lumi_rig_string){false, LUMI_RIG_RUN_STRAIGHT, 2, 0.03, 0.4, 0.6, 70 * DEGREE};
    rig.turns = 12;
    assert_int_equal(lumi_rig_check(&rig, NULL), LUMI_OK);
    for (int t = 0; t <= 12; t++) {
        double angle = s->hold_angle - lumi_rig_drop(&rig, t);
        struct lumi_vec3 hold = lumi_vec3(0.4 * cos(angle), 0, 0.4 * sin(angle)), anchor = lumi_vec3(0, 0, 0.6);
        double start = lumi_length(lumi_sub(lumi_vec3(0.4 * cos(s->hold_angle), 0, 0.4 * sin(s->hold_angle)), anchor));
        assert_true(fabs(lumi_length(lumi_sub(hold, anchor)) - start - t * 0.03) < 1e-12);
    }
}

static void positions_fall_on_the_nearest_step_without_drift(void **state)
{
    struct lumi_rig rig = builtin("bar2");

    (void)state;
    assert_true(lumi_rig_steps_per_turn(&rig) == 28800);
    assert_int_equal(lumi_rig_position_step(&rig, 72 * 18), 28800 * 18);
    rig.gear_motor = 55;
    rig.gear_platform = 7;
    for (int i = 0; i <= 72 * 18; i++) {
        int64_t step = lumi_rig_position_step(&rig, i);
        assert_true(fabs((double)step - lumi_rig_steps_per_turn(&rig) * i / 72) <= 0.5 + 1e-6);
        assert_true(fabs(lumi_rig_step_turns(&rig, step) - i / 72.0) < 0.51 / lumi_rig_steps_per_turn(&rig));
    }
    rig.direction = -1;
    assert_true(lumi_rig_turn_angle(&rig, 0.25) == -LUMI_PI / 2);
}

static void mounting_angles_turn_the_camera_the_way_they_say(void **state)
{
    struct lumi_rig rig = builtin("arc16");
    struct lumi_pose plain, turned;

    (void)state;
    lumi_rig_camera_pose(&rig, 7, 0, &plain);
    rig.cameras[7].pan = 0.1;
    lumi_rig_camera_pose(&rig, 7, 0, &turned);
    assert_true(fabs(lumi_dot(lumi_axis(&turned, 2), lumi_axis(&plain, 0)) - sin(0.1)) < 1e-12); /* to the right */
    rig.cameras[7].pan = 0;
    rig.cameras[7].tilt = 0.1;
    lumi_rig_camera_pose(&rig, 7, 0, &turned);
    assert_true(fabs(lumi_dot(lumi_axis(&turned, 2), lumi_axis(&plain, 1)) + sin(0.1)) < 1e-12); /* up */
    rig.cameras[7].tilt = 0;
    rig.cameras[7].offset_m = 0.02;
    lumi_rig_camera_pose(&rig, 7, 0, &turned);
    assert_true(fabs(lumi_dot(lumi_sub(turned.t, plain.t), lumi_axis(&plain, 0)) - 0.02) < 1e-12);
}

static int parse(const char *text, struct lumi_rig *rig, struct lumi_error *error)
{
    return lumi_rig_parse(text, strlen(text), "test.rig", rig, error);
}

static void what_is_printed_parses_to_the_same_numbers_bit_for_bit(void **state)
{
    static char text[LUMI_RIG_TEXT_MAX];
    unsigned seed = 1;

    (void)state;
    for (int n = 0; lumi_rig_builtin_names[n]; n++)
        for (int round = 0; round < 20; round++) {
            struct lumi_rig rig = builtin(lumi_rig_builtin_names[n]), back;
            struct lumi_error error = {0};
            for (int c = 0; c < rig.camera_count; c++) { /* angles no short decimal number hits */
                seed = seed * 1664525u + 1013904223u;
                rig.cameras[c].pan = round * (seed / 4294967296.0 - 0.5) / 20;
                rig.cameras[c].offset_m = round * (seed % 1000) / 3e5;
            }
            size_t length = lumi_rig_print(&rig, text, sizeof text);
            assert_true(length < sizeof text && strlen(text) == length);
            assert_int_equal(lumi_rig_print(&rig, NULL, 0), length);
            if (parse(text, &back, &error) != LUMI_OK)
                fail_msg("%s", error.text);
            assert_memory_equal(&back, &rig, sizeof rig);
        }
}

/* Replaces the first `from` in the printed arc16x2 by `to` and expects the parser to refuse with `reason`. */
static void refused(const char *from, const char *to, const char *reason)
{
    static char text[LUMI_RIG_TEXT_MAX], changed[LUMI_RIG_TEXT_MAX + 4096];
    struct lumi_rig rig = builtin("arc16x2"), back;
    struct lumi_error error = {0};

    lumi_rig_print(&rig, text, sizeof text);
    char *at = strstr(text, from);
    assert_non_null(at);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    int code = parse(changed, &back, &error);
    if (code >= 0 || !strstr(error.text, reason))
        fail_msg("'%s' → '%s': code %d, '%s'", from, to, code, error.text);
    assert_true(!strncmp(error.text, "test.rig", 8));
    assert_int_equal(lumi_exit_status(code), 3);
}

static void rigs_that_cannot_be_are_refused_with_the_reason(void **state)
{
    (void)state;
    refused("gear_motor = 9", "gear_motor = 0", "ratio of the drive is zero");
    refused("microsteps = 16", "microsteps = -1", "out of range");
    refused("direction = 1", "direction = 2", "1 or -1 wanted");
    refused("turns = 2", "turns = 200", "turns need");
    refused("held = no", "held = yes", "same row");
    refused("length_m = ", "length_m = 0.2 # ", "'0.2 # ");
    refused("[string]", "[string]\nlength_m = 0.2\n[lens x]\nmodel = pinhole\n[string]", "comes twice");
    refused("hold_m = 0.35", "hold_m = 5", "longer than its string");
    refused("[camera c00]", "[camera more]\nlens = wide\nangle_deg = 1\nradius_m = 0.35\n\n[camera c00]",
            "more than 16 cameras");
    refused("[camera c01]", "[camera c00]", "two cameras are called");
    refused("[camera c01]", "[camera ../c01]", "no usable name");
    refused("lens = wide", "lens = narrow", "no lens 'narrow'");
    refused("radius_m = 0.35", "radius_m = nan", "is no number");
    refused("radius_m = 0.35", "radius_m = 1e400", "is no number");
    refused("radius_m = 0.35", "radius_m = 0", "radius");
    refused("motor_steps = 200", "motor_steps = 200.5", "whole number");
    refused("motor_steps = 200", "motor_stops = 200", "no key 'motor_stops'");
    refused("motor_steps = 200", "motor_steps = 200\nmotor_steps = 200", "comes twice");
    refused("fx = ", "fx = -1\nk1 = ", "comes twice");
    refused("width = 1280", "width = 0", "out of range");
    refused("[drive]", "[drive", "']' is missing");
    refused("[drive]", "[engine]", "no section 'engine'");
    refused("[rig]\n", "", "before the first section");
    refused("positions = 72", "positions = 100000", "positions a turn");
    refused("positions = 72", "hello", "neither a section nor");
}

static void a_profile_that_is_cut_anywhere_is_refused_or_whole(void **state)
{
    static char text[LUMI_RIG_TEXT_MAX];
    struct lumi_rig rig = builtin("arc16"), back;
    size_t length = lumi_rig_print(&rig, text, sizeof text);
    int taken = 0;

    (void)state;
    for (size_t cut = 0; cut < length; cut++)
        if (lumi_rig_parse(text, cut, "cut", &back, NULL) == LUMI_OK) {
            assert_int_equal(lumi_rig_check(&back, NULL), LUMI_OK);
            taken++;
        }
    assert_true(taken > 0); /* fewer cameras are a rig too */
    assert_int_equal(lumi_rig_parse(text, 0, "empty", &back, NULL), LUMI_ERR_FORMAT);
}

static void other_numbers_of_cameras_and_turns_are_checked(void **state)
{
    struct lumi_error error;
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_arc(&rig, 17, 72, 1, 0.35, 64, 48, 1, 1, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "17 cameras"));
    assert_int_equal(lumi_rig_arc(&rig, 8, 36, 1, 0.35, 64, 48, 1, 1, &error), LUMI_OK);
    assert_int_equal(lumi_rig_bar(&rig, 36, 30, 0.4, 0.03, 64, 48, 1, 1, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_rig_bar(&rig, 36, 9, 0.4, 0.06, 64, 48, 1, 1, &error), LUMI_OK);
    assert_int_equal(lumi_rig_builtin("arc17", &rig, &error), LUMI_ERR_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_camera_lies_on_the_sphere_and_looks_outward),
        cmocka_unit_test(arc16_has_16_even_rows_of_72_even_columns),
        cmocka_unit_test(two_turns_on_the_string_double_the_rows_of_the_arc),
        cmocka_unit_test(bar2_takes_2592_frames_on_two_spirals),
        cmocka_unit_test(the_cameras_cover_the_sphere),
        cmocka_unit_test(a_straight_string_follows_the_law_of_cosines),
        cmocka_unit_test(positions_fall_on_the_nearest_step_without_drift),
        cmocka_unit_test(mounting_angles_turn_the_camera_the_way_they_say),
        cmocka_unit_test(what_is_printed_parses_to_the_same_numbers_bit_for_bit),
        cmocka_unit_test(rigs_that_cannot_be_are_refused_with_the_reason),
        cmocka_unit_test(a_profile_that_is_cut_anywhere_is_refused_or_whole),
        cmocka_unit_test(other_numbers_of_cameras_and_turns_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
