/* The local engine: as many images at once as this computer's cores and memory allow. */
#ifndef LUMI_PIPELINE_ENGINE_LOCAL_H
#define LUMI_PIPELINE_ENGINE_LOCAL_H

#include "pipeline/engine/resources.h"
#include "pipeline/run/run.h"

/* What one image in work holds: the stage's measured bytes a pixel times the larger of a source and a view. 0: the
 * stage states nothing. */
int64_t lumi_engine_image_bytes(const struct lumi_run *run, const struct lumi_stage *stage);

/* Threads for a stage: `threads` (0: resources->cores), fewer where so many images would not fit into nine tenths of
 * the memory that is left; never under 1. */
int lumi_engine_threads(const struct lumi_resources *resources, int64_t image_bytes, int threads);

/* Lets the run ask before every stage how many images to make at once (run->parallel), and sets run->threads. `say` is
 * told in one line where memory or an allocation leaves fewer than there are cores; may be NULL. */
void lumi_engine_use_local(struct lumi_run *run, void (*say)(const char *line));

#endif
