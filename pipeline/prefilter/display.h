/* Pictures between linear light and the numbers that are shown (sRGB's transfer function, continued above white): what
 * the prefilter blends, as the renderer does. */
#ifndef LUMI_PIPELINE_PREFILTER_DISPLAY_H
#define LUMI_PIPELINE_PREFILTER_DISPLAY_H

#include "proto/base/raster.h"

/* In place, F32, any channels; tables that follow the curves to a millionth. What is not a number becomes 0. */
void prefilter_to_display(struct lumi_raster *raster);
void prefilter_to_linear(struct lumi_raster *raster);

#endif
