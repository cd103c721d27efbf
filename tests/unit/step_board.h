/* A board that has nothing but a clock, a step timer and inputs, in virtual time. It notes every pulse. */
#ifndef LUMI_TESTS_UNIT_STEP_BOARD_H
#define LUMI_TESTS_UNIT_STEP_BOARD_H

#include "firmware/core/motion_state.h"

#include <stdlib.h>

struct step_board {
    struct board board;
    struct motion *motion;
    uint64_t now;
    bool stepping, forward;
    uint64_t next;  /* tick of the pulse to come … */
    uint32_t after; /* … and from it to the one after; 0: none */
    bool inputs[BOARD_INPUTS];
    uint32_t pulse_width;
    int locks, starts, stops;
    /* Every pulse, in order. */
    uint64_t *pulses;
    size_t count, room;
    int64_t steps; /* forward less backward: the truth */
    void (*on_pulse)(struct step_board *board);
    void *context;
};

static uint64_t step_board_now(void *port)
{
    return ((struct step_board *)port)->now;
}

static unsigned step_board_lock(void *port)
{
    ((struct step_board *)port)->locks++;
    return 0;
}

static void step_board_unlock(void *port, unsigned state)
{
    (void)state;
    ((struct step_board *)port)->locks--;
}

static void step_board_start(void *port, uint64_t at, bool forward, uint32_t first)
{
    struct step_board *b = port;

    b->starts++;
    b->stepping = true;
    b->forward = forward;
    b->next = at > b->now ? at : b->now;
    b->after = first;
}

static void step_board_stop(void *port)
{
    struct step_board *b = port;

    b->stops++;
    b->stepping = false;
}

static void step_board_width(void *port, uint32_t ticks)
{
    ((struct step_board *)port)->pulse_width = ticks;
}

static bool step_board_input(void *port, enum board_input input)
{
    return ((struct step_board *)port)->inputs[input];
}

static inline void step_board_init(struct step_board *b, struct motion *motion)
{
    *b = (struct step_board){.motion = motion};
    b->board = (struct board){.port = b,
                              .now = step_board_now,
                              .lock = step_board_lock,
                              .unlock = step_board_unlock,
                              .steps_start = step_board_start,
                              .steps_stop = step_board_stop,
                              .step_pulse_width = step_board_width,
                              .input = step_board_input};
    b->now = 1000;
    motion_init(motion, &b->board);
}

static inline void step_board_finish(struct step_board *b)
{
    free(b->pulses);
    b->pulses = NULL;
    b->count = b->room = 0;
}

/* One pulse rises: the timer takes the period that was preloaded, the interrupt preloads the next. */
static inline void step_board_pulse(struct step_board *b)
{
    if (b->count == b->room) {
        b->room = b->room ? 2 * b->room : 1024;
        b->pulses = realloc(b->pulses, b->room * sizeof *b->pulses);
        if (!b->pulses)
            abort();
    }
    b->now = b->next;
    b->pulses[b->count++] = b->now;
    b->steps += b->forward ? 1 : -1;
    uint32_t period = b->after;
    if (period == 0)
        b->stepping = false;
    b->next += period;
    b->after = motion_on_step(b->motion, b->now);
    if (b->on_pulse)
        b->on_pulse(b);
}

/* Lets time run to tick `to` without the main loop. */
static inline void step_board_advance(struct step_board *b, uint64_t to)
{
    while (b->stepping && b->next <= to)
        step_board_pulse(b);
    b->now = to;
}

/* Runs main loop and pulses until nothing moves or tick `to`, the loop coming round every `period` ticks. */
static inline void step_board_run(struct step_board *b, uint64_t to, uint64_t period)
{
    motion_poll(b->motion);
    while (motion_moving(b->motion) && b->now < to) {
        uint64_t next = b->now + period;
        step_board_advance(b, next < to ? next : to);
        motion_poll(b->motion);
    }
}

#endif
