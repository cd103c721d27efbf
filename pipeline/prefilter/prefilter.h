/* The stage `prefilter` (Overbeck et al. 2018, section 5): the pictures of the field's views, taken anew from the dense
 * light field by cameras as wide as the views' disks. Reads the dense views' pictures and depth and the kept views'
 * meshes; writes an OpenEXR image of run->grid's size (RGB, half floats, linear light). docs/prefilter.md. */
#ifndef LUMI_PIPELINE_PREFILTER_PREFILTER_H
#define LUMI_PIPELINE_PREFILTER_PREFILTER_H

#include "pipeline/prefilter/view_filter.h"
#include "pipeline/run/run.h"

extern const struct lumi_stage lumi_stage_prefilter;

/* For measurements: the same for one kept view with settings of the caller's (base, most, tolerance, seed), as a
 * picture in display's numbers. `state` as the stage's begin made it. */
int lumi_prefilter_image(struct lumi_run *run, void *state, int index, const struct lumi_prefilter_settings *settings,
                         struct lumi_raster *result, struct lumi_prefilter_report *report, struct lumi_error *error);
/* The settings that the run's parameters stand for. */
void lumi_prefilter_settings_of(const struct lumi_run *run, int index, struct lumi_prefilter_settings *settings);

#endif
