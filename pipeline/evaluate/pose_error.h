/* Poses that were found, against the true ones. */
#ifndef LUMI_PIPELINE_EVALUATE_POSE_ERROR_H
#define LUMI_PIPELINE_EVALUATE_POSE_ERROR_H

#include "pipeline/calibrate/align.h"

#include <stddef.h>

/* Poses by name. */
struct lumi_pose_set {
    int count;
    char **names; /* of the pictures, without folder and extension */
    struct lumi_pose *poses;
};
/* From a work folder (what calibration left there), a places file (frames that are used), or what can be imported: a
 * transforms.json, a COLMAP model's folder. */
int lumi_pose_set_read(const char *path, struct lumi_pose_set *set, struct lumi_error *error);
void lumi_pose_set_finish(struct lumi_pose_set *set);

/* Brings poses from the world of the true ones into that of those that were found, by the similarity that is best for
 * the pictures that both sets name: what is seen from a true place is compared with what a calibrated field shows
 * there. `poses`: `count` of them, `stride` bytes from one to the next. */
int lumi_pose_set_align(const struct lumi_pose_set *truth, const struct lumi_pose_set *found, struct lumi_pose *poses,
                        size_t stride, int count, struct lumi_error *error);

/* One picture's; `name` is owned. */
struct lumi_pose_off {
    char *name;
    double position, rotation; /* metres, radians */
};

struct lumi_pose_error {
    int truths; /* pictures that have a true pose; distance.count of them were found */
    double scale;
    struct lumi_pose_distance distance; /* after the best similarity */
    struct lumi_pose_off *off;          /* distance.count of them, the furthest from its place first */
    char *worst_turned;                 /* name of the one that is turned the most; owned by `off` */
};
/* LUMI_ERR_FORMAT where too few names are in both. */
int lumi_pose_error(const struct lumi_pose_set *found, const struct lumi_pose_set *truth,
                    struct lumi_pose_error *result, struct lumi_error *error);
void lumi_pose_error_finish(struct lumi_pose_error *result);
/* With the `listed` pictures that are furthest off. Free with g_free. */
char *lumi_pose_error_text(const struct lumi_pose_error *result, int listed);
char *lumi_pose_error_json(const struct lumi_pose_error *result, int listed);

#endif
