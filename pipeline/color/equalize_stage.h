/* The stage `equalize`: how bright every picture is beside the others. docs/color.md. */
#ifndef LUMI_PIPELINE_COLOR_EQUALIZE_STAGE_H
#define LUMI_PIPELINE_COLOR_EQUALIZE_STAGE_H

#include "pipeline/run/run.h"

/* One JSON file for all (pipeline/equiangular/gains.h), from the matches of the stages `features` and `pairs`; beside
 * it report.txt, for a person. */
extern const struct lumi_stage lumi_stage_equalize;

#endif
