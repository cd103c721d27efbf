/* The mechanism's numbers against what was seen, and against poses. */
#ifndef LUMI_PIPELINE_CALIBRATE_MECHANISM_RESIDUAL_H
#define LUMI_PIPELINE_CALIBRATE_MECHANISM_RESIDUAL_H

#include "pipeline/calibrate/mechanism.h"

/* 2 residuals: blocks of mechanism_blocks, then the point's. */
struct mechanism_measured {
    const struct lumi_mechanism *mechanism;
    const struct lumi_bundle *bundle;
    int observation;
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
