/* From step and turn to the pose of every camera. For a rig that passed lumi_rig_check. */
#ifndef LUMI_PROTO_MECHANISM_KINEMATICS_H
#define LUMI_PROTO_MECHANISM_KINEMATICS_H

#include "proto/mechanism/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Motor (micro)steps a platform turn; not always a whole number. */
double lumi_rig_steps_per_turn(const struct lumi_rig *rig);
/* Turns since step 0; negative before it. */
double lumi_rig_step_turns(const struct lumi_rig *rig, int64_t step);
/* The step nearest to position `position` of the sweep (0 .. positions · turns − 1), computed without drift. */
int64_t lumi_rig_position_step(const struct lumi_rig *rig, int position);

/* The platform's direction after so many turns, radians from +X, counter-clockwise; not reduced to a circle. */
double lumi_rig_turn_angle(const struct lumi_rig *rig, double turns);
/* How far every arm angle has fallen after so many turns of unwinding; 0 while held. Before the sweep's start (turns
 * below 0: a sweep runs up to its speed there) the law goes on and the arm is above its place, as far as it can be
 * lifted. Beyond the string's end it stays where the string ends. */
double lumi_rig_drop(const struct lumi_rig *rig, double turns);
/* The turns after which the arm has fallen by `drop`, where it can; 0 while held. */
double lumi_rig_drop_turns(const struct lumi_rig *rig, double drop);

/* Camera to world, `turns` into the sweep (whole part: the turn; fraction: the place in it). */
void lumi_rig_camera_pose(const struct lumi_rig *rig, int camera, double turns, struct lumi_pose *pose);
/* The same with the platform's angle and the drop given, as measured. */
void lumi_rig_camera_pose_at(const struct lumi_rig *rig, int camera, double turn_angle, double drop,
                             struct lumi_pose *pose);

/* The sweep as a grid: one row for each camera and turn, from the top of the sphere down; columns by azimuth, column 0
 * at +X. */
int lumi_rig_rows(const struct lumi_rig *rig);
int lumi_rig_row(const struct lumi_rig *rig, int camera, int turn);
int lumi_rig_column(const struct lumi_rig *rig, int camera, int position);

#ifdef __cplusplus
}
#endif
#endif
