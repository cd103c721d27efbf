/* Radiance along a ray: texture, sun, stored light, reflections. Nothing here is random. */
#include "sim/shade.h"

#include "sim/embree.h"

#define MAX_BOUNCES 3

void sim_trace(const struct sim_scene *scene, const struct sim_ray *ray, float near, struct sim_hit *hit)
{
    struct RTCRayHit r;

    r.ray.org_x = ray->origin.x;
    r.ray.org_y = ray->origin.y;
    r.ray.org_z = ray->origin.z;
    r.ray.tnear = near;
    r.ray.dir_x = ray->direction.x;
    r.ray.dir_y = ray->direction.y;
    r.ray.dir_z = ray->direction.z;
    r.ray.time = 0;
    r.ray.tfar = INFINITY;
    r.ray.mask = ~0u;
    r.ray.id = 0;
    r.ray.flags = 0;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    sim_embree_intersect(scene->tree, &r);
    hit->distance = INFINITY;
    hit->triangle = -1;
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return;
    hit->distance = r.ray.tfar;
    hit->u = r.hit.u;
    hit->v = r.hit.v;
    hit->triangle = (int)r.hit.primID;
    hit->face = v3_unit(v3(r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z));
    if (v3_dot(hit->face, ray->direction) > 0)
        hit->face = v3_scale(hit->face, -1);
}

bool sim_clear(const struct sim_scene *scene, struct sim_v3 from, struct sim_v3 direction, float distance)
{
    struct RTCRay r;

    r.org_x = from.x;
    r.org_y = from.y;
    r.org_z = from.z;
    r.tnear = 1e-4f;
    r.dir_x = direction.x;
    r.dir_y = direction.y;
    r.dir_z = direction.z;
    r.time = 0;
    r.tfar = distance;
    r.mask = ~0u;
    r.id = 0;
    r.flags = 0;
    sim_embree_occluded(scene->tree, &r);
    return r.tfar >= 0;
}

struct sim_v3 sim_sky_radiance(const struct sim_sky *sky, struct sim_v3 d, float spread, float roughness, bool sun)
{
    float up = d.z;
    struct sim_v3 c = v3_mix(sky->horizon, sky->zenith, powf(sim_clamp(up, 0, 1), 0.55f));

    if (up < 0)
        c = v3_mix(sky->horizon, sky->ground, sim_clamp(-up / (0.02f + roughness), 0, 1));
    else if (sky->clouds > 0 && up > 0.01f) {
        /* A layer of clouds at height 1. */
        struct sim_octaves octaves = {1.6f, 0.62f, (spread + roughness) / (up * up), false, sky->seed};
        float n = sim_fractal(&octaves, v3(d.x / up, d.y / up, 0), NULL);
        float cover = sim_smooth(-0.2f, 1.5f, n + 2.2f * sky->clouds - 1.1f) * sim_smooth(0.01f, 0.25f, up);
        c = v3_mix(c, v3_scale(v3(1, 0.98f, 0.96f), sky->cloud * (1 + 0.1f * n)), cover);
    }
    if (sun && sky->sun.x > 0) {
        float radius = sky->sun_radius + roughness, cosine = v3_dot(d, sky->sun_direction);
        float area = 1 - cosf(radius); /* over 2π; irradiance over π spread over it */
        float inside = sim_smooth(cosf(radius * 1.3f), cosf(radius * 0.7f), cosine);
        c = v3_along(c, sky->sun, inside * 0.5f / area);
    }
    return c;
}

/* Points of a unit disk, one in each of sixteen equal parts: two rings of 5 and 11. */
static void disk_point(int i, float *x, float *y)
{
    float r = i < 5 ? 0.37f : 0.80f, angle = 2 * (float)LUMI_PI * (i < 5 ? (float)i / 5 : ((float)i - 4.5f) / 11);

    *x = r * cosf(angle);
    *y = r * sinf(angle);
}

/* Through which rectangle a ray from `p` passes. */
static bool crosses_light(const struct sim_scene *scene, struct sim_v3 p, struct sim_v3 d)
{
    for (int i = 0; i < scene->light_count; i++) {
        const struct sim_light *light = &scene->lights[i];
        struct sim_v3 n = v3_cross(light->u, light->v);
        float t = v3_dot(v3_sub(light->origin, p), n) / v3_dot(d, n);
        if (!(t > 0))
            continue;
        struct sim_v3 q = v3_sub(v3_along(p, d, t), light->origin);
        float a = v3_dot(q, light->u) / v3_dot(light->u, light->u);
        float b = v3_dot(q, light->v) / v3_dot(light->v, light->v);
        if (a >= -0.02f && a <= 1.02f && b >= -0.02f && b <= 1.02f)
            return true;
    }
    return false;
}

struct sim_v3 sim_sun_light(const struct sim_scene *scene, struct sim_v3 point, struct sim_v3 face,
                            struct sim_v3 normal, bool thin, int sample)
{
    const struct sim_sky *sky = &scene->sky;
    float x, y, cosine = v3_dot(normal, sky->sun_direction);
    struct sim_v3 u, v;

