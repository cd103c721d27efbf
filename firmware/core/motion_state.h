/* The state of motion.h's planner. Only firmware/core includes this; nobody but motion.c touches a member. */
#ifndef LUMI_FIRMWARE_CORE_MOTION_STATE_H
#define LUMI_FIRMWARE_CORE_MOTION_STATE_H

#include "firmware/core/motion.h"

#include <stdatomic.h>

/* `count` intervals between pulses in 2⁻³² ticks: `interval`, then each `add` more than the one before. */
struct motion_segment {
    uint64_t interval;
    int64_t add;
    uint32_t count;
};
#define MOTION_SEGMENTS 64 /* a power of two */

struct motion {
    const struct board *board;
    uint64_t direction_setup; /* ticks */

    /* Shared with the interrupt: segments go from `head` (main loop) to `tail` (interrupt). */
    struct motion_segment segments[MOTION_SEGMENTS];
    atomic_uint head, tail;
    atomic_bool planned; /* all segments of the move are in the queue */
    atomic_bool running; /* pulses are still to come */
    atomic_bool known, halted, starved;

    /* The interrupt's while `running`. */
    struct motion_segment playing;
    uint32_t fraction; /* of a tick, carried from pulse to pulse */
    bool ending;       /* the pulse to come is the last */
    int direction;     /* +1, −1 */
    int64_t position;

    /* The main loop's. */
    struct ramp ramp;
    struct motion_limits limits;
    int64_t from;      /* position at the curve's begin */
    int64_t turned_at; /* since there all steps were rising */
    uint64_t origin;   /* tick of the curve's begin */
    uint64_t rest_at;  /* tick of its end */
    uint64_t next_poll;
    uint64_t safe_until; /* tick of the last pulse but one in the queue: there, more must be in it */
    int64_t pulses;      /* of the move */
    int64_t last;        /* number of the last pulse that is in the queue, from 0 */
    struct {
        struct ramp_phase curve; /* when it comes by the curve, the speed there … */
        double inverse;          /* 1 / speed */
        uint64_t ticks;          /* when it comes, from the origin … */
        uint32_t fraction;       /* … and 2⁻³² of a tick, half a tick added */
    } at_last;
    uint32_t stride; /* steps the segment before had */
    bool curve;      /* there is a curve to ask about */
};

#endif
