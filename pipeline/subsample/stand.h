/* The room that the rig's stand takes up: about the axis, from the rig down to the floor, widening downwards. */
#ifndef LUMI_PIPELINE_SUBSAMPLE_STAND_H
#define LUMI_PIPELINE_SUBSAMPLE_STAND_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"

#include <stdbool.h>

/* Of a stand whose size nobody told: how far its feet are from the axis, metres. */
#define LUMI_STAND_RADIUS 0.8
/* Of its head, below the cameras: how far it may reach from the axis, and how far below them it is at least, metres. It
 * may be wider than the circle that the lowest cameras go round. */
#define LUMI_STAND_HEAD 0.09
#define LUMI_STAND_CLEAR 0.03
/* How far below the rig a floor is looked for. */
#define LUMI_STAND_REACH 4.0

struct lumi_stand {
    struct lumi_vec3 centre; /* of the rig's sphere */
    double top, bottom;      /* heights: from where it widens, and where it ends (the floor) */
    double narrow, wide;     /* radius at and above `top`, and at `bottom` */
    double head;             /* radius LUMI_STAND_CLEAR below `top` and lower, as far as the head goes */
};

/* `gap`: of the lower pole (lumi_pole_gap); `radius` at the floor, metres, ≤ 0: LUMI_STAND_RADIUS; `floor`: its height.
 * False: the rig leaves no room for a stand. */
bool lumi_stand_place(struct lumi_vec3 centre, double sphere, double gap, double radius, double floor,
                      struct lumi_stand *stand);

/* Inside, of what is above the floor by `margin`. */
bool lumi_stand_holds(const struct lumi_stand *stand, struct lumi_vec3 point, double margin);

/* Whether a camera may see any of it. */
bool lumi_stand_seen(const struct lumi_stand *stand, const struct lumi_lens *lens, const struct lumi_pose *pose);

#endif
