/* Light at the vertices: from the areas that shine, and from everything else once reflected. */
#include "sim/shade.h"

#define DIRECTIONS 64
#define AREA_POINTS 6 /* a side */

/* What light leaves a point that was hit, towards wherever: its mean colour under the sun and the ambient light. Things
 * that shine count where they are asked for as a light of the scene only, lest small ones make spots. */
static struct sim_v3 rough_radiance(const struct sim_scene *scene, const struct sim_ray *ray, const struct sim_hit *hit,
                                    bool emission)
{
    if (hit->triangle < 0)
        return sim_sky_radiance(&scene->sky, ray->direction, 0.2f, 0.1f, false);
    const struct sim_material *m = &scene->materials[scene->triangle_material[hit->triangle]];
    struct sim_v3 point = v3_along(ray->origin, ray->direction, hit->distance);
    struct sim_v3 light = v3_add(scene->sky.ambient, sim_sun_light(scene, point, hit->face, hit->face, m->thin, 0));
    return v3_along(v3_mul(sim_texture_mean(m), light), m->emission, emission ? 1 : 0);
}

/* Points of the unit square, a Fibonacci lattice: even, and without rows. */
static void even_point(int i, float *a, float *b)
{
    float golden = 0.618034f * (float)i;

    *a = ((float)i + 0.5f) / DIRECTIONS;
    *b = golden - floorf(golden);
}

static bool through_light(const struct sim_scene *scene, struct sim_v3 p, struct sim_v3 d, float distance)
{
    for (int i = 0; i < scene->light_count; i++) {
        const struct sim_light *light = &scene->lights[i];
        struct sim_v3 n = v3_cross(light->u, light->v);
        float t = v3_dot(v3_sub(light->origin, p), n) / v3_dot(d, n);
        if (!(t > 0) || t > distance + 0.01f)
            continue;
        struct sim_v3 q = v3_sub(v3_along(p, d, t), light->origin);
        float a = v3_dot(q, light->u) / v3_dot(light->u, light->u);
        float b = v3_dot(q, light->v) / v3_dot(light->v, light->v);
        if (a >= 0 && a <= 1 && b >= 0 && b <= 1)
            return true;
    }
    return false;
}

/* The hemisphere above n, but for the directions of the lights: sums radiance, cosine-weighted. */
static struct sim_v3 from_around(const struct sim_scene *scene, struct sim_v3 p, struct sim_v3 n)
{
    struct sim_v3 u, v, sum = v3_grey(0);

    v3_frame(n, &u, &v);
    for (int i = 0; i < DIRECTIONS; i++) {
        float a, b;
        struct sim_hit hit;
        even_point(i, &a, &b);
        float r = sqrtf(a), angle = 2 * (float)LUMI_PI * b;
        struct sim_ray ray = {.origin = p};
        ray.direction = v3_scale(n, sqrtf(1 - a));
        ray.direction = v3_along(v3_along(ray.direction, u, r * cosf(angle)), v, r * sinf(angle));
        sim_trace(scene, &ray, 1e-4f, &hit);
        if (!through_light(scene, p, ray.direction, hit.distance))
            sum = v3_add(sum, rough_radiance(scene, &ray, &hit, false));
    }
    return v3_scale(sum, 1.0f / DIRECTIONS);
}

static struct sim_v3 from_light(const struct sim_scene *scene, const struct sim_light *light, struct sim_v3 p,
                                struct sim_v3 n)
{
    struct sim_v3 normal = v3_cross(light->u, light->v), sum = v3_grey(0);
    float part = v3_length(normal) / (AREA_POINTS * AREA_POINTS);

    normal = v3_unit(normal);
    for (int i = 0; i < AREA_POINTS * AREA_POINTS; i++) {
        float a = ((float)(i % AREA_POINTS) + 0.5f) / AREA_POINTS, b = ((float)(i / AREA_POINTS) + 0.5f) / AREA_POINTS;
        struct sim_v3 to = v3_sub(v3_along(v3_along(light->origin, light->u, a), light->v, b), p);
        float distance = v3_length(to);
        struct sim_ray ray = {.origin = p, .direction = v3_scale(to, 1 / distance)};
        float cosine = v3_dot(n, ray.direction), other = fabsf(v3_dot(normal, ray.direction));
        struct sim_hit hit;
        if (cosine <= 0)
            continue;
        sim_trace(scene, &ray, 1e-4f, &hit);
        if (hit.distance < distance - 0.01f)
            continue;
        /* Close to the light the points stand for too much; the area of one of them bounds what it gives. */
        float solid = part * other / (distance * distance + part / (float)LUMI_PI);
        sum = v3_along(sum, rough_radiance(scene, &ray, &hit, true), cosine * solid / (float)LUMI_PI);
    }
    return v3_scale(sum, light->gain);
}

static struct sim_v3 gather(const struct sim_scene *scene, struct sim_v3 p, struct sim_v3 n)
{
    struct sim_v3 sum = from_around(scene, p, n);

    for (int i = 0; i < scene->light_count; i++)
        sum = v3_add(sum, from_light(scene, &scene->lights[i], p, n));
    return sum;
}

/* A vertex may be lit by several threads at once; they store the same numbers. */
struct sim_v3 sim_vertex_light(const struct sim_scene *scene, unsigned vertex)
{
    _Atomic(float) *store = &scene->light[3 * (size_t)vertex];

    if (!atomic_load_explicit(&scene->lit[vertex], memory_order_acquire)) {
        const struct sim_vertex *at = &scene->vertices[vertex];
        struct sim_v3 sum = gather(scene, v3_along(at->probe, at->normal, 2e-3f), at->normal);
        atomic_store_explicit(&store[0], sum.x, memory_order_relaxed);
        atomic_store_explicit(&store[1], sum.y, memory_order_relaxed);
        atomic_store_explicit(&store[2], sum.z, memory_order_relaxed);
        atomic_store_explicit(&scene->lit[vertex], 1, memory_order_release);
    }
    return v3(atomic_load_explicit(&store[0], memory_order_relaxed),
              atomic_load_explicit(&store[1], memory_order_relaxed),
              atomic_load_explicit(&store[2], memory_order_relaxed));
}
