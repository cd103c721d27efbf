/* A motion planner on a step board, the true curves in long double, and random moves: for the tests of motion. */
#ifndef LUMI_TESTS_UNIT_MOTION_RIG_H
#define LUMI_TESTS_UNIT_MOTION_RIG_H

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

static inline struct truth truth_of(int64_t distance, const struct motion_limits *l)
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
static inline long double truth_ramp(const struct truth *t, long double s)
{
    long double a = t->a, r = t->rise;

    if (s <= r)
        return t->j * s * s * s / 6;
    if (s <= r + t->hold)
        return a * r * r / 6 + a * r / 2 * (s - r) + a * (s - r) * (s - r) / 2;
    long double left = 2 * r + t->hold - s;
    return t->v * (2 * r + t->hold) / 2 - t->v * left + t->j * left * left * left / 6;
}

static inline long double truth_place(const struct truth *t, long double s)
{
    long double ramp = 2 * t->rise + t->hold;

    if (s <= ramp)
        return truth_ramp(t, s);
    if (s <= ramp + t->cruise)
        return t->v * ramp / 2 + t->v * (s - ramp);
    return t->distance - truth_ramp(t, 2 * ramp + t->cruise - s);
}

static inline long double truth_end(const struct truth *t)
{
    return 2 * (2 * t->rise + t->hold) + t->cruise;
}

static inline long double truth_time(const struct truth *t, long double x)
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

static inline struct rig *rig_new(void)
{
    struct rig *rig = calloc(1, sizeof *rig);

    assert_non_null(rig);
    step_board_init(&rig->board, &rig->motion);
    motion_set_position(&rig->motion, 0);
    return rig;
}

static inline void rig_free(struct rig *rig)
{
    assert_int_equal(rig->board.locks, 0);
    step_board_finish(&rig->board);
    free(rig);
}

/* One move, whole, polled every `period`. */
static inline void move(struct rig *rig, int64_t target, const struct motion_limits *limits, uint64_t period)
{
    rig->board.count = 0;
    assert_true(motion_start(&rig->motion, target, limits, 0));
    step_board_run(&rig->board, BOARD_NEVER, period);
    assert_false(motion_starved(&rig->motion));
    assert_true(motion_known(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), target);
}

/* The largest distance, in ticks, of a pulse of the move just made from its place on the true curve. */
static inline long double worst_error(const struct rig *rig, const struct motion_limits *limits)
{
    struct truth truth = truth_of((int64_t)rig->board.count, limits);
    long double worst = 0;

    for (size_t k = 0; k < rig->board.count; k++) {
        long double at = (long double)(rig->board.pulses[k] - rig->motion.origin);
        worst = fmaxl(worst, fabsl(at - truth_time(&truth, k + 0.5L) * HZ));
    }
    return worst;
}

/* Divided differences of the pulses over spans of at least `span` seconds, rest before and after included, are weighted
 * means of speed, acceleration and jerk: within the limits, but for what the pulses' tolerance makes of them. */
struct places {
    double *t, *x;
    size_t count;
};

static inline struct places places_of(const struct rig *rig, double span)
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

static inline double divided(const struct places *p, const size_t *at, int order)
{
    if (order == 0)
        return p->x[at[0]];
    return (divided(p, at + 1, order - 1) - divided(p, at, order - 1)) / (p->t[at[order]] - p->t[at[0]]);
}

static inline void assert_within_limits(const struct rig *rig, const struct motion_limits *l)
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

static inline double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) / 9007199254740992.0;
}

static inline double between(double low, double high) /* evenly on a logarithmic scale */
{
    return low * pow(high / low, uniform());
}

static inline struct motion_limits random_limits(void)
{
    struct motion_limits l;

    l.speed = between(3, 100000);
    l.acceleration = l.speed / between(0.01, 3);
    l.jerk = l.acceleration / between(0.003, 1);
    return l;
}

static inline int64_t random_distance(const struct motion_limits *l)
{
    return (int64_t)between(1, fmin(l->speed * 10, 200000) + 2);
}

#endif
