/* The S-curve: where a move is at a time, and when it is at a place. Plain maths in steps and seconds, in doubles, for
 * the main loop.
 *
 * A curve is a row of phases of constant jerk, seven for a move from rest to rest: the acceleration rises, holds,
 * falls, the speed holds (the cruise), and the same mirrored. A move too short for the speed or the acceleration has
 * fewer. A stop cuts the curve anywhere and ends it in at most three phases. Place 0 and time 0 are where and when the
 * curve begins; it never runs backwards. */
#ifndef LUMI_FIRMWARE_CORE_RAMP_H
#define LUMI_FIRMWARE_CORE_RAMP_H

#include <stdbool.h>

/* Limits in steps; from the profile, or lower ones for a search. All positive. */
struct motion_limits {
    double speed;        /* steps/s */
    double acceleration; /* steps/s² */
    double jerk;         /* steps/s³ */
};

/* One phase: time, place, speed and acceleration at its begin, its jerk. */
struct ramp_phase {
    double t, x, v, a, j;
};
#define RAMP_PHASES 10 /* all seven, cut in the last, and three more */

struct ramp {
    struct ramp_phase phases[RAMP_PHASES + 1]; /* phases[count] is the end: at rest */
    int count;
    bool stopped;
};

/* From rest to rest over `distance` (> 0), as fast as the limits allow. Takes lumi_move_time of it. */
void ramp_plan(struct ramp *ramp, double distance, const struct motion_limits *limits);
/* Forgets what comes after time t and slows down to rest from there, whatever the acceleration is there. A curve that
 * was stopped already does so anyway. */
void ramp_stop(struct ramp *ramp, double t, const struct motion_limits *limits);

/* Place, speed, acceleration and jerk at time t; outside the curve those of its ends. */
void ramp_at(const struct ramp *ramp, double t, struct ramp_phase *state);
/* The time at which place x is reached, to far below a tick; outside the curve that of its ends. */
double ramp_time(const struct ramp *ramp, double x);
/* The state there; `guess` is a time near it. */
void ramp_pass(const struct ramp *ramp, double x, double guess, struct ramp_phase *state);

double ramp_end_time(const struct ramp *ramp);
double ramp_end_place(const struct ramp *ramp);

#endif
