/* Colours of a camera as those of the display, by an ICC profile (through Little CMS). */
#ifndef LUMI_PIPELINE_COLOR_ICC_H
#define LUMI_PIPELINE_COLOR_ICC_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

struct lumi_icc;

/* From a profile of an RGB device, in memory, to linear light of the sRGB primaries (white 1, relative colorimetric).
 * `linear`: the pictures are linear in light (merged brackets, OpenEXR, raw), of which only the profile's matrix can
 * make sense; otherwise the profile is given what the files hold, curves and all. `name` stands for it in errors.
 * LUMI_ERR_FORMAT: no profile; LUMI_ERR_UNSUPPORTED: of something else than RGB, or linear and without a matrix. */
int lumi_icc_create(const void *data, size_t size, const char *name, bool linear, struct lumi_icc **icc,
                    struct lumi_error *error);
void lumi_icc_destroy(struct lumi_icc *icc);

/* `count` pixels of three floats, linear as the pipeline has them, in place. Any number of threads. */
void lumi_icc_apply(const struct lumi_icc *icc, float *pixels, size_t count);

#endif
