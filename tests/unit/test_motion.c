/* firmware/core: motion: steps come when the curve says, all of them, within the limits. */
#include "proto/mechanism/ramp_time.h"
#include "step_board.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define MS (BOARD_TICK_HZ / 1000)
#define HZ ((long double)BOARD_TICK_HZ)

static const struct motion_limits bar2 = {4800, 14400, 192000};
static const struct motion_limits fast = {100000, 200000, 2000000};

/* The curve again, by another way and in long double: integrate the phases that symmetry gives. */
struct truth {
    long double distance, v, a, j, rise, hold, cruise;
};

static struct truth truth_of(int64_t distance, const struct motion_limits *l)
{
    struct truth t = {.distance = distance, .j = l->jerk};
    long double low = 0, high = l->speed;

    for (int i = 0; i < 200; i++) { /* the highest speed whose two ramps fit, by halving */
        t.v = i == 0 ? high : (low + high) / 2;
        t.a = fminl(l->acceleration, sqrtl(t.v * t.j));
        t.rise = t.a / t.j;
        t.hold = t.v / t.a - t.rise;
        if (t.v * (2 * t.rise + t.hold) > distance)
            high = t.v;
        else
            low = t.v;
        if (i == 0 && low == high)
            break;
    }
    t.cruise = (distance - t.v * (2 * t.rise + t.hold)) / t.v;
    return t;
}

/* Place after s seconds of the ramp up. */
static long double truth_ramp(const struct truth *t, long double s)
{
    long double a = t->a, r = t->rise;

    if (s <= r)
        return t->j * s * s * s / 6;
    if (s <= r + t->hold)
        return a * r * r / 6 + a * r / 2 * (s - r) + a * (s - r) * (s - r) / 2;
    long double left = 2 * r + t->hold - s;
    return t->v * (2 * r + t->hold) / 2 - t->v * left + t->j * left * left * left / 6;
}

static long double truth_place(const struct truth *t, long double s)
{
    long double ramp = 2 * t->rise + t->hold;

    if (s <= ramp)
        return truth_ramp(t, s);
    if (s <= ramp + t->cruise)
        return t->v * ramp / 2 + t->v * (s - ramp);
    return t->distance - truth_ramp(t, 2 * ramp + t->cruise - s);
}

static long double truth_end(const struct truth *t)
{
    return 2 * (2 * t->rise + t->hold) + t->cruise;
}

static long double truth_time(const struct truth *t, long double x)
{
    long double low = 0, high = truth_end(t);

    for (int i = 0; i < 100; i++) {
        long double mid = (low + high) / 2;
        if (truth_place(t, mid) < x)
            low = mid;
        else
            high = mid;
    }
    return low;
}

struct rig {
    struct motion motion;
    struct step_board board;
};

static struct rig *rig_new(void)
{
    struct rig *rig = calloc(1, sizeof *rig);

    assert_non_null(rig);
    step_board_init(&rig->board, &rig->motion);
    motion_set_position(&rig->motion, 0);
    return rig;
}

static void rig_free(struct rig *rig)
{
    assert_int_equal(rig->board.locks, 0);
    step_board_finish(&rig->board);
    free(rig);
}

/* One move, whole, polled every `period`. */
static void move(struct rig *rig, int64_t target, const struct motion_limits *limits, uint64_t period)
{
    rig->board.count = 0;
    assert_true(motion_start(&rig->motion, target, limits, 0));
    step_board_run(&rig->board, BOARD_NEVER, period);
    assert_false(motion_starved(&rig->motion));
    assert_true(motion_known(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), target);
}

/* The largest distance, in ticks, of a pulse of the move just made from its place on the true curve. */
static long double worst_error(const struct rig *rig, const struct motion_limits *limits)
{
    struct truth truth = truth_of((int64_t)rig->board.count, limits);
    long double worst = 0;

    for (size_t k = 0; k < rig->board.count; k++) {
        long double at = (long double)(rig->board.pulses[k] - rig->motion.origin);
        worst = fmaxl(worst, fabsl(at - truth_time(&truth, k + 0.5L) * HZ));
    }
    return worst;
}

