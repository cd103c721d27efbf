/* What a rig brings into its own pictures. */
#ifndef LUMI_SIM_TRIPOD_H
#define LUMI_SIM_TRIPOD_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "sim/scene.h"

/* A tripod under cameras on a sphere of this radius: a head and a column below the sphere, three legs to the floor of
 * the places at z = −1.2. To be added before the scene is committed. */
void sim_stand_add(struct sim_scene *scene, double radius);

/* The arm's end as a camera sees it: a dark rod that leaves downwards from below the lens. It stands still in the
 * camera's frame, so it is drawn over the picture (linear light). Pixels it covers more than half are the arm's. */
void sim_arm_draw(const struct lumi_lens *lens, struct lumi_raster *picture);

#endif
