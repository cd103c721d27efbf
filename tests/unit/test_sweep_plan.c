/* proto/mechanism: the paper's sweeps are what the paper says they are, and what a rig cannot do is refused. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/ramp_time.h"
#include "proto/mechanism/sweep_plan.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct lumi_rig builtin(const char *name)
{
    struct lumi_error error = {0};
    struct lumi_rig rig;

    if (lumi_rig_builtin(name, &rig, &error) != LUMI_OK)
        fail_msg("%s: %s", name, error.text);
    return rig;
}

static struct lumi_plan plan_for(const struct lumi_rig *rig)
{
    struct lumi_plan plan;

    lumi_plan_init(&plan, rig);
    return plan;
}

static void can(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    struct lumi_error error = {0};

    if (lumi_plan_check(plan, rig, &error) != LUMI_OK)
        fail_msg("%s: %s", plan->name, error.text);
}

static void cannot(const struct lumi_plan *plan, const struct lumi_rig *rig, const char *reason)
{
    struct lumi_error error = {0};
    int code = lumi_plan_check(plan, rig, &error);

    if (code != LUMI_ERR_FORMAT || !strstr(error.text, reason) || strchr(error.text, '\n'))
        fail_msg("wanted '%s', got %d: %s", reason, code, error.text);
    assert_true(strlen(error.text) < 160); /* what a reply of the board holds */
    assert_int_equal(lumi_exit_status(code), 3);
}

static void arc16_turns_once_in_30_60_and_120_seconds(void **state)
{
    const double times[] = {30, 60, 120};

    (void)state;
    for (int t = 0; t < 3; t++) {
        struct lumi_rig rig = builtin("arc16");
        struct lumi_plan plan = plan_for(&rig);
        plan.turn_time = times[t];
        can(&plan, &rig);
        assert_int_equal(lumi_plan_shots(&plan), 72);
        assert_int_equal(lumi_plan_frames(&plan, &rig), 16 * 72);
        assert_true(lumi_plan_seconds(&plan, &rig) > times[t] * 71 / 72);
        assert_true(lumi_plan_seconds(&plan, &rig) < times[t] + 2);
        plan.mode = LUMI_PLAN_START_STOP; /* "for the longer settings" */
        if (t == 0) {
            cannot(&plan, &rig, "0.416667 s a position: the move takes 0.4");
            continue;
        }
        can(&plan, &rig);
        assert_int_equal(lumi_plan_frames(&plan, &rig), 16 * 72);
        assert_true(fabs(lumi_plan_seconds(&plan, &rig) - times[t]) < 1.5);
    }
}

static void two_turns_of_arc16_take_32_rows(void **state)
{
    struct lumi_rig rig = builtin("arc16x2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    can(&plan, &rig);
    assert_int_equal(lumi_plan_shots(&plan), 144);
    assert_int_equal(lumi_plan_frames(&plan, &rig), 32 * 72);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.turn_time = 60;
    can(&plan, &rig);
}

static void bar2_takes_2592_frames_in_about_nine_minutes(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    can(&plan, &rig);
    assert_int_equal(plan.turns, 18);
    assert_int_equal(lumi_plan_shots(&plan), 1296);
    assert_int_equal(lumi_plan_frames(&plan, &rig), 2592);
    assert_true(fabs(lumi_plan_seconds(&plan, &rig) / 60 - 9) < 0.05);
}

static void bar2_with_brackets_takes_7776_frames_in_about_33_minutes(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);
    const double stops[3] = {0.25, 1, 4};

    (void)state;
    plan.mode = LUMI_PLAN_START_STOP;
    plan.position_time = 1.5;
    plan.bracket = 3;
    for (int k = 0; k < 3; k++)
        plan.exposures[k] = stops[k] / 60;
    can(&plan, &rig);
    assert_int_equal(lumi_plan_shots(&plan), 3888);
    assert_int_equal(lumi_plan_frames(&plan, &rig), 7776);
    assert_true(fabs(lumi_plan_seconds(&plan, &rig) / 60 - 32.5) < 0.6);
    /* Every camera has its time: one exposure, its busy time and its lag later comes the next. */
    assert_true(lumi_plan_exposure_offset(&plan, &rig, 1) >= 1.0 / 240 + 0.08 + 0.05 - 1e-12);
    plan.position_time = 0.9;
    cannot(&plan, &rig, "0.9 s a position: the move takes");
    plan.position_time = 1.5;
    plan.exposures[2] = 1;
    cannot(&plan, &rig, "1.5 s a position");
}

