/* Faults: what raises them, what each does to motor, brake and triggers (the profile says), how they are cleared.
 *
 * 1. An emergency stop's edge stops the steps in the interrupt itself; the main loop tells about it afterwards.
 * 2. A fault stands until a Clear names it and its cause is gone. While one stands nothing begins to move.
 * 3. The end of the string and a slack string forbid to pay out more, not to wind up: their cause is the motion, and it
 *    is gone at rest. */
#ifndef LUMI_FIRMWARE_CORE_SAFETY_H
#define LUMI_FIRMWARE_CORE_SAFETY_H

#include "firmware/core/debounce.h"
#include "firmware/core/index_watch.h"
#include "proto/mechanism/rig.h"

struct core;

struct safety {
    uint32_t standing;           /* bit a fault */
    volatile bool driver_seen;   /* by the interrupt, while the main loop hung; until the fault is raised */
    volatile bool estop_seen;    /* by the interrupt, until the fault is raised */
    struct debounce index;       /* shared with the interrupt, under lock */
    struct debounce_edge marked; /* the last index mark, for the time between them; `active`: there is one */
    struct index_watch watch;
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
/* A sweep sets off, with rising steps only, until it rests: index marks are held to their places. */
void safety_watch_index(struct core *core);
/* Interrupt. */
void safety_on_input(struct core *core, enum board_input input, bool active, uint64_t at);

#endif
