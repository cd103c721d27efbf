/* Motion of the one stepper: jerk-limited ramps, constant velocity, exact step times.
 *
 * 1. Positions are step numbers of the profile's drive: step 0 is the platform's `index` direction at turn 0; rising
 *    steps are the sweep's direction. A whole sweep is one number line.
 * 2. A move is planned in segments of steps ahead of time (main loop) and played by core_on_step (interrupt).
 * 3. While a move runs, when each of its steps and every place between two steps is passed is known before it is
 *    passed: that is what triggers go by. */
#ifndef LUMI_FIRMWARE_CORE_MOTION_H
#define LUMI_FIRMWARE_CORE_MOTION_H

#include "firmware/board/board.h"

#include <stdbool.h>
#include <stdint.h>

/* Limits in steps; from the profile, or lower ones for a search. */
struct motion_limits {
    double speed;        /* steps/s */
    double acceleration; /* steps/s² */
    double jerk;         /* steps/s³ */
};

struct motion; /* motion_state.h */

void motion_init(struct motion *motion, const struct board *board);
/* s, and what the driver needs */
void motion_set_driver(struct motion *motion, double step_pulse, double direction_setup);

/* Starts a move from rest, at `at` or as soon as it can, to `target` (a step number), within the limits. A move that is
 * long enough reaches limits.speed exactly and holds it: its cruise. Returns the tick of its first step. False (0): not
 * at rest, a position that is not known, or nothing to do. */
bool motion_start(struct motion *motion, int64_t target, const struct motion_limits *limits, uint64_t at);
/* Slows down within the limits from wherever it is; the position stays known. */
void motion_stop(struct motion *motion);
/* No more steps. From interrupts too. Moving: the platform runs on, the position is lost. */
void motion_halt(struct motion *motion);

bool motion_moving(const struct motion *motion);
/* The tick at which the move in progress passes place `position` (steps, between two too), or BOARD_NEVER where it will
 * not (any more) or where that part of the move has been given up by a stop. For places that lie in the cruise it is
 * exact to a tick, in ramps to the planner's tolerance. */
uint64_t motion_time_of(const struct motion *motion, double position);
/* Ticks of the move's last step (where it ends, if nothing intervenes). */
uint64_t motion_end(const struct motion *motion);
/* steps/s now, signed; 0 at rest. */
double motion_speed(const struct motion *motion, uint64_t now);

int64_t motion_position(const struct motion *motion); /* steps made; interrupt-safe */
bool motion_known(const struct motion *motion);
/* At rest only: this is step `position` (homing ends with it), or nobody knows. */
void motion_set_position(struct motion *motion, int64_t position);
void motion_forget(struct motion *motion);

/* Main loop: plans ahead. And when it wants to be called again. */
void motion_poll(struct motion *motion);
uint64_t motion_next_poll(const struct motion *motion);
/* Interrupt. */
uint32_t motion_on_step(struct motion *motion, uint64_t at);

#endif
