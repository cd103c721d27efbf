/* Groups of neighbouring views: clusters that share a reference image, and the views that make the coarse level. A
 * bounding volume hierarchy over the centres of projection, split at the middle of the longest side. */
#ifndef LUMI_PIPELINE_COMPRESS_CLUSTER_H
#define LUMI_PIPELINE_COMPRESS_CLUSTER_H

#include "proto/base/geometry.h"
#include "proto/base/result.h"

#define LUMI_COARSE_SHARE 9 /* one view of about so many is in the coarse level */

/* members[first[i] .. first[i + 1]) are the views of cluster i, its reference image (the view nearest their centroid)
 * first, the others ascending. Clusters that follow each other lie side by side. */
struct lumi_clusters {
    int count;
    int *first;   /* count + 1 */
    int *members; /* every view once */
};

/* Clusters of at most `size` views, as even in size as can be. */
int lumi_clusters_make(int view_count, const struct lumi_pose *poses, int size, struct lumi_clusters *clusters,
                       struct lumi_error *error);
void lumi_clusters_finish(struct lumi_clusters *clusters);

/* The views of the coarse level, ascending: the reference images of clusters of LUMI_COARSE_SHARE. *views (transfer
 * full, lumi_free). Every view where there are fewer than 4 · LUMI_COARSE_SHARE: too few would span no surface. */
int lumi_coarse_views(int view_count, const struct lumi_pose *poses, int **views, int *count, struct lumi_error *error);

#endif
