/* Residual: where a point is seen, by a camera that is where the mechanism has it. */
#include "pipeline/calibrate/mechanism_residual.h"
#include "pipeline/calibrate/reprojection.h"

#include <string.h>

static void look_up(const struct mechanism_measured *m, const double *const *blocks, bool with_slope)
{
    struct mechanism_memo *memo = m->memo;
    double from[MECHANISM_NUMBERS + 1];
    int count = 0;

    for (int i = 0; i < MECHANISM_BLOCKS; i++) {
        memcpy(from + count, blocks[i], sizeof(double) * (size_t)mechanism_sizes[i]);
        count += mechanism_sizes[i];
    }
    if (memo->pose_there && (memo->slope_there || !with_slope) && memcmp(from, memo->from, sizeof from) == 0)
        return;
    memcpy(memo->from, from, sizeof from);
    memo->pose_there = true;
    memo->slope_there = with_slope;
    mechanism_pose(m->mechanism, m->bundle->observations[m->observation].camera, blocks, &memo->pose,
                   with_slope ? memo->rotation : NULL, with_slope ? memo->place : NULL);
}

bool mechanism_seen_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct mechanism_measured *m = context;
    const struct lumi_bundle *b = m->bundle;
    const struct lumi_bundle_observation *o = &b->observations[m->observation];
    struct lumi_reprojection_slope slope;

    look_up(m, blocks, jacobians != NULL);
    if (!lumi_reproject(b, o, &m->memo->pose, b->lenses[b->cameras[o->camera].lens].block, blocks[MECHANISM_BLOCKS],
                        b->shutter, residuals, jacobians ? &slope : NULL))
        return false;
    if (!jacobians)
        return true;
    mechanism_chain(m->mechanism, o->camera, 2, slope.rotation, slope.place, m->memo->rotation, m->memo->place,
                    jacobians);
    if (jacobians[MECHANISM_BLOCKS])
        memcpy(jacobians[MECHANISM_BLOCKS], slope.point, sizeof slope.point);
    return true;
}
