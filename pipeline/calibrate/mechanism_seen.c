/* Residual: where a point is seen, by a camera that is where the mechanism has it. */
#include "pipeline/calibrate/mechanism_pose.h"
#include "pipeline/calibrate/mechanism_residual.h"
#include "pipeline/calibrate/reprojection.h"

#include <string.h>

bool mechanism_seen_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct mechanism_measured *m = context;
    const struct lumi_bundle *b = m->bundle;
    const struct lumi_bundle_observation *o = &b->observations[m->observation];
    double rotation[3 * MECHANISM_NUMBERS], place[3 * MECHANISM_NUMBERS];
    struct lumi_reprojection_slope slope;
    struct lumi_pose pose;

    mechanism_pose(m->mechanism, o->camera, blocks, &pose, jacobians ? rotation : NULL, jacobians ? place : NULL);
    if (!lumi_reproject(b, o, &pose, b->lenses[b->cameras[o->camera].lens].block, blocks[MECHANISM_BLOCKS], b->shutter,
                        residuals, jacobians ? &slope : NULL))
        return false;
    if (!jacobians)
        return true;
    mechanism_chain(m->mechanism, o->camera, 2, slope.rotation, slope.place, rotation, place, jacobians);
    if (jacobians[MECHANISM_BLOCKS])
        memcpy(jacobians[MECHANISM_BLOCKS], slope.point, sizeof slope.point);
    return true;
}
