/* The samples of a prefilter: each a place on the view's disk to look from, and an offset within the pixels. */
#ifndef LUMI_PIPELINE_PREFILTER_APERTURE_H
#define LUMI_PIPELINE_PREFILTER_APERTURE_H

#include "pipeline/prefilter/view_filter.h"

#define PREFILTER_TAPS 4 /* of the Lanczos-2 kernel an axis, wherever it stands between samples */

/* Where an axis' samples stand: at the pixels' centres plus `offset`, in [−½, ½). Pixel p is made of those of the
 * pixels p + start … p + start + 3, with these weights. */
struct prefilter_axis {
    double offset;
    int start;
    float taps[PREFILTER_TAPS];
};

struct prefilter_sample {
    float u, v;   /* on the disk, metres */
    float weight; /* what equation 5 gives it: ρ over how often such places are drawn */
    struct prefilter_axis x, y;
};

/* The first `count` samples of the sequence `seed` names. LUMI_ERR_NOMEM. */
int prefilter_samples(const struct lumi_prefilter_view *view, uint32_t seed, int count,
                      struct prefilter_sample *samples);

#endif
