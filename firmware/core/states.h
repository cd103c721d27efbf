/* The states of the board (rig.proto, State) and what each event makes of them: one table. Whether the position is
 * known is part of the state. */
#ifndef LUMI_FIRMWARE_CORE_STATES_H
#define LUMI_FIRMWARE_CORE_STATES_H

#include "proto/wire/message.h"

#include <stdbool.h>

#define STATES (lumi_wire_State_TESTING + 1)

enum state_event {
    /* Commands. */
    EVENT_HOME = 0,
    EVENT_JOG,
    EVENT_TEST,
    EVENT_START, /* a sweep */
    EVENT_FIRE,  /* external drive: a bracket where the platform stands */
    EVENT_PAUSE,
    EVENT_STOP,
    EVENT_PROFILE,    /* another profile is the board's; nothing is known of the position in its steps */
    EVENT_NO_PROFILE, /* there is none */
    /* What was going on. */
    EVENT_AT_START,   /* wound to where the sweep begins */
    EVENT_REST_KNOWN, /* at rest, done or given up; no fault stands */
    EVENT_REST_LOST,
    /* Faults. */
    EVENT_FAULT_LATER, /* the reaction takes time: the row's end, a ramp */
    EVENT_FAULT_KNOWN, /* at rest with a fault */
    EVENT_FAULT_LOST,
    EVENT_CLEAR_KNOWN, /* no fault stands any more */
    EVENT_CLEAR_LOST,
    STATE_EVENTS
};

/* What the table says beside a state. */
enum state_answer {
    STATE_MISSING = 0, /* no cell may be */
    STATE_REFUSE = 64, /* a command that is not for this state */
    STATE_IMPOSSIBLE,  /* cannot be: an internal fault */
    STATE_STAY         /* nothing changes */
};

/* A lumi_wire_State, or a state_answer. */
unsigned state_next(lumi_wire_State state, enum state_event event);
/* Nothing moves in this state, nor will without a command. */
bool state_at_rest(lumi_wire_State state);
/* A sweep is going on that a host must watch. */
bool state_sweeping(lumi_wire_State state);
/* "homing", "paused" …: for texts. */
const char *state_name(lumi_wire_State state);

#endif