    cosine = thin ? 0.7f * fabsf(cosine) : cosine;
    if (!(sky->sun.x > 0) || cosine <= 0 || (!thin && v3_dot(face, sky->sun_direction) <= 0))
        return v3_grey(0);
    disk_point(sample, &x, &y);
    v3_frame(sky->sun_direction, &u, &v);
    struct sim_v3 to = v3_along(v3_along(sky->sun_direction, u, x * sky->sun_radius), v, y * sky->sun_radius);
    if (scene->indoors && !crosses_light(scene, point, to))
        return v3_grey(0);
    float side = v3_dot(face, to) < 0 ? -5e-4f : 5e-4f;
    if (!sim_clear(scene, v3_along(point, face, side), to, INFINITY))
        return v3_grey(0);
    return v3_scale(sky->sun, cosine);
}

static struct sim_v3 shade(const struct sim_scene *scene, const struct sim_ray *ray, const struct sim_hit *hit,
                           int sample, int bounce, float roughness);

/* What a coat of reflectance at normal incidence r0 gives back at this cosine (Schlick, "An inexpensive BRDF model for
 * physically-based rendering", 1994). */
static float fresnel(float r0, float cosine)
{
    float a = 1 - sim_clamp(cosine, 0, 1);

    return r0 + (1 - r0) * a * a * a * a * a;
}

static struct sim_v3 reflection(const struct sim_scene *scene, const struct sim_ray *ray, struct sim_v3 point,
                                struct sim_v3 face, struct sim_v3 normal, float roughness, int sample, int bounce)
{
    struct sim_ray next = {.spread = ray->spread + 2 * roughness};
    struct sim_hit hit;

    next.direction = v3_unit(v3_along(ray->direction, normal, -2 * v3_dot(ray->direction, normal)));
    next.origin = v3_along(point, face, 3e-4f);
    if (v3_dot(next.direction, face) <= 0)
        next.direction = v3_unit(v3_along(next.direction, face, 0.01f - v3_dot(next.direction, face)));
    sim_trace(scene, &next, 1e-4f, &hit);
    return shade(scene, &next, &hit, sample, bounce + 1, roughness);
}

static struct sim_v3 shade(const struct sim_scene *scene, const struct sim_ray *ray, const struct sim_hit *hit,
                           int sample, int bounce, float roughness)
{
    if (hit->triangle < 0)
        return sim_sky_radiance(&scene->sky, ray->direction, ray->spread, roughness, bounce > 0);
    const struct sim_material *m = &scene->materials[scene->triangle_material[hit->triangle]];
    const unsigned *corner = &scene->triangles[hit->triangle].a;
    struct sim_v3 w = sim_weights(hit), normal = v3_grey(0), at = v3_grey(0), light = v3_grey(0);
    const float weight[3] = {w.x, w.y, w.z};

    for (int i = 0; i < 3; i++) {
        const struct sim_vertex *vertex = &scene->vertices[corner[i]];
        normal = v3_along(normal, vertex->normal, weight[i]);
        at = v3_along(at, vertex->at, weight[i]);
        if (!m->metal)
            light = v3_along(light, sim_vertex_light(scene, corner[i]), weight[i]);
    }
    normal = v3_unit(normal);
    if (v3_dot(normal, hit->face) < 0)
        normal = v3_scale(normal, -1);
    struct sim_v3 point = v3_along(ray->origin, ray->direction, hit->distance), color;
    float cosine = fmaxf(-v3_dot(ray->direction, normal), 0.02f);
    float width = ray->spread * hit->distance, footprint = width / powf(fmaxf(cosine, 0.08f), 0.75f);
    struct sim_v3 paint = sim_texture(m, at, footprint);
    if (m->metal) {
        color = v3_grey(0);
    } else {
        light = v3_add(light, sim_sun_light(scene, point, hit->face, normal, m->thin, sample));
        color = v3_add(v3_mul(paint, light), m->emission);
    }
    if (m->reflectance > 0 && bounce < MAX_BOUNCES) {
        float f = fresnel(m->reflectance, cosine);
        /* A rough coat shows little more at grazing angles than at others. */
        if (m->roughness > 0.05f)
            f = fminf(f, m->reflectance * 4);
        struct sim_v3 mirrored = reflection(scene, ray, point, hit->face, normal, m->roughness, sample, bounce);
        struct sim_v3 tint = m->metal ? v3_scale(paint, f) : v3_grey(f);
        color = v3_add(v3_scale(color, 1 - f), v3_mul(tint, mirrored));
    }
    return color;
}

struct sim_v3 sim_shade(const struct sim_scene *scene, const struct sim_ray *ray, const struct sim_hit *hit, int sample)
{
    return shade(scene, ray, hit, sample, 0, 0);
}
