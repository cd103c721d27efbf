/* The brackets of a capture: how each shot was exposed, and its picture as light. */
#ifndef LUMI_PIPELINE_HDR_BRACKETS_H
#define LUMI_PIPELINE_HDR_BRACKETS_H

#include "pipeline/hdr/merge.h"
#include "pipeline/hdr/response.h"
#include "pipeline/run/run.h"

/* What all brackets of a capture share. */
struct lumi_brackets {
    double nominal;                 /* the exposure that 0 stops stand for: the median of what the cameras reported, in
                                       seconds at ISO 100; 1 where none did */
    int offset_count;               /* the exposures asked for in most of them */
    double offsets[LUMI_SHOTS_MAX]; /* stops, ascending */
};

void lumi_brackets_find(const struct lumi_run *run, struct lumi_brackets *brackets);

/* Exposures of a source's parts, as struct lumi_shot has them: reported by the camera, or (where not all of them are)
 * as asked for; 0 where nothing tells them apart. *reported says which. */
void lumi_bracket_exposures(const struct lumi_source *source, const struct lumi_brackets *brackets, double *exposures,
                            bool *reported);

#endif
