/* Plans pulses along the curve and plays them. */
#include "firmware/core/motion_state.h"

#include "proto/mechanism/ramp_time.h"

#include <math.h>
#include <string.h>

#define HORIZON (BOARD_TICK_HZ / 40)     /* planned ahead */
#define START_LEAD (BOARD_TICK_HZ / 500) /* from motion_start to the curve's begin: time to plan its first segments */
#define FIRST_SEGMENTS 4                 /* planned by motion_start itself */
#define POLL_SEGMENTS 16 /* planned by one call: some half a millisecond's work, at least 3 ms of motion */
#define SEGMENT_SECONDS_MAX 0.005F
#define SEGMENT_SECONDS_MIN 0.0002F /* a ramp that takes milliseconds bends by a few ticks in that */
#define ONE 4294967296.0            /* 2^32: a tick in an interval's units */

void motion_init(struct motion *motion, const struct board *board)
{
    memset(motion, 0, sizeof *motion);
    motion->board = board;
    motion->direction = 1;
    motion->next_poll = BOARD_NEVER;
}

void motion_set_driver(struct motion *motion, double step_pulse, double direction_setup)
{
    const struct board *board = motion->board;

    board->step_pulse_width(board->port, (uint32_t)(step_pulse * BOARD_TICK_HZ + 0.5));
    motion->direction_setup = (uint64_t)(direction_setup * BOARD_TICK_HZ + 0.5);
}

/* Playing. */

/* Ticks to the next pulse, 0: none is left. */
static uint32_t next_interval(struct motion *motion)
{
    struct motion_segment *s = &motion->playing;

    if (s->count == 0) {
        unsigned tail = atomic_load_explicit(&motion->tail, memory_order_relaxed);
        if (tail == atomic_load_explicit(&motion->head, memory_order_acquire)) {
            if (!atomic_load_explicit(&motion->planned, memory_order_relaxed)) {
                motion->starved = motion->halted = true;
                motion->known = false;
            }
            return 0;
        }
        *s = motion->segments[tail % MOTION_SEGMENTS];
        atomic_store_explicit(&motion->tail, tail + 1, memory_order_release);
    }
    uint64_t sum = s->interval + motion->fraction;
    motion->fraction = (uint32_t)sum;
    s->interval += (uint64_t)s->add;
    s->count--;
    return (uint32_t)(sum >> 32);
}

uint32_t motion_on_step(struct motion *motion, uint64_t at)
{
    (void)at; /* it is the sum of what this has returned */
    motion->position += motion->direction;
    if (!atomic_load_explicit(&motion->running, memory_order_relaxed))
        return 0; /* it had risen when the steps were stopped */
    uint32_t interval = motion->ending ? 0 : next_interval(motion);
    if (motion->ending)
        motion->running = false;
    motion->ending = interval == 0;
    return interval;
}

void motion_halt(struct motion *motion)
{
    const struct board *board = motion->board;
    unsigned state = board->lock(board->port);

    motion->halted = true;
    if (motion->running) {
        board->steps_stop(board->port);
        if (motion->position != motion->from)
            motion->known = false;
        motion->running = false;
    }
    board->unlock(board->port, state);
}

void motion_release(struct motion *motion)
{
    if (motion->halted) {
        motion->curve = false;
        motion->rest_at = 0; /* the end of a move that was broken off holds nothing up */
    }
    motion->starved = motion->halted = false;
}

/* Planning. */

/* How far a parabola through a segment's ends strays from the curve, ticks: t(x) has the third derivative 3 a² / v⁵ −
 * j / v⁴, and s (s − n/2) (s − n) is at most n³ √3 / 36 in 0 … n. An estimate: single precision is enough. */
static float bend(const struct ramp_phase *at, float n)
{
    float v = (float)at->v, w = n / v, aw = (float)at->a * w / v, jw = (float)at->j * w * w / v;

    return BOARD_TICK_HZ * (0.0481125F / 6) * w * fabsf(3 * aw * aw - jw);
}

