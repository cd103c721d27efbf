/* Shapes as triangles. */
#include "sim/shapes.h"

static const float pi = (float)LUMI_PI;

/* A grid of (rows + 1) × (columns + 1) vertices that begins at vertex `first`, row by row. */
static void stitch(struct sim_scene *scene, unsigned first, int rows, int columns, int material)
{
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
            unsigned a = first + (unsigned)(j * (columns + 1) + i), b = a + 1, c = a + (unsigned)columns + 1;
            sim_scene_triangle(scene, a, b, c + 1, material);
            sim_scene_triangle(scene, a, c + 1, c, material);
        }
}

void sim_quad_at(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float grid,
                 int material, float offset_u, float offset_v)
{
    float lu = v3_length(u), lv = v3_length(v), scale = v3_length(scene->frame.x);
    int columns = (int)sim_clamp(ceilf(lu * scale / grid), 1, 400);
    int rows = (int)sim_clamp(ceilf(lv * scale / grid), 1, 400);
    struct sim_v3 normal = v3_unit(v3_cross(u, v));
    unsigned first = (unsigned)scene->vertex_count;
    /* Where a wall meets a ceiling, light is measured short of the corner, lest it come from behind the other. */
    float edge_u = fminf(0.015f / (lu * scale), 0.3f), edge_v = fminf(0.015f / (lv * scale), 0.3f);

    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns; i++) {
            float a = (float)i / (float)columns, b = (float)j / (float)rows;
            struct sim_v3 p = v3_along(v3_along(origin, u, a), v, b);
            unsigned vertex = sim_scene_vertex(scene, p, normal, v3(offset_u + a * lu, offset_v + b * lv, 0));
            float ia = sim_clamp(a, edge_u, 1 - edge_u), ib = sim_clamp(b, edge_v, 1 - edge_v);
            sim_scene_probe(scene, vertex, v3_along(v3_along(origin, u, ia), v, ib));
        }
    stitch(scene, first, rows, columns, material);
}

void sim_quad(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float grid, int material)
{
    sim_quad_at(scene, origin, u, v, grid, material, 0, 0);
}

void sim_box(struct sim_scene *scene, struct sim_v3 low, struct sim_v3 high, float grid, int material)
{
    struct sim_v3 s = v3_sub(high, low), x = v3(s.x, 0, 0), y = v3(0, s.y, 0), z = v3(0, 0, s.z);
    /* So that boxes of one material do not look alike. */
    float o = 10 * sim_hash((int)(1000 * low.x), (int)(1000 * (low.y + 3 * low.z)), 5);

    sim_quad_at(scene, v3(low.x, low.y, low.z), x, z, grid, material, o, 0);
    sim_quad_at(scene, v3(high.x, low.y, low.z), y, z, grid, material, o + s.x, 0);
    sim_quad_at(scene, v3(high.x, high.y, low.z), v3_scale(x, -1), z, grid, material, o + s.x + s.y, 0);
    sim_quad_at(scene, v3(low.x, high.y, low.z), v3_scale(y, -1), z, grid, material, o + 2 * s.x + s.y, 0);
    if (s.x >= s.y) {
        sim_quad_at(scene, v3(low.x, low.y, high.z), x, y, grid, material, o, s.z);
        sim_quad_at(scene, v3(low.x, high.y, low.z), x, v3_scale(y, -1), grid, material, o, -s.y);
    } else {
        sim_quad_at(scene, v3(high.x, low.y, high.z), y, v3_scale(x, -1), grid, material, o, s.z);
        sim_quad_at(scene, v3(low.x, low.y, low.z), y, x, grid, material, o, -s.x);
    }
}

