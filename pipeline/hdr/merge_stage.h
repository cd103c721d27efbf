/* The stages `response` and `merge`: brackets as one picture each, in linear light. */
#ifndef LUMI_PIPELINE_HDR_MERGE_STAGE_H
#define LUMI_PIPELINE_HDR_MERGE_STAGE_H

#include "pipeline/run/run.h"

/* Estimates every camera's response from its brackets, where that is asked for: one text file, all cameras. */
extern const struct lumi_stage lumi_stage_response;

/* OpenEXR, RGB, half floats, one file a bracket; 1 is the white of the capture's middle exposure. Beside it NAME.txt
 * says how its shots were used. */
extern const struct lumi_stage lumi_stage_merge;

/* What is to be said about the capture's brackets, a line each ("" for nothing); release with g_free. */
char *lumi_merge_remarks(const struct lumi_run *run);

#endif
