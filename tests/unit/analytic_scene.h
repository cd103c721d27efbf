/* Scenes whose every ray is known, and view sets taken of them: for the tests of the renderers. */
#ifndef LUMI_TESTS_UNIT_ANALYTIC_SCENE_H
#define LUMI_TESTS_UNIT_ANALYTIC_SCENE_H

#include "proto/base/lens.h"
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "render/viewset/viewset.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* A room (seen from within), a wall with a panel before it, a ball (seen from without). */
enum scene_kind { SCENE_ROOM, SCENE_WALL, SCENE_BALL };

/* Distance along d (any length) to the nearest surface, or 0. */
static inline double scene_hit(enum scene_kind kind, struct lumi_vec3 o, struct lumi_vec3 d)
{
    if (kind == SCENE_ROOM) { /* the inside of a box of 4 × 5 × 3 m */
        double best = 1e30;
        const double origin[3] = {o.x, o.y, o.z}, direction[3] = {d.x, d.y, d.z}, half[3] = {2, 2.5, 1.5};
        for (int i = 0; i < 3; i++)
            if (direction[i] != 0) {
                double t = ((direction[i] > 0 ? half[i] : -half[i]) - origin[i]) / direction[i];
                if (t > 0 && t < best)
                    best = t;
            }
        return best;
    }
    if (kind == SCENE_WALL) { /* z = 3, and before it a panel at z = 2 of 0.5 × 0.5 m */
        double near = (2 - o.z) / d.z, far = (3 - o.z) / d.z;
        struct lumi_vec3 p = lumi_add(o, lumi_scale(d, near));
        if (near > 0 && fabs(p.x) < 0.25 && fabs(p.y) < 0.25)
            return near;
        return far > 0 ? far : 0;
    }
    double a = lumi_dot(d, d), b = lumi_dot(o, d), c = lumi_dot(o, o) - 1, root = b * b - a * c;
    if (root < 0)
        return 0;
    double t = (-b - sqrt(root)) / a;
    return t > 0 ? t : 0;
}

static inline void scene_color(struct lumi_vec3 p, double color[3])
{
    color[0] = 0.5 + 0.2 * sin(5 * p.x + 1) + 0.2 * cos(4 * p.y - 3 * p.z);
    color[1] = 0.5 + 0.2 * sin(4 * p.y + 2) + 0.2 * cos(6 * p.z + 2 * p.x);
    color[2] = 0.5 + 0.2 * sin(6 * p.z) + 0.2 * cos(5 * p.x + 3 * p.y);
}

/* What a ray sees, as sRGB bytes; false where it sees nothing (black). */
static inline bool scene_pixel(enum scene_kind kind, struct lumi_vec3 o, struct lumi_vec3 d, uint8_t rgb[3])
{
    double t = scene_hit(kind, o, d), color[3];

    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!(t > 0))
        return false;
    scene_color(lumi_add(o, lumi_scale(d, t)), color);
    for (int i = 0; i < 3; i++)
        rgb[i] = (uint8_t)(fmin(fmax(color[i], 0), 1) * 255 + 0.5);
    return true;
}

#define SCENE_MAX_VIEWS 80

struct scene_set {
    int count;
    struct lumi_grid grid;
    struct lumi_view views[SCENE_MAX_VIEWS];
    struct lumi_raster images[SCENE_MAX_VIEWS], depths[SCENE_MAX_VIEWS];
    struct lumi_view_mesh meshes[SCENE_MAX_VIEWS];
    struct lumi_viewset *set;
};

/* Every tile a lattice of 17 × 17 vertices with the scene's own depths: as the real meshes are, but denser. */
static inline void scene_mesh(const struct lumi_grid *grid, const struct lumi_raster *depth,
                              struct lumi_view_mesh *mesh)
{
    int tiles = grid->cols * grid->rows;
    size_t vertices = 17 * 17, indices = 16 * 16 * 6;
    uint8_t *block = lumi_alloc((size_t)tiles, vertices * sizeof(struct lumi_mesh_vertex) + indices * 2);

