/* Pictures for people: differences, and contact sheets that put truth, rendering and difference side by side. */
#ifndef LUMI_PIPELINE_EVALUATE_SHEET_H
#define LUMI_PIPELINE_EVALUATE_SHEET_H

#include "proto/base/raster.h"
#include "proto/base/result.h"

/* Four times the absolute difference a channel, sRGB values, RGB bytes; black: the same. */
int lumi_difference_picture(const struct lumi_raster *truth, const struct lumi_raster *rendered,
                            struct lumi_raster *difference, struct lumi_error *error);

/* Two views abreast, each as truth, rendering, difference; an all-zero sheet is empty. */
struct lumi_sheet {
    struct lumi_raster *cells; /* three a view, scaled down */
    int count, capacity;
};

int lumi_sheet_add(struct lumi_sheet *sheet, const struct lumi_raster *truth, const struct lumi_raster *rendered,
                   const struct lumi_raster *difference, struct lumi_error *error);
int lumi_sheet_write(const struct lumi_sheet *sheet, const char *path, struct lumi_error *error);
void lumi_sheet_finish(struct lumi_sheet *sheet);

#endif
