/* Rotations as vectors: the axis, as long as the angle. */
#ifndef LUMI_PIPELINE_CALIBRATE_ROTATION_H
#define LUMI_PIPELINE_CALIBRATE_ROTATION_H

#include "proto/base/geometry.h"

void lumi_rotation_exp(const double w[3], double r[9]);
/* For a rotation by less than a half turn. */
void lumi_rotation_log(const double r[9], double w[3]);
/* The right Jacobian: exp(w + d) = exp(w) exp(J d) to first order (Chirikjian, Stochastic Models, Information Theory,
 * and Lie Groups, volume 2, 2012, 10.3). */
void lumi_rotation_slope(const double w[3], double j[9]);
/* Its inverse: log(exp(w) exp(d)) = w + J⁻¹ d. */
void lumi_rotation_slope_inverse(const double w[3], double j[9]);
/* aᵀ b, and its angle. */
void lumi_rotation_between(const double a[9], const double b[9], double result[9]);
double lumi_rotation_angle(const double a[9], const double b[9]);

#endif
