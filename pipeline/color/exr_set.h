/* The views of a run as a folder of OpenEXR files, for programs that do the rest themselves. */
#ifndef LUMI_PIPELINE_COLOR_EXR_SET_H
#define LUMI_PIPELINE_COLOR_EXR_SET_H

#include "pipeline/run/run.h"

/* Copies every kept view as it is before the stage `color`, in scene-referred linear light, to FOLDER/NAME.exr, and at
 * last writes FOLDER/transforms.json (docs/color.md): poses in nerfstudio's convention; the lens as a pinhole where it
 * is one, otherwise "camera_model": "LUMISPHERE_TILES" with the tangents at the tiles' edges. The run is placed.
 * LUMI_ERR_NOTFOUND: a view has not been made. */
int lumi_exr_set(const struct lumi_run *run, const char *folder, struct lumi_error *error);

#endif
