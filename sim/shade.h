/* The light that comes along a ray. */
#ifndef LUMI_SIM_SHADE_H
#define LUMI_SIM_SHADE_H

#include "sim/scene.h"

struct sim_ray {
    struct sim_v3 origin, direction; /* unit */
    float spread;                    /* angle between neighbouring rays, radians: what a texture is filtered to */
};

/* What a ray meets. `distance` is INFINITY for the sky, `triangle` −1. */
struct sim_hit {
    float distance, u, v;
    struct sim_v3 face; /* the triangle's normal, unit, towards the ray's origin */
    int triangle;
};

void sim_trace(const struct sim_scene *scene, const struct sim_ray *ray, float near, struct sim_hit *hit);

/* True if nothing stands between `from` and the point `distance` further along `direction`. */
bool sim_clear(const struct sim_scene *scene, struct sim_v3 from, struct sim_v3 direction, float distance);

/* Radiance of what was hit, linear RGB, 1 the white of the picture. `sample` picks the point of the sun's disk that
 * casts the shadow (0 .. SIM_SUN_POINTS-1). */
#define SIM_SUN_POINTS 16
struct sim_v3 sim_shade(const struct sim_scene *scene, const struct sim_ray *ray, const struct sim_hit *hit,
                        int sample);

/* Radiance of the sky, blurred over a cone of half-angle `roughness`; without the sun when `sun` is false. */
struct sim_v3 sim_sky_radiance(const struct sim_sky *sky, struct sim_v3 direction, float spread, float roughness,
                               bool sun);

/* Where on a triangle: barycentric weights of its three corners. */
static inline struct sim_v3 sim_weights(const struct sim_hit *hit)
{
    return v3(1 - hit->u - hit->v, hit->u, hit->v);
}

/* Indirect light and light of an area at a vertex (irradiance over π); computed once. */
struct sim_v3 sim_vertex_light(const struct sim_scene *scene, unsigned vertex);

/* Sunlight on a point (irradiance over π) from one point of the sun's disk. */
struct sim_v3 sim_sun_light(const struct sim_scene *scene, struct sim_v3 point, struct sim_v3 face,
                            struct sim_v3 normal, bool thin, int sample);

#endif
