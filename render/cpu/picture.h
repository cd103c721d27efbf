/* What the CPU renderers make, and the settings they share. */
#ifndef LUMI_RENDER_CPU_PICTURE_H
#define LUMI_RENDER_CPU_PICTURE_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"

#ifdef __cplusplus
extern "C" {
#endif

struct lumi_picture {
    struct lumi_raster color;            /* RGB, the sample type that was asked for; black where nothing is covered */
    struct lumi_raster weight;           /* F32: sum of the disks' weights; 0 where the pixel is not covered */
    struct lumi_raster inverse_distance; /* F32: blended 1/distance along the ray (1/m); 0 infinity or not covered */
    long imaged;                         /* pixels the lens images (a fisheye's corners are not) */
    long covered;                        /* of these, pixels with weight */
};

void lumi_picture_finish(struct lumi_picture *picture);

/* How a view's pixels are interpolated. */
enum lumi_filter { LUMI_FILTER_BILINEAR = 0, LUMI_FILTER_CUBIC = 1 };

#ifdef __cplusplus
}
#endif
#endif
