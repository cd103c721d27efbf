/* Residual: how far a camera is from its prior. */
#include "pipeline/calibrate/bundle.h"
#include "pipeline/calibrate/priors.h"
#include "pipeline/calibrate/rotation.h"

#include <string.h>

bool lumi_pose_prior_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct lumi_bundle_camera *camera = context;
    const double *block = blocks[0], *r = camera->prior.r;
    double turn[9], rotation[9], between[9], w[3];

    lumi_rotation_exp(block, turn);
    lumi_rotation_multiply(camera->pose.r, turn, rotation);
    lumi_rotation_between(r, rotation, between);
    lumi_rotation_log(between, w);
    struct lumi_vec3 moved = lumi_rotate_back(r, lumi_sub(lumi_vec3(block[3], block[4], block[5]), camera->prior.t));
    const double along[3] = {moved.x, moved.y, moved.z};
    for (int i = 0; i < 3; i++) {
        residuals[i] = w[i] / camera->prior_rotation;
        residuals[3 + i] = along[i] / camera->prior_position[i];
    }
    if (!jacobians || !jacobians[0])
        return true;
    double right[9], back[9], both[9];
    lumi_rotation_slope(block, right);
    lumi_rotation_slope_inverse(w, back);
    lumi_rotation_multiply(back, right, both);
    memset(jacobians[0], 0, 36 * sizeof(double));
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            jacobians[0][6 * i + k] = both[3 * i + k] / camera->prior_rotation;
            jacobians[0][6 * (3 + i) + 3 + k] = r[3 * k + i] / camera->prior_position[i];
        }
    return true;
}
