/* The state of homing.h. Only firmware/core includes this; nobody but homing.c touches a member. */
#ifndef LUMI_FIRMWARE_CORE_HOMING_STATE_H
#define LUMI_FIRMWARE_CORE_HOMING_STATE_H

#include "firmware/core/debounce.h"
#include "firmware/core/homing.h"

enum homing_phase {
    HOMING_IDLE = 0,
    HOMING_SETTLE,   /* at rest: what do the switches say? */
    HOMING_WIND,     /* back until the arm is up */
    HOMING_BACK,     /* back over the mark */
    HOMING_FORTH,    /* from the upper end on to the mark */
    HOMING_CLEAR,    /* back to where the approach begins */
    HOMING_APPROACH, /* on, slowly, until the switch closes */
    HOMING_SET,      /* at rest behind the mark: that is it */
    HOMING_GIVE_UP   /* at rest: failed */
};

struct homing {
    const struct board *board;
    struct motion *motion;
    const struct lumi_rig *rig;
    int turn;
    enum homing_phase phase, next; /* next: once it stands; HOMING_IDLE: it has not been stopped */
    enum homing_result result;
    const char *reason;
    uint64_t since;   /* tick at which the phase began */
    int64_t began;    /* position then */
    int64_t mark;     /* where the switch closed or, turning back, opened */
    int64_t slack_at; /* position since which the string has been slack */
    bool wind, on_mark, slack, slack_from_start;
    struct debounce index, wound; /* shared with the interrupt */
};

#endif
