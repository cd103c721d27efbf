/* The stages that make depth: "match" (first pass, every image) and "depth" (second pass, which reads the first pass's
 * maps of the neighbours too). Each leaves one OpenEXR file an image with the float channel "W", inverse depth in 1/m
 * on the view's grid. Both read the views of the stage "equiangular". */
#ifndef LUMI_PIPELINE_DEPTH_DEPTH_H
#define LUMI_PIPELINE_DEPTH_DEPTH_H

#include "pipeline/run/run.h"

extern const struct lumi_stage lumi_stage_match;
extern const struct lumi_stage lumi_stage_depth;

#endif
