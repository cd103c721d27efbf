/* Per-view geometry: one small triangle mesh a tile, quantised (Overbeck et al. 2018, section 4.5).
 *
 * Everything is in inverse depth w = 1/z, z the distance along the optical axis in metres; w = 0 is infinity. A view
 * has a lattice of 65,536 codes, w = w_min + code · w_step. A tile's vertex has 8-bit s, t and d: its place is (s, t) ·
 * 64/255 pixels from the tile's top left corner, its code is base + (d << shift). base is a multiple of 1 << shift; a
 * vertex on an edge shared by two tiles has the same (edge coordinate, code) in both, so surfaces meet exactly (the
 * code there is a multiple of the coarser of the two steps). */
#ifndef LUMI_PROTO_LIGHTFIELD_MESH_H
#define LUMI_PROTO_LIGHTFIELD_MESH_H

#include "proto/base/bytes.h"
#include "proto/base/result.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_MESH_MAX_VERTICES 4096  /* a tile */
#define LUMI_MESH_MAX_TRIANGLES 8192 /* a tile */

struct lumi_mesh_vertex {
    uint8_t s, t, d;
};

struct lumi_tile_mesh {
    uint16_t base;
    uint8_t shift; /* 0..8 */
    uint16_t vertex_count, triangle_count;
    const struct lumi_mesh_vertex *vertices;
    const uint16_t *indices; /* 3 a triangle, clockwise as seen in the image (y down) */
};

/* The meshes of one view, tile by tile in row-major order; all memory in one block behind `block`. */
struct lumi_view_mesh {
    float w_min, w_step;
    int cols, rows;
    struct lumi_tile_mesh *tiles; /* cols · rows */
    void *block;                  /* vertices and indices of all tiles; owned, as `tiles` is */
};

/* Allocates tiles, vertices and indices as counted (a count a tile), all zero; they are filled through
 * lumi_mesh_vertices and lumi_mesh_indices. LUMI_ERR_NOMEM, or LUMI_ERR_ARG for anything over the limits. */
int lumi_view_mesh_create(struct lumi_view_mesh *mesh, int cols, int rows, const int *vertex_counts,
                          const int *triangle_counts);
/* Releases tiles and block; accepts an all-zero mesh. */
void lumi_view_mesh_finish(struct lumi_view_mesh *mesh);

/* Writable: only for who made the mesh. */
static inline struct lumi_mesh_vertex *lumi_mesh_vertices(const struct lumi_view_mesh *mesh, int tile)
{
    return (struct lumi_mesh_vertex *)mesh->tiles[tile].vertices;
}
static inline uint16_t *lumi_mesh_indices(const struct lumi_view_mesh *mesh, int tile)
{
    return (uint16_t *)mesh->tiles[tile].indices;
}

static inline float lumi_mesh_inverse_depth(const struct lumi_view_mesh *mesh, const struct lumi_tile_mesh *tile, int d)
{
    return mesh->w_min + (float)(tile->base + (d << tile->shift)) * mesh->w_step;
}

/* Appends the variable-length coding of `mesh` (docs/lumi-format.md, "Geometry"). Any mesh within the limits can be
 * coded. One whose tiles are triangulated without gaps, meet without cracks, have their least code as base and their
 * vertices in order (corners, top, left, right, bottom edge, inside; each by t, then s) takes about a quarter of the
 * bytes; its triangles come back in another order. */
void lumi_view_mesh_encode(const struct lumi_view_mesh *mesh, struct lumi_writer *writer);

/* Decodes what lumi_view_mesh_encode wrote, for a view of cols × rows tiles. Trusts nothing: LUMI_ERR_FORMAT for
 * anything out of range, LUMI_ERR_NOMEM. Memory is bounded by the limits above and the bytes read. */
int lumi_view_mesh_decode(struct lumi_reader *reader, int cols, int rows, struct lumi_view_mesh *mesh,
                          struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
