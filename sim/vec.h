/* Small float vectors for the ray tracer; poses and lenses stay in double. */
#ifndef LUMI_SIM_VEC_H
#define LUMI_SIM_VEC_H

#include "proto/base/geometry.h"

#include <math.h>

struct sim_v3 {
    float x, y, z;
};

static inline struct sim_v3 v3(float x, float y, float z)
{
    struct sim_v3 v = {x, y, z};
    return v;
}
static inline struct sim_v3 v3_of(struct lumi_vec3 a)
{
    return v3((float)a.x, (float)a.y, (float)a.z);
}
static inline struct sim_v3 v3_grey(float a)
{
    return v3(a, a, a);
}
static inline struct sim_v3 v3_add(struct sim_v3 a, struct sim_v3 b)
{
    return v3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline struct sim_v3 v3_sub(struct sim_v3 a, struct sim_v3 b)
{
    return v3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline struct sim_v3 v3_mul(struct sim_v3 a, struct sim_v3 b)
{
    return v3(a.x * b.x, a.y * b.y, a.z * b.z);
}
static inline struct sim_v3 v3_scale(struct sim_v3 a, float s)
{
    return v3(a.x * s, a.y * s, a.z * s);
}
/* a + s b */
static inline struct sim_v3 v3_along(struct sim_v3 a, struct sim_v3 b, float s)
{
    return v3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}
static inline struct sim_v3 v3_mix(struct sim_v3 a, struct sim_v3 b, float t)
{
    return v3_along(a, v3_sub(b, a), t);
}
static inline float v3_dot(struct sim_v3 a, struct sim_v3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline struct sim_v3 v3_cross(struct sim_v3 a, struct sim_v3 b)
{
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline float v3_length(struct sim_v3 a)
{
    return sqrtf(v3_dot(a, a));
}
static inline struct sim_v3 v3_unit(struct sim_v3 a)
{
    return v3_scale(a, 1 / v3_length(a));
}
/* Two unit vectors that complete the unit vector n to a right-handed frame (Duff et al., "Building an orthonormal
 * basis, revisited", 2017). */
static inline void v3_frame(struct sim_v3 n, struct sim_v3 *u, struct sim_v3 *v)
{
    float sign = copysignf(1, n.z);
    float a = -1 / (sign + n.z), b = n.x * n.y * a;

    *u = v3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    *v = v3(b, sign + n.y * n.y * a, -n.y);
}
static inline float sim_clamp(float x, float low, float high)
{
    return x < low ? low : x > high ? high : x;
}
static inline float sim_smooth(float low, float high, float x)
{
    float t = sim_clamp((x - low) / (high - low), 0, 1);
    return t * t * (3 - 2 * t);
}

#endif
