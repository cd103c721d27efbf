/* Reference images: short VP9 streams, each a key frame and frames predicted from it. */
#ifndef LUMI_PROTO_LIGHTFIELD_REFERENCE_CODE_H
#define LUMI_PROTO_LIGHTFIELD_REFERENCE_CODE_H

#include "proto/base/bytes.h"
#include "proto/base/result.h"
#include "proto/lightfield/yuv.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_REFERENCE_RUN 8 /* images a stream */

/* Encodes `count` images of one size. quantizer 0..63 and speed as libvpx has them. sizes[i]: bytes of frame i; the
 * frames are appended to `writer` one after the other. */
int lumi_references_encode(const struct lumi_yuv *images, int count, int quantizer, int speed, uint32_t *sizes,
                           struct lumi_writer *writer, struct lumi_error *error);

/* Decodes what lumi_references_encode wrote; images[i] are created. Trusts nothing: memory is bounded by count images
 * of width × height. LUMI_ERR_FORMAT, and the images that could be decoded before the fault are kept (the rest all
 * zero). */
int lumi_references_decode(const uint8_t *data, const uint32_t *sizes, int count, int width, int height,
                           struct lumi_yuv *images);

#ifdef __cplusplus
}
#endif
#endif