static void every_pulse_of_a_move_lies_on_the_curve(void **state)
{
    static const int64_t distances[] = {1, 2, 3, 4, 5, 10, 33, 100, 399, 400, 401, 1000, 5000, 28800};
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        struct rig *rig = rig_new();
        move(rig, distances[i], &bar2, MS);
        assert_int_equal(rig->board.count, distances[i]);
        assert_true(worst_error(rig, &bar2) <= MOTION_RAMP_TICKS);
        move(rig, 0, &bar2, 2 * MS);
        assert_int_equal(rig->board.count, distances[i]);
        assert_int_equal(rig->board.steps, 0);
        assert_true(worst_error(rig, &bar2) <= MOTION_RAMP_TICKS);
        rig_free(rig);
    }
}

static void a_hundred_thousand_steps_a_second_come_with_a_poll_every_two_milliseconds(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    move(rig, 300000, &fast, 2 * MS);
    assert_int_equal(rig->board.count, 300000);
    assert_int_equal(rig->board.pulses[150001] - rig->board.pulses[150000], 840);
    assert_true(worst_error(rig, &fast) <= MOTION_RAMP_TICKS);
    rig_free(rig);
}

/* Divided differences of the pulses over spans of at least `span` seconds, rest before and after included, are weighted
 * means of speed, acceleration and jerk: within the limits, but for what the pulses' tolerance makes of them. */
struct places {
    double *t, *x;
    size_t count;
};

static struct places places_of(const struct rig *rig, double span)
{
    const struct motion *m = &rig->motion;
    size_t n = rig->board.count;
    struct places p = {calloc(n + 8, sizeof(double)), calloc(n + 8, sizeof(double)), 0};

    assert_true(p.t && p.x);
    for (int i = 3; i >= 0; i--, p.count++)
        p.t[p.count] = -i * span;
    for (size_t k = 0; k < n; k++, p.count++) {
        p.t[p.count] = (double)(rig->board.pulses[k] - m->origin) / BOARD_TICK_HZ;
        p.x[p.count] = (double)k + 0.5;
    }
    for (int i = 0; i < 4; i++, p.count++) {
        p.t[p.count] = ramp_end_time(&m->ramp) + i * span;
        p.x[p.count] = ramp_end_place(&m->ramp);
    }
    return p;
}

static double divided(const struct places *p, const size_t *at, int order)
{
    if (order == 0)
        return p->x[at[0]];
    return (divided(p, at + 1, order - 1) - divided(p, at, order - 1)) / (p->t[at[order]] - p->t[at[0]]);
}

static void assert_within_limits(const struct rig *rig, const struct motion_limits *l)
{
    /* A pulse that is late by the tolerance is a place that is off by `off`; the span makes that 2 % of the jerk. */
    double off = l->speed * (MOTION_RAMP_TICKS + 1) / BOARD_TICK_HZ, span = cbrt(8 * off / (0.02 * l->jerk));
    struct places p = places_of(rig, span);

    for (size_t i = 0; i < p.count; i++) {
        size_t at[4] = {i};
        int order = 0;
        for (size_t k = i; k < p.count && order < 3; k++)
            if (p.t[k] - p.t[at[order]] >= span)
                at[++order] = k;
        if (order < 3)
            break;
        double v = divided(&p, at, 1), a = 2 * divided(&p, at, 2), j = 6 * divided(&p, at, 3);
        if (v < -2 * off / span || v > l->speed + 2 * off / span || fabs(a) > l->acceleration + 4 * off / span / span ||
            fabs(j) > l->jerk * 1.02)
            fail_msg("pulse %zu: speed %g, acceleration %g, jerk %g of %g, %g, %g", i, v, a, j, l->speed,
                     l->acceleration, l->jerk);
    }
    free(p.t);
    free(p.x);
}

static uint64_t seed = 1;

static double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) / 9007199254740992.0;
}

static double between(double low, double high) /* evenly on a logarithmic scale */
{
    return low * pow(high / low, uniform());
}

