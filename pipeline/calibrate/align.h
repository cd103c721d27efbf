/* Two sets of poses of the same cameras laid over one another. */
#ifndef LUMI_PIPELINE_CALIBRATE_ALIGN_H
#define LUMI_PIPELINE_CALIBRATE_ALIGN_H

#include "proto/base/geometry.h"
#include "proto/base/result.h"

/* b = scale · rotation · a + shift */
struct lumi_similarity {
    double scale, rotation[9];
    struct lumi_vec3 shift;
};

/* The similarity that brings the cameras of `from` nearest to those of `to`, in the least-squares sense (Umeyama:
 * Least-Squares Estimation of Transformation Parameters Between Two Point Patterns, 1991): their centres, and for the
 * rotation also the ends of their axes, two mean distances long. LUMI_ERR_FORMAT where the
 * centres do not determine one: fewer than three, or all on a line. */
int lumi_align(int count, const struct lumi_pose *from, const struct lumi_pose *to, struct lumi_similarity *similarity,
               struct lumi_error *error);
/* The same without those far beside what most agree on (more than five robust standard deviations of a position). */
int lumi_align_robust(int count, const struct lumi_pose *from, const struct lumi_pose *to,
                      struct lumi_similarity *similarity, struct lumi_error *error);
void lumi_similarity_apply(const struct lumi_similarity *similarity, const struct lumi_pose *pose,
                           struct lumi_pose *result);

/* How far two sets are apart, camera by camera, `from` after the similarity. */
struct lumi_pose_distance {
    int count;
    double median_m, rms_m, worst_m;
    double median_rotation, rms_rotation, worst_rotation; /* radians */
    int worst, worst_turned;                              /* indices */
};
int lumi_pose_compare(int count, const struct lumi_pose *from, const struct lumi_pose *to,
                      const struct lumi_similarity *similarity, struct lumi_pose_distance *distance,
                      struct lumi_error *error);

#endif
