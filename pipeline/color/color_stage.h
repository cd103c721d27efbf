/* The stages `grade` and `color`: views in the display's colours. docs/color.md. */
#ifndef LUMI_PIPELINE_COLOR_COLOR_STAGE_H
#define LUMI_PIPELINE_COLOR_COLOR_STAGE_H

#include "pipeline/run/run.h"

/* What is done to all views alike, from how much light they all show: one small text file. */
extern const struct lumi_stage lumi_stage_grade;

/* OpenEXR, RGB, half floats, one file a view: linear light of the sRGB primaries, 1 is the display's white. */
extern const struct lumi_stage lumi_stage_color;

#endif
