/* A place as the ray tracer sees it: triangles with materials, lights, a sky.
 *
 * 1. All geometry is one mesh of triangles. A vertex has a normal, surface coordinates (metres) and, once a ray has
 * come near it, the indirect light that falls on it: computed when first asked for, a function of the scene alone, so
 * that neither the order nor the number of threads matters.
 * 2. Light is split three ways: the sun (a ray from every point that is seen), lights of an area (windows, lamps: fixed
 *    points on them, at the vertices) and the rest (fixed directions, at the vertices).
 * 3. World: metres, +Z up, the rig's centre in the origin. */
#ifndef LUMI_SIM_SCENE_H
#define LUMI_SIM_SCENE_H

#include "proto/base/result.h"
#include "sim/texture.h"

#include <stdatomic.h>
#include <stddef.h>

#define SIM_MATERIALS 200
#define SIM_LIGHTS 6

/* A rectangle origin + a u + b v, a and b in 0..1: an opening to the sky, or a shining thing. It gives `gain` times the
 * light it would give if it were as bright as it is seen: that way a window lights a room without burning out, as in a
 * picture merged from brackets and tone-mapped. */
struct sim_light {
    struct sim_v3 origin, u, v;
    float gain;
};

struct sim_sky {
    struct sim_v3 zenith, horizon, ground; /* radiance */
    float clouds;                          /* 0..1: how much of it */
    float cloud;                           /* radiance of a cloud */
    struct sim_v3 sun_direction;           /* towards it, unit */
    struct sim_v3 sun;                     /* irradiance over π on a surface that faces it; 0: none */
    float sun_radius;                      /* radians */
    struct sim_v3 ambient;                 /* light taken to fall on what indirect light comes from */
    unsigned seed;
};

struct sim_vertex {
    struct sim_v3 normal, at;
    struct sim_v3 probe; /* where its light is measured: its place, but for corners where faces meet */
};

struct sim_triangle {
    unsigned a, b, c;
};

/* Where local coordinates of the shapes lie in the world: world = axes · local + origin, axes a scaled rotation. */
struct sim_frame {
    struct sim_v3 x, y, z, origin;
};

struct sim_scene {
    struct sim_material materials[SIM_MATERIALS];
    int material_count;
    struct sim_light lights[SIM_LIGHTS];
    int light_count;
    bool indoors; /* the sun comes in through the lights only */
    struct sim_sky sky;
    struct sim_frame frame;

    float (*positions)[4];
    struct sim_vertex *vertices;
    struct sim_triangle *triangles;
    unsigned char *triangle_material;
    size_t vertex_count, vertex_room, triangle_count, triangle_room;
    size_t unseen; /* triangles from here on take light, but no camera sees them; 0: there are none */
    bool failed;   /* memory could not be had: sim_scene_commit says so */

    _Atomic(float) *light; /* three a vertex */
    atomic_uchar *lit;
    void *device, *tree; /* Embree's */
};

/* Building: create, add, commit; after that the scene is read only (but for invariant 1) and any thread may trace. */
int sim_scene_create(struct sim_scene **scene, struct lumi_error *error);
void sim_scene_destroy(struct sim_scene *scene);
int sim_scene_commit(struct sim_scene *scene, struct lumi_error *error);

/* Returns the material's number. */
int sim_scene_material(struct sim_scene *scene, const struct sim_material *material);
/* Local coordinates from here on: turned by `yaw` degrees about Z, scaled, moved. */
void sim_scene_place(struct sim_scene *scene, struct sim_v3 origin, float yaw, float scale);
void sim_scene_place_frame(struct sim_scene *scene, const struct sim_frame *frame);

unsigned sim_scene_vertex(struct sim_scene *scene, struct sim_v3 position, struct sim_v3 normal, struct sim_v3 at);
/* Measures the light of a vertex there instead: a little inside the face that the vertex bounds. */
void sim_scene_probe(struct sim_scene *scene, unsigned vertex, struct sim_v3 local);
void sim_scene_triangle(struct sim_scene *scene, unsigned a, unsigned b, unsigned c, int material);
struct sim_v3 sim_scene_point(const struct sim_scene *scene, struct sim_v3 local);
void sim_scene_light(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float gain);

#endif
