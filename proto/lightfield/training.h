/* Choosing the tiles that train a level's contexts. */
#ifndef LUMI_PROTO_LIGHTFIELD_TRAINING_H
#define LUMI_PROTO_LIGHTFIELD_TRAINING_H

#include "proto/lightfield/tile_encoder.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_TRAINING_IMAGES 16 /* images that training tiles are taken from, at most */

/* How many training tiles suit a level with so many tiles to code: they cost bytes, and time for every decoder. */
int lumi_training_count(long coded_tiles);

/* Takes `count` tiles of an image, at places drawn with `seed`, each with the shifts that lumi_shift_search finds
 * (arguments as there and in lumi_cluster_encode_image). */
int lumi_training_pick(const struct lumi_yuv *image, int reference_index, const struct lumi_yuv *reference,
                       const struct lumi_shift *seeds, int range, int count, uint64_t seed,
                       struct lumi_training_tile *tiles, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