/* The most it bends between two places of the curve: at its ends, and where a phase begins in between. */
static float most_bend(const struct ramp *ramp, const struct ramp_phase *from, const struct ramp_phase *to, float n)
{
    float most = fmaxf(bend(from, n), bend(to, n));

    for (int i = 1; i < ramp->count; i++)
        if (ramp->phases[i].t > from->t && ramp->phases[i].t < to->t)
            most = fmaxf(most, bend(&ramp->phases[i], n));
    return most;
}

static double time_of_pulse(const struct motion *motion, int64_t pulse)
{
    return ramp_time(&motion->ramp, (double)pulse + 0.5);
}

/* The state n pulses on from `at`, looked for where the first three terms of t(x) lead. */
static void pulse_after(const struct motion *motion, const struct ramp_phase *at, uint32_t n, struct ramp_phase *state)
{
    double w = n * motion->at_last.inverse, bent = at->a * w * motion->at_last.inverse;
    double jerked = at->j * w * w * motion->at_last.inverse;
    double guess = at->t + w * (1 - bent * (0.5 - 0.5 * bent) - jerked * (1.0 / 6));

    ramp_pass(&motion->ramp, at->x + n, guess, state);
}

/* Puts the segment from the last planned pulse to pulse last + n into the queue: it ends at the tick, and the fraction,
 * that the curve says, and its first and last interval differ as the curve's speeds do. */
static void put_segment(struct motion *motion, uint32_t n, const struct ramp_phase *end)
{
    unsigned head = motion->head;
    struct motion_segment *s = &motion->segments[head % MOTION_SEGMENTS];
    double ticks = end->t * BOARD_TICK_HZ + 0.5 - (double)motion->at_last.ticks;
    double interval = ticks * ONE - motion->at_last.fraction, inverse = 1 / end->v;

    s->count = n;
    s->add = 0;
    if (n > 1) {
        double share = 1.0 / n;
        double add = (inverse - motion->at_last.inverse) * (BOARD_TICK_HZ * ONE) * share;
        s->add = (int64_t)floor(add + 0.5);
        interval = interval * share - (double)s->add * (0.5 * (n - 1));
    }
    s->interval = (uint64_t)(interval + 0.5);

    uint64_t sum = s->interval * n + (uint64_t)(s->add * ((int64_t)n * (n - 1) / 2)) + motion->at_last.fraction;
    motion->at_last.ticks += sum >> 32;
    motion->at_last.fraction = (uint32_t)sum;
    motion->at_last.curve = *end;
    motion->at_last.inverse = inverse;
    motion->last += n;
    motion->stride = n;
    motion->safe_until = motion->origin + motion->at_last.ticks - ((s->interval + (uint64_t)s->add * (n - 1)) >> 32);
    atomic_store_explicit(&motion->head, head + 1, memory_order_release);
}

/* Plans one segment more: as long as lets the parabola be within half the tolerance. */
static void plan_segment(struct motion *motion)
{
    const struct ramp_phase here = motion->at_last.curve;
    struct ramp_phase end;
    float v = (float)here.v, limit = MOTION_RAMP_TICKS / 2.0F - 1;
    int64_t left = motion->pulses - 1 - motion->last;
    uint32_t longest = v * SEGMENT_SECONDS_MAX > 1 ? (uint32_t)(v * SEGMENT_SECONDS_MAX) : 1;
    uint32_t shortest = v * SEGMENT_SECONDS_MIN > 1 ? (uint32_t)(v * SEGMENT_SECONDS_MIN) : 1;
    uint32_t n = motion->stride;

    longest = longest < left ? longest : (uint32_t)left;
    shortest = shortest < longest ? shortest : longest;
    n = n > longest ? longest : n < shortest ? shortest : n;
    while (n < longest && bend(&here, 2 * (float)n) < limit)
        n = 2 * n < longest ? 2 * n : longest;
    for (;;) {
        pulse_after(motion, &here, n, &end);
        if (n <= shortest || most_bend(&motion->ramp, &here, &end, (float)n) <= limit)
            break;
        n = n / 2 > shortest ? n / 2 : shortest;
    }
    put_segment(motion, n, &end);
}