static struct motion_limits random_limits(void)
{
    struct motion_limits l;

    l.speed = between(3, 100000);
    l.acceleration = l.speed / between(0.01, 3);
    l.jerk = l.acceleration / between(0.003, 1);
    return l;
}

static int64_t random_distance(const struct motion_limits *l)
{
    return (int64_t)between(1, fmin(l->speed * 10, 200000) + 2);
}

static void random_moves_keep_the_limits_and_lie_on_the_curve(void **state)
{
    long double worst = 0;

    (void)state;
    seed = 11;
    for (int i = 0; i < 150; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        move(rig, uniform() < 0.5 ? distance : -distance, &l, (1 + (uint64_t)(uniform() * 2)) * MS);
        assert_int_equal(rig->board.count, distance);
        worst = fmaxl(worst, worst_error(rig, &l));
        assert_within_limits(rig, &l);
        rig_free(rig);
    }
    print_message("worst pulse %.2Lf ticks from its curve\n", worst);
    assert_true(worst <= MOTION_RAMP_TICKS);
}

static void a_move_takes_the_time_the_plan_reckons_with(void **state)
{
    (void)state;
    seed = 12;
    for (int i = 0; i < 50; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        assert_true(motion_start(&rig->motion, distance, &l, 0));
        double seconds = lumi_move_time((double)distance, l.speed, l.acceleration, l.jerk);
        assert_true(fabs(ramp_end_time(&rig->motion.ramp) / seconds - 1) < 1e-9);
        rig_free(rig);
    }
}

/* A whole sweep of 18 turns at 30 s a turn: every pulse of the cruise within a tick of its time, the last like the
 * first. */
static void a_sweep_of_18_turns_does_not_drift(void **state)
{
    static const double turn_times[] = {30, 31.4159, 120};
    (void)state;
    for (size_t i = 0; i < sizeof turn_times / sizeof *turn_times; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = bar2;
        l.speed = 28800 / turn_times[i];
        int64_t run_up = motion_run_up_steps(&l), last = 18 * 28800;
        motion_set_position(&rig->motion, -run_up);
        assert_true(motion_start(&rig->motion, last + run_up, &l, 0));
        uint64_t begin = motion_time_of(&rig->motion, 0);
        step_board_run(&rig->board, BOARD_NEVER, 2 * MS);
        assert_int_equal(motion_position(&rig->motion), last + run_up);
        long double interval = HZ * turn_times[i] / 28800;
        for (int64_t p = 1; p <= last; p++) {
            uint64_t pulse = rig->board.pulses[run_up + p - 1];
            long double wanted = (p - 0.5L) * interval;
            if (fabsl((long double)(pulse - begin) - wanted) > 1.01L)
                fail_msg("pulse %lld: %Lf ticks off", (long long)p, (long double)(pulse - begin) - wanted);
        }
        assert_true(fabsl((long double)(motion_time_of(&rig->motion, (double)last) - begin) -
                          18 * HZ * turn_times[i]) <= 1.01L);
        rig_free(rig);
    }
}

static void places_are_passed_when_it_was_said(void **state)
{
    (void)state;
    seed = 13;
    for (int i = 0; i < 40; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l), start = (int64_t)(uniform() * 1000);
        int sign = uniform() < 0.5 ? 1 : -1;
        motion_set_position(&rig->motion, start);
        assert_true(motion_start(&rig->motion, start + sign * distance, &l, 5000 * MS));
        assert_int_equal(motion_time_of(&rig->motion, (double)start), 5000 * MS);
        assert_int_equal(motion_time_of(&rig->motion, (double)(start - sign)), BOARD_NEVER);
        assert_int_equal(motion_time_of(&rig->motion, (double)(start + sign * (distance + 1))), BOARD_NEVER);
        uint64_t *said = calloc((size_t)distance, sizeof *said), end = motion_end(&rig->motion);
        assert_non_null(said);
        /* All is said before the first step, and stays true while it runs. */
        for (int64_t k = 0; k < distance; k++)
            said[k] = motion_time_of(&rig->motion, (double)start + sign * ((double)k + 0.5));
        uint64_t middle = motion_time_of(&rig->motion, (double)start + sign * (double)distance / 2);
        step_board_run(&rig->board, middle, MS);
        for (int64_t k = 0; k < distance; k += 1 + distance / 17)
            assert_int_equal(motion_time_of(&rig->motion, (double)start + sign * ((double)k + 0.5)), said[k]);
        step_board_run(&rig->board, BOARD_NEVER, MS);
        for (int64_t k = 0; k < distance; k++)
            assert_true(llabs((long long)(said[k] - rig->board.pulses[k])) <= MOTION_RAMP_TICKS);
        assert_int_equal(end, said[distance - 1]);
        free(said);
        rig_free(rig);
    }
}