static void a_video_has_no_shots_and_turns_its_whole_turns(void **state)
{
    struct lumi_rig rig = builtin("arc16x2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    plan.mode = LUMI_PLAN_VIDEO;
    can(&plan, &rig);
    assert_int_equal(lumi_plan_shots(&plan), 0);
    assert_int_equal(lumi_plan_frames(&plan, &rig), 0);
    assert_true(lumi_plan_seconds(&plan, &rig) > 60 && lumi_plan_seconds(&plan, &rig) < 62);
    rig.control.triggers[3].channel = -1;
    plan.cameras = 0x8;
    cannot(&plan, &rig, "camera 'c03' has no channel for its record line");
    for (int i = 0; i < 16; i++)
        rig.control.triggers[i].channel = -1;
    plan.cameras = 0;
    cannot(&plan, &rig, "no camera has a channel for its record line");
    plan.mode = LUMI_PLAN_CONTINUOUS;
    cannot(&plan, &rig, "no camera has a channel for its trigger");
    rig = builtin("arc16x2");
    plan.mode = LUMI_PLAN_VIDEO;
    rig.control.video.lamp_bit = 2;
    cannot(&plan, &rig, "the lamp's code takes 34 s, a turn 30 s");
}

static void the_paper_s_limit_of_blur_passes_and_a_little_more_does_not(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    rig.lenses[0].lens.fx = rig.lenses[0].lens.fy = 20 * 180 / LUMI_PI; /* 20 pixels a degree */
    plan.turn_time = 30;
    plan.exposures[0] = 1.0 / 250;
    can(&plan, &rig);
    assert_true(fabs(lumi_plan_blur(&plan, &rig) - 0.96) < 1e-9);
    plan.exposures[0] = 1.0 / 200;
    cannot(&plan, &rig, "smears 1.2 pixels, 1 are allowed");
    plan.blur_max = 1.25;
    can(&plan, &rig);
    plan.blur_max = 0;
    plan.turn_time = 60; /* half as fast */
    can(&plan, &rig);
    plan.mode = LUMI_PLAN_START_STOP; /* stands */
    plan.exposures[0] = 1.0 / 4;
    plan.turn_time = 120;
    can(&plan, &rig);
    assert_true(lumi_plan_blur(&plan, &rig) == 0);
    /* A camera on its side smears along the other side of its image. */
    plan = plan_for(&rig);
    rig.lenses[0].lens.fy *= 2;
    can(&plan, &rig);
    rig.cameras[1].roll = LUMI_PI / 2;
    cannot(&plan, &rig, "smears 1.92 pixels");
}

static void a_plan_that_outruns_motor_board_or_cameras_is_refused(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    plan.exposures[0] = 1e-4;
    plan.turn_time = 5;
    cannot(&plan, &rig, "a turn in 5 s is 1.25664 rad/s, the motor makes 1.0472 (a turn in 6 s)");
    plan.turn_time = 9;
    cannot(&plan, &rig, "positions pass every 0.125 s, the cameras take a picture every");
    plan.positions = 24;
    can(&plan, &rig);
    rig.microsteps = 256;
    rig.gear_motor = 15;
    plan.turn_time = 7.6;
    cannot(&plan, &rig, "steps/s, the board makes 100000");
    rig = builtin("bar2");
    plan = plan_for(&rig);
    plan.bracket = 2;
    plan.exposures[1] = 1e-3;
    cannot(&plan, &rig, "2 exposures a position while turning");
    plan = plan_for(&rig);
    rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    cannot(&plan, &rig, "an external drive makes start-stop sweeps only");
    plan = plan_for(&rig); /* made for that drive */
    can(&plan, &rig);
    rig = builtin("bar2");
    plan = plan_for(&rig);
    rig.control.triggers[1].busy = 0.4;
    cannot(&plan, &rig, "positions pass every 0.416667 s, the cameras take a picture every 0.455 s");
    rig.control.triggers[1].busy = 0;
    rig.control.triggers[1].pulse = 0.42;
    cannot(&plan, &rig, "take a picture every 0.426 s");
    plan.cameras = 1; /* the other one can */
    can(&plan, &rig);
}

static void turns_beyond_the_string_or_with_the_arm_held_are_refused(void **state)
{
    struct lumi_rig rig = builtin("bar2"), held = builtin("arc16");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    plan.first_turn = 10;
    plan.turns = 8;
    can(&plan, &rig);
    plan.turns = 40;
    cannot(&plan, &rig, "of string, there are 1.25664 m");
    plan.first_turn = 250;
    cannot(&plan, &rig, "of string");
    plan.first_turn = 256;
    cannot(&plan, &rig, "first turn 256");
    plan = plan_for(&held);
    plan.turns = 2;
    cannot(&plan, &held, "with the arm held by its brake");
    plan.turns = 1;
    plan.first_turn = 1;
    cannot(&plan, &held, "turn 1 of an arm that is held");
}

static void numbers_that_cannot_be_are_refused(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan good = plan_for(&rig), plan;

    (void)state;
#define WITH(change, reason)                                                                                           \
    do {                                                                                                               \
        plan = good;                                                                                                   \
        change;                                                                                                        \
        cannot(&plan, &rig, reason);                                                                                   \
    } while (0)
    WITH(plan.name[0] = '/', "no usable name");
    WITH(plan.mode = (enum lumi_plan_mode)7, "mode 7");
    WITH(plan.wind = (enum lumi_plan_wind) - 1, "wind -1");
    WITH(plan.positions = 0, "0 positions");
    WITH(plan.positions = 5000, "5000 positions");
    WITH(plan.turns = 0, "0 turns");
    WITH(plan.turns = 300, "300 turns");
    WITH(plan.first_turn = -1, "first turn -1");
    WITH(plan.turn_time = NAN, "a turn in nan s");
    WITH((plan.turn_time = 86400, rig.microsteps = 1), "steps 48.");
    rig.microsteps = 16;
    WITH(plan.turn_time = 0, "a turn in 0 s");
    WITH(plan.turn_time = INFINITY, "a turn in inf s");
    WITH(plan.position_time = NAN, "a position in nan s");
    WITH(plan.settle = NAN, "settle of nan s");
    WITH(plan.bracket = 0, "0 exposures");
    WITH(plan.bracket = 10, "10 exposures");
    WITH(plan.exposures[0] = 0, "an exposure of 0 s");
    WITH(plan.exposures[0] = NAN, "an exposure of nan s");
    WITH(plan.bracket_gap = -1, "bracket gap of -1 s");
    WITH(plan.blur_max = NAN, "a blur of nan pixels");
    WITH(plan.cameras = 0x4, "the plan names camera 2, the rig has 2");
    WITH((plan.positions = 4096, plan.turns = 3), "3 turns of 4096 positions with 1 exposures are 12288 shots");
    WITH((plan.positions = 4096, plan.turns = 1, rig.microsteps = 1), "1800 steps a turn cannot reach 4096");
#undef WITH
}

static void positions_of_a_plan_fall_on_the_nearest_step_without_drift(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    rig.gear_motor = 55;
    rig.gear_platform = 7;
    plan.positions = 37;
    plan.first_turn = 3;
    for (int i = 0; i < 37 * 15; i++) {
        double wanted = lumi_rig_steps_per_turn(&rig) * (3 + i / 37.0);
        assert_true(fabs((double)lumi_plan_position_step(&plan, &rig, i) - wanted) <= 0.5 + 1e-6);
    }
    plan.positions = rig.positions;
    plan.first_turn = 0;
    for (int i = 0; i < 72 * 18; i++)
        assert_int_equal(lumi_plan_position_step(&plan, &rig, i), lumi_rig_position_step(&rig, i));
}

/* The formula against a move that is integrated in small steps from its own phases. */
static void a_move_takes_the_time_that_its_phases_take(void **state)
{
    const double cases[][4] = {{0.0873, 1, 3, 40},  {0.0873, 0.2, 3, 40}, {2, 1, 3, 40},  {0.001, 1, 3, 40},
                               {0.0873, 1, 100, 2}, {0.5, 1, 3, 4},       {3, 10, 3, 400}};

    (void)state;
    for (unsigned n = 0; n < sizeof cases / sizeof *cases; n++) {
        double d = cases[n][0], v = cases[n][1], a = cases[n][2], j = cases[n][3];
        double peak = lumi_move_speed(d, v, a, j), rise = fmin(a, sqrt(peak * j)) / j;
        double ramp = lumi_ramp_time(peak, a, j), total = lumi_move_time(d, v, a, j);
        double flat = ramp - 2 * rise, dt = total / 200000, acceleration = 0, speed = 0, place = 0, fastest = 0;
        assert_true(flat > -1e-9 && peak <= v + 1e-12);
        for (int i = 0; i < 200000; i++) {
            double t = (i + 0.5) * dt, u = fmin(t, total - t), sign = t < total / 2 ? 1 : -1;
            acceleration = u < rise ? j * u : u < rise + flat ? j * rise : u < ramp ? j * (ramp - u) : 0;
            assert_true(acceleration <= a * (1 + 1e-9));
            place += (speed + sign * acceleration * dt / 2) * dt;
            speed += sign * acceleration * dt;
            fastest = fmax(fastest, speed);
        }
        assert_true(fabs(speed) < 1e-4 * peak);
        assert_true(fabs(place - d) < 1e-4 * d);
        assert_true(fastest <= v * (1 + 1e-4));
        assert_true(fabs(lumi_ramp_distance(peak, a, j) * 2 + (total - 2 * ramp) * peak - d) < 1e-9 * d);
    }
}

static void the_run_up_is_ramp_backlash_and_margin(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);
    const struct lumi_rig_motion *m = &rig.control.motion;

    (void)state;
    double v = lumi_plan_speed(&plan), ramp = lumi_ramp_distance(v, m->acceleration_max, m->jerk_max);
    double held = v * (LUMI_PLAN_CRUISE_MARGIN + plan.exposures[0] / 2), swing = v * LUMI_PLAN_SWING_MARGIN;
    double play = rig.control.motion.backlash;
    assert_true(fabs(v - 2 * LUMI_PI / 30) < 1e-12);
    assert_true(fabs(lumi_plan_run_up(&plan, &rig) * 2 * LUMI_PI - ramp - play - swing - held) < 1e-9);
    assert_true(fabs(lumi_plan_run_down(&plan, &rig) * 2 * LUMI_PI - ramp - held) < 1e-9);
    assert_true(fabs(lumi_plan_span(&plan) - (18 - 1 / 72.0)) < 1e-12);
    double seconds = lumi_plan_seconds(&plan, &rig);
    rig.control.motion.backlash = 0.2;
    assert_true(fabs(lumi_plan_run_up(&plan, &rig) * 2 * LUMI_PI - ramp - 0.2 - swing - held) < 1e-9);
    assert_true(fabs(lumi_plan_run_down(&plan, &rig) * 2 * LUMI_PI - ramp - held) < 1e-9);
    assert_true(fabs(lumi_plan_seconds(&plan, &rig) - seconds - (0.2 - play) / v) < 1e-9);
}

