/* The dense inverse depth that a view's meshes stand for. */
#ifndef LUMI_PROTO_LIGHTFIELD_MESH_RASTER_H
#define LUMI_PROTO_LIGHTFIELD_MESH_RASTER_H

#include "proto/base/raster.h"
#include "proto/lightfield/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Inverse depth (1/m, one channel F32) at every pixel centre of a view of width × height pixels: the nearest surface
 * where several lie behind one another, NaN where there is none. *inverse_depth is made (release it with
 * lumi_raster_finish). As lumi_raster_create fails. */
int lumi_mesh_rasterize(const struct lumi_view_mesh *mesh, int width, int height, struct lumi_raster *inverse_depth);

#ifdef __cplusplus
}
#endif
#endif
