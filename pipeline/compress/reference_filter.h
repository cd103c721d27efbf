/* Reference images without their noise. Every tile of a cluster is predicted from its reference image, whose noise is
 * coded once there and once more, to be taken away, in each tile. So what is coded is not the view but an average of
 * what its neighbours show of the same things, found block by block. */
#ifndef LUMI_PIPELINE_COMPRESS_REFERENCE_FILTER_H
#define LUMI_PIPELINE_COMPRESS_REFERENCE_FILTER_H

#include "proto/base/result.h"
#include "proto/lightfield/tile_window.h"

#define LUMI_FILTER_OTHERS_MAX 24

struct lumi_filter_view {
    const struct lumi_yuv *image;   /* of the reference's size */
    const struct lumi_shift *seeds; /* where to look for each tile of the reference; NULL: in its own place */
};

/* How much the view's own pixels weigh against another view's, for tiles of this quantizer: the finer the tiles, the
 * more is lost where the reference view, which has no tiles, differs from its picture. 0: do not filter at all. */
int lumi_filter_own_weight(int quantizer);

/* Averages `count` (at most LUMI_FILTER_OTHERS_MAX) other views into a view. What does not match, by more than the
 * best quarter of them do, is left out. `range`: of the search, pixels around the seeds. *filtered is created. */
int lumi_reference_filter(const struct lumi_yuv *reference, const struct lumi_filter_view *others, int count, int range,
                          int own_weight, struct lumi_yuv *filtered, struct lumi_error *error);

#endif