static void between_two_steps_places_are_even_in_the_cruise(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    struct motion_limits l = {1000, 5000, 50000};

    assert_true(motion_start(&rig->motion, 5000, &l, 0));
    uint64_t at = motion_time_of(&rig->motion, 2000);
    for (int i = 0; i <= 20; i++)
        assert_true(llabs((long long)(motion_time_of(&rig->motion, 2000 + i / 20.0) - at) - i * 84000 / 20) <= 1);
    assert_true(fabs(motion_speed(&rig->motion, at) - 1000) < 1e-9);
    assert_true(motion_speed(&rig->motion, rig->board.now) == 0);
    rig_free(rig);
}

static void the_run_up_reaches_the_speed(void **state)
{
    (void)state;
    seed = 14;
    for (int i = 0; i < 50; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t run_up = motion_run_up_steps(&l);
        motion_set_position(&rig->motion, -run_up);
        assert_true(motion_start(&rig->motion, 10 * run_up, &l, 0));
        assert_true(fabs(motion_speed(&rig->motion, motion_time_of(&rig->motion, 0) + 1) / l.speed - 1) < 1e-9);
        double before = motion_speed(&rig->motion, motion_time_of(&rig->motion, -0.3 * (double)run_up));
        assert_true(before < l.speed || run_up < 10);
        rig_free(rig);
    }
}

/* How far a ramp down from the curve's state takes. */
static double stop_distance(double v, double a, const struct motion_limits *l)
{
    double up = fmax(a, 0) / l->jerk; /* until it stops getting faster */
    double top = v + fmax(a, 0) * up / 2;

    return (v + top) * up + lumi_ramp_distance(top, l->acceleration, l->jerk);
}

static void a_stop_in_any_phase_keeps_the_limits_and_the_position(void **state)
{
    (void)state;
    seed = 15;
    for (int i = 0; i < 250; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        uint64_t period = MS + (uint64_t)(uniform() * MS);
        assert_true(motion_start(&rig->motion, distance, &l, 0));
        double end = ramp_end_time(&rig->motion.ramp);
        uint64_t when = rig->motion.origin + (uint64_t)(end * uniform() * BOARD_TICK_HZ);
        step_board_run(&rig->board, when, period);
        struct ramp_phase at;
        ramp_at(&rig->motion.ramp, motion_moving(&rig->motion) ? rig->motion.at_last.t : end, &at);
        double bound = fmin(at.x + stop_distance(at.v, at.a, &l) + 1, (double)distance);
        motion_stop(&rig->motion);
        motion_stop(&rig->motion);
        double given_up = ramp_end_place(&rig->motion.ramp) + 0.01;
        if (given_up < (double)distance)
            assert_int_equal(motion_time_of(&rig->motion, given_up), BOARD_NEVER);
        step_board_run(&rig->board, when + (uint64_t)(uniform() * 0.1 * end * BOARD_TICK_HZ), period);
        motion_stop(&rig->motion);
        uint64_t last = motion_end(&rig->motion);
        step_board_run(&rig->board, BOARD_NEVER, period);
        assert_false(motion_starved(&rig->motion));
        assert_true(motion_known(&rig->motion));
        assert_int_equal(motion_position(&rig->motion), rig->board.steps);
        assert_int_equal(rig->board.steps, rig->board.count);
        assert_true((double)rig->board.count <= bound);
        assert_true(fabs((double)rig->board.steps - ramp_end_place(&rig->motion.ramp)) < 0.5001);
        assert_true(llabs((long long)(last - rig->board.pulses[rig->board.count - 1])) <= MOTION_RAMP_TICKS);
        assert_within_limits(rig, &l);
        /* And on it goes, not before the last curve is at rest. */
        uint64_t rest = rig->motion.rest_at;
        move(rig, distance + 1, &l, period);
        assert_true(rig->motion.origin >= rest);
        rig_free(rig);
    }
}