static void cap(struct sim_scene *scene, struct sim_v3 center, struct sim_v3 axis, struct sim_v3 u, struct sim_v3 v,
                float radius, int sides, int material)
{
    unsigned hub = sim_scene_vertex(scene, center, axis, center);

    for (int i = 0; i <= sides; i++) {
        float angle = 2 * pi * (float)i / (float)sides;
        struct sim_v3 r = v3_add(v3_scale(u, radius * cosf(angle)), v3_scale(v, radius * sinf(angle)));
        unsigned at = sim_scene_vertex(scene, v3_add(center, r), axis, v3_add(center, r));
        if (i)
            sim_scene_triangle(scene, hub, at - 1, at, material);
    }
}

void sim_tube(struct sim_scene *scene, const struct sim_v3 *points, int count, float radius, int sides, int material)
{
    unsigned first = (unsigned)scene->vertex_count;
    float along = 0;
    struct sim_v3 u = {0}, v = {0};

    for (int j = 0; j < count; j++) {
        struct sim_v3 axis = v3_unit(v3_sub(points[j + 1 < count ? j + 1 : j], points[j > 0 ? j - 1 : 0]));
        if (j == 0) {
            v3_frame(axis, &u, &v);
        } else {
            u = v3_unit(v3_along(u, axis, -v3_dot(u, axis)));
            v = v3_cross(axis, u);
            along += v3_length(v3_sub(points[j], points[j - 1]));
        }
        for (int i = 0; i <= sides; i++) {
            float angle = 2 * pi * (float)i / (float)sides;
            struct sim_v3 n = v3_add(v3_scale(u, cosf(angle)), v3_scale(v, sinf(angle)));
            sim_scene_vertex(scene, v3_along(points[j], n, radius), n, v3(along, radius * angle, 0));
        }
    }
    stitch(scene, first, count - 1, sides, material);
    struct sim_v3 axis = v3_unit(v3_sub(points[1], points[0]));
    v3_frame(axis, &u, &v);
    if (sides > 6) {
        cap(scene, points[0], v3_scale(axis, -1), u, v, radius, sides, material);
        axis = v3_unit(v3_sub(points[count - 1], points[count - 2]));
        v3_frame(axis, &u, &v);
        cap(scene, points[count - 1], axis, u, v, radius, sides, material);
    }
}

void sim_bar(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float radius, int sides, int material)
{
    struct sim_v3 points[33];
    int count = (int)sim_clamp(ceilf(v3_length(v3_sub(b, a)) / 0.08f), 1, 32);

    for (int i = 0; i <= count; i++)
        points[i] = v3_mix(a, b, (float)i / (float)count);
    sim_tube(scene, points, count + 1, radius, sides, material);
}

void sim_wire(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float sag, float radius, int material)
{
    struct sim_v3 points[49];

    for (int i = 0; i <= 48; i++) {
        float t = (float)i / 48;
        points[i] = v3_mix(a, b, t);
        points[i].z -= 4 * sag * t * (1 - t);
    }
    sim_tube(scene, points, 49, radius, 6, material);
}

void sim_lump(struct sim_scene *scene, struct sim_v3 center, struct sim_v3 r, float bumps, int rows, int material)
{
    unsigned first = (unsigned)scene->vertex_count;
    int columns = 2 * rows;

    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns; i++) {
            float latitude = pi * ((float)j / (float)rows - 0.5f),
                  longitude = 2 * pi * (float)(i % columns) / (float)columns;
            struct sim_v3 n = v3(cosf(latitude) * cosf(longitude), cosf(latitude) * sinf(longitude), sinf(latitude));
            float push = 1 + bumps * sim_noise3(v3_add(v3_scale(n, 1.7f), v3_scale(center, 3)), 77);
            struct sim_v3 p = v3_mul(v3_scale(n, push), r);
            struct sim_v3 normal = v3_unit(v3(n.x / r.x, n.y / r.y, n.z / r.z));
            sim_scene_vertex(scene, v3_add(center, p), normal, p);
        }
    stitch(scene, first, rows, columns, material);
}

void sim_ball(struct sim_scene *scene, struct sim_v3 center, float radius, int rows, int material)
{
    sim_lump(scene, center, v3_grey(radius), 0, rows, material);
}

