/* The compact form of a view's meshes, for triangulations without gaps. Inside mesh_code. */
#ifndef LUMI_PROTO_LIGHTFIELD_MESH_COMPACT_H
#define LUMI_PROTO_LIGHTFIELD_MESH_COMPACT_H

#include "proto/lightfield/mesh.h"

#include <stdbool.h>

/* Appends the compact form. False (and nothing appended that matters: the caller drops it) where the mesh is not of the
 * kind and order it needs. */
bool lumi_mesh_compact_encode(const struct lumi_view_mesh *mesh, struct lumi_writer *writer);
/* Makes and fills `mesh` but for w_min and w_step; on failure it is all zero. */
int lumi_mesh_compact_decode(struct lumi_reader *reader, int cols, int rows, struct lumi_view_mesh *mesh,
                             struct lumi_error *error);

/* mesh.c: a copy, with memory of its own; the largest s (or t) of a tile's vertices. */
int lumi_view_mesh_copy(const struct lumi_view_mesh *mesh, struct lumi_view_mesh *copy);
int lumi_mesh_extent(const struct lumi_tile_mesh *tile, bool vertical);

#endif
