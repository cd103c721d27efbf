/* The caps of the sphere that no camera reached, and views laid out there. */
#ifndef LUMI_PIPELINE_SUBSAMPLE_POLES_H
#define LUMI_PIPELINE_SUBSAMPLE_POLES_H

#include "pipeline/subsample/spread.h"

/* How far from the pole the nearest row runs: radians from +Z (or −Z: `bottom`) to the centres that lie there, the
 * median of eight directions round the axis. 0 where the row does not go round, or none is nearer than 60°. */
double lumi_pole_gap(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre, bool bottom);

/* Poses that fill a cap of `gap` radians at the spacing's density: the pole, and circles about it. They look along the
 * radius, outwards (or inwards), the image's top to the north as the rig's cameras stand; at the pole along +X. None
 * where the hole in the middle is hardly larger than those of an even arrangement. Returns their number; *poses is
 * g_free'd by the caller. */
int lumi_pole_poses(struct lumi_vec3 centre, double radius, double gap, bool bottom, bool inward,
                    struct lumi_spacing spacing, double density, struct lumi_pose **poses);

#endif