/* A position is ready when the cameras' lines have had their lead, and over when the last of them has fallen. */
static void focus_lines_and_long_pulses_take_their_time_at_a_position(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan = plan_for(&rig);

    (void)state;
    plan.mode = LUMI_PLAN_START_STOP;
    plan.position_time = 1.2;
    can(&plan, &rig);
    rig.control.triggers[1].focus_channel = 5;
    rig.control.triggers[1].focus_lead = 1;
    assert_int_equal(lumi_rig_check(&rig, NULL), LUMI_OK);
    can(&plan, &rig);
    rig.control.triggers[1].focus_lead = 1.15;
    cannot(&plan, &rig, "the first exposure begins after 1.2 s");
    rig = builtin("bar2");
    rig.control.triggers[1].pulse = 0.4;
    cannot(&plan, &rig, "all is done after 1.28667 s");
    plan.cameras = 1;
    can(&plan, &rig);
}

/* ---- Text ---- */

static int parse(const char *text, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    return lumi_plan_parse(text, strlen(text), "test.plan", rig, plan, error);
}

static void a_plan_that_is_printed_parses_to_the_same_numbers(void **state)
{
    char text[LUMI_PLAN_TEXT_MAX];
    unsigned seed = 7;

    (void)state;
    for (int round = 0; round < 60; round++) {
        struct lumi_rig rig = builtin(lumi_rig_builtin_names[round % 3]);
        struct lumi_plan plan = plan_for(&rig), back;
        struct lumi_error error = {0};
        plan.mode = (enum lumi_plan_mode)(round % 3);
        plan.wind = (enum lumi_plan_wind)(round / 3 % 3);
        plan.turn_time = 240 + round / 7.0;
        plan.cameras = round & 4 ? 3 : 0;
        plan.settle = round & 1 ? 0.1 + round / 190.0 : -1;
        plan.bracket = plan.mode == LUMI_PLAN_START_STOP ? 1 + round % LUMI_PLAN_BRACKET : 1;
        plan.bracket_gap = round / 1e4;
        plan.blur_max = round / 3.0;
        for (int k = 0; k < plan.bracket; k++) {
            seed = seed * 1664525u + 1013904223u;
            plan.exposures[k] = seed & 64 ? 1.0 / (250 + k) : (seed % 4000 + 10) / 1e6 / 3;
        }
        size_t length = lumi_plan_print(&plan, &rig, text, sizeof text);
        assert_true(length < sizeof text && strlen(text) == length);
        assert_int_equal(lumi_plan_print(&plan, &rig, NULL, 0), length);
        if (parse(text, &rig, &back, &error) != LUMI_OK)
            fail_msg("%s\n%s", error.text, text);
        assert_memory_equal(&back, &plan, sizeof plan);
    }
}

