/* Throwing away what stages have made. */
#ifndef LUMI_PIPELINE_ENGINE_CLEAR_WORK_H
#define LUMI_PIPELINE_ENGINE_CLEAR_WORK_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stdint.h>

/* Marks in `chosen` (one a stage, in the order of lumi_stages) the stages named, and all that rest on them; none named:
 * all. LUMI_ERR_ARG: there is no stage of that name. */
int lumi_clear_choose(const char *const *names, bool *chosen, struct lumi_error *error);

/* What would go: folders of the chosen stages that are there, and the bytes in them. */
void lumi_clear_measure(const char *work, const bool *chosen, int *folders, int64_t *bytes);

/* Removes them; where all are chosen, also the record, the tasks' files, and the work folder itself where nothing else
 * lies in it. LUMI_ERR_BUSY: a run is at work there, here or on the cluster. Nothing outside of the work folder goes:
 * links are removed, not followed. */
int lumi_clear_work(const char *work, const bool *chosen, struct lumi_error *error);

#endif
