/* Small vectors, rotations, poses. Doubles; matrices are row-major. */
#ifndef LUMI_PROTO_BASE_GEOMETRY_H
#define LUMI_PROTO_BASE_GEOMETRY_H

#include <math.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_PI 3.14159265358979323846

struct lumi_vec3 {
    double x, y, z;
};

/* Camera to world: world = r · camera + t. The columns of r are the camera's axes in the world: x right, y down,
 * z forward. World: right-handed, +Z along the rotation axis away from the tripod, +X at the index mark; metres. */
struct lumi_pose {
    double r[9];
    struct lumi_vec3 t;
};

static inline struct lumi_vec3 lumi_vec3(double x, double y, double z)
{
    struct lumi_vec3 v = {x, y, z};
    return v;
}
static inline struct lumi_vec3 lumi_add(struct lumi_vec3 a, struct lumi_vec3 b)
{
    return lumi_vec3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline struct lumi_vec3 lumi_sub(struct lumi_vec3 a, struct lumi_vec3 b)
{
    return lumi_vec3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline struct lumi_vec3 lumi_scale(struct lumi_vec3 a, double s)
{
    return lumi_vec3(a.x * s, a.y * s, a.z * s);
}
static inline double lumi_dot(struct lumi_vec3 a, struct lumi_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline struct lumi_vec3 lumi_cross(struct lumi_vec3 a, struct lumi_vec3 b)
{
    return lumi_vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double lumi_length(struct lumi_vec3 a)
{
    return sqrt(lumi_dot(a, a));
}
static inline struct lumi_vec3 lumi_normalize(struct lumi_vec3 a)
{
    return lumi_scale(a, 1 / lumi_length(a));
}
/* r · v and rᵀ · v */
static inline struct lumi_vec3 lumi_rotate(const double r[9], struct lumi_vec3 v)
{
    return lumi_vec3(r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
                     r[6] * v.x + r[7] * v.y + r[8] * v.z);
}
static inline struct lumi_vec3 lumi_rotate_back(const double r[9], struct lumi_vec3 v)
{
    return lumi_vec3(r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
                     r[2] * v.x + r[5] * v.y + r[8] * v.z);
}
static inline struct lumi_vec3 lumi_to_world(const struct lumi_pose *pose, struct lumi_vec3 camera)
{
    return lumi_add(lumi_rotate(pose->r, camera), pose->t);
}
static inline struct lumi_vec3 lumi_to_camera(const struct lumi_pose *pose, struct lumi_vec3 world)
{
    return lumi_rotate_back(pose->r, lumi_sub(world, pose->t));
}
/* Column i of r: the camera's right (0), down (1), forward (2) in the world. */
static inline struct lumi_vec3 lumi_axis(const struct lumi_pose *pose, int i)
{
    return lumi_vec3(pose->r[i], pose->r[3 + i], pose->r[6 + i]);
}

/* a · b, for rotations and for poses (first b, then a). */
void lumi_rotation_multiply(const double a[9], const double b[9], double result[9]);
void lumi_pose_multiply(const struct lumi_pose *a, const struct lumi_pose *b, struct lumi_pose *result);

/* A camera at `eye` that looks along `forward`, its image's down as near to -up as can be. Where forward is parallel to
 * up, +X of the world stands in for up. */
void lumi_pose_look(struct lumi_vec3 eye, struct lumi_vec3 forward, struct lumi_vec3 up, struct lumi_pose *pose);

/* Unit quaternion (w, x, y, z) from and to a rotation; the quaternion's w is not negative. */
void lumi_rotation_to_quaternion(const double r[9], double q[4]);
void lumi_rotation_from_quaternion(const double q[4], double r[9]);

/* No place has a larger coordinate, metres: sums of products of places stay far inside a double. */
#define LUMI_PLACE_MAX 1e12
bool lumi_place_valid(struct lumi_vec3 t);

/* t a place, and r a rotation: all finite, rows orthonormal to `tolerance` (1e-3 suits printed matrices), determinant
 * +1. */
bool lumi_pose_valid(const struct lumi_pose *pose, double tolerance);

/* The nearest rotation to r, for a matrix that passed lumi_pose_valid (Gram-Schmidt through the quaternion). */
void lumi_rotation_orthonormalize(double r[9]);

#ifdef __cplusplus
}
#endif
#endif