static void a_stop_comes_within_thirty_milliseconds(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    assert_true(motion_start(&rig->motion, 200000, &bar2, 0));
    step_board_run(&rig->board, motion_time_of(&rig->motion, 100000), 2 * MS);
    uint64_t now = rig->board.now;
    double most = 4800 * 0.03 + lumi_ramp_distance(bar2.speed, bar2.acceleration, bar2.jerk);
    motion_stop(&rig->motion);
    assert_true(ramp_end_place(&rig->motion.ramp) - 100000 < most);
    assert_true(motion_end(&rig->motion) > now);
    rig_free(rig);
}

static void a_stop_before_the_first_step_and_at_rest_is_harmless(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    motion_stop(&rig->motion);
    assert_true(motion_start(&rig->motion, 28800, &bar2, 0));
    motion_stop(&rig->motion);
    step_board_run(&rig->board, BOARD_NEVER, MS);
    assert_int_equal(motion_position(&rig->motion), rig->board.count);
    assert_in_range(rig->board.count, 1, 100);
    motion_stop(&rig->motion);
    move(rig, 0, &bar2, MS);
    rig_free(rig);
}

static void after_a_halt_no_step_comes_and_the_count_is_right(void **state)
{
    (void)state;
    seed = 16;
    for (int i = 0; i < 100; i++) {
        struct rig *rig = rig_new();
        assert_true(motion_start(&rig->motion, 5000, &bar2, 0));
        step_board_run(&rig->board, rig->motion.origin + (uint64_t)(1.2 * uniform() * BOARD_TICK_HZ), MS);
        bool begun = rig->board.count > 0, late = i % 2 && begun && motion_moving(&rig->motion);
        if (late) { /* a pulse has risen whose interrupt has to wait for the e-stop's */
            rig->board.steps += 1;
            rig->board.count++;
        }
        motion_halt(&rig->motion);
        assert_false(rig->board.stepping);
        if (late)
            assert_int_equal(motion_on_step(&rig->motion, rig->board.now), 0);
        size_t count = rig->board.count;
        step_board_run(&rig->board, rig->board.now + BOARD_TICK_HZ, MS);
        assert_int_equal(rig->board.count, count);
        assert_int_equal(motion_position(&rig->motion), rig->board.steps);
        assert_false(motion_moving(&rig->motion));
        assert_int_equal(motion_known(&rig->motion), !begun);
        assert_int_equal(motion_time_of(&rig->motion, 4999), BOARD_NEVER);
        assert_true(motion_speed(&rig->motion, rig->board.now) == 0);
        /* Latched. */
        assert_true(motion_halted(&rig->motion));
        motion_set_position(&rig->motion, 0);
        assert_false(motion_start(&rig->motion, 10, &bar2, 0));
        motion_release(&rig->motion);
        assert_int_equal(motion_time_of(&rig->motion, 1), BOARD_NEVER);
        rig->board.steps = 0;
        move(rig, 10, &bar2, MS);
        rig_free(rig);
    }
}

static void a_halt_at_rest_keeps_the_position(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    move(rig, 100, &bar2, MS);
    motion_halt(&rig->motion);
    assert_true(motion_known(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), 100);
    motion_release(&rig->motion);
    move(rig, 0, &bar2, MS);
    rig_free(rig);
}

