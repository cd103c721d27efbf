/* A view's surface as the eye sees it: directions of its vertices, in patches that can be rejected whole.
 *
 * 1. A vertex is kept as a homogeneous point about the eye: (x, y, z) a unit direction, w its inverse distance (so that
 *    infinity, w = 0, is a vertex like any other).
 * 2. Vertices that two patches share come out the same to the bit; with the canonical edge order of triangle.c no pixel
 *    between neighbouring triangles is drawn twice or not at all. */
#ifndef LUMI_RENDER_CPU_VIEW_SURFACE_H
#define LUMI_RENDER_CPU_VIEW_SURFACE_H

#include "render/cpu/rays.h"
#include "render/viewset/viewset.h"

struct lumi_surface_vertex {
    float x, y, z, w;    /* about the eye, in the world */
    float tx, ty, depth; /* in the view: tangents, and inverse depth along its axis */
};

struct lumi_patch {
    struct lumi_cone cone; /* about its vertices */
    int tile;
    int first_vertex, vertex_count;
    const uint16_t *indices; /* 3 a triangle, counted from first_vertex */
    int triangle_count;
};

/* A view, prepared for one eye. Single precision where pixels need it. */
struct lumi_surface_view {
    const struct lumi_view *view;
    struct lumi_surface_vertex *vertices;
    struct lumi_patch *patches;
    int patch_count;
    uint16_t *block_indices; /* dense depth: the triangles of a full patch, then of the cut ones */
    float rt[9];             /* world to camera */
    float ex, ey, ez;        /* the eye in the camera's frame */
    float sides[4][3];       /* normals of the half-spaces that hold the directions through the disk, in the world */
    float forward[3];        /* the optical axis */
    float *tile_x, *tile_y;  /* pixel = tile_x[2 col] · tangent + tile_x[2 col + 1] */
};

/* Fills everything but vertices and patches: enough to tell which blocks see the disk. */
void lumi_surface_place(struct lumi_surface_view *surface, const struct lumi_view *view, struct lumi_vec3 eye,
                        float disk_scale);
/* True where no direction of the cone goes through the disk the right way. */
int lumi_surface_hidden(const struct lumi_surface_view *surface, const struct lumi_cone *cone);
/* The rest. LUMI_ERR_NOMEM leaves the surface as it was. */
int lumi_surface_build(struct lumi_surface_view *surface);
void lumi_surface_finish(struct lumi_surface_view *surface);

#endif
