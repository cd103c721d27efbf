/* The stage "calibrate": where every picture was taken, from what the pictures have in common; a places file, and
 * beside it report.txt and report.json. */
#ifndef LUMI_PIPELINE_CALIBRATE_CALIBRATE_STAGE_H
#define LUMI_PIPELINE_CALIBRATE_CALIBRATE_STAGE_H

#include "pipeline/run/run.h"

extern const struct lumi_stage lumi_stage_calibrate;

/* The report's one line, of a calibration that has been made; NULL where there is none. Free with g_free. */
char *lumi_calibrate_line(const struct lumi_run *run);
/* What there is to look at, a line each ("" for nothing); free with g_free. */
char *lumi_calibrate_remarks(const struct lumi_run *run);

#endif
