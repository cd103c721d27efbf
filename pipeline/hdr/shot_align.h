/* How far a shot of a bracket lies beside another, because the rig moved meanwhile. */
#ifndef LUMI_PIPELINE_HDR_SHOT_ALIGN_H
#define LUMI_PIPELINE_HDR_SHOT_ALIGN_H

#include "proto/base/raster.h"

#include <stdbool.h>

#define LUMI_SHIFT_MOST 0.03 /* of the longer side: beyond that nothing is looked for */

struct lumi_shot_shift {
    double x, y; /* what the reference shows at p, the shot shows at p + (x, y); 0 where it is not told */
    bool told;   /* enough of both pictures is neither dark nor clipped, and has detail */
};

/* Both linear (3-channel F32, 1 their white) and of one size. `scale`: the reference's exposure by the shot's. */
int lumi_shot_shift(const struct lumi_raster *reference, const struct lumi_raster *shot, double scale,
                    struct lumi_shot_shift *shift, struct lumi_error *error);

/* The shot as the reference would have it (Catmull-Rom, held to the nearest 2 × 2 pixels); what lies outside repeats
 * the border. */
int lumi_shot_move(const struct lumi_raster *shot, const struct lumi_shot_shift *shift, struct lumi_raster *moved,
                   struct lumi_error *error);

/* Median over pixels, neither dark nor clipped in either, of `shot`'s light by `reference`'s, every `step`th pixel;
 * *pixels: how many there were. 0 where there is none. */
double lumi_shot_ratio(const struct lumi_raster *reference, const struct lumi_raster *shot, long *pixels);

#endif
