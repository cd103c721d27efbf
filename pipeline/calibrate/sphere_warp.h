/* A picture resampled to the stereographic projection of what its lens sees. That keeps the shape of everything small
 * wherever in the picture it lies, so that a point looks alike at the edge of a wide lens and in the middle of the next
 * picture (and it is the only projection that does). */
#ifndef LUMI_PIPELINE_CALIBRATE_SPHERE_WARP_H
#define LUMI_PIPELINE_CALIBRATE_SPHERE_WARP_H

#include "proto/base/lens.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stdint.h>

struct lumi_sphere_warp {
    struct lumi_lens lens;
    int width, height;
    double focal, cx, cy; /* of the stereographic picture: r = 2 focal tan(θ / 2) */
    float *at;            /* owned: x, y in the lens's picture for every pixel (centres at half-integers); NaN: none */
    uint8_t *use;         /* owned: 0 where the lens has nothing, or its picture's edge is near */
};

/* How far the lens is from keeping shapes: the largest ratio between its two scales anywhere in the picture. */
double lumi_lens_stretch(const struct lumi_lens *lens);

/* Up to 150° off the axis. LUMI_ERR_NOMEM. */
int lumi_sphere_warp_init(struct lumi_sphere_warp *warp, const struct lumi_lens *lens, struct lumi_error *error);
void lumi_sphere_warp_finish(struct lumi_sphere_warp *warp);

/* Cubic (Catmull-Rom). `grey`: the lens's width × height; `result`: the warp's. */
void lumi_sphere_warp_apply(const struct lumi_sphere_warp *warp, const float *grey, float *result);

/* From the stereographic picture to the lens's, exactly. */
bool lumi_sphere_warp_back(const struct lumi_sphere_warp *warp, double u, double v, double *x, double *y);

#endif