void motion_poll(struct motion *motion)
{
    const struct board *board = motion->board;
    uint64_t now = board->now(board->port);

    if (!motion->running || motion->planned) {
        motion->next_poll = BOARD_NEVER;
        return;
    }
    for (int n = 0; n < POLL_SEGMENTS && motion->last < motion->pulses - 1 && motion->safe_until < now + HORIZON &&
                    motion->head - motion->tail < MOTION_SEGMENTS;
         n++)
        plan_segment(motion);
    if (motion->last == motion->pulses - 1)
        motion->planned = true;
    uint64_t until = motion->safe_until;
    motion->next_poll = motion->planned ? BOARD_NEVER : until > now ? now + (until - now) / 2 : now;
}

uint64_t motion_next_poll(const struct motion *motion)
{
    return motion->running ? motion->next_poll : BOARD_NEVER;
}

/* Moves. */

/* Pulses of a curve that ends at place x: one at every half below it. One that falls on the very end, but for rounding,
 * is left away. */
static int64_t pulses_to(double x)
{
    return (int64_t)floor(x + 0.5 - 1e-6);
}

/* Intervals stay below 2^30 ticks, and long enough for an interrupt each. */
static bool limits_in_range(const struct motion_limits *limits)
{
    return limits->speed > 0 && limits->acceleration > 0 && limits->jerk > 0 &&
           limits->speed <= BOARD_TICK_HZ / 100.0 &&
           lumi_ramp_slowest_step(limits->speed, limits->acceleration, limits->jerk) <= LUMI_RAMP_STEP_SECONDS;
}

/* Plans the first segments: the first pulse comes at tick *pulse, the next so many ticks later (0: there is none). */
static uint32_t plan_start(struct motion *motion, uint64_t now, uint64_t at, uint64_t *pulse)
{
    struct ramp_phase *curve = &motion->at_last.curve;

    ramp_pass(&motion->ramp, 0.5, -1, curve);
    double ticks = curve->t * BOARD_TICK_HZ + 0.5;
    uint64_t start = now + START_LEAD;

    if (start < motion->rest_at)
        start = motion->rest_at;
    if (start < at)
        start = at;
    if (start + (uint64_t)ticks < now + motion->direction_setup)
        start = now + motion->direction_setup;
    motion->at_last.inverse = 1 / curve->v;
    motion->origin = start;
    *pulse = start + (uint64_t)ticks;
    motion->last = 0;
    motion->at_last.ticks = (uint64_t)ticks;
    motion->at_last.fraction = (uint32_t)((ticks - floor(ticks)) * ONE);
    motion->fraction = motion->at_last.fraction;
    motion->stride = 1;
    motion->playing.count = 0;
    motion->tail = motion->head;
    for (int i = 0; i < FIRST_SEGMENTS && motion->last < motion->pulses - 1; i++)
        plan_segment(motion);
    motion->planned = motion->last == motion->pulses - 1;
    return motion->pulses > 1 ? next_interval(motion) : 0;
}

static bool start(struct motion *motion, int64_t steps, const struct motion_limits *limits, uint64_t at)
{
    const struct board *board = motion->board;
    uint64_t now = board->now(board->port);

    if (motion->running || motion->halted || steps == 0 || !limits_in_range(limits))
        return false;
    if (steps > 0 && motion->direction < 0)
        motion->turned_at = motion->position;
    motion->direction = steps > 0 ? 1 : -1;
    motion->limits = *limits;
    motion->from = motion->position;
    motion->pulses = steps > 0 ? steps : -steps;
    ramp_plan(&motion->ramp, (double)motion->pulses, limits);
    uint64_t pulse;
    uint32_t first = plan_start(motion, now, at, &pulse);

    unsigned state = board->lock(board->port);
    bool free = !motion->halted;
    motion->curve = free;
    if (free) {
        motion->rest_at = motion->origin + (uint64_t)ceil(ramp_end_time(&motion->ramp) * BOARD_TICK_HZ);
        motion->next_poll = now;
        motion->ending = first == 0;
        motion->running = true;
        board->steps_start(board->port, pulse, steps > 0, first);
    }
    board->unlock(board->port, state);
    return free;
}