static struct motion *halted_by_lock;
static unsigned lock_and_halt(void *port)
{
    struct motion *motion = halted_by_lock;

    halted_by_lock = NULL;
    if (motion)
        motion_halt(motion); /* the e-stop's interrupt, just before interrupts are held off */
    return step_board_lock(port);
}

static void a_halt_while_a_move_is_being_started_wins(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    rig->board.board.lock = lock_and_halt;
    for (int n = 0; n < 2; n++) {
        halted_by_lock = &rig->motion;
        if (n == 0)
            motion_position(&rig->motion);
        assert_false(motion_start(&rig->motion, 100, &bar2, 0));
        assert_int_equal(rig->board.starts, 0);
        motion_release(&rig->motion);
    }
    rig_free(rig);
}

/* The main loop stops coming: the steps made are right, the rest is not made. */
static void a_main_loop_that_is_late_ends_the_steps_and_never_makes_a_wrong_one(void **state)
{
    int starved = 0;

    (void)state;
    seed = 17;
    for (int i = 0; i < 60; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = i % 2 ? fast : bar2;
        struct truth truth = truth_of(20000, &l);
        assert_true(motion_start(&rig->motion, 20000, &l, 0));
        step_board_run(&rig->board, rig->motion.origin + (uint64_t)(uniform() * truth_end(&truth) * HZ), MS);
        step_board_advance(&rig->board, rig->board.now + (uint64_t)(2 * uniform() * 30 * MS));
        step_board_run(&rig->board, BOARD_NEVER, MS);
        assert_false(rig->board.stepping);
        assert_int_equal(motion_position(&rig->motion), rig->board.count);
        for (size_t k = 0; k < rig->board.count; k++)
            assert_true(fabsl((long double)(rig->board.pulses[k] - rig->motion.origin) -
                              truth_time(&truth, k + 0.5L) * HZ) <= MOTION_RAMP_TICKS);
        if (rig->board.count < 20000) {
            starved++;
            assert_true(motion_starved(&rig->motion));
            assert_false(motion_known(&rig->motion));
            assert_false(motion_start(&rig->motion, 0, &l, 0));
            motion_release(&rig->motion);
            assert_false(motion_starved(&rig->motion));
            assert_false(motion_start(&rig->motion, 0, &l, 0)); /* nobody knows from where */
            assert_true(motion_seek(&rig->motion, 10, &l));
        }
        rig_free(rig);
    }
    assert_in_range(starved, 10, 50);
}

static void a_main_loop_every_ten_milliseconds_is_enough(void **state)
{
    (void)state;
    seed = 18;
    for (int i = 0; i < 60; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        l.acceleration = l.speed / between(0.1, 3);
        l.jerk = l.acceleration / between(0.03, 1);
        move(rig, random_distance(&l), &l, 10 * MS);
        rig_free(rig);
    }
}

static void it_is_polled_as_often_as_it_asks(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    int polls = 0;

    assert_int_equal(motion_next_poll(&rig->motion), BOARD_NEVER);
    assert_true(motion_start(&rig->motion, 20000, &fast, 0));
    while (motion_moving(&rig->motion)) {
        uint64_t next = motion_next_poll(&rig->motion);
        if (next == BOARD_NEVER) {
            step_board_advance(&rig->board, rig->board.now + MS);
            continue;
        }
        assert_true(next >= rig->board.now);
        step_board_advance(&rig->board, next);
        motion_poll(&rig->motion);
        polls++;
    }
    assert_false(motion_starved(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), 20000);
    assert_in_range(polls, 10, 1000);
    rig_free(rig);
}