void sim_lathe(struct sim_scene *scene, struct sim_v3 center, const float (*profile)[2], int count, int sides,
               int material)
{
    enum { STEPS = 4 }; /* between two points of the profile, along a Catmull-Rom spline */
    unsigned first = (unsigned)scene->vertex_count;
    int rows = (count - 1) * STEPS;

    for (int j = 0; j <= rows; j++) {
        int k = j == rows ? count - 2 : j / STEPS;
        float t = (float)(j - k * STEPS) / STEPS, value[2], slope[2];
        for (int d = 0; d < 2; d++) {
            float p1 = profile[k][d], p2 = profile[k + 1][d];
            float p0 = k > 0 ? profile[k - 1][d] : p1, p3 = k + 2 < count ? profile[k + 2][d] : p2;
            float a = 0.5f * (p2 - p0), b = p0 - 2.5f * p1 + 2 * p2 - 0.5f * p3;
            float c = 0.5f * (p3 - p0) + 1.5f * (p1 - p2);
            value[d] = p1 + t * (a + t * (b + t * c));
            slope[d] = a + t * (2 * b + t * 3 * c) + 1e-6f;
        }
        for (int i = 0; i <= sides; i++) {
            float angle = 2 * pi * (float)(i % sides) / (float)sides, c = cosf(angle), s = sinf(angle);
            struct sim_v3 p = v3(value[0] * c, value[0] * s, value[1]);
            sim_scene_vertex(scene, v3_add(center, p), v3(slope[1] * c, slope[1] * s, -slope[0]), p);
        }
    }
    stitch(scene, first, rows, sides, material);
}

void sim_leaf(struct sim_scene *scene, struct sim_v3 stem, struct sim_v3 along, struct sim_v3 up, float length,
              float width, float droop, int steps, int material)
{
    struct sim_v3 x = v3_unit(along), side = v3_unit(v3_cross(up, x)), z = v3_cross(x, side), p = stem;
    unsigned first = (unsigned)scene->vertex_count;

    for (int j = 0; j <= steps; j++) {
        float t = (float)j / (float)steps, w = width * 0.5f * sinf(pi * powf(t, 0.75f)) + 0.0008f,
              bend = 1.6f * droop * t;
        struct sim_v3 dir = v3_add(v3_scale(x, cosf(bend)), v3_scale(z, -sinf(bend)));
        struct sim_v3 normal = v3_add(v3_scale(z, cosf(bend)), v3_scale(x, sinf(bend)));
        if (j)
            p = v3_along(p, dir, length / (float)steps);
        for (int i = -1; i <= 1; i++) {
            struct sim_v3 q = v3_along(v3_along(p, side, (float)i * w), normal, i ? 0.12f * w : 0);
            sim_scene_vertex(scene, q, normal, v3(stem.x + t * length, stem.y + (float)i * w, stem.z));
        }
    }
    stitch(scene, first, steps, 2, material);
}

void sim_curtain(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float height, int folds, float depth,
                 int material)
{
    int columns = folds * 10, rows = (int)(height / 0.08f) + 1;
    struct sim_v3 u = v3_sub(b, a), out = v3_unit(v3_cross(u, v3(0, 0, 1)));
    unsigned first = (unsigned)scene->vertex_count;
    float width = v3_length(u);

    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns; i++) {
            float s = (float)i / (float)columns, t = (float)j / (float)rows, spread = 0.6f + 0.4f * t;
            float phase = 2 * pi * (float)folds * s + 0.8f * sinf(3 * t + 5 * s);
            struct sim_v3 p = v3_along(v3_along(a, u, s), out, depth * spread * sinf(phase));
            p.z -= height * t;
            float slope = depth * spread * cosf(phase) * 2 * pi * (float)folds / width;
            struct sim_v3 normal = v3_unit(v3_along(out, v3_scale(u, 1 / width), -slope));
            sim_scene_vertex(scene, p, normal, v3(2 * s * width, t * height, 0));
        }
    stitch(scene, first, rows, columns, material);
}
