/* Pixels that show the rig's stand, told by their depth. */
#ifndef LUMI_PIPELINE_SYNTHESIZE_STAND_MASK_H
#define LUMI_PIPELINE_SYNTHESIZE_STAND_MASK_H

#include "pipeline/subsample/stand.h"
#include "proto/base/raster.h"
#include "proto/lightfield/grid.h"

#include <stdint.h>

#define LUMI_FLOOR_BINS 1024

/* Heights of what is below the rig, gathered from depth maps. */
struct lumi_floor {
    double top, step; /* bin i begins at top − i · step */
    double area[LUMI_FLOOR_BINS];
};

void lumi_floor_init(struct lumi_floor *floor, double top);
/* Adds what a view sees within `reach` metres of the axis through `centre`. */
void lumi_floor_add(struct lumi_floor *floor, const struct lumi_grid *grid, const struct lumi_pose *pose,
                    const struct lumi_raster *depth, struct lumi_vec3 centre, double reach);
/* The height most of it lies at. False: it is spread over all heights, or there is nothing. */
bool lumi_floor_find(const struct lumi_floor *floor, double *height);

/* Share of the view's pixels whose points are where only a stand can be: next to the axis, not wider than the hole
 * that the cameras go round, in the upper half of the way to the floor; or below the floor, where its head would be in
 * between, too near to be matched. */
double lumi_stand_share(const struct lumi_stand *stand, const struct lumi_grid *grid, const struct lumi_pose *pose,
                        const struct lumi_raster *depth);

/* A byte a pixel, 1 where the view shows the stand or is next to where it does. Returns how many; 0 bytes stay. */
long lumi_stand_mask(const struct lumi_stand *stand, const struct lumi_grid *grid, const struct lumi_pose *pose,
                     const struct lumi_raster *depth, uint8_t *blocked);
/* Every pixel within `reach` pixels of one that is not 0 becomes 1. LUMI_ERR_NOMEM. */
int lumi_mask_widen(uint8_t *blocked, int width, int height, int reach);

#endif
