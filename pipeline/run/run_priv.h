/* What run.c and stage.c share. */
#ifndef LUMI_PIPELINE_RUN_RUN_PRIV_H
#define LUMI_PIPELINE_RUN_RUN_PRIV_H

#include "pipeline/run/run.h"

/* The key of a stage's output, remembered or read from beside it (whatever its extension). False if it is not there. */
bool lumi_run_output_key(const struct lumi_run *run, const char *stage, int index, char *hex);
void lumi_run_remember_key(const struct lumi_run *run, const char *stage, int index, const char *hex);

/* run->kept anew, from the sources' flags. */
void run_list_kept(struct lumi_run *run);

#endif
