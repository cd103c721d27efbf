/* How densely centres of projection lie on their sphere, and which of them an even density keeps. */
#ifndef LUMI_PIPELINE_SUBSAMPLE_SPREAD_H
#define LUMI_PIPELINE_SUBSAMPLE_SPREAD_H

#include "proto/base/geometry.h"

#include <stdbool.h>

/* Distances of neighbours along the circles of latitude and across them, metres; both 0: there is no telling. */
struct lumi_spacing {
    double east, north;
};

/* The spacing at the equator of the sphere about `centre` whose axis is +Z: what a rig that turns about the axis does
 * everywhere but that rows close up towards its poles. Medians, so single centres that are astray do not count. */
struct lumi_spacing lumi_spacing_measure(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre);

/* Keeps as many as leave the spacing even: two that are kept are nowhere nearer than 0.7 of it, what is dropped lies
 * nearer than that to one that is kept. `density`: kept centres an area, as a share of the equator's. Goes from the
 * equator to the poles, so that the rows there stay whole; depends on the points alone, not on their order. */
void lumi_spread_keep(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre, struct lumi_spacing spacing,
                      double density, bool *kept);

#endif
