/* Where the vertices of a view's meshes lie in its image, and the dense inverse depth that the meshes stand for. */
#ifndef LUMI_PROTO_LIGHTFIELD_MESH_RASTER_H
#define LUMI_PROTO_LIGHTFIELD_MESH_RASTER_H

#include "proto/base/raster.h"
#include "proto/lightfield/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A vertex: pixels of the view's image, inverse depth (1/m). */
struct lumi_mesh_point {
    double x, y, w;
};
struct lumi_mesh_point lumi_mesh_point(const struct lumi_view_mesh *mesh, int tile,
                                       const struct lumi_mesh_vertex *vertex);

/* Inverse depth (1/m, one channel F32) at every pixel centre of a view of width × height pixels: the nearest surface
 * where several lie behind one another, NaN where there is none. *inverse_depth is made (release it with
 * lumi_raster_finish). As lumi_raster_create fails. */
int lumi_mesh_rasterize(const struct lumi_view_mesh *mesh, int width, int height, struct lumi_raster *inverse_depth);

#ifdef __cplusplus
}
#endif
#endif
