/* A view out of others with depth: on memory, without files.
 *
 * Each source's depth map is carried over to the new view as a surface that is cut where depth jumps. Where sources
 * disagree on a pixel's depth, the nearest that enough of them agree on is taken; its colour is the sources', each
 * asked where the point lies in it, those left out that see something else there. What no source shows is filled from
 * what is around it, from the farther side. Results do not depend on the number of threads. */
#ifndef LUMI_PIPELINE_SYNTHESIZE_VIEW_SYNTHESIS_H
#define LUMI_PIPELINE_SYNTHESIZE_VIEW_SYNTHESIS_H

#include "proto/base/geometry.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"
#include "proto/lightfield/grid.h"

#include <stdint.h>

#define LUMI_SYNTHESIS_SOURCES 24 /* at most, a view */

struct lumi_synthesis_source {
    const struct lumi_grid *grid;
    struct lumi_pose pose;
    struct lumi_raster image; /* 3 channels F32, linear light, grid-sized; the caller's */
    struct lumi_raster depth; /* 1 channel F32, inverse depth, grid-sized; the caller's */
    const uint8_t *blocked;   /* a byte a pixel, not 0: not of the place; NULL: none. The caller's */
};

/* The sources for a view among `count` poses, nearest first; none that looks elsewhere, none that is `skip` (−1: all
 * may). The nearest in each direction around, at most 3 times as far as the nearest of all; with `far`, also those that
 * look past what hides a place from the near ones: in each direction the one that is nearest to `far` metres away.
 * Returns how many. */
int lumi_synthesis_sources(int count, const struct lumi_pose *poses, const struct lumi_pose *view, int skip, double far,
                           int sources[LUMI_SYNTHESIS_SOURCES]);

/* What `source` shows of the view: inverse depth in the view (a new raster, 1 channel F32), −1 where it shows nothing.
 */
int lumi_synthesis_carry(const struct lumi_synthesis_source *source, const struct lumi_grid *grid,
                         const struct lumi_pose *pose, struct lumi_raster *depth);

/* Fills image (3 channels F32) and depth (1 channel F32; both the caller's, grid-sized) where `wanted` is not 0 (a byte
 * a pixel; NULL: everywhere); other pixels stay, and count as known where holes are filled. `filled` (may be NULL) gets
 * how many no source showed. */
int lumi_synthesize_view(const struct lumi_grid *grid, const struct lumi_pose *pose, int count,
                         const struct lumi_synthesis_source *sources, const uint8_t *wanted, int threads,
                         struct lumi_raster *image, struct lumi_raster *depth, long *filled, struct lumi_error *error);

/* Pixels with known 0 take what is around them: of those around, the farther ones. `known` all 0: nothing is done. */
int lumi_synthesis_fill(struct lumi_raster *image, struct lumi_raster *depth, const uint8_t *known, double tolerance);

#endif
