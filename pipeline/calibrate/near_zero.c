/* Residual: numbers that are near 0. */
#include "pipeline/calibrate/priors.h"

#include <string.h>

bool lumi_near_zero_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct lumi_near_zero *near = context;

    if (jacobians && jacobians[0])
        memset(jacobians[0], 0, sizeof(double) * (size_t)(near->count * near->count));
    for (int i = 0; i < near->count; i++) {
        double scale = near->sigma && near->sigma[i] > 0 ? 1 / near->sigma[i] : 1;
        residuals[i] = blocks[0][i] * scale;
        if (jacobians && jacobians[0])
            jacobians[0][i * near->count + i] = scale;
    }
    return true;
}
