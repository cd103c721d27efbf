/* Masks of the rig itself: what stays where it is in a camera's picture while the rig turns is part of the rig. The
 * stage "masks" finds it, one ".masks" file for the capture; masks drawn by hand are taken as well. */
#ifndef LUMI_PIPELINE_CALIBRATE_RIG_MASK_H
#define LUMI_PIPELINE_CALIBRATE_RIG_MASK_H

#include "pipeline/run/run.h"
#include "proto/base/raster.h"

/* The mask of frame `index`: 8-bit grey of its picture's size, 255 the world, 0 the rig. Its camera's from the stage,
 * and 0 too where the folder `run->parameters.masks` holds a picture of the camera's or the frame's name that is black
 * there. *raster stays all zero where nothing is masked. Release with lumi_raster_finish. */
int lumi_rig_mask_read(const struct lumi_run *run, int index, struct lumi_raster *raster, struct lumi_error *error);
/* Its part in a key: the stage's output and the drawings' bytes. */
int lumi_rig_mask_key(struct lumi_key *key, const struct lumi_run *run, int index, struct lumi_error *error);

extern const struct lumi_stage lumi_stage_masks;

#endif
