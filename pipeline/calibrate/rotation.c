/* Rotations as vectors. */
#include "pipeline/calibrate/rotation.h"

/* I + a [w] + b [w]² */
static void combine(const double w[3], double a, double b, double j[9])
{
    double x = w[0], y = w[1], z = w[2];

    j[0] = 1 - b * (y * y + z * z);
    j[1] = -a * z + b * x * y;
    j[2] = a * y + b * x * z;
    j[3] = a * z + b * x * y;
    j[4] = 1 - b * (x * x + z * z);
    j[5] = -a * x + b * y * z;
    j[6] = -a * y + b * x * z;
    j[7] = a * x + b * y * z;
    j[8] = 1 - b * (x * x + y * y);
}

static double length(const double w[3])
{
    return sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
}

void lumi_rotation_exp(const double w[3], double r[9])
{
    double t = length(w);

    if (t < 1e-4) /* by series; the next terms are below a double's last place */
        combine(w, 1 - t * t / 6, 0.5 - t * t / 24, r);
    else
        combine(w, sin(t) / t, (1 - cos(t)) / (t * t), r);
}

void lumi_rotation_log(const double r[9], double w[3])
{
    double q[4];

    lumi_rotation_to_quaternion(r, q);
    double s = length(q + 1);
    double scale = s > 1e-9 ? 2 * atan2(s, q[0]) / s : 2 / q[0];
    for (int i = 0; i < 3; i++)
        w[i] = scale * q[1 + i];
}

void lumi_rotation_slope(const double w[3], double j[9])
{
    double t = length(w);

    if (t < 1e-3)
        combine(w, -0.5 + t * t / 24, 1.0 / 6 - t * t / 120, j);
    else
        combine(w, -(1 - cos(t)) / (t * t), (t - sin(t)) / (t * t * t), j);
}

void lumi_rotation_slope_inverse(const double w[3], double j[9])
{
    double t = length(w);

    if (t < 1e-3)
        combine(w, 0.5, 1.0 / 12 + t * t / 720, j);
    else
        combine(w, 0.5, 1 / (t * t) - (1 + cos(t)) / (2 * t * sin(t)), j);
}

void lumi_rotation_between(const double a[9], const double b[9], double result[9])
{
    const double back[9] = {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]};

    lumi_rotation_multiply(back, b, result);
}

double lumi_rotation_angle(const double a[9], const double b[9])
{
    double between[9], w[3];

    lumi_rotation_between(a, b, between);
    lumi_rotation_log(between, w);
    return length(w);
}
