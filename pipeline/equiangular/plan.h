/* Which lens the views of a field get. */
#ifndef LUMI_PIPELINE_EQUIANGULAR_PLAN_H
#define LUMI_PIPELINE_EQUIANGULAR_PLAN_H

#include "pipeline/run/run.h"

/* One grid for images taken through any of these lenses. Undistorted pinholes that are all the same and see less than
 * 75° keep their pixels (auto), as do wider ones where rectilinear views are asked for. Otherwise the views are
 * equiangular (or rectilinear): as wide as the narrowest image allows, with as many pixels a degree in the middle as
 * the finest image has there, or as fov_x, fov_y (radians) and pixels_per_degree say where they are not 0; sizes are
 * multiples of 64. LUMI_ERR_ARG where the images do not cover what is asked for, LUMI_ERR_UNSUPPORTED where a lens
 * cannot be used. */
int lumi_equiangular_choose(const struct lumi_lens *lenses, int count, enum lumi_projection projection, double fov_x,
                            double fov_y, double pixels_per_degree, struct lumi_grid *grid, struct lumi_error *error);

/* The same for all sources of a run, into run->grid. */
int lumi_equiangular_plan(struct lumi_run *run, struct lumi_error *error);

#endif
