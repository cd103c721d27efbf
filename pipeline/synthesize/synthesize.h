/* The stage `synthesize` (Overbeck et al. 2018, section 7.1, "Synthesis"): pictures and depth of views that nobody
 * took, and of photographs with the rig's stand in them. One OpenEXR file a view: R, G, B, linear light, and W, inverse
 * depth in 1/m. docs/poles.md tells the method and its figures. */
#ifndef LUMI_PIPELINE_SYNTHESIZE_SYNTHESIZE_H
#define LUMI_PIPELINE_SYNTHESIZE_SYNTHESIZE_H

#include "pipeline/run/run.h"

extern const struct lumi_stage lumi_stage_synthesize;

#endif
