/* Residual: a camera that was found somewhere, against where the mechanism has it. */
#include "pipeline/calibrate/mechanism_pose.h"
#include "pipeline/calibrate/mechanism_residual.h"
#include "pipeline/calibrate/rotation.h"

bool mechanism_found_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct mechanism_found *f = context;
    double rotation[3 * MECHANISM_NUMBERS], place[3 * MECHANISM_NUMBERS], between[9], w[3], back[9];
    double by_rotation[18] = {0}, by_place[18] = {0};
    struct lumi_pose pose;

    mechanism_pose(f->mechanism, f->frame, blocks, &pose, jacobians ? rotation : NULL, jacobians ? place : NULL);
    lumi_rotation_between(f->pose->r, pose.r, between);
    lumi_rotation_log(between, w);
    struct lumi_vec3 moved = lumi_rotate_back(f->pose->r, lumi_sub(pose.t, f->pose->t));
    const double along[3] = {moved.x, moved.y, moved.z};
    for (int i = 0; i < 3; i++) {
        residuals[i] = w[i] / f->rotation_sigma;
        residuals[3 + i] = along[i] / f->position_sigma;
    }
    if (!jacobians)
        return true;
    lumi_rotation_slope_inverse(w, back);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            by_rotation[3 * i + k] = back[3 * i + k] / f->rotation_sigma;
            by_place[3 * (3 + i) + k] = f->pose->r[3 * k + i] / f->position_sigma;
        }
    mechanism_chain(f->mechanism, f->frame, 6, by_rotation, by_place, rotation, place, jacobians);
    return true;
}
