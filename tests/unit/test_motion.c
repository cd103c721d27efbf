/* firmware/core: motion: steps come when the curve says, all of them, within the limits. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pulse_of_a_move_lies_on_the_curve),
        cmocka_unit_test(a_hundred_thousand_steps_a_second_come_with_a_poll_every_two_milliseconds),
    };

    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}
