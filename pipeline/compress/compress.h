/* The stage `compress`: from views, depth maps and meshes to the field. */
#ifndef LUMI_PIPELINE_COMPRESS_COMPRESS_H
#define LUMI_PIPELINE_COMPRESS_COMPRESS_H

#include "pipeline/run/run.h"

/* Reads the stages "equiangular", "depth", "geometry" and "geometry-coarse"; one output, "all.lumi". Beside it lie the
 * coded reference images and clusters, each with a key of its own, so that what was done before a stop is not done
 * again. */
extern const struct lumi_stage lumi_stage_compress;

#endif
