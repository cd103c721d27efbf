/* Small vectors, rotations, poses. */
#include "proto/base/geometry.h"

#include <string.h>

void lumi_rotation_multiply(const double a[9], const double b[9], double result[9])
{
    double product[9];

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            product[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    memcpy(result, product, sizeof product);
}

void lumi_pose_multiply(const struct lumi_pose *a, const struct lumi_pose *b, struct lumi_pose *result)
{
    struct lumi_vec3 t = lumi_to_world(a, b->t);

    lumi_rotation_multiply(a->r, b->r, result->r);
    result->t = t;
}

void lumi_pose_look(struct lumi_vec3 eye, struct lumi_vec3 forward, struct lumi_vec3 up, struct lumi_pose *pose)
{
    struct lumi_vec3 z = lumi_normalize(forward);
    struct lumi_vec3 x = lumi_cross(z, up);

    if (lumi_length(x) < 1e-9 * lumi_length(up))
        x = lumi_cross(z, fabs(z.x) < 0.9 ? lumi_vec3(1, 0, 0) : lumi_vec3(0, 1, 0));
    x = lumi_normalize(x);
    struct lumi_vec3 y = lumi_cross(z, x);
    const double r[9] = {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
    memcpy(pose->r, r, sizeof r);
    pose->t = eye;
}

/* Shepperd, "Quaternion from rotation matrix", 1978: divide by the largest component. */
void lumi_rotation_to_quaternion(const double r[9], double q[4])
{
    double trace = r[0] + r[4] + r[8];
    double v[4] = {trace, r[0], r[4], r[8]};
    int k = 0;

    for (int i = 1; i < 4; i++)
        if (v[i] > v[k])
            k = i;
    double big = sqrt(fmax(0, 1 + 2 * v[k] - trace)) / 2, f = 0.25 / big;
    double wx = (r[7] - r[5]) * f, wy = (r[2] - r[6]) * f, wz = (r[3] - r[1]) * f;
    double xy = (r[1] + r[3]) * f, xz = (r[2] + r[6]) * f, yz = (r[5] + r[7]) * f;
    const double all[4][4] = {{big, wx, wy, wz}, {wx, big, xy, xz}, {wy, xy, big, yz}, {wz, xz, yz, big}};
    double sign = all[k][0] < 0 ? -1 : 1;
    for (int i = 0; i < 4; i++)
        q[i] = sign * all[k][i];
}

void lumi_rotation_from_quaternion(const double q[4], double r[9])
{
    double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    double w = q[0] / n, x = q[1] / n, y = q[2] / n, z = q[3] / n;
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(r, m, sizeof m);
}

bool lumi_place_valid(struct lumi_vec3 t)
{
    return fabs(t.x) <= LUMI_PLACE_MAX && fabs(t.y) <= LUMI_PLACE_MAX && fabs(t.z) <= LUMI_PLACE_MAX;
}

bool lumi_pose_valid(const struct lumi_pose *pose, double tolerance)
{
    const double *r = pose->r;

    if (!lumi_place_valid(pose->t))
        return false;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            double dot = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
            if (!(fabs(dot - (i == j)) <= tolerance))
                return false;
        }
    return r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
               r[2] * (r[3] * r[7] - r[4] * r[6]) >
           0;
}

void lumi_rotation_orthonormalize(double r[9])
{
    double q[4];

    lumi_rotation_to_quaternion(r, q);
    lumi_rotation_from_quaternion(q, r);
}
