/* Lenses: from a direction in the camera's frame to a place in its image, and back. */
#ifndef LUMI_PROTO_BASE_LENS_H
#define LUMI_PROTO_BASE_LENS_H

#include "proto/base/geometry.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Models, as OpenCV defines them (calib3d documentation, "Camera Calibration and 3D Reconstruction" and "Fisheye camera
 * model"). Equirectangular serves as an output projection only. */
enum lumi_lens_model {
    LUMI_LENS_BROWN = 1,          /* pinhole with Brown-Conrady distortion k1 k2 p1 p2 k3 (all zero: a plain pinhole) */
    LUMI_LENS_FISHEYE = 2,        /* equidistant: r = θ(1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) */
    LUMI_LENS_EQUIRECTANGULAR = 3 /* longitude and latitude; fx, fy in pixels a radian; image centre looks along +z */
};

/* Pixel units; pixel centres at half-integers, so the image spans [0, width] × [0, height]. */
struct lumi_lens {
    enum lumi_lens_model model;
    int width, height;
    double fx, fy, cx, cy;
    double k1, k2, k3, k4, p1, p2;
};

/* Image position of `direction` (camera frame, any length). False if the model cannot image it: behind a pinhole,
 * beyond the angle where a distortion polynomial turns back. The position may lie outside the image. */
bool lumi_lens_project(const struct lumi_lens *lens, struct lumi_vec3 direction, double *x, double *y);

/* Direction (camera frame, unit length) of an image position; inverse of lumi_lens_project to 1e-9 of a pixel. False
 * where no direction is imaged there. */
bool lumi_lens_unproject(const struct lumi_lens *lens, double x, double y, struct lumi_vec3 *direction);

/* Finite, positive focal lengths, size in 1..LUMI_RASTER_MAX, a known model. */
bool lumi_lens_valid(const struct lumi_lens *lens);

/* Equal in every number. */
bool lumi_lens_equal(const struct lumi_lens *a, const struct lumi_lens *b);

/* Pinhole with the given horizontal field of view (radians), square pixels, centred. */
void lumi_lens_init_pinhole(struct lumi_lens *lens, int width, int height, double fov_x);

#ifdef __cplusplus
}
#endif
#endif
