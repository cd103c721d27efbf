/* Flicker: what changes from frame to frame of a slow path and does not in the truth. */
#ifndef LUMI_PIPELINE_EVALUATE_FLICKER_H
#define LUMI_PIPELINE_EVALUATE_FLICKER_H

#include "pipeline/evaluate/evaluate.h"

#define LUMI_FLICKER_JUMP 8 /* grey levels */

/* Means over all pixels, channels and neighbouring frames, grey levels of 255. */
struct lumi_flicker {
    int frames;
    double rendered; /* |R(t+1) − R(t)| */
    double truth;    /* |T(t+1) − T(t)| */
    double flicker;  /* |(R(t+1) − R(t)) − (T(t+1) − T(t))| */
    double jumps;    /* share of values with |R(t+1) − R(t)| > |T(t+1) − T(t)| + LUMI_FLICKER_JUMP */
};

/* The truth's pictures are the frames, in their order; two at least, all of one size. Of `options` render and progress
 * count. */
int lumi_flicker(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *options,
                 struct lumi_flicker *result, struct lumi_error *error);

/* A line for people, and JSON; both are freed with g_free. */
char *lumi_flicker_text(const struct lumi_flicker *flicker);
char *lumi_flicker_json(const struct lumi_flicker *flicker);

#endif
