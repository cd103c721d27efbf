/* What the prefilter of a view reads: the disks of the field and of the dense set, and the dense views whose disks can
 * matter to a view. From places alone, so that a key can be made before anything is there. */
#ifndef LUMI_PIPELINE_PREFILTER_DISK_PLAN_H
#define LUMI_PIPELINE_PREFILTER_DISK_PLAN_H

#include "pipeline/prefilter/view_filter.h"
#include "pipeline/run/run.h"

struct prefilter_plan {
    struct lumi_disk *dense; /* of run->sources, among all of them */
    struct lumi_disk *kept;  /* the same places; all zero where a source is not kept */
};

/* From run's places and disk_scale. Release with prefilter_plan_finish. */
int prefilter_plan_make(const struct lumi_run *run, struct prefilter_plan *plan, struct lumi_error *error);
void prefilter_plan_finish(struct prefilter_plan *plan);

/* Indices of sources that a ray from view `index`'s disk can go through the disk of, within what both picture;
 * ascending. `sources` has room for run->count. Returns how many. */
int prefilter_sources(const struct lumi_run *run, const struct prefilter_plan *plan, int index, int *sources);

/* Whether one of `count` samples (a lattice of each one's rays) goes through a dense view's disk. */
bool prefilter_sees(const struct lumi_prefilter_view *view, const struct lumi_view *dense, uint32_t seed, int count);

#endif
