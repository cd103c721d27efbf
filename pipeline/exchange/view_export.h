/* A view's depth as a picture, its mesh as a file for other programs. */
#ifndef LUMI_PIPELINE_EXCHANGE_VIEW_EXPORT_H
#define LUMI_PIPELINE_EXCHANGE_VIEW_EXPORT_H

#include "proto/base/geometry.h"
#include "proto/base/raster.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"

/* An OpenEXR file with one float channel "Z": metres along the optical axis, infinity where the inverse depth is 0 or
 * less, NaN where it is NaN. */
int lumi_export_depth(const char *path, const struct lumi_raster *inverse_depth, struct lumi_error *error);

/* A PLY file in world coordinates: the tiles' triangles, vertices of neighbouring tiles kept apart, with texture
 * coordinates and, if `image` (U8 RGB, grid-sized) is given, colours. What is farther than `far_m` is brought to there.
 */
int lumi_export_mesh(const char *path, const struct lumi_grid *grid, const struct lumi_pose *pose,
                     const struct lumi_view_mesh *mesh, const struct lumi_raster *image, double far_m,
                     struct lumi_error *error);

#endif
