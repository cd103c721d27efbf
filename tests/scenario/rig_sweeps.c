/* The sweeps of Overbeck et al. 2018, section 3, in virtual time: every shot once, at its angle, as many as there. */
#include "rig_fixture.h"

/* The angle is met to this while turning. */
#define ANGLE_MOST 0.01
/* What is left of the swing at an exposure in start-stop. */
#define SWING_MOST 0.02

/* The arm's own angle, and the mark: string stretch, swing and what homing leaves. */
#define DROP_MOST 0.02
#define ZERO_MOST 0.01

/* What holds of every sweep: the arm is where its turns put it, and it took the plan's time, finding the position and
 * winding up aside. */
static void judge_whole(const struct rig_fixture *f, const struct rig_figures *figures)
{
    const double seconds = lumi_plan_seconds(&f->plan, &f->rig);

    assert_true(figures->drop_worst < DROP_MOST);
    assert_true(fabs(figures->zero) < ZERO_MOST);
    assert_true(figures->virtual_seconds > seconds && figures->virtual_seconds < seconds + 30);
}

static struct rig_figures sweep(const char *rig, enum lumi_plan_mode mode, double turn_time, int frames)
{
    struct rig_fixture f;
    struct rig_figures figures;
    char name[64];

    rig_fixture_init(&f, rig);
    f.plan.mode = mode;
    f.plan.turn_time = turn_time;
    rig_fixture_start(&f);
    figures = rig_fixture_sweep(&f);
    assert_int_equal(figures.exposures, frames);
    assert_int_equal(lumi_plan_frames(&f.plan, &f.rig), frames);
    snprintf(name, sizeof name, "%s %s %g s", rig, mode == LUMI_PLAN_CONTINUOUS ? "continuous" : "start-stop",
             turn_time);
    print_figures(name, &figures);
    judge_whole(&f, &figures);
    if (mode == LUMI_PLAN_CONTINUOUS) {
        assert_true(figures.angle_worst < ANGLE_MOST);
    } else {
        assert_true(figures.swing_worst < SWING_MOST);
        assert_true(figures.angle_worst < SWING_MOST);
    }
    rig_fixture_finish(&f);
    return figures;
}

static void sixteen_rows_in_30_60_and_120_s(void **state)
{
    (void)state;
    sweep("arc16", LUMI_PLAN_CONTINUOUS, 30, 1152);
    sweep("arc16", LUMI_PLAN_CONTINUOUS, 60, 1152);
    sweep("arc16", LUMI_PLAN_CONTINUOUS, 120, 1152);
}

static void sixteen_rows_stopping_at_each_of_72_positions(void **state)
{
    (void)state;
    sweep("arc16", LUMI_PLAN_START_STOP, 60, 1152);
    sweep("arc16", LUMI_PLAN_START_STOP, 120, 1152);
}

static void thirty_two_rows_in_two_turns_on_the_string(void **state)
{
    (void)state;
    sweep("arc16x2", LUMI_PLAN_CONTINUOUS, 30, 2304);
    sweep("arc16x2", LUMI_PLAN_CONTINUOUS, 60, 2304);
    sweep("arc16x2", LUMI_PLAN_CONTINUOUS, 120, 2304);
    sweep("arc16x2", LUMI_PLAN_START_STOP, 60, 2304);
    sweep("arc16x2", LUMI_PLAN_START_STOP, 120, 2304);
}

static void two_cameras_take_2592_frames_in_nine_minutes(void **state)
{
    struct rig_fixture f;

    (void)state;
    struct rig_figures figures = sweep("bar2", LUMI_PLAN_CONTINUOUS, 30, 2592);
    rig_fixture_init(&f, "bar2");
    assert_true(fabs(lumi_plan_seconds(&f.plan, &f.rig) - 540) < 10);
    /* With finding its position and winding up before it. */
    assert_true(figures.virtual_seconds > 540 && figures.virtual_seconds < 700);
}

static void two_cameras_take_7776_frames_with_brackets_in_33_minutes(void **state)
{
    struct rig_fixture f;

    (void)state;
    rig_fixture_init(&f, "bar2");
    f.plan.mode = LUMI_PLAN_START_STOP;
    f.plan.position_time = 1.5;
    f.plan.bracket = 3;
    f.plan.exposures[0] = 1.0 / 1000;
    f.plan.exposures[1] = 1.0 / 250;
    f.plan.exposures[2] = 1.0 / 60;
    rig_fixture_start(&f);
    struct rig_figures figures = rig_fixture_sweep(&f);
    print_figures("bar2 brackets 1.5 s", &figures);
    judge_whole(&f, &figures);
    assert_int_equal(figures.exposures, 7776);
    assert_true(fabs(lumi_plan_seconds(&f.plan, &f.rig) / 60 - 32.4) < 0.5);
    assert_true(figures.swing_worst < SWING_MOST);
    assert_true(figures.angle_worst < SWING_MOST);
    rig_fixture_finish(&f);
}

/* Play up to most of what the profile says is taken up before every beginning, and what it stirs has swung out. */
static void a_belt_with_play_puts_nothing_off_its_angle(void **state)
{
    static const double shares[] = {0.2, 0.4, 0.8}, times[] = {30, 60, 120};
    double worst[2] = {0};

    (void)state;
    for (int k = 0; k < 15; k++) {
        struct rig_fixture f;
        rig_fixture_init(&f, "arc16x2");
        f.plan.mode = k < 9 ? LUMI_PLAN_CONTINUOUS : LUMI_PLAN_START_STOP;
        f.plan.turn_time = times[k < 9 ? k % 3 : 1 + k % 2];
        f.options.mechanics.backlash = shares[k < 9 ? k / 3 : (k - 9) / 2] * f.rig.control.motion.backlash;
        rig_fixture_start(&f);
        worst[k >= 9] = fmax(worst[k >= 9], rig_fixture_sweep(&f).angle_worst);
        rig_fixture_finish(&f);
    }
    print_message("play of up to 0.4 deg in the belt: worst %.5f deg turning, %.5f in start-stop\n", worst[0],
                  worst[1]);
    assert_true(worst[0] < ANGLE_MOST);
    assert_true(worst[1] < SWING_MOST);
}

static void an_arm_that_swings_for_long_is_seen_to_swing(void **state)
{
    struct rig_fixture f;

    (void)state;
    rig_fixture_init(&f, "arc16");
    f.plan.mode = LUMI_PLAN_START_STOP;
    f.plan.turn_time = 60;
    f.options.mechanics.sway_share = 0.9;
    f.options.mechanics.sway_frequency = 1.5;
    f.options.mechanics.sway_damping = 0.01;
    rig_fixture_start(&f);
    struct rig_figures figures = rig_fixture_sweep(&f);
    print_figures("arc16 start-stop 60 s, weak arm", &figures);
    assert_true(figures.swing_worst > 5 * SWING_MOST);
    rig_fixture_finish(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sixteen_rows_in_30_60_and_120_s),
        cmocka_unit_test(sixteen_rows_stopping_at_each_of_72_positions),
        cmocka_unit_test(thirty_two_rows_in_two_turns_on_the_string),
        cmocka_unit_test(two_cameras_take_2592_frames_in_nine_minutes),
        cmocka_unit_test(two_cameras_take_7776_frames_with_brackets_in_33_minutes),
        cmocka_unit_test(a_belt_with_play_puts_nothing_off_its_angle),
        cmocka_unit_test(an_arm_that_swings_for_long_is_seen_to_swing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
