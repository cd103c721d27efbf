/* The stage `equiangular`: source images as views, in linear light. */
#ifndef LUMI_PIPELINE_EQUIANGULAR_EQUIANGULAR_H
#define LUMI_PIPELINE_EQUIANGULAR_EQUIANGULAR_H

#include "pipeline/run/run.h"

/* Reads each source's frame, writes an OpenEXR image of run->grid's size (RGB, half floats, linear light). */
extern const struct lumi_stage lumi_stage_equiangular;

#endif
