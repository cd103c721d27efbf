/* The stage "features": points of every picture that are found again in others, SIFT (Lowe 2004), one ".feat" file a
 * frame (docs/features.md). Positions are the original picture's pixels, whatever was sampled to find them. */
#ifndef LUMI_PIPELINE_CALIBRATE_FEATURES_H
#define LUMI_PIPELINE_CALIBRATE_FEATURES_H

#include "pipeline/run/run.h"

#include <stddef.h>
#include <stdint.h>

#define LUMI_DESCRIPTOR_SIZE 128
#define LUMI_FEATURES_MAX 65536 /* of a picture */

struct lumi_feature {
    float x, y;        /* pixels, centres at half-integers */
    float scale;       /* standard deviation of the blob that it is, pixels */
    float orientation; /* radians, from the picture's x towards its y */
    uint8_t descriptor[LUMI_DESCRIPTOR_SIZE];
};

struct lumi_features {
    int width, height, count;
    struct lumi_feature *items; /* owned */
    /* Of the whole picture: its mean brightness (sRGB-encoded grey, 0..1), and how sharp it is: the ratio of what the
     * finest and the next coarser band of it hold (root mean squares); falls with every blur, not with the light. */
    float mean, sharpness;
};

void lumi_features_finish(struct lumi_features *features);

int lumi_features_read(const char *path, struct lumi_features *features, struct lumi_error *error);
int lumi_features_decode(const void *data, size_t size, const char *name, struct lumi_features *features,
                         struct lumi_error *error);
int lumi_features_write(const char *path, const struct lumi_features *features, struct lumi_error *error);

extern const struct lumi_stage lumi_stage_features;

#endif
