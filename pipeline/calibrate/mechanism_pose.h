/* The pose of a frame as the mechanism's numbers have it, with derivatives. */
#ifndef LUMI_PIPELINE_CALIBRATE_MECHANISM_POSE_H
#define LUMI_PIPELINE_CALIBRATE_MECHANISM_POSE_H

#include "pipeline/calibrate/mechanism.h"

/* The blocks that a frame's pose is made of, for Ceres: mount, platform, the shot's turn, two knots of the drop. */
#define MECHANISM_BLOCKS 5
enum { MECHANISM_NUMBERS = LUMI_MOUNT_NUMBERS + LUMI_PLATFORM_NUMBERS + 2 }; /* the knots' mean counts once */
extern const int mechanism_sizes[MECHANISM_BLOCKS];

void mechanism_blocks(struct lumi_mechanism *mechanism, int frame, double *blocks[MECHANISM_BLOCKS]);

/* `rotation` (3 × MECHANISM_NUMBERS): the rotation after the pose's that each number makes; `place` likewise, in the
 * world. Both may be NULL. */
void mechanism_pose(const struct lumi_mechanism *mechanism, int frame, const double *const *blocks,
                    struct lumi_pose *pose, double *rotation, double *place);

/* From derivatives of a residual (rows × 3 each) to those of the blocks. */
void mechanism_chain(const struct lumi_mechanism *mechanism, int frame, int rows, const double *by_rotation,
                     const double *by_place, const double *rotation, const double *place, double **jacobians);

#endif
