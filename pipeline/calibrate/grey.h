/* A picture's file in grey. */
#ifndef LUMI_PIPELINE_CALIBRATE_GREY_H
#define LUMI_PIPELINE_CALIBRATE_GREY_H

#include "proto/base/result.h"

/* As seen: sRGB-encoded, 0..255 and above. *grey: width × height, released with lumi_free. */
int lumi_grey_read(const char *path, float **grey, int *width, int *height, struct lumi_error *error);

#endif
