/* Bundle adjustment: poses, lenses and points that agree best with where points were seen (Triggs, McLauchlan, Hartley,
 * Fitzgibbon: Bundle Adjustment – A Modern Synthesis, 2000).
 *
 * 1. A point is a direction and an inverse distance from an anchor (the middle of the cameras that see it), so that
 *    what is far or at infinity is as good as what is near.
 * 2. Nothing here knows a rig: what it knows of poses comes in as a prior of each.
 * 3. One thread, no chance: the same input gives the same bytes. */
#ifndef LUMI_PIPELINE_CALIBRATE_BUNDLE_H
#define LUMI_PIPELINE_CALIBRATE_BUNDLE_H

#include "pipeline/calibrate/lens_slope.h"
#include "proto/base/geometry.h"
#include "proto/base/result.h"

#include <stdbool.h>

struct lumi_bundle_lens {
    struct lumi_lens lens;           /* BROWN or FISHEYE */
    double sigma[LUMI_LENS_NUMBERS]; /* one standard deviation of what is known of each number; 0: it stays */
    double block[LUMI_LENS_NUMBERS]; /* while solving: how far each is from `lens`, in sigmas */
};

struct lumi_bundle_camera {
    int lens;
    bool used; /* otherwise its observations count for nothing, and its pose stays */
    struct lumi_pose pose;
    struct lumi_pose prior;
    double prior_position[3]; /* one standard deviation along each of the prior's axes, metres; 0: no prior */
    double prior_rotation;    /* about each axis, radians; 0: no prior */
    double block[6];          /* while solving: a rotation after pose.r, and the place */
};

struct lumi_bundle_point {
    struct lumi_vec3 anchor, direction, e1, e2; /* at anchor + (direction + a e1 + b e2) / inverse distance */
    double block[3];                            /* a, b, inverse distance (1/m) */
    bool used;
};

struct lumi_bundle_observation {
    int camera, point;
    double x, y, sigma; /* pixels */
    double residual[2]; /* pixels, found minus seen; after lumi_bundle_residuals */
    bool outlier;
};

struct lumi_bundle {
    int lens_count, camera_count, point_count, observation_count;
    struct lumi_bundle_lens *lenses;
    struct lumi_bundle_camera *cameras;
    struct lumi_bundle_point *points;
    struct lumi_bundle_observation *observations; /* those of a point one after the other */
    int *first;                                   /* of each point, and the count at the end */
    /* A rolling shutter: how far the world turns about +Z against the rig while a picture is read, radians, from its
     * first row to its last; a picture's pose is that of its middle row. */
    double shutter, shutter_sigma; /* sigma 0: it stays */
};

struct lumi_bundle_settings {
    bool lenses;      /* are solved for too */
    bool shutter;     /* so is that */
    double loss;      /* from so many sigmas an observation counts less (Cauchy); 0: never */
    int iterations;   /* at most */
    double tolerance; /* relative change of the cost that ends it; 0: 1e-6 */
};

struct lumi_bundle_result {
    int iterations;
    double initial_cost, final_cost;
    bool converged;
};

/* Arrays of these sizes, all zero but e1, …; LUMI_ERR_NOMEM. */
int lumi_bundle_init(struct lumi_bundle *bundle, int lenses, int cameras, int points, int observations,
                     struct lumi_error *error);
void lumi_bundle_finish(struct lumi_bundle *bundle);

/* Every point anew from its observations that are no outliers in cameras that are used, by least squares over the
 * directions. A point is used when at least `fewest` such see it, from places that are not all the same, none of them
 * from behind. */
void lumi_bundle_triangulate(struct lumi_bundle *bundle, int fewest);

int lumi_bundle_solve(struct lumi_bundle *bundle, const struct lumi_bundle_settings *settings,
                      struct lumi_bundle_result *result, struct lumi_error *error);

/* Fills residuals; NAN where a point is not used or not imaged. */
void lumi_bundle_residuals(struct lumi_bundle *bundle);
/* Marks as outliers those further than `sigmas` of their own, and takes back those that are not; a camera's that is
 * not used are not touched. Returns how many are marked. Residuals must be fresh. */
int lumi_bundle_reject(struct lumi_bundle *bundle, double sigmas);
/* Robust spread of the residuals in units of their sigmas (1 where the sigmas are right): from the median of their
 * lengths over cameras that are used. */
double lumi_bundle_spread(const struct lumi_bundle *bundle);

/* Whether an observation takes part. */
bool lumi_bundle_counts(const struct lumi_bundle *bundle, int observation);
/* Where a point is: its homogeneous place: direction from the anchor, and inverse distance. */
struct lumi_vec3 lumi_bundle_ray(const struct lumi_bundle_point *point);

#endif