bool motion_start(struct motion *motion, int64_t target, const struct motion_limits *limits, uint64_t at)
{
    return motion->known && start(motion, target - motion_position(motion), limits, at);
}

bool motion_seek(struct motion *motion, int64_t steps, const struct motion_limits *limits)
{
    return start(motion, steps, limits, 0);
}

/* Stopped before its first pulse: it does not begin at all. */
static bool call_off(struct motion *motion)
{
    const struct board *board = motion->board;
    unsigned state = board->lock(board->port);
    bool begun = !motion->running || motion->position != motion->from;

    if (!begun) {
        board->steps_stop(board->port);
        motion->running = false;
        motion->origin = motion->rest_at = board->now(board->port);
        motion->ramp.count = 0;
        motion->ramp.phases[0] = (struct ramp_phase){0};
        motion->pulses = 0;
    }
    board->unlock(board->port, state);
    return !begun;
}

void motion_stop(struct motion *motion)
{
    if (call_off(motion) || !motion->running || motion->planned)
        return;
    ramp_stop(&motion->ramp, motion->at_last.curve.t, &motion->limits);
    int64_t pulses = pulses_to(ramp_end_place(&motion->ramp));
    if (pulses < motion->pulses)
        motion->pulses = pulses > motion->last ? pulses : motion->last + 1;
    motion->rest_at = motion->origin + (uint64_t)ceil(ramp_end_time(&motion->ramp) * BOARD_TICK_HZ);
    motion->stride = 1;
    if (motion->last == motion->pulses - 1)
        motion->planned = true;
}

/* Questions. */

bool motion_halted(const struct motion *motion)
{
    return motion->halted;
}

bool motion_starved(const struct motion *motion)
{
    return motion->starved;
}

bool motion_moving(const struct motion *motion)
{
    return motion->running;
}

bool motion_known(const struct motion *motion)
{
    return motion->known;
}

int64_t motion_position(const struct motion *motion)
{
    const struct board *board = motion->board;
    unsigned state = board->lock(board->port);
    int64_t position = motion->position;

    board->unlock(board->port, state);
    return position;
}

static uint64_t tick_of(const struct motion *motion, double t)
{
    return motion->origin + (uint64_t)(t * BOARD_TICK_HZ + 0.5);
}

uint64_t motion_time_of(const struct motion *motion, double position)
{
    double x = (position - (double)motion->from) * motion->direction;

    if (!motion->curve || motion->halted || !(x >= 0 && x <= ramp_end_place(&motion->ramp)))
        return BOARD_NEVER;
    return tick_of(motion, ramp_time(&motion->ramp, x));
}

uint64_t motion_end(const struct motion *motion)
{
    if (!motion->curve || motion->halted)
        return BOARD_NEVER;
    return tick_of(motion, time_of_pulse(motion, motion->pulses - 1));
}

double motion_speed(const struct motion *motion, uint64_t now)
{
    struct ramp_phase at;

    if (!motion->running || now < motion->origin)
        return 0;
    ramp_at(&motion->ramp, (double)(now - motion->origin) / BOARD_TICK_HZ, &at);
    return at.v * motion->direction;
}

int64_t motion_run_up_steps(const struct motion_limits *limits)
{
    return (int64_t)ceil(lumi_ramp_distance(limits->speed, limits->acceleration, limits->jerk));
}

void motion_set_position(struct motion *motion, int64_t position)
{
    const struct board *board = motion->board;
    unsigned state = board->lock(board->port);

    if (!motion->running) {
        motion->turned_at += position - motion->position;
        motion->from += position - motion->position;
        motion->position = position;
        motion->known = true;
    }
    board->unlock(board->port, state);
}

void motion_forget(struct motion *motion)
{
    motion->known = false;
}

int64_t motion_next_leg(const struct motion *motion, int64_t target, int64_t backlash)
{
    int64_t position = motion_position(motion);
    int64_t turned_at = motion->direction > 0 ? motion->turned_at : position;

    return target >= position && target - turned_at >= backlash ? target : target - backlash;
}
