/* The images of a capture as the pipeline sees them. */
#ifndef LUMI_PIPELINE_RUN_SOURCES_H
#define LUMI_PIPELINE_RUN_SOURCES_H

#include "pipeline/run/run.h"

/* Fills run->sources and run->count from run->capture: the frames that have a pose and are not rejected, in the order
 * of the positions, brackets as one; what is missing; and run->rig. LUMI_ERR_FORMAT if there is none. */
int lumi_sources_load(struct lumi_run *run, struct lumi_error *error);

/* What the parameters say of the rig (backwards, exchange), done to the poses. LUMI_ERR_ARG where they are not those of
 * one. */
int lumi_sources_mend(struct lumi_run *run, struct lumi_error *error);

/* Releases what a source owns. */
void sources_free(struct lumi_source *source);

#endif
