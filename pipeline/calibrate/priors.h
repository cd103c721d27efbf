/* What is known before anything is seen, as residuals of Ceres. */
#ifndef LUMI_PIPELINE_CALIBRATE_PRIORS_H
#define LUMI_PIPELINE_CALIBRATE_PRIORS_H

#include <stdbool.h>

/* A camera's pose: 6 residuals, block camera (6); context struct lumi_bundle_camera. */
bool lumi_pose_prior_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians);

/* Numbers that are near 0, each divided by a standard deviation (one that is 0 counts as 1). */
struct lumi_near_zero {
    int count;
    const double *sigma; /* NULL: all 1 */
};
bool lumi_near_zero_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians);

#endif
