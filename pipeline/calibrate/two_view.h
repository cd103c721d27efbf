/* Two pictures: what one's motion against the other does to directions, and the motion that suits the most matches. */
#ifndef LUMI_PIPELINE_CALIBRATE_TWO_VIEW_H
#define LUMI_PIPELINE_CALIBRATE_TWO_VIEW_H

#include "proto/base/geometry.h"

#include <stdbool.h>

/* The second camera in the first's frame: a direction b of the second is rotation · b in the first. */
struct lumi_motion_between {
    double rotation[9];
    struct lumi_vec3 direction; /* of the second's place, unit length */
};

/* The same point's direction in either picture, unit length. */
struct lumi_sight {
    struct lumi_vec3 a, b;
};

void lumi_motion_of(const struct lumi_pose *first, const struct lumi_pose *second, struct lumi_motion_between *motion,
                    double *baseline);

/* How far a match is from fitting the motion, radians (to first order, as if both directions erred alike: Sampson). */
double lumi_motion_error(const struct lumi_motion_between *motion, const struct lumi_sight *sight);

/* Improves a motion by least squares that count large errors less and less (Cauchy, from the scale `begin` down to
 * `end`, radians). False where the matches do not determine it. */
bool lumi_motion_refine(struct lumi_motion_between *motion, const struct lumi_sight *sights, int count, double begin,
                        double end);

/* Turns `direction` so that more of the points lie before the cameras than behind them. */
void lumi_motion_face(struct lumi_motion_between *motion, const struct lumi_sight *sights, int count, double most);

/* The motion that suits most matches, knowing nothing before: rotations of pairs of matches (Fischler, Bolles: Random
 * Sample Consensus, 1981) as far as the pictures' distance lets them, then refined from several directions. `parallax`:
 * how far points may differ from a mere rotation; `end`: from a motion; radians. Returns how many fit it; `sights` are
 * put into another order. */
int lumi_motion_find(struct lumi_sight *sights, int count, double parallax, double end,
                     struct lumi_motion_between *motion);

#endif
