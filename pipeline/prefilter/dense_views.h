/* Dense views in memory, kept from image to image: neighbouring images read the same ones. */
#ifndef LUMI_PIPELINE_PREFILTER_DENSE_VIEWS_H
#define LUMI_PIPELINE_PREFILTER_DENSE_VIEWS_H

#include "pipeline/run/run.h"
#include "proto/base/raster.h"

struct prefilter_dense {
    int index;                  /* of the source; −1: none */
    long used;                  /* the shelf's clock */
    struct lumi_raster picture; /* RGB F32 in display's numbers */
    struct lumi_raster depth;   /* inverse depth, F32, finite and not below 0 */
};

struct prefilter_shelf;

struct prefilter_shelf *prefilter_shelf_create(void);
void prefilter_shelf_destroy(struct prefilter_shelf *shelf);

/* Has these views in memory, reading those that are not with all threads; they stay until the next call. Views used
 * longest ago go first where all would take more than 1 GiB. */
int prefilter_shelf_hold(struct prefilter_shelf *shelf, struct lumi_run *run, int count, const int *indices,
                         struct lumi_error *error);
/* One that is held. */
const struct prefilter_dense *prefilter_shelf_view(const struct prefilter_shelf *shelf, int index);

#endif
