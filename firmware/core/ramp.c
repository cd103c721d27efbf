/* The S-curve. */
#include "firmware/core/ramp.h"

#include "proto/mechanism/ramp_time.h"

#include <math.h>

/* The state `s` seconds into a phase. */
static void phase_at(const struct ramp_phase *p, double s, struct ramp_phase *state)
{
    double js = p->j * s;

    state->t = p->t + s;
    state->x = p->x + s * (p->v + s * (0.5 * p->a + js * (1.0 / 6)));
    state->v = p->v + s * (p->a + 0.5 * js);
    state->a = p->a + js;
    state->j = p->j;
}

/* Adds a phase of jerk j that lasts `seconds`, and after it the state it ends in. */
static void add_phase(struct ramp *ramp, double j, double seconds)
{
    struct ramp_phase *p = &ramp->phases[ramp->count];

    if (!(seconds > 0))
        return;
    p->j = j;
    phase_at(p, seconds, p + 1);
    ramp->count++;
}

static void set_rest(struct ramp *ramp, double x)
{
    struct ramp_phase *end = &ramp->phases[ramp->count];

    end->x = x;
    end->v = end->a = end->j = 0;
}

void ramp_plan(struct ramp *ramp, double distance, const struct motion_limits *limits)
{
    double j = limits->jerk;
    double v = lumi_move_speed(distance, limits->speed, limits->acceleration, j);
    double whole = lumi_ramp_time(v, limits->acceleration, j);
    double rise = fmin(limits->acceleration / j, whole / 2), hold = whole - 2 * rise;

    ramp->count = 0;
    ramp->stopped = false;
    ramp->phases[0] = (struct ramp_phase){0};
    add_phase(ramp, j, rise);
    add_phase(ramp, 0, hold);
    add_phase(ramp, -j, rise);
    /* The sums are right but for rounding; what must be exact is made so. */
    ramp->phases[ramp->count].v = v;
    ramp->phases[ramp->count].a = 0;
    add_phase(ramp, 0, (distance - v * whole) / v);
    add_phase(ramp, -j, rise);
    add_phase(ramp, 0, hold);
    add_phase(ramp, j, rise);
    set_rest(ramp, distance);
}

static const struct ramp_phase *phase_of_time(const struct ramp *ramp, double t)
{
    int n = 0;

    while (n + 1 < ramp->count && t >= ramp->phases[n + 1].t)
        n++;
    return &ramp->phases[n];
}

void ramp_at(const struct ramp *ramp, double t, struct ramp_phase *state)
{
    if (t <= ramp->phases[0].t || ramp->count == 0) {
        *state = ramp->phases[0];
        return;
    }
    if (t >= ramp->phases[ramp->count].t) {
        *state = ramp->phases[ramp->count];
        return;
    }
    const struct ramp_phase *p = phase_of_time(ramp, t);
    phase_at(p, t - p->t, state);
    state->v = fmax(state->v, 0);
}

/* From speed v and acceleration a to rest in the least time: the acceleration falls to −p, p at most the limit, holds,
 * and rises to 0. The fall changes the speed by (a² − p²) / 2j, whichever sign a has, the rise by −p² / 2j. */
void ramp_stop(struct ramp *ramp, double t, const struct motion_limits *limits)
{
    const struct ramp_phase *end = &ramp->phases[ramp->count];

    if (ramp->stopped || t >= end->t)
        return;
    ramp->stopped = true;
    int n = (int)(phase_of_time(ramp, t) - ramp->phases);
    struct ramp_phase at;
    ramp_at(ramp, t, &at);
    double j = limits->jerk, a = at.a, v = at.v + a * a / (2 * j); /* speed, were a brought to 0 first */
    /* At least what it slows down with already; that is more only by rounding. */
    double p = fmax(fmin(sqrt(fmax(v * j, 0)), limits->acceleration), -a);

    ramp->count = n + (t > ramp->phases[n].t);
    ramp->phases[ramp->count] = at;
    add_phase(ramp, -j, (a + p) / j);
    add_phase(ramp, 0, p > 0 ? v / p - p / j : 0);
    add_phase(ramp, j, p / j);
    set_rest(ramp, ramp->phases[ramp->count].x);
}

#define CLOSE 1e-7 /* s; the error of Newton's next step is the square of the last, times acceleration by speed */

/* The state where a phase that lasts `seconds` passes x, looked for from `s` on: Newton's steps, halving where they
 * lead out of the bracket. */
static void solve_phase(const struct ramp_phase *p, double seconds, double x, double s, struct ramp_phase *state)
{
    double low = 0, high = seconds;

    if (!(s > low && s < high))
        s = p->v == 0 ? fmin(cbrt(6 * (x - p->x) / p->j), seconds) : 0.5 * seconds;
    for (int i = 0; i < 100; i++) {
        phase_at(p, s, state);
        double over = state->x - x;
        if (over > 0)
            high = s;
        else
            low = s;
        double step = state->v > 0 ? over / state->v : seconds, next = s - step;
        if (fabs(step) < CLOSE) {
            state->t -= step;
            state->v -= step * state->a;
            break;
        }
        if (!(next > low && next < high)) {
            next = 0.5 * (low + high);
            if (next <= low || next >= high)
                break;
        }
        s = next;
    }
    state->x = x;
}

void ramp_pass(const struct ramp *ramp, double x, double guess, struct ramp_phase *state)
{
    int n = 0;

    if (x <= ramp->phases[0].x || ramp->count == 0) {
        *state = ramp->phases[0];
        return;
    }
    if (x >= ramp->phases[ramp->count].x) {
        *state = ramp->phases[ramp->count];
        return;
    }
    while (n + 1 < ramp->count && x >= ramp->phases[n + 1].x)
        n++;
    const struct ramp_phase *p = &ramp->phases[n];
    if (p->a == 0 && p->j == 0) {
        *state = *p;
        state->t += (x - p->x) / p->v;
        state->x = x;
    } else {
        solve_phase(p, ramp->phases[n + 1].t - p->t, x, guess - p->t, state);
    }
}

double ramp_time(const struct ramp *ramp, double x)
{
    struct ramp_phase state;

    ramp_pass(ramp, x, -1, &state);
    return state.t;
}

double ramp_end_time(const struct ramp *ramp)
{
    return ramp->phases[ramp->count].t;
}

double ramp_end_place(const struct ramp *ramp)
{
    return ramp->phases[ramp->count].x;
}
