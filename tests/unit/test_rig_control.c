/* proto/mechanism: what a profile says to the board comes back from its text, and what cannot be is refused. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/rig.h"

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

static int parse(const char *text, struct lumi_rig *rig, struct lumi_error *error)
{
    return lumi_rig_parse(text, strlen(text), "test.rig", rig, error);
}

static void the_paper_s_rigs_have_sound_control(void **state)
{
    (void)state;
    for (int n = 0; lumi_rig_builtin_names[n]; n++) {
        struct lumi_rig rig = builtin(lumi_rig_builtin_names[n]);
        const struct lumi_rig_safety *s = &rig.control.safety;
        assert_true(rig.control.motion.speed_max > 2 * LUMI_PI / 30);
        assert_true(s->host_timeout == 5);
        assert_int_equal(s->reactions[LUMI_RIG_FAULT_ESTOP].motor, LUMI_RIG_MOTOR_HALT);
        assert_true(s->reactions[LUMI_RIG_FAULT_ESTOP].brake);
        assert_int_equal(s->reactions[LUMI_RIG_FAULT_ESTOP].triggers, LUMI_RIG_TRIGGERS_OFF);
        assert_int_equal(s->reactions[LUMI_RIG_FAULT_HOST_LOST].motor, LUMI_RIG_MOTOR_ROW_END);
        assert_true(rig.string.held == !s->wound_fitted);
        for (int i = 0; i < rig.camera_count; i++)
            assert_int_equal(rig.control.triggers[i].channel, i);
    }
}

/* A text of before there was control. */
static const char *const old_text =
    "[rig]\nname = old\n[drive]\nmotor_steps = 200\nmicrosteps = 16\ngear_motor = 9\n"
    "gear_platform = 1\ndirection = 1\n[sweep]\npositions = 72\nturns = 1\n[string]\n"
    "held = yes\nrun = arc\nlength_m = 1\nper_turn_m = 0.03\nhold_m = 0.4\n"
    "[lens wide]\nmodel = pinhole\nwidth = 640\nheight = 480\nfx = 300\nfy = 300\n"
    "[camera c0]\nlens = wide\nradius_m = 0.4\n[camera c1]\nlens = wide\nangle_deg = 9\n"
    "radius_m = 0.4\n";

