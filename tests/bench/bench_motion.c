/* What the motion planner costs here, and how true its pulses are: for three sets of limits, nanoseconds a planned
 * segment and a step interrupt, segments a second of motion, and the worst distance of a pulse from its curve.
 *
 *   bench_motion
 *
 * What it costs on the board, in instructions, is counted on the emulated one. */
#include "firmware/core/motion_state.h"

#include <math.h>
#include <stdio.h>
#include <time.h>

static uint64_t ticks;

static uint64_t now(void *port)
{
    (void)port;
    return ticks;
}

static unsigned lock(void *port)
{
    (void)port;
    return 0;
}

static void unlock(void *port, unsigned state)
{
    (void)port, (void)state;
}

static struct {
    uint64_t next;
    uint32_t after;
} timer;

static void steps_start(void *port, uint64_t at, bool forward, uint32_t first)
{
    (void)port, (void)forward;
    timer.next = at;
    timer.after = first;
}

static double seconds(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void measure(const struct motion_limits *limits, int64_t steps)
{
    static struct motion motion;
    const struct board board = {.now = now, .lock = lock, .unlock = unlock, .steps_start = steps_start};
    double planning = 0, playing = 0, worst = 0;
    long made = 0;

    ticks = 1000;
    motion_init(&motion, &board);
    motion_set_position(&motion, 0);
    if (!motion_start(&motion, steps, limits, 0))
        return;
    while (motion_moving(&motion)) {
        uint64_t to = ticks + BOARD_TICK_HZ / 1000;
        double begin = seconds(), middle;
        motion_poll(&motion);
        middle = seconds();
        planning += middle - begin;
        while (motion_moving(&motion) && timer.next <= to) {
            double wanted = ramp_time(&motion.ramp, (double)made + 0.5) * BOARD_TICK_HZ;
            worst = fmax(worst, fabs((double)(timer.next - motion.origin) - wanted));
            timer.next += timer.after;
            begin = seconds();
            timer.after = motion_on_step(&motion, timer.next);
            playing += seconds() - begin;
            made++;
        }
        ticks = to;
    }
    double moved = ramp_end_time(&motion.ramp);
    printf("%8.0f steps/s %9.0f steps/s²: %7ld steps%s, %5.0f segments/s, %4.0f ns a segment, %3.0f ns a step "
           "(clock included), worst pulse %4.1f ticks off\n",
           limits->speed, limits->acceleration, made, motion_starved(&motion) ? ", STARVED" : "", motion.head / moved,
           1e9 * planning / motion.head, 1e9 * playing / (double)made, worst);
}

int main(void)
{
    /* bar2 at 30 s a turn, bar2 as fast as its profile, the most the board does. */
    static const struct motion_limits limits[] = {{960, 14400, 192000}, {4800, 14400, 192000}, {100000, 200000, 2e6}};

    for (int i = 0; i < 3; i++)
        measure(&limits[i], (int64_t)(limits[i].speed * 10));
    return 0;
}
