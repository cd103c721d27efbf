/* Matching the features of two pictures: inside the band that a prior leaves, or freely. */
#ifndef LUMI_PIPELINE_CALIBRATE_PAIR_MATCH_H
#define LUMI_PIPELINE_CALIBRATE_PAIR_MATCH_H

#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"
#include "pipeline/calibrate/two_view.h"

/* A picture's features in its camera's frame. */
struct lumi_sighted {
    struct lumi_features features;
    struct lumi_vec3 *ways; /* unit length */
    struct lumi_vec3 *tops; /* of their orientations, unit length, across the way */
    float *sizes;           /* their scale, radians */
    double pixel;           /* of the picture's middle, radians */
};

/* Takes the features over. A feature where the lens sees nothing has a way of no length. */
int lumi_sighted_init(struct lumi_sighted *sighted, const struct lumi_lens *lens, struct lumi_features *features,
                      struct lumi_error *error);
void lumi_sighted_finish(struct lumi_sighted *sighted);

/* How far a prior may be wrong, and what may be before the cameras. */
struct lumi_band {
    double rotation; /* radians, whatever the distance */
    double shift;    /* of the second place, in baselines */
    double parallax; /* of the nearest thing, baselines over its distance */
};

/* Whether a match can be under the motion and its band. */
bool lumi_band_holds(const struct lumi_motion_between *motion, const struct lumi_band *band,
                     const struct lumi_sight *sight);

struct lumi_matches {
    int count;
    struct lumi_match *items;  /* owned */
    struct lumi_sight *sights; /* owned */
};
void lumi_matches_finish(struct lumi_matches *matches);

/* The best in the band, from either side, much better than the second best (`ratio`, of distances). motion NULL: any,
 * of the first `most` of either. LUMI_ERR_NOMEM. */
int lumi_match_features(const struct lumi_sighted *first, const struct lumi_sighted *second,
                        const struct lumi_motion_between *motion, const struct lumi_band *band, double ratio, int most,
                        struct lumi_matches *matches);

/* Of the matches only those whose error is at most `most`, radians. */
void lumi_matches_keep(struct lumi_matches *matches, const struct lumi_motion_between *motion, double most);

#endif
