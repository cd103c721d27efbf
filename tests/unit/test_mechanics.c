/* sim/rig: motor, platform, string, arm, switches and cameras behave as their physics says. */
#include "proto/mechanism/kinematics.h"
#include "sim/rig/mechanics.h"
#include "sim/rig/oscillator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)
#define TICK(s) ((uint64_t)((s)*BOARD_TICK_HZ))

struct bench {
    struct lumi_rig rig;
    struct sim_mechanics_options options;
    struct sim_mechanics *m;
    uint64_t now;
    int edges[BOARD_INPUTS], feedbacks;
    uint64_t last_edge;
    int64_t edge_step; /* pulses at the first edge of the index */
};

static void on_input(void *context, enum board_input input, bool active, uint64_t at)
{
    struct bench *bench = context;

    (void)active;
    if (input == BOARD_IN_INDEX && bench->edges[input] == 0)
        bench->edge_step = sim_mechanics_steps(bench->m);
    bench->edges[input]++;
    bench->last_edge = at;
}

static void on_feedback(void *context, int input, bool active, uint64_t at)
{
    struct bench *bench = context;

    (void)input, (void)active, (void)at;
    bench->feedbacks++;
}

static void bench_rig(struct bench *bench, const char *name)
{
    *bench = (struct bench){.now = 0};
    assert_int_equal(lumi_rig_builtin(name, &bench->rig, NULL), 0);
    sim_mechanics_options_init(&bench->options, &bench->rig);
}

static void bench_start(struct bench *bench)
{
    bench->m = sim_mechanics_create(&bench->rig, &bench->options);
    sim_mechanics_output(bench->m, 0, BOARD_OUT_ENABLE, true);
    sim_mechanics_output(bench->m, 0, BOARD_OUT_BRAKE, true);
}

static void run_to(struct bench *bench, uint64_t to)
{
    const struct sim_mechanics_listener listener = {bench, on_input, on_feedback};

    for (;;) {
        uint64_t next = sim_mechanics_next(bench->m);
        sim_mechanics_advance(bench->m, next < to ? next : to, &listener);
        if (next >= to)
            break;
    }
    bench->now = to;
}

/* `count` steps, `rate` a second, sped up and slowed down over `ramp` of them. */
static void steps(struct bench *bench, int count, double rate, int ramp, bool forward)
{
    for (int k = 0; k < count; k++) {
        int edge = k < count - 1 - k ? k : count - 1 - k;
        double share = ramp > 0 && edge < ramp ? sqrt((edge + 0.5) / ramp) : 1;
        run_to(bench, bench->now + TICK(1 / (rate * share)));
        sim_mechanics_step(bench->m, bench->now, forward);
    }
}

static void rest(struct bench *bench, double seconds)
{
    run_to(bench, bench->now + TICK(seconds));
}

static void an_oscillator_is_exact_however_long_the_step(void **state)
{
    (void)state;
    for (double zeta = 0.05; zeta < 2; zeta += 0.19) {
        struct sim_oscillator once = {1, -3}, often = once;
        sim_oscillator_advance(&once, 0.3, 40, zeta);
        for (int i = 0; i < 300; i++)
            sim_oscillator_advance(&often, 0.001, 40, zeta);
        assert_true(fabs(once.y - often.y) < 1e-9 && fabs(once.v - often.v) < 1e-8);
    }
}

static void the_platform_follows_the_pulses(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "arc16");
    bench.options.start_turns = 0.3;
    bench_start(&bench);
    steps(&bench, 7200, 960, 200, true);
    rest(&bench, 3);
    /* A quarter turn; the belt's play lies behind it. */
    assert_true(fabs(sim_mechanics_turns(bench.m) - 0.55) * 360 < 0.03);
    assert_true(sim_mechanics_swing(bench.m) < 0.001 * DEGREE);
    assert_int_equal(sim_mechanics_missed_steps(bench.m), 0);
    steps(&bench, 7200, 960, 200, false);
    rest(&bench, 3);
    assert_true(fabs(sim_mechanics_turns(bench.m) - 0.3) * 360 < 0.03);
    sim_mechanics_destroy(bench.m);
}

static void an_abrupt_start_beyond_the_torque_loses_whole_motor_steps(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "arc16");
    bench_start(&bench);
    steps(&bench, 20000, 60000, 0, true);
    rest(&bench, 3);
    assert_true(sim_mechanics_missed_steps(bench.m) > 100);
    double lost = (0.3 + 20000 / 28800.0 - sim_mechanics_turns(bench.m)) * 28800;
    /* Four full steps of 16 microsteps at a time. */
    assert_true(fabs(lost - 64 * round(lost / 64)) < 3);
    assert_true(lost > 1000);
    sim_mechanics_destroy(bench.m);
}

