/* The stages `geometry` and `geometry-coarse`: meshes of every view at full and at half resolution. */
#ifndef LUMI_PIPELINE_GEOMETRY_GEOMETRY_H
#define LUMI_PIPELINE_GEOMETRY_GEOMETRY_H

#include "pipeline/run/run.h"

/* Read the depth map and the view (stages "depth", "equiangular"); write the bytes of lumi_view_mesh_encode, for the
 * grid of the run and for its half (lumi_grid_init_half). Coarse meshes have 2·gp triangles a tile of theirs. */
extern const struct lumi_stage lumi_stage_geometry;
extern const struct lumi_stage lumi_stage_geometry_coarse;

/* Pixels that 1/m of inverse depth moves a point between view `index` and its neighbours: focal length in the middle of
 * the grid times the mean distance to the four nearest. */
double lumi_geometry_disparity(const struct lumi_run *run, int index);

#endif
