/* Resampling an image from its lens to a view's grid. */
#ifndef LUMI_PIPELINE_EQUIANGULAR_WARP_H
#define LUMI_PIPELINE_EQUIANGULAR_WARP_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "proto/lightfield/grid.h"

#include <stdbool.h>

/* Where each pixel of the grid lies in the lens's image. Immutable once made: any number of threads may use it. */
struct lumi_warp;

/* True where the grid's pixels are the lens's own: an undistorted pinhole with the same focal lengths and size. */
bool lumi_warp_is_copy(const struct lumi_lens *lens, const struct lumi_grid *grid);

/* LUMI_ERR_ARG if the lens does not image some pixel of the grid. */
int lumi_warp_create(const struct lumi_lens *lens, const struct lumi_grid *grid, struct lumi_warp **warp,
                     struct lumi_error *error);
/* From a view to the same view at half resolution (lumi_grid_init_half). */
int lumi_warp_create_half(const struct lumi_grid *grid, const struct lumi_grid *half, struct lumi_warp **warp,
                          struct lumi_error *error);
void lumi_warp_destroy(struct lumi_warp *warp);

/* `source` is 3-channel F32 (linear light), lens-sized; `result`, as large as the grid, is made (release it with
 * lumi_raster_finish). Lanczos, three lobes, widened along each image axis where the grid is coarser than the image;
 * values are held to those of the nearest 4 × 4 pixels so that bright edges do not ring. */
int lumi_warp_apply(const struct lumi_warp *warp, const struct lumi_raster *source, struct lumi_raster *result,
                    struct lumi_error *error);

#endif