static void a_sudden_stop_swings_and_a_weak_arm_swings_longer(void **state)
{
    struct bench bench;
    double sound, weak;

    (void)state;
    bench_rig(&bench, "arc16");
    bench_start(&bench);
    steps(&bench, 400, 960, 0, true);
    assert_true(sim_mechanics_swing(bench.m) > 0.02 * DEGREE);
    rest(&bench, 0.5);
    sound = sim_mechanics_swing(bench.m);
    sim_mechanics_destroy(bench.m);

    bench_rig(&bench, "arc16");
    bench.options.sway_share = 0.9;
    bench.options.sway_frequency = 2;
    bench.options.sway_damping = 0.01;
    bench_start(&bench);
    steps(&bench, 400, 960, 0, true);
    rest(&bench, 0.5);
    weak = sim_mechanics_swing(bench.m);
    sim_mechanics_destroy(bench.m);
    assert_true(sound < 0.02 * DEGREE);
    assert_true(weak > 0.2 * DEGREE);
}

static void the_index_switch_closes_at_its_mark_and_bounces(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "arc16");
    bench.options.start_turns = 0.9;
    bench_start(&bench);
    steps(&bench, 3600, 500, 100, true);
    rest(&bench, 1);
    /* Turn 1 is 2,880 steps on: the body passes it within the play and half a step. */
    assert_in_range(bench.edge_step, 2880, 2884);
    assert_true(bench.edges[BOARD_IN_INDEX] >= 2);
    assert_int_equal(bench.edges[BOARD_IN_INDEX] % 2, 0);
    assert_false(sim_mechanics_input(bench.m, BOARD_IN_INDEX));
    sim_mechanics_destroy(bench.m);
}

static void the_arm_falls_by_the_string_and_is_wound_up_to_its_rest(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "bar2");
    bench.options.start_turns = 0;
    bench_start(&bench);
    steps(&bench, 28800, 4000, 2000, true);
    rest(&bench, 5);
    assert_true(fabs(sim_mechanics_drop(bench.m) - lumi_rig_drop(&bench.rig, 1)) < 0.01 * DEGREE);
    assert_false(sim_mechanics_input(bench.m, BOARD_IN_WOUND));
    steps(&bench, 28800 + 4000, 4000, 2000, false);
    assert_true(sim_mechanics_input(bench.m, BOARD_IN_WOUND));
    assert_int_equal(sim_mechanics_missed_steps(bench.m), 0);
    steps(&bench, 12000, 2000, 2000, false); /* against the rest: the motor stalls, the platform stays */
    rest(&bench, 1);
    assert_true(sim_mechanics_missed_steps(bench.m) > 0);
    assert_true(sim_mechanics_turns(bench.m) > -0.42);
    assert_true(sim_mechanics_fallen(bench.m) == 0);
    sim_mechanics_destroy(bench.m);
}

static void an_arm_that_nothing_holds_falls_and_a_brake_or_current_holds_it(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "bar2");
    bench.rig.control.safety.brake_fitted = true;
    bench_start(&bench);
    sim_mechanics_output(bench.m, TICK(1), BOARD_OUT_ENABLE, false);
    sim_mechanics_output(bench.m, TICK(1), BOARD_OUT_BRAKE, false);
    bench.now = TICK(1);
    rest(&bench, 2);
    assert_false(sim_mechanics_falling(bench.m));
    assert_true(sim_mechanics_fallen(bench.m) == 0);
    sim_mechanics_output(bench.m, bench.now, BOARD_OUT_BRAKE, true);
    rest(&bench, 0.3);
    assert_true(sim_mechanics_falling(bench.m));
    assert_true(sim_mechanics_fallen(bench.m) > 1 * DEGREE);
    sim_mechanics_output(bench.m, bench.now, BOARD_OUT_ENABLE, true);
    rest(&bench, 0.3);
    assert_false(sim_mechanics_falling(bench.m));
    sim_mechanics_driver_fault(bench.m, true);
    rest(&bench, 0.3);
    assert_true(sim_mechanics_falling(bench.m));
    assert_true(sim_mechanics_input(bench.m, BOARD_IN_DRIVER_FAULT));
    sim_mechanics_destroy(bench.m);
}

static void a_string_that_snags_hangs_slack_and_says_so(void **state)
{
    struct bench bench;

    (void)state;
    bench_rig(&bench, "bar2");
    bench_start(&bench);
    sim_mechanics_snag(bench.m, true);
    double drop = sim_mechanics_drop(bench.m);
    steps(&bench, 28800, 4000, 2000, true);
    rest(&bench, 3);
    assert_true(sim_mechanics_input(bench.m, BOARD_IN_SLACK));
    assert_true(fabs(sim_mechanics_drop(bench.m) - drop) < 0.1 * DEGREE);
    sim_mechanics_snag(bench.m, false);
    assert_true(sim_mechanics_dropped(bench.m) > 1 * DEGREE); /* it drops into the string */
    sim_mechanics_destroy(bench.m);
}