static void a_text_without_control_has_the_defaults(void **state)
{
    struct lumi_rig_control usual;
    struct lumi_error error = {0};
    struct lumi_rig rig;

    (void)state;
    if (parse(old_text, &rig, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    lumi_rig_control_init(&usual);
    assert_memory_equal(&rig.control, &usual, sizeof usual);
}

static uint32_t next_random(uint32_t *seed)
{
    return *seed = *seed * 1664525u + 1013904223u;
}
static double random_in(uint32_t *seed, double low, double high)
{
    return low + (high - low) * (next_random(seed) / 4294967296.0);
}

/* Every number of the control, with no short decimal, in a rig of 16 cameras with names as long as they can be. */
static struct lumi_rig random_rig(uint32_t seed)
{
    struct lumi_rig rig = builtin("arc16x2");
    struct lumi_rig_motion *m = &rig.control.motion;
    struct lumi_rig_safety *s = &rig.control.safety;

    for (int i = 0; i < 16; i++) {
        struct lumi_rig_trigger *t = &rig.control.triggers[i];
        struct lumi_rig_camera *c = &rig.cameras[i];
        snprintf(c->name, sizeof c->name, "camera-with-the-longest-name-%02d", i);
        c->angle = -random_in(&seed, 1e-5, 1e-4);
        c->azimuth = -random_in(&seed, 1e-5, 1e-4);
        c->roll = c->pan = c->tilt = -random_in(&seed, 1e-5, 1e-4);
        c->offset_m = -random_in(&seed, 1e-5, 1e-4);
        c->radius = random_in(&seed, 0.1, 1);
        t->channel = i < 12 ? i : -1;
        t->focus_channel = i < 4 ? 12 + i : -1;
        t->focus_lead = i < 4 ? random_in(&seed, 0.1, 1) : 0;
        t->shutter_lag = random_in(&seed, 1e-5, 1e-4);
        t->pulse = random_in(&seed, 2e-5, 1e-4);
        t->busy = random_in(&seed, 1e-5, 1e-4);
        t->feedback = i < 4 ? 3 - i : -1;
    }
    rig.lens_count = 4;
    for (int i = 0; i < 4; i++) {
        struct lumi_lens *l = &rig.lenses[i].lens;
        *l = rig.lenses[0].lens;
        snprintf(rig.lenses[i].name, sizeof rig.lenses[i].name, "lens-with-the-longest-name-of-%d", i % 10);
        l->k1 = l->k2 = l->k3 = l->k4 = l->p1 = l->p2 = random_in(&seed, 1e-6, 1e-5);
        l->cx = random_in(&seed, 100, 600);
    }
    m->speed_max = random_in(&seed, 1, 2);
    m->acceleration_max = random_in(&seed, 2, 3);
    m->jerk_max = random_in(&seed, 20, 30);
    m->home_speed = random_in(&seed, 0.01, 0.1);
    m->wind_speed = random_in(&seed, 0.01, 0.1);
    m->backlash = random_in(&seed, 1e-5, 1e-4);
    m->index_window = random_in(&seed, 1e-5, 1e-4);
    m->settle = random_in(&seed, 1e-5, 1e-4);
    m->step_pulse = random_in(&seed, 1e-6, 2e-6);
    m->direction_setup = random_in(&seed, 1e-6, 2e-6);
    rig.control.video.record_pulse = random_in(&seed, 1e-5, 1e-4);
    rig.control.video.record_lead = random_in(&seed, 1e-5, 1e-4);
    rig.control.video.lamp_bit = random_in(&seed, 1e-2, 1e-1);
    s->host_timeout = random_in(&seed, 1, 10);
    s->supply_minimum = random_in(&seed, 10, 20);
    s->overspeed = random_in(&seed, 3, 4);
    for (int f = 0; f < LUMI_RIG_FAULTS; f++) {
        s->reactions[f].motor = next_random(&seed) >> 30 & 1 ? LUMI_RIG_MOTOR_OFF : LUMI_RIG_MOTOR_HALT;
        s->reactions[f].brake = true;
        s->reactions[f].triggers = LUMI_RIG_TRIGGERS_OFF;
    }
    return rig;
}

static void control_that_is_printed_parses_to_the_same_numbers_and_fits(void **state)
{
    static char text[LUMI_RIG_TEXT_MAX];
    size_t longest = 0;

    (void)state;
    for (uint32_t seed = 1; seed <= 50; seed++) {
        struct lumi_rig rig = random_rig(seed), back;
        struct lumi_error error = {0};
        if (lumi_rig_check(&rig, &error) != LUMI_OK)
            fail_msg("%s", error.text);
        size_t length = lumi_rig_print(&rig, text, sizeof text);
        assert_true(length < sizeof text);
        longest = length > longest ? length : longest;
        if (parse(text, &back, &error) != LUMI_OK)
            fail_msg("%s", error.text);
        assert_memory_equal(&back, &rig, sizeof rig);
    }
    assert_true(longest > 10000); /* as long as it gets, or nearly */
}

static void numbers_and_words_of_control_are_read(void **state)
{
    char text[4096];
    struct lumi_error error = {0};
    struct lumi_rig rig;

    (void)state;
    snprintf(text, sizeof text,
             "%schannel = 7\nshutter_lag_s = 0.06\nfocus_channel = 9\nfocus_lead_s = 0.5\nfeedback = 2\nbusy_s = 0.4\n"
             "[camera c2]\nlens = wide\nradius_m = 0.3\nchannel = none\n"
             "[motion]\nspeed_max_rad_s = 2\nacceleration_max_deg_s2 = 90\nbacklash_deg = 1\n"
             "[safety]\nbrake_fitted = yes\nslack =  triggers-finish,ramp ,brake\ndriver = off, brake, triggers-off\n"
             "overspeed_deg_s = 720\n",
             old_text);
    if (parse(text, &rig, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(rig.control.triggers[0].channel, 0);
    assert_int_equal(rig.control.triggers[1].channel, 7);
    assert_int_equal(rig.control.triggers[1].focus_channel, 9);
    assert_int_equal(rig.control.triggers[1].feedback, 2);
    assert_true(rig.control.triggers[1].shutter_lag == 0.06);
    assert_int_equal(rig.control.triggers[2].channel, -1);
    assert_true(rig.control.motion.speed_max == 2);
    assert_true(rig.control.motion.acceleration_max == 90 * (LUMI_PI / 180));
    assert_int_equal(rig.control.safety.reactions[LUMI_RIG_FAULT_SLACK].motor, LUMI_RIG_MOTOR_RAMP);
    assert_true(rig.control.safety.reactions[LUMI_RIG_FAULT_SLACK].brake);
    assert_int_equal(rig.control.safety.reactions[LUMI_RIG_FAULT_SLACK].triggers, LUMI_RIG_TRIGGERS_FINISH);
    assert_int_equal(rig.control.safety.reactions[LUMI_RIG_FAULT_DRIVER].motor, LUMI_RIG_MOTOR_OFF);
    assert_true(rig.control.safety.overspeed == 720 * (LUMI_PI / 180));
}

/* `lines` at the end of bar2's text, whose last section is camera c01's. */
static void refused_text(const char *from, const char *to, const char *reason)
{
    static char text[LUMI_RIG_TEXT_MAX], changed[LUMI_RIG_TEXT_MAX + 4096];
    struct lumi_rig rig = builtin("bar2"), back;
    struct lumi_error error = {0};

    lumi_rig_print(&rig, text, sizeof text);
    char *at = strstr(text, from);
    assert_non_null(at);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    int code = parse(changed, &back, &error);
    if (code >= 0 || !strstr(error.text, reason) || strchr(error.text, '\n'))
        fail_msg("'%s' → '%s': code %d, '%s'", from, to, code, error.text);
    assert_true(!strncmp(error.text, "test.rig", 8));
    assert_int_equal(lumi_exit_status(code), 3);
}

static void control_that_cannot_be_read_is_refused_with_the_line(void **state)
{
    (void)state;
    refused_text("estop = halt, brake, triggers-off", "estop = halt, wave, triggers-off", "'wave' is none of");
    refused_text("estop = halt, brake, triggers-off", "estop = halt, brake", "one of triggers-finish");
    refused_text("estop = halt, brake, triggers-off", "estop = halt, off, triggers-off", "one of row-end");
    refused_text("estop = halt, brake, triggers-off", "estop =", "none of");
    refused_text("estop = halt", "estop = ramp", "the motor stops at once");
    refused_text("estop = halt, brake, triggers-off", "estop = halt, brake, triggers-finish", "triggers-off wanted");
    refused_text("estop = halt", "estop = off", "no brake fitted the arm falls");
    refused_text("slack = halt", "slack = row-end", "row-end is for host-lost only");
    refused_text("drive = stepper", "drive = horse", "neither stepper nor external");
    refused_text("channel = 0", "channel = 16", "channel 16");
    refused_text("channel = 0", "channel = one", "neither a whole number nor none");
    refused_text("channel = 0", "channel = 1", "cameras 'c00' and 'c01' are both on channel 1");
    refused_text("focus_channel = none", "focus_channel = 1", "without a focus_lead");
    refused_text("speed_max_deg_s = 60", "speed_max_deg = 60", "no key 'speed_max_deg'");
    refused_text("speed_max_deg_s = 60", "speed_max_deg_s2 = 60", "no key");
    refused_text("jerk_max_deg_s3 = 2400", "jerk_max_deg_s3 = inf", "is no number");
    refused_text("[video]", "[safety]\n[video]", "section 'safety' comes twice");
}

static void cannot(const struct lumi_rig *rig, const char *reason)
{
    struct lumi_error error = {0};
    int code = lumi_rig_check(rig, &error);

    if (code != LUMI_ERR_FORMAT || !strstr(error.text, reason))
        fail_msg("wanted '%s', got %d: %s", reason, code, error.text);
    assert_null(strchr(error.text, '\n'));
    assert_true(strlen(error.text) < 160); /* what a reply of the board holds */
}

#define WITH(change, reason)                                                                                           \
    do {                                                                                                               \
        struct lumi_rig rig = builtin("bar2");                                                                         \
        struct lumi_rig_motion *m = &rig.control.motion;                                                               \
        struct lumi_rig_trigger *t = rig.control.triggers;                                                             \
        struct lumi_rig_safety *s = &rig.control.safety;                                                               \
        (void)m, (void)t, (void)s;                                                                                     \
        change;                                                                                                        \
        cannot(&rig, reason);                                                                                          \
    } while (0)

static void limits_of_motion_that_cannot_be_are_refused(void **state)
{
    (void)state;
    WITH(rig.gear_motor = 0, "a ratio of the drive is zero");
    WITH(m->drive = (enum lumi_rig_drive_kind)2, "drive 2");
    WITH(m->speed_max = 0, "speed_max of 0 rad/s");
    WITH(m->speed_max = NAN, "speed_max of nan rad/s");
    WITH(m->speed_max = 30, "steps/s, the board makes 100000");
    WITH(m->acceleration_max = -1, "acceleration_max of -1");
    WITH(m->acceleration_max = 0.001, "is reached in 1047");
    WITH(m->jerk_max = INFINITY, "jerk_max of inf");
    WITH(m->jerk_max = 1e-4, "jerk_max is too low");
    WITH(m->home_speed = 2, "home_speed of 2 rad/s");
    WITH(m->home_speed = NAN, "home_speed of nan");
    WITH((m->home_speed = 1e-4, rig.microsteps = 1), "home_speed of 0.0001 or wind_speed of 0.785398 rad/s is too low");
    WITH((m->wind_speed = 1e-4, rig.microsteps = 1), "wind_speed of 0.0001 rad/s is too low: steps 35.");
    WITH(m->wind_speed = 0, "wind_speed of 0");
    WITH(m->backlash = -0.1, "backlash of -0.1");
    WITH(m->backlash = NAN, "backlash of nan");
    WITH(m->index_window = 3, "index_window of 3 rad");
    WITH(m->settle = 100, "settle of 100 s");
    WITH(m->step_pulse = 0, "step_pulse of 0 s");
    WITH(m->step_pulse = 2e-4, "more than half");
    WITH(m->direction_setup = NAN, "direction_setup of nan s");
}

static void wirings_that_cannot_be_are_refused(void **state)
{
    (void)state;
    WITH(rig.camera_count = 17, "17 cameras");
    WITH(t[0].channel = 16, "channel 16");
    WITH(t[0].channel = -2, "channel -2");
    WITH(t[1].channel = 0, "'c00' and 'c01' are both on channel 0");
    WITH((t[1].focus_channel = 0, t[1].focus_lead = 0.1), "'c00' and 'c01' are both on channel 0");
    WITH((t[1].focus_channel = 1, t[1].focus_lead = 0.1), "'c01' and 'c01' are both on channel 1");
    WITH((t[1].focus_channel = 20, t[1].focus_lead = 0.1), "focus_channel 20");
    WITH(t[1].focus_lead = 0.1, "without a focus_channel");
    WITH(t[1].focus_channel = 5, "without a focus_lead");
    WITH((t[1].channel = -1, t[1].focus_channel = 5, t[1].focus_lead = 0.1), "focus_channel 5 without a channel");
    WITH(t[1].focus_lead = NAN, "focus_lead of nan");
    WITH(t[1].shutter_lag = -0.01, "shutter_lag of -0.01 s");
    WITH(t[1].shutter_lag = 11, "shutter_lag of 11 s");
    WITH(t[1].shutter_lag = NAN, "shutter_lag of nan s");
    WITH(t[1].pulse = 0, "pulse of 0 s");
    WITH(t[1].pulse = 20, "pulse of 20 s");
    WITH(t[1].busy = 61, "busy for 61 s");
    WITH(t[1].busy = -INFINITY, "busy for -inf s");
    WITH(t[1].feedback = 4, "feedback 4");
    WITH(t[1].feedback = 0, "both on feedback input 0");
    WITH(rig.control.video.lamp_bit = 0, "lamp_bit of 0 s");
    WITH(rig.control.video.record_pulse = -1, "record_pulse of -1 s");
    WITH(rig.control.video.record_lead = NAN, "record_lead of nan s");
}

static void reactions_that_let_the_arm_fall_are_refused(void **state)
{
    (void)state;
    for (int f = 0; f < LUMI_RIG_FAULTS; f++) {
        WITH(s->reactions[f].motor = LUMI_RIG_MOTOR_OFF, "no brake fitted the arm falls");
        WITH((s->brake_fitted = true, s->reactions[f].motor = LUMI_RIG_MOTOR_OFF, s->reactions[f].brake = false),
             "the brake open the arm falls");
        if (f != LUMI_RIG_FAULT_HOST_LOST)
            WITH(s->reactions[f].motor = LUMI_RIG_MOTOR_ROW_END, "row-end is for host-lost only");
        WITH(s->reactions[f].motor = (enum lumi_rig_motor_reaction)4, "4 is nothing a motor can do");
        WITH(s->reactions[f].triggers = (enum lumi_rig_trigger_reaction)2, "2 is nothing triggers can do");
    }
    WITH(s->reactions[LUMI_RIG_FAULT_ESTOP].motor = LUMI_RIG_MOTOR_RAMP, "the motor stops at once");
    WITH(s->host_timeout = NAN, "host_timeout of nan");
    WITH(s->host_timeout = 0.01, "shorter than 0.1 s");
    WITH(s->supply_minimum = -1, "supply_minimum of -1");
    WITH(s->overspeed = 0.5, "overspeed of 0.5 rad/s is not above speed_max");
    WITH(s->overspeed = NAN, "overspeed of nan");

    struct lumi_rig held = builtin("arc16");
    for (int f = 0; f < LUMI_RIG_FAULTS; f++)
        held.control.safety.reactions[f].motor = LUMI_RIG_MOTOR_OFF; /* nothing hangs on the motor */
    assert_int_equal(lumi_rig_check(&held, NULL), LUMI_OK);
}

static void before_the_sweep_s_start_the_arm_is_a_little_higher(void **state)
{
    struct lumi_rig rig = builtin("bar2");

    (void)state;
    assert_true(fabs(lumi_rig_drop(&rig, -0.1) + 0.003 / 0.4) < 1e-12);
    for (double turns = -0.5; turns <= 18; turns += 0.25)
        assert_true(fabs(lumi_rig_drop_turns(&rig, lumi_rig_drop(&rig, turns)) - turns) < 1e-9);
    rig.string = (struct lumi_rig_string){false, LUMI_RIG_RUN_STRAIGHT, 2, 0.03, 0.4, 0.6, 70 * (LUMI_PI / 180)};
    rig.turns = 12;
    assert_int_equal(lumi_rig_check(&rig, NULL), LUMI_OK);
    for (double turns = -0.5; turns <= 12; turns += 0.25) {
        assert_true(lumi_rig_drop(&rig, turns) < lumi_rig_drop(&rig, turns + 0.01));
        assert_true(fabs(lumi_rig_drop_turns(&rig, lumi_rig_drop(&rig, turns)) - turns) < 1e-9);
    }
    /* No higher than straight up, whatever the turns. */
    assert_true(fabs(rig.string.hold_angle - lumi_rig_drop(&rig, -1000) - LUMI_PI / 2) < 1e-9);
    struct lumi_rig held = builtin("arc16");
    assert_true(lumi_rig_drop(&held, -1) == 0 && lumi_rig_drop_turns(&held, 0.1) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_paper_s_rigs_have_sound_control),
        cmocka_unit_test(a_text_without_control_has_the_defaults),
        cmocka_unit_test(control_that_is_printed_parses_to_the_same_numbers_and_fits),
        cmocka_unit_test(numbers_and_words_of_control_are_read),
        cmocka_unit_test(control_that_cannot_be_read_is_refused_with_the_line),
        cmocka_unit_test(limits_of_motion_that_cannot_be_are_refused),
        cmocka_unit_test(wirings_that_cannot_be_are_refused),
        cmocka_unit_test(reactions_that_let_the_arm_fall_are_refused),
        cmocka_unit_test(before_the_sweep_s_start_the_arm_is_a_little_higher),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
