/* Depth of a view by multi-view stereo against its neighbours. docs/depth.md has the method and its figures.
 *
 * Two passes. lumi_mvs_match sweeps planes of equal inverse depth over the view and its neighbours and picks, pixel by
 * pixel, by semi-global matching. lumi_mvs_refine takes the first pass's maps of the view and of its neighbours, drops
 * what they do not agree on, and fills and smooths along the colours.
 *
 * Everything is in inverse depth w = 1/z, z along the view's optical axis, 1/m; 0 is infinity. Results do not depend on
 * the number of threads. */
#ifndef LUMI_PIPELINE_DEPTH_MVS_H
#define LUMI_PIPELINE_DEPTH_MVS_H

#include "proto/base/geometry.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"
#include "proto/lightfield/grid.h"

#define LUMI_MVS_NEIGHBOURS 8 /* at most, a view */

struct lumi_mvs_view {
    const struct lumi_grid *grid;
    struct lumi_pose pose;
    struct lumi_raster image; /* 3 channels U8 sRGB, grid-sized; the caller's */
    struct lumi_raster depth; /* 1 channel F32, inverse depth, grid-sized; the caller's; for lumi_mvs_refine only */
};

struct lumi_mvs_settings {
    double near_m, far_m; /* nearest and farthest surface along the optical axis; 0: found from the images */
    double step_px;       /* planes lie at most so far apart in the neighbour where they move most */
};

void lumi_mvs_defaults(struct lumi_mvs_settings *settings);

/* The neighbours of view `index` that it is matched against: the nearest in each direction around it, then the nearest
 * of all until there are at least five; none that looks elsewhere (over 40°). Indices go to `neighbours`, nearest
 * first, at most `wanted` (1..LUMI_MVS_NEIGHBOURS; 0: LUMI_MVS_NEIGHBOURS). Returns how many. */
int lumi_mvs_neighbours(int count, const struct lumi_pose *poses, int index, int wanted,
                        int neighbours[LUMI_MVS_NEIGHBOURS]);

/* Inverse depth of `view` (a new raster, 1 channel F32). Without neighbours it is the farthest surface's everywhere (0,
 * or 1/far_m). Threads: as lumi_parallel_for. */
int lumi_mvs_match(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours,
                   const struct lumi_mvs_settings *settings, int threads, struct lumi_raster *inverse_depth,
                   struct lumi_error *error);

/* The second pass: `view` and `neighbours` with their `depth` from the first. */
int lumi_mvs_refine(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours, int threads,
                    struct lumi_raster *inverse_depth, struct lumi_error *error);

#endif
