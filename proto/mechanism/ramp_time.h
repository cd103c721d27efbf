/* How long jerk-limited motion takes: what the plan's check and the motion planner both go by.
 *
 * A ramp from rest to speed v raises the acceleration at the rate j to a, holds it, and lets it fall again. It takes
 * v / a + a / j, or 2 √(v / j) where a is not reached (v < a² / j), and being symmetrical covers v / 2 times that. A
 * move from rest to rest is a ramp, a cruise and the ramp mirrored. Units are the caller's: radians or steps. */
#ifndef LUMI_PROTO_MECHANISM_RAMP_TIME_H
#define LUMI_PROTO_MECHANISM_RAMP_TIME_H

#ifdef __cplusplus
extern "C" {
#endif

/* All arguments positive. */
double lumi_ramp_time(double speed, double acceleration, double jerk);
double lumi_ramp_distance(double speed, double acceleration, double jerk);
/* The speed that a move over `distance` reaches: `speed`, or less where that needs two ramps that are longer. */
double lumi_move_speed(double distance, double speed, double acceleration, double jerk);
/* Seconds from rest to rest over `distance`. */
double lumi_move_time(double distance, double speed, double acceleration, double jerk);

/* Seconds, at most, between two steps of a move with these limits in steps, wherever it is stopped: a step from rest
 * and one in the cruise. The board makes LUMI_RAMP_STEP_SECONDS. */
double lumi_ramp_slowest_step(double speed, double acceleration, double jerk);
#define LUMI_RAMP_STEP_SECONDS 12.0

#ifdef __cplusplus
}
#endif
#endif
