/* Faults: what raises them, what each does to motor, brake and triggers (the profile says), how they are cleared.
 *
 * 1. An emergency stop's edge stops the steps in the interrupt itself; the main loop tells about it afterwards.
 * 2. A fault stands until a Clear names it and its cause is gone. While one stands nothing begins to move.
 * 3. The end of the string and a slack string forbid to pay out more, not to wind up: their cause is the motion, and it
 *    is gone at rest. */
#ifndef LUMI_FIRMWARE_CORE_SAFETY_H
#define LUMI_FIRMWARE_CORE_SAFETY_H

#include "firmware/board/board.h"
#include "proto/mechanism/rig.h"

struct core;

struct safety {
    uint32_t standing;           /* bit a fault */
    volatile bool estop_seen;    /* by the interrupt, until the fault is raised */
    volatile bool index_seen;    /* the last leading edge of the index mark … */
    volatile uint64_t index_at;  /* … its tick … */
    volatile int64_t index_step; /* … and the step it fell on */
    uint64_t index_before;       /* the edge before that, for the time between them; 0: none */
    int64_t index_step_before;
    bool inputs[BOARD_INPUTS]; /* debounced */
    bool raw[BOARD_INPUTS];
    uint64_t changed[BOARD_INPUTS]; /* of raw */
    uint64_t heard;                 /* tick of the last heartbeat */
    uint64_t supply_due, speed_due; /* when to look again */
    int supply_mv;
    int supply_low; /* readings below the minimum, in a row */
};

void safety_init(struct core *core);
void safety_poll(struct core *core);
uint64_t safety_next_poll(const struct core *core);
void safety_heartbeat(struct core *core);
/* `text` is static: what happened. Once for each fault until it is cleared. */
void safety_raise(struct core *core, enum lumi_rig_fault fault, const char *text);
/* NULL: cleared; otherwise why not. */
const char *safety_clear(struct core *core, uint32_t faults);
/* Interrupt. */
void safety_on_input(struct core *core, enum board_input input, bool active, uint64_t at);

#endif
