/* The mechanism's numbers against what was seen, and against poses. */
#ifndef LUMI_PIPELINE_CALIBRATE_MECHANISM_RESIDUAL_H
#define LUMI_PIPELINE_CALIBRATE_MECHANISM_RESIDUAL_H

#include "pipeline/calibrate/mechanism_pose.h"

/* A frame's pose and its derivatives as they were last asked for: all that a frame sees asks for the same. */
struct mechanism_memo {
    bool pose_there, slope_there;
    double from[MECHANISM_NUMBERS + 1]; /* what its blocks held */
    struct lumi_pose pose;
    double rotation[3 * MECHANISM_NUMBERS], place[3 * MECHANISM_NUMBERS];
};

/* 2 residuals: blocks of mechanism_blocks, then the point's. */
struct mechanism_measured {
    const struct lumi_mechanism *mechanism;
    const struct lumi_bundle *bundle;
    int observation;
    struct mechanism_memo *memo; /* of the frame */
};
bool mechanism_seen_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians);

/* 6 residuals: rotation, place, in standard deviations; blocks of mechanism_blocks. */
struct mechanism_found {
    const struct lumi_mechanism *mechanism;
    const struct lumi_pose *pose;
    int frame;
    double position_sigma, rotation_sigma;
};
bool mechanism_found_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians);

#endif