    *mesh = (struct lumi_view_mesh){.w_min = 0,
                                    .w_step = 2.0f / 65535,
                                    .cols = grid->cols,
                                    .rows = grid->rows,
                                    .tiles = lumi_calloc((size_t)tiles, sizeof *mesh->tiles),
                                    .block = block};
    for (int tile = 0; tile < tiles; tile++) {
        uint16_t *index = (uint16_t *)(void *)(block + (size_t)tile * indices * 2);
        struct lumi_mesh_vertex *vertex =
            (struct lumi_mesh_vertex *)(void *)(block + (size_t)tiles * indices * 2) + (size_t)tile * vertices;
        mesh->tiles[tile] = (struct lumi_tile_mesh){.shift = 8,
                                                    .vertex_count = (uint16_t)vertices,
                                                    .triangle_count = (uint16_t)(indices / 3),
                                                    .vertices = vertex,
                                                    .indices = index};
        for (int y = 0; y < 17; y++)
            for (int x = 0; x < 17; x++) {
                int px = tile % grid->cols * 64 + 4 * x, py = tile / grid->cols * 64 + 4 * y;
                float w = lumi_row_f32(
                    depth, py < grid->height ? py : grid->height - 1)[px < grid->width ? px : grid->width - 1];
                vertex[y * 17 + x] = (struct lumi_mesh_vertex){(uint8_t)(255 * x / 16), (uint8_t)(255 * y / 16),
                                                               (uint8_t)lroundf(w / mesh->w_step / 256)};
                if (x == 16 || y == 16)
                    continue;
                uint16_t a = (uint16_t)(y * 17 + x), b = (uint16_t)(a + 1), c = (uint16_t)(a + 17),
                         d = (uint16_t)(c + 1);
                const uint16_t two[6] = {a, b, d, a, d, c};
                memcpy(index + (y * 16 + x) * 6, two, sizeof two);
            }
    }
}

static inline void scene_shoot(struct scene_set *s, enum scene_kind kind, struct lumi_pose pose, float extent,
                               bool meshes)
{
    int i = s->count++;

    s->views[i] = (struct lumi_view){.grid = &s->grid, .pose = pose, .disk = {extent, extent, extent, extent}};
    lumi_raster_create(&s->images[i], s->grid.width, s->grid.height, 3, LUMI_U8);
    lumi_raster_create(&s->depths[i], s->grid.width, s->grid.height, 1, LUMI_F32);
    for (int y = 0; y < s->grid.height; y++)
        for (int x = 0; x < s->grid.width; x++) {
            double tx, ty;
            lumi_grid_unproject(&s->grid, x + 0.5, y + 0.5, &tx, &ty);
            struct lumi_vec3 d = lumi_rotate(pose.r, lumi_vec3(tx, ty, 1));
            double t = scene_hit(kind, pose.t, d);
            scene_pixel(kind, pose.t, d, lumi_row_u8(&s->images[i], y) + 3 * x);
            lumi_row_f32(&s->depths[i], y)[x] = t > 0 ? (float)(1 / t) : 0;
        }
    s->views[i].inverse_depth = &s->depths[i];
    if (meshes) {
        scene_mesh(&s->grid, &s->depths[i], &s->meshes[i]);
        s->views[i].mesh = &s->meshes[i];
    }
}

/* 3 × 3 cameras 10 cm apart at z = 0; or 5 × 12 on a sphere of 30 cm looking out, 4 × 12 on one of 3 m looking in. */
static inline int scene_open(struct scene_set *s, enum scene_kind kind, bool meshes)
{
    struct lumi_pose pose;

    memset(s, 0, sizeof *s);
    if (kind == SCENE_WALL) {
        lumi_grid_init_pinhole(&s->grid, 160, 128, 160, 160, 80, 64);
        for (int i = 0; i < 9; i++) {
            lumi_pose_look(lumi_vec3(0.1 * (i % 3 - 1), 0.1 * (i / 3 - 1), 0), lumi_vec3(0, 0, 1), lumi_vec3(0, -1, 0),
                           &pose);
            scene_shoot(s, kind, pose, 0.1f, meshes);
        }
    } else {
        bool out = kind == SCENE_ROOM;
        double radius = out ? 0.3 : 3, fov = out ? LUMI_PI / 2 : 0.9;
        int rows = out ? 5 : 4;
        lumi_grid_init_equiangular(&s->grid, 128, 128, fov, fov);
        for (int i = 0; i < rows * 12; i++) {
            double latitude = (i / 12 - (rows - 1) / 2.0) * LUMI_PI / 6, longitude = i % 12 * LUMI_PI / 6;
            struct lumi_vec3 d =
                lumi_vec3(cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude));
            lumi_pose_look(lumi_scale(d, radius), lumi_scale(d, out ? 1 : -1), lumi_vec3(0, 0, 1), &pose);
            scene_shoot(s, kind, pose, (float)(1.1 * radius * LUMI_PI / 6), meshes);
        }
    }
    return lumi_viewset_create(s->count, s->views, s->images, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &s->set, NULL);
}

static inline void scene_close(struct scene_set *s)
{
    lumi_viewset_destroy(s->set);
    for (int i = 0; i < s->count; i++) {
        lumi_raster_finish(&s->images[i]);
        lumi_raster_finish(&s->depths[i]);
        lumi_free(s->meshes[i].tiles);
        lumi_free(s->meshes[i].block);
    }
}

#endif
