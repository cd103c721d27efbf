/* The coded tiles of one cluster between encoder and file: all that a file needs of them, uncompressed. */
#ifndef LUMI_PROTO_LIGHTFIELD_CLUSTER_CODE_H
#define LUMI_PROTO_LIGHTFIELD_CLUSTER_CODE_H

#include "proto/lightfield/tile_encoder.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Encodes the tiles of an image, row by row, appending them to `writer`. `seeds`: where to look for each tile in the
 * reference (NULL: in its own place); `range`: how far around. `squared_error`, unless NULL, is raised by the sum of
 * squared differences of all three planes inside the image. */
int lumi_cluster_encode_image(struct lumi_tile_encoder *encoder, const struct lumi_yuv *reference,
                              const struct lumi_yuv *image, const struct lumi_shift *seeds, int range,
                              struct lumi_writer *writer, double *squared_error, struct lumi_error *error);

/* The next tile; its bytes lie in the reader's. LUMI_ERR_FORMAT past the end. */
int lumi_cluster_read_tile(struct lumi_reader *reader, struct lumi_tile_code *code);

#ifdef __cplusplus
}
#endif
#endif
