/* The one measurement there is: where a point is seen. Shared by every solve that differs in what a pose is made of. */
#ifndef LUMI_PIPELINE_CALIBRATE_REPROJECTION_H
#define LUMI_PIPELINE_CALIBRATE_REPROJECTION_H

#include "pipeline/calibrate/bundle.h"

/* Derivatives of the residual, 2 rows each: by a rotation after the pose's, by the place, the point's block, the lens'
 * block, the shutter. */
struct lumi_reprojection_slope {
    double rotation[6], place[6], point[6], lens[2 * LUMI_LENS_NUMBERS], shutter[2];
};

/* Found minus seen, in sigmas. `lens`, `point`: their blocks. False: not imaged. Slope may be NULL. */
bool lumi_reproject(const struct lumi_bundle *bundle, const struct lumi_bundle_observation *observation,
                    const struct lumi_pose *pose, const double *lens, const double *point, double shutter,
                    double residual[2], struct lumi_reprojection_slope *slope);

/* As a residual of Ceres: blocks camera (6), lens, point (3), shutter (1); context struct lumi_measured. */
struct lumi_measured {
    const struct lumi_bundle *bundle;
    int observation;
};
bool lumi_reprojection_residual(const void *context, const double *const *blocks, double *residuals,
                                double **jacobians);

#endif