static void slow_steps_may_be_seconds_apart(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    const struct motion_limits slow = {0.2, 0.5, 1};

    move(rig, 20, &slow, 10 * MS);
    assert_int_equal(rig->board.pulses[11] - rig->board.pulses[10], 5u * BOARD_TICK_HZ);
    assert_true(worst_error(rig, &slow) <= MOTION_RAMP_TICKS);
    const struct motion_limits bad[] = {{0.01, 1, 1}, {1, 1e-4, 1},        {1, 1, 1e-4},    {0, 1, 1},
                                        {1, 0, 1},    {1, 1, (double)NAN}, {1e6, 1e6, 1e6}, {-1, 1, 1}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(motion_start(&rig->motion, 0, &bad[i], 0));
    rig_free(rig);
}

static void moves_begin_when_they_are_told_and_the_driver_has_its_time(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    motion_set_driver(&rig->motion, 5e-6, 0.5);
    assert_int_equal(rig->board.pulse_width, 420);
    assert_true(motion_start(&rig->motion, 5, &bar2, 3 * (uint64_t)BOARD_TICK_HZ));
    assert_int_equal(motion_time_of(&rig->motion, 0), 3 * (uint64_t)BOARD_TICK_HZ);
    assert_false(motion_start(&rig->motion, 9, &bar2, 0)); /* not at rest */
    step_board_run(&rig->board, BOARD_NEVER, MS);
    uint64_t now = rig->board.now;
    assert_false(motion_start(&rig->motion, 5, &bar2, 0)); /* it is there */
    rig->board.count = 0;
    assert_true(motion_start(&rig->motion, 0, &bar2, 0));
    step_board_run(&rig->board, BOARD_NEVER, MS);
    assert_true(rig->board.pulses[0] >= now + BOARD_TICK_HZ / 2);
    motion_forget(&rig->motion);
    assert_false(motion_start(&rig->motion, 5, &bar2, 0));
    rig_free(rig);
}

static void every_stop_is_approached_with_rising_steps(void **state)
{
    static const int64_t targets[] = {500, 520, 900, 890, 890, 0, 10, 41, 42, -3000, -2999};
    (void)state;
    struct rig *rig = rig_new();
    int64_t rising = 0;

    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        int moves = 0;
        for (int64_t leg; (leg = motion_next_leg(&rig->motion, targets[i], 40)) != motion_position(&rig->motion);) {
            int64_t by = leg - motion_position(&rig->motion);
            rising = by > 0 ? rising + by : 0;
            move(rig, leg, &bar2, MS);
            assert_true(++moves <= 2);
        }
        assert_int_equal(motion_position(&rig->motion), targets[i]);
        assert_true(rising >= 40);
    }
    /* Without backlash the way is straight. */
    assert_int_equal(motion_next_leg(&rig->motion, -5000, 0), -5000);
    rig_free(rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pulse_of_a_move_lies_on_the_curve),
        cmocka_unit_test(a_hundred_thousand_steps_a_second_come_with_a_poll_every_two_milliseconds),
        cmocka_unit_test(random_moves_keep_the_limits_and_lie_on_the_curve),
        cmocka_unit_test(a_move_takes_the_time_the_plan_reckons_with),
        cmocka_unit_test(a_sweep_of_18_turns_does_not_drift),
        cmocka_unit_test(places_are_passed_when_it_was_said),
        cmocka_unit_test(between_two_steps_places_are_even_in_the_cruise),
        cmocka_unit_test(the_run_up_reaches_the_speed),
        cmocka_unit_test(a_stop_in_any_phase_keeps_the_limits_and_the_position),
        cmocka_unit_test(a_stop_comes_within_thirty_milliseconds),
        cmocka_unit_test(a_stop_before_the_first_step_and_at_rest_is_harmless),
        cmocka_unit_test(after_a_halt_no_step_comes_and_the_count_is_right),
        cmocka_unit_test(a_halt_at_rest_keeps_the_position),
        cmocka_unit_test(a_halt_while_a_move_is_being_started_wins),
        cmocka_unit_test(a_main_loop_that_is_late_ends_the_steps_and_never_makes_a_wrong_one),
        cmocka_unit_test(a_main_loop_every_ten_milliseconds_is_enough),
        cmocka_unit_test(it_is_polled_as_often_as_it_asks),
        cmocka_unit_test(slow_steps_may_be_seconds_apart),
        cmocka_unit_test(moves_begin_when_they_are_told_and_the_driver_has_its_time),
        cmocka_unit_test(every_stop_is_approached_with_rising_steps),
    };

    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}
