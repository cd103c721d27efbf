/* From a dense inverse-depth map to the meshes of a view (Overbeck et al. 2018, section 4.5). */
#ifndef LUMI_PIPELINE_GEOMETRY_SIMPLIFY_H
#define LUMI_PIPELINE_GEOMETRY_SIMPLIFY_H

#include "proto/base/raster.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"

struct lumi_simplify_options {
    double triangles_per_tile; /* on average over the view, at least 2; tiles share them by their error */
    double disparity;          /* pixels that 1/m of inverse depth moves a point from one view to the next */
    double error_cap;          /* pixels of disparity; far larger errors count as this one (a wrong surface is wrong) */
};

/* 10 triangles a tile, 30 pixels, 4 pixels. */
void lumi_simplify_defaults(struct lumi_simplify_options *options);

/* `inverse_depth`: 1 channel F32, grid-sized, 1/m; what is not finite or below 0 counts as 0, infinity. `colour`: RGB
 * F32 of the same size, or NULL; where it is given, errors count the less the plainer the picture is around them. The
 * same input gives the same mesh. */
int lumi_simplify(const struct lumi_raster *inverse_depth, const struct lumi_raster *colour,
                  const struct lumi_grid *grid, const struct lumi_simplify_options *options,
                  struct lumi_view_mesh *mesh, struct lumi_error *error);

/* Inverse depth at half resolution: of the four pixels around each new one's centre the second nearest, so that edges
 * stay steps and things two pixels wide stay. `half`, as lumi_grid_init_half made it from `grid`. */
int lumi_halve_inverse_depth(const struct lumi_raster *inverse_depth, const struct lumi_grid *grid,
                             const struct lumi_grid *half, struct lumi_raster *result);

#endif
