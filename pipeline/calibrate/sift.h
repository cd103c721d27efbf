/* SIFT (Lowe, "Distinctive Image Features from Scale-Invariant Keypoints", 2004) by VLFeat, the only file that names
 * it: the strongest points of a grey picture, spread evenly. */
#ifndef LUMI_PIPELINE_CALIBRATE_SIFT_H
#define LUMI_PIPELINE_CALIBRATE_SIFT_H

#include "pipeline/calibrate/features.h"

struct lumi_sift_settings {
    int first_octave;   /* 0: the picture as it is; −1: at twice its size first */
    int most;           /* features at most */
    double contrast;    /* least difference of two neighbouring blurs, of a picture of 0..255 */
    double edge;        /* largest ratio of the curvatures, as (r + 1)² / r: edges are nowhere */
    const uint8_t *use; /* width × height, 0 where nothing is looked for; NULL: everywhere */
};

void lumi_sift_defaults(struct lumi_sift_settings *settings);

/* One picture after another, of any size; for one thread at a time. */
struct lumi_sift;
struct lumi_sift *lumi_sift_create(void);
void lumi_sift_destroy(struct lumi_sift *sift);

/* `grey`: width × height, 0..255 as seen (sRGB-encoded); at least 16 × 16. Places are the picture's, descriptors the
 * root of the L1-normalised ones (Arandjelović, Zisserman 2012). `sharpness` as in struct lumi_features. *items is
 * released with lumi_free; the order is that of the strongest, region by region. */
int lumi_sift_find(struct lumi_sift *sift, const float *grey, int width, int height,
                   const struct lumi_sift_settings *settings, struct lumi_feature **items, int *count, float *sharpness,
                   struct lumi_error *error);

#endif
