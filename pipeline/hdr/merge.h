/* Bracketed shots of one place as one picture in linear light. */
#ifndef LUMI_PIPELINE_HDR_MERGE_H
#define LUMI_PIPELINE_HDR_MERGE_H

#include "pipeline/hdr/shot_align.h"

#include <stdbool.h>

#define LUMI_SHOTS_MAX 32

/* A shot as the camera gave it. */
struct lumi_shot {
    struct lumi_raster light; /* 3-channel F32, 1 is its white; the owner's */
    double exposure;          /* seconds times sensitivity, or any measure of it that the shots share; 0: not known */
    float quantum;            /* of its codes, on an sRGB scale: 1/255, 1/65535, 0 for floats */
};

enum lumi_shot_fate {
    LUMI_SHOT_USED = 0,
    LUMI_SHOT_BLACK = 1, /* far darker than the others and its exposure say */
    LUMI_SHOT_WHITE = 2  /* far brighter */
};

struct lumi_shot_report {
    enum lumi_shot_fate fate;
    double exposure; /* that it was merged by */
    double measured; /* exposure by the reference's, by the pictures; 0: they do not tell */
    bool guessed;    /* there was no exposure: the pictures' was taken */
    bool contrary;   /* what was told and what the pictures say are more than a third of a stop apart */
    struct lumi_shot_shift shift;
    double ghosts; /* share of the picture where the reference wins over it */
};

struct lumi_merge_report {
    int reference;
    double clipped; /* share of the picture that is clipped in every shot */
    struct lumi_shot_report shots[LUMI_SHOTS_MAX];
};

struct lumi_merge_options {
    double nominal;    /* the exposure whose white is 1 in the result; 0: the reference's */
    double full_well;  /* electrons at white, for weights by noise */
    double read_noise; /* electrons, one standard deviation */
    bool align;        /* look for shifts between the shots */
    bool ghosts;       /* and for what moved */
};

/* 10,000 and 10 electrons, both looked for. */
void lumi_merge_options_init(struct lumi_merge_options *options);

/* Merges 1 to LUMI_SHOTS_MAX shots of one size, in any order. The result is as if taken from where the reference was:
 * the shot in which most pixels are well exposed. Clipped parts of a shot say nothing; of the rest each value weighs by
 * the inverse of its variance; where a shot differs from the reference by more than noise, the reference wins. The
 * shots' pixels are changed in place by alignment. LUMI_ERR_FORMAT if no shot is left. */
int lumi_merge(struct lumi_shot *shots, int count, const struct lumi_merge_options *options, struct lumi_raster *result,
               struct lumi_merge_report *report, struct lumi_error *error);

#endif
