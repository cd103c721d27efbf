/* Pictures as tiles hold them: 8-bit YUV 4:2:0, BT.709 matrix, full range, of sRGB-encoded colour. Chroma samples sit
 * in the middle of their four luma samples (MPEG-1 siting). */
#ifndef LUMI_PROTO_LIGHTFIELD_YUV_H
#define LUMI_PROTO_LIGHTFIELD_YUV_H

#include "proto/base/raster.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Planes without padding: y is width × height, u and v are ((width + 1) / 2) × ((height + 1) / 2). */
struct lumi_yuv {
    int width, height;
    uint8_t *plane[3];
};

static inline int lumi_yuv_width(const struct lumi_yuv *image, int plane)
{
    return plane ? (image->width + 1) / 2 : image->width;
}
static inline int lumi_yuv_height(const struct lumi_yuv *image, int plane)
{
    return plane ? (image->height + 1) / 2 : image->height;
}

/* Allocates (contents undefined); LUMI_ERR_NOMEM, or LUMI_ERR_ARG for a size that is not 1..LUMI_RASTER_MAX. */
int lumi_yuv_create(struct lumi_yuv *image, int width, int height);
/* Accepts an all-zero image. */
void lumi_yuv_finish(struct lumi_yuv *image);

/* From a raster of 3 or more channels (alpha is ignored), U8 and U16 sRGB or F32 linear, which is clamped to 0..1.
 * `image` is created. */
int lumi_yuv_from_raster(const struct lumi_raster *raster, struct lumi_yuv *image);
/* To a created raster of 3 channels, U8 and of the image's size: LUMI_ERR_ARG otherwise. */
int lumi_yuv_to_raster(const struct lumi_yuv *image, const struct lumi_raster *raster);

#ifdef __cplusplus
}
#endif
#endif
