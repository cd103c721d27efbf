/* The stage `subsample` (Overbeck et al. 2018, section 7.1, "Subsampling" and "Synthesis"): which photographs become
 * views of the field, where views that nobody took are wanted, and which photographs may show the rig's stand. It ends
 * the run's first phase with a list of places. docs/poles.md tells the rules. */
#ifndef LUMI_PIPELINE_SUBSAMPLE_SUBSAMPLE_H
#define LUMI_PIPELINE_SUBSAMPLE_SUBSAMPLE_H

#include "pipeline/run/run.h"

extern const struct lumi_stage lumi_stage_subsample;

#endif
