/* The stages as a graph, and the run over all of them: from a capture to a field. */
#ifndef LUMI_PIPELINE_GRAPH_GRAPH_H
#define LUMI_PIPELINE_GRAPH_GRAPH_H

#include "pipeline/run/run.h"

/* The stages there are, in an order that can be run. NULL-terminated. */
extern const struct lumi_stage *const lumi_stages[];

const struct lumi_stage *lumi_stage_by_name(const char *name);

/* Opens a run. What the stages of the second phase share, the views' grid and the surface the centres lie on, is chosen
 * when it is placed. Arguments as lumi_run_open. */
int lumi_graph_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                    enum lumi_run_use use, struct lumi_run **run, struct lumi_error *error);

/* The stages have two phases (run.h). Before a stage of the second one is run or counted, the run must be placed;
 * lumi_graph_open does so where nothing of the first phase is wanted, lumi_graph_process between the two.
 * lumi_graph_prepare: as far as `stage` wants it. LUMI_ERR_NOTFOUND: a stage of the first phase has not been run. */
int lumi_graph_place(struct lumi_run *run, struct lumi_error *error);
int lumi_graph_prepare(struct lumi_run *run, const struct lumi_stage *stage, struct lumi_error *error);

/* Called before and (with done true) after every stage; skipped: outputs that were there already. May be NULL. */
typedef void (*lumi_graph_report)(const struct lumi_stage *stage, bool done, int outputs, int skipped);

/* Runs every stage and leaves the field at `output` (written under a temporary name and renamed). */
int lumi_graph_process(struct lumi_run *run, const char *output, lumi_graph_report report, struct lumi_error *error);

#endif