static void all_cameras_can_be_named_in_one_line(void **state)
{
    char text[LUMI_PLAN_TEXT_MAX];
    struct lumi_rig rig = builtin("arc16");
    struct lumi_plan plan = plan_for(&rig), back;
    struct lumi_error error = {0};

    (void)state;
    for (int i = 0; i < 16; i++)
        snprintf(rig.cameras[i].name, sizeof rig.cameras[i].name, "camera-with-the-longest-name-%02d", i);
    plan.cameras = 0xffff;
    assert_true(lumi_plan_print(&plan, &rig, text, sizeof text) < sizeof text);
    if (parse(text, &rig, &back, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_memory_equal(&back, &plan, sizeof plan);
}

static void exposures_are_listed_or_given_by_stops(void **state)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(parse("[sweep]\nmode = start-stop\nposition_time_s = 1.5\nexposure_s = 1/60\nstops = -2 0, 2\n",
                           &rig, &plan, NULL),
                     LUMI_OK);
    assert_int_equal(plan.bracket, 3);
    assert_true(plan.exposures[0] == 1.0 / 240 && plan.exposures[1] == 1.0 / 60 && plan.exposures[2] == 4.0 / 60);
    assert_int_equal(lumi_plan_frames(&plan, &rig), 7776);
    assert_int_equal(parse("# quick\n[sweep]\nmode = start-stop\nposition_time_s = 1.5\ncameras = c01\n"
                           "exposures_s = 1/1000, 1 / 250, 0.02\n",
                           &rig, &plan, NULL),
                     LUMI_OK);
    assert_int_equal(plan.bracket, 3);
    assert_int_equal(plan.cameras, 2);
    assert_true(plan.exposures[0] == 1.0 / 1000 && plan.exposures[1] == 1.0 / 250 && plan.exposures[2] == 0.02);
    assert_int_equal(parse("[sweep]\n", &rig, &plan, NULL), LUMI_OK); /* what the rig is meant for */
    assert_string_equal(plan.name, "bar2");
    assert_int_equal(lumi_plan_frames(&plan, &rig), 2592);
}

static void without_a_rig(const char *text, const char *reason)
{
    struct lumi_error error = {0};
    int code = lumi_plan_check_text(text, strlen(text), "test.plan", &error);

    assert_int_equal(code, reason ? LUMI_ERR_FORMAT : LUMI_OK);
    if (reason)
        assert_string_equal(error.text, reason);
}

/* What a rig can do is another question. */
static void whether_it_is_a_plan_at_all_is_known_without_a_rig(void **state)
{
    (void)state;
    without_a_rig("[sweep]\n", NULL);
    without_a_rig("[sweep]\nmode = start-stop\ncameras = nobody, c01\nexposures_s = 1/1000, 1 / 250\n", NULL);
    without_a_rig("[sweep]\nmode = continuous\n\nspeed = 7\n", "test.plan:4: a plan has no key 'speed'");
    without_a_rig("", "test.plan: section 'sweep' is missing");
    without_a_rig("[sweep]\nstops = 1\n", "test.plan: stops about what? exposure_s is missing");
}

static void refused(const char *text, const char *reason)
{
    struct lumi_rig rig = builtin("bar2");
    struct lumi_error error = {0};
    struct lumi_plan plan;
    int code = parse(text, &rig, &plan, &error);

    if (code >= 0 || !strstr(error.text, reason))
        fail_msg("'%s': code %d, '%s'", text, code, error.text);
    assert_true(!strncmp(error.text, "test.plan", 9));
    assert_int_equal(lumi_exit_status(code), 3);
    assert_int_equal(parse(text, &rig, &plan, NULL), code);
}

static void plans_that_cannot_be_read_are_refused_with_the_line(void **state)
{
    (void)state;
    refused("", "section 'sweep' is missing");
    refused("mode = video\n", "test.plan:1: a key before the section");
    refused("[sweep]\n[sweep]\n", "test.plan:2: section 'sweep' comes twice");
    refused("[sleep]\n", "the section [sweep] and no other");
    refused("[sweep]\nmode\n", "test.plan:2: neither a section nor");
    refused("[sweep]\nmood = video\n", "no key 'mood'");
    refused("[sweep]\nmode = sideways\n", "'sideways' is none of continuous, start-stop, video");
    refused("[sweep]\nwind = up\n", "'up' is none of plan, full, none");
    refused("[sweep]\nturns = 1\nturns = 1\n", "test.plan:3: 'turns' comes twice");
    refused("[sweep]\nturns = 1.5\n", "no whole number");
    refused("[sweep]\nturn_time_s = fast\n", "'fast' is no number");
    refused("[sweep]\nturn_time_s = nan\n", "'nan' is no number");
    refused("[sweep]\nsettle_s = -1\n", "neither a time nor profile");
    refused("[sweep]\nexposures_s = 1/0\n", "'1/0' is no number");
    refused("[sweep]\nexposures_s = 1/x\n", "is no number");
    refused("[sweep]\nexposures_s = ,\n", "nothing is listed");
    refused("[sweep]\nexposures_s = 1,1,1,1,1,1,1,1,1,1\n", "more than 9 exposures");
    refused("[sweep]\nexposures_s = 1/250\nexposure_s = 1/250\n", "either exposures_s, or");
    refused("[sweep]\nstops = 0\n", "exposure_s is missing");
    refused("[sweep]\nexposure_s = 1/60\nstops = 400\n", "400 stops");
    refused("[sweep]\ncameras = c00 c09\n", "no camera 'c09'");
    refused("[sweep]\ncameras =\n", "nothing is listed");
    refused("[sweep]\nname = a-name-that-is-much-too-long-to-be-one\n", "too long");
    refused("[sweep]\nexposures_s = 1/20\n", "test.plan: an exposure of 0.05 s at a turn in 30 s smears");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arc16_turns_once_in_30_60_and_120_seconds),
        cmocka_unit_test(two_turns_of_arc16_take_32_rows),
        cmocka_unit_test(bar2_takes_2592_frames_in_about_nine_minutes),
        cmocka_unit_test(bar2_with_brackets_takes_7776_frames_in_about_33_minutes),
        cmocka_unit_test(a_video_has_no_shots_and_turns_its_whole_turns),
        cmocka_unit_test(the_paper_s_limit_of_blur_passes_and_a_little_more_does_not),
        cmocka_unit_test(a_plan_that_outruns_motor_board_or_cameras_is_refused),
        cmocka_unit_test(turns_beyond_the_string_or_with_the_arm_held_are_refused),
        cmocka_unit_test(numbers_that_cannot_be_are_refused),
        cmocka_unit_test(positions_of_a_plan_fall_on_the_nearest_step_without_drift),
        cmocka_unit_test(a_move_takes_the_time_that_its_phases_take),
        cmocka_unit_test(the_run_up_is_ramp_backlash_and_margin),
        cmocka_unit_test(focus_lines_and_long_pulses_take_their_time_at_a_position),
        cmocka_unit_test(a_plan_that_is_printed_parses_to_the_same_numbers),
        cmocka_unit_test(all_cameras_can_be_named_in_one_line),
        cmocka_unit_test(exposures_are_listed_or_given_by_stops),
        cmocka_unit_test(whether_it_is_a_plan_at_all_is_known_without_a_rig),
        cmocka_unit_test(plans_that_cannot_be_read_are_refused_with_the_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
