/* Motion of the one stepper: jerk-limited ramps, constant velocity, exact step times.
 *
 * 1. Positions are step numbers of the profile's drive: step 0 is the platform's `index` direction at turn 0; rising
 *    steps are the sweep's direction. A whole sweep is one number line.
 * 2. A move follows an S-curve (ramp.h) from one whole step to another. The pulse that makes step p comes when the
 * curve is half-way from the step before to p, so that the steps lie on both sides of the curve alike: where the curve
 * is, the platform is on average. Triggers go by the curve: motion_time_of.
 * 3. Pulses are planned some 25 ms ahead (main loop), as segments of steps in whole numbers that motion_on_step plays
 *    (interrupt). In the cruise every pulse is within a tick of its time, and stays so however long it lasts; in ramps
 *    within MOTION_RAMP_TICKS.
 * 4. Should the main loop not come round in time, the steps end, the position is lost and motion_starved says so: never
 *    a wrong step.
 * 5. motion_halt latches: nothing moves until motion_release. So no move that was about to begin when an e-stop's
 *    interrupt came can slip through. */
#ifndef LUMI_FIRMWARE_CORE_MOTION_H
#define LUMI_FIRMWARE_CORE_MOTION_H

#include "firmware/board/board.h"
#include "firmware/core/ramp.h"

#include <stdbool.h>
#include <stdint.h>

#define MOTION_RAMP_TICKS 21 /* 0.25 µs: how far a pulse in a ramp may be from the curve */

struct motion; /* motion_state.h */

void motion_init(struct motion *motion, const struct board *board);
/* s, and what the driver needs */
void motion_set_driver(struct motion *motion, double step_pulse, double direction_setup);

/* Starts a move from rest to `target` (a step number), within the limits. Its curve begins at tick `at`, or as soon as
 * it can (some 2 ms from now, and not before the curve of the last move has ended). A move that is long enough reaches
 * limits.speed exactly and holds it: its cruise. False: not at rest, halted and not released, a position that is not
 * known, limits out of range (lumi_ramp_slowest_step), or nothing to do. */
bool motion_start(struct motion *motion, int64_t target, const struct motion_limits *limits, uint64_t at);
/* The same from a position that need not be known, `steps` on: for homing only. */
bool motion_seek(struct motion *motion, int64_t steps, const struct motion_limits *limits);
/* Slows down within the limits from wherever it is; the position stays known. Begins within some 30 ms or three steps.
 * Again, or at rest: nothing. */
void motion_stop(struct motion *motion);
/* No more steps, until released. From interrupts too. Moving: the platform runs on, the position is lost. */
void motion_halt(struct motion *motion);
void motion_release(struct motion *motion);
bool motion_halted(const struct motion *motion);
/* The main loop was late, a fault: see 4. Until the next motion_release. */
bool motion_starved(const struct motion *motion);

/* From motion_start until the last step is made. */
bool motion_moving(const struct motion *motion);
/* The tick at which the curve passes place `position` (steps, between two too), or BOARD_NEVER where it will not:
 * beyond the move's ends, or in a part that has been given up by a stop or a halt. Exact to a tick; a place that has
 * been passed keeps its tick until the next move. */
uint64_t motion_time_of(const struct motion *motion, double position);
/* Ticks of the move's last step, if nothing intervenes, or of the last move's. */
uint64_t motion_end(const struct motion *motion);
/* steps/s now, signed; 0 at rest. */
double motion_speed(const struct motion *motion, uint64_t now);
/* Whole steps, at least, from rest until limits.speed is reached: how far before the first position a sweep begins. */
int64_t motion_run_up_steps(const struct motion_limits *limits);

int64_t motion_position(const struct motion *motion); /* steps made; interrupt-safe */
bool motion_known(const struct motion *motion);
/* At rest only: this is step `position` (homing ends with it), or nobody knows. */
void motion_set_position(struct motion *motion, int64_t position);
void motion_forget(struct motion *motion);
/* Backlash: the target of the next move on the way to `target` that ends with at least `backlash` rising steps. It
 * equals the position when that is so: nothing is left to do. At rest. */
int64_t motion_next_leg(const struct motion *motion, int64_t target, int64_t backlash);

/* Main loop: plans ahead. And when it wants to be called again. */
void motion_poll(struct motion *motion);
uint64_t motion_next_poll(const struct motion *motion);
/* Interrupt. */
uint32_t motion_on_step(struct motion *motion, uint64_t at);

#endif
