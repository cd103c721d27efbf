/* What is said to `lumi preview --serve`, and how it is answered: lines (docs/preview.md, "Protocol"). */
#ifndef LUMI_PIPELINE_PREVIEW_PREVIEW_LINE_H
#define LUMI_PIPELINE_PREVIEW_PREVIEW_LINE_H

#include "pipeline/preview/preview.h"

#include <stdint.h>

#define LUMI_PREVIEW_LINE_MAX 255

/* "view ID x y z yaw pitch fov width height". LUMI_ERR_FORMAT: it is none; LUMI_ERR_ARG: a number that cannot be, but
 * *id is known. */
int lumi_preview_line_parse(const char *line, uint32_t *id, struct lumi_preview_gaze *gaze, struct lumi_error *error);

#endif