static void cameras_lag_expose_and_lose_triggers_while_busy(void **state)
{
    struct bench bench;
    int count;

    (void)state;
    bench_rig(&bench, "bar2");
    for (int i = 0; i < 2; i++) {
        bench.rig.control.triggers[i] = (struct lumi_rig_trigger){
            .channel = i, .shutter_lag = 0.05, .busy = 0.1, .focus_channel = -1, .feedback = i};
    }
    bench.options.camera_jitter = 0;
    bench_start(&bench);
    const double exposure = 0.01;
    sim_mechanics_set_exposures(bench.m, &exposure, 1);
    sim_mechanics_trigger_lines(bench.m, TICK(1), 3);
    sim_mechanics_trigger_lines(bench.m, TICK(1.01), 0);
    bench.now = TICK(1.01);
    rest(&bench, 0.1);
    sim_mechanics_trigger_lines(bench.m, bench.now, 1);
    rest(&bench, 0.5);
    const struct sim_exposure *e = sim_mechanics_exposures(bench.m, &count);
    assert_int_equal(count, 3);
    assert_true(!e[0].lost && !e[1].lost && e[2].lost);
    assert_true(e[0].done && e[1].done && !e[2].done);
    assert_int_equal(e[0].begin, TICK(1.05));
    assert_int_equal(e[0].end, TICK(1.06));
    assert_int_equal(bench.feedbacks, 4);
    sim_mechanics_destroy(bench.m);
}

/* What the lenses of simulated cameras are given: the pose of every camera at any instant, a swing included. */
static void cameras_are_where_platform_and_arm_truly_are(void **state)
{
    struct bench bench;
    struct lumi_pose pose, start;
    (void)state;

    bench_rig(&bench, "bar2");
    bench.options.start_turns = 0;
    bench_start(&bench);
    double per_turn = lumi_rig_steps_per_turn(&bench.rig);
    sim_mechanics_pose(bench.m, 0, &start);
    steps(&bench, (int)(per_turn * 1.25), per_turn / 20, 400, true);
    for (int i = 0; i < 3; i++) { /* just after the stop, while it swings, and at rest */
        for (int camera = 0; camera < 2; camera++) {
            const struct lumi_rig_camera *c = &bench.rig.cameras[camera];
            double arm = c->angle - sim_mechanics_drop(bench.m), heading = sim_mechanics_angle(bench.m) + c->azimuth;
            sim_mechanics_pose(bench.m, camera, &pose);
            assert_true(fabs(pose.t.x - c->radius * cos(arm) * cos(heading)) < 1e-9);
            assert_true(fabs(pose.t.y - c->radius * cos(arm) * sin(heading)) < 1e-9);
            assert_true(fabs(pose.t.z - c->radius * sin(arm)) < 1e-9);
            assert_true(fabs(pose.r[2] * c->radius - pose.t.x) < 1e-9); /* it looks outwards */
        }
        run_to(&bench, bench.now + TICK(i == 0 ? 0.05 : 5));
    }
    /* At rest: a quarter of a turn on, and lower by what the string has paid out. */
    struct lumi_pose planned;
    lumi_rig_camera_pose(&bench.rig, 0, lumi_rig_step_turns(&bench.rig, (int)(per_turn * 1.25)), &planned);
    sim_mechanics_pose(bench.m, 0, &pose);
    assert_true(lumi_length(lumi_sub(pose.t, planned.t)) < 0.002);
    assert_true(lumi_length(lumi_sub(pose.t, start.t)) > 0.1);
    sim_mechanics_destroy(bench.m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_oscillator_is_exact_however_long_the_step),
        cmocka_unit_test(the_platform_follows_the_pulses),
        cmocka_unit_test(cameras_are_where_platform_and_arm_truly_are),
        cmocka_unit_test(an_abrupt_start_beyond_the_torque_loses_whole_motor_steps),
        cmocka_unit_test(a_sudden_stop_swings_and_a_weak_arm_swings_longer),
        cmocka_unit_test(the_index_switch_closes_at_its_mark_and_bounces),
        cmocka_unit_test(the_arm_falls_by_the_string_and_is_wound_up_to_its_rest),
        cmocka_unit_test(an_arm_that_nothing_holds_falls_and_a_brake_or_current_holds_it),
        cmocka_unit_test(a_string_that_snags_hangs_slack_and_says_so),
        cmocka_unit_test(cameras_lag_expose_and_lose_triggers_while_busy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
