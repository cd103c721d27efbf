/* What compression alone cost: decoded views against the views before coding. */
#ifndef LUMI_PIPELINE_EVALUATE_CODEC_COST_H
#define LUMI_PIPELINE_EVALUATE_CODEC_COST_H

#include "proto/base/result.h"

#include <stdint.h>

struct lumi_codec_view {
    char name[64];
    double psnr_yuv; /* Overbeck et al. 2018, section 8.2 */
};

struct lumi_codec_cost {
    struct lumi_codec_view *views; /* of the fine level */
    int count, worst, damaged;     /* damaged: tiles */
    double mean_yuv;               /* mean of the views' decibels */
    double pooled_yuv;             /* decibels of the mean error, as a codec is judged by */
    uint64_t image_bytes, reference_bytes, side_bytes, geometry_bytes, file_bytes; /* image, geometry: fine level */
    uint64_t pixels;                                                               /* of the fine level */
};

/* `capture`: the capture's folder, whose work folder holds the stage "equiangular", or that work folder itself. */
int lumi_codec_cost(const char *field, const char *capture, int threads,
                    void (*progress)(void *context, const char *what, int done, int total), void *context,
                    struct lumi_codec_cost *cost, struct lumi_error *error);
void lumi_codec_cost_finish(struct lumi_codec_cost *cost);

/* Freed with g_free. */
char *lumi_codec_cost_text(const struct lumi_codec_cost *cost);
char *lumi_codec_cost_json(const struct lumi_codec_cost *cost);

#endif
