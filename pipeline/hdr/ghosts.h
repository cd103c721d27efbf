/* Where two shots of a bracket do not show the same. */
#ifndef LUMI_PIPELINE_HDR_GHOSTS_H
#define LUMI_PIPELINE_HDR_GHOSTS_H

#include "pipeline/hdr/merge.h"

/* Variance of a shot's value `v` (1 is white) by photons, amplifier and codes; never 0. */
float lumi_shot_variance(const struct lumi_shot *shot, const struct lumi_merge_options *options, float v);

/* How much of a pixel counts: 1, falling to 0 where a channel nears white. */
float lumi_shot_trust(const float pixel[3]);

/* `map` (1-channel F32, made here): 0 where the shot agrees with the reference, 1 where it does not, soft between.
 * `scale`: the reference's exposure by the shot's. *share: of the picture with a map over a half. */
int lumi_ghosts_find(const struct lumi_shot *reference, const struct lumi_shot *shot, float scale,
                     const struct lumi_merge_options *options, struct lumi_raster *map, double *share,
                     struct lumi_error *error);

#endif
