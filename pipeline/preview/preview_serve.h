/* The preview as a program that is asked for pictures: lines in, pictures out (docs/preview.md, "Protocol"). */
#ifndef LUMI_PIPELINE_PREVIEW_PREVIEW_SERVE_H
#define LUMI_PIPELINE_PREVIEW_PREVIEW_SERVE_H

#include "pipeline/preview/preview.h"

/* Answers what comes on `in` on `out` and works on the views between; returns 0 when `in` ends, an error when the
 * capture is gone or the answers cannot be written. Lines that are none are told by `skipped` of the options. */
int lumi_preview_serve(struct lumi_preview *preview, const struct lumi_preview_options *options, int in, int out,
                       struct lumi_error *error);

/* This process from now on: what is left of the processor and the disk, at most so many bytes of memory more than now,
 * and the first to go where memory runs out. What the system does not grant is done without. */
void lumi_preview_humble(size_t memory_bytes);

#endif
