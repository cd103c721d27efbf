/* A field's size from a tenth of its images. */
#ifndef LUMI_PIPELINE_COMPRESS_SAMPLE_H
#define LUMI_PIPELINE_COMPRESS_SAMPLE_H

#include "pipeline/run/run.h"

/* Whether a sample is much less than the whole. */
bool compress_sample_pays(int view_count, int cluster_size);

/* Codes a third of the clusters of both levels, of each its reference image and a quarter of the others, and takes the
 * rest to be alike. */
int compress_sample_size(struct lumi_run *run, int quality, long long *size, struct lumi_error *error);

#endif
