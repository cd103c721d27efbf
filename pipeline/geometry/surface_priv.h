/* A triangulated height field over an image, cut along tile edges: what the simplifier works on.
 *
 * 1. Positions are integers on the lattice of a view's meshes, continued over all tiles: a vertex at (x, y) lies at
 *    pixel (x, y) · 64/255, tile (i, j) covers [255 i, 255 (i + 1)] × [255 j, 255 (j + 1)].
 * 2. Triangles are clockwise as seen in the image, never flat, and lie in one tile. Edges on tile edges are never
 *    flipped and their vertices never leave them: both tiles always have the same vertices there.
 * 3. Heights are in pixels of disparity. */
#ifndef LUMI_PIPELINE_GEOMETRY_SURFACE_PRIV_H
#define LUMI_PIPELINE_GEOMETRY_SURFACE_PRIV_H

#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"

#include <stdbool.h>

#define LATTICE 255              /* steps a tile */
#define PIXEL (64.0 / LATTICE)   /* pixels a step */
#define TILE_TRIANGLES_LIMIT 800 /* no tile takes more, however bad the others think it is */
#define STAR_LIMIT 128           /* triangles around a vertex, at most */

struct surface_vertex {
    int x, y;
    float height;
    int triangle; /* one of those around it; −1: removed */
};

struct surface_triangle {
    int v[3];
    int n[3]; /* neighbour across the edge opposite v[i], −1 at the image's edge */
    int tile; /* −1: removed */
    float error;
    unsigned stamp; /* the surface's clock at its last change */
};

struct surface {
    int cols, rows;
    int right, bottom;   /* lattice size: the last tiles may be cut */
    int width, height;   /* pixels */
    const float *target; /* heights wanted, width · height */
    const float *weight; /* of each pixel's error */
    float cap;
    struct surface_vertex *vertices;
    struct surface_triangle *triangles;
    int *tile_triangles;
    int vertex_count, triangle_count, vertex_limit, triangle_limit;
    int alive;      /* triangles that are not removed */
    unsigned clock; /* counts changes */
};

/* The triangles around a vertex and its place in each. */
struct star {
    int count;
    int triangles[STAR_LIMIT];
    int corners[STAR_LIMIT];
};

static inline int surface_cross(const struct surface *s, int a, int b, int c)
{
    const struct surface_vertex *p = &s->vertices[a], *q = &s->vertices[b], *r = &s->vertices[c];

    return (q->x - p->x) * (r->y - p->y) - (q->y - p->y) * (r->x - p->x);
}

/* surface.c */
int surface_init(struct surface *s, const struct lumi_grid *grid, int triangle_limit); /* two triangles a tile */
void surface_finish(struct surface *s);
/* False (and nothing done) where it has more than STAR_LIMIT triangles. */
bool surface_star(const struct surface *s, int vertex, struct star *star);
/* True where edge i of the triangle lies on a tile's edge. */
bool surface_hard(const struct surface *s, int triangle, int i);
/* Puts a vertex at (x, y), inside the triangle or on one of its edges. False where it cannot be. */
bool surface_insert(struct surface *s, int triangle, int x, int y, float height, int *vertex);
/* Replaces the edge by the other diagonal, if the quadrilateral is convex and the edge not hard. */
bool surface_can_flip(const struct surface *s, int triangle, int i);
void surface_flip(struct surface *s, int triangle, int i);
/* Whether v can be moved onto its neighbour u, and doing so. */
bool surface_can_collapse(const struct surface *s, const struct star *star, int v, int u);
void surface_collapse(struct surface *s, const struct star *star, int v, int u);

/* error.c: sums over the pixels whose centres lie inside. A pixel belongs to exactly one triangle. */
float surface_triangle_error(const struct surface *s, const int v[3]);
float surface_star_error(const struct surface *s, const struct star *star);
/* The pixel with the largest error, if it has one that is no vertex. */
bool surface_worst_pixel(const struct surface *s, int triangle, int *x, int *y);
/* The height of vertex v that fits the pixels around it best, the other vertices as they are. */
float surface_best_height(const struct surface *s, const struct star *star, int v);

/* quantize.c */
int surface_to_mesh(const struct surface *s, double w_per_height, struct lumi_view_mesh *mesh,
                    struct lumi_error *error);

#endif
