/* A picture of a place through a lens. */
#ifndef LUMI_SIM_CAMERA_H
#define LUMI_SIM_CAMERA_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "sim/scene.h"

/* Linear RGB (F32), each pixel the mean of 2 × 2 rays, of 4 × 4 where those differ. Pixels that the lens does not image
 * are black. `depth` (F32, one channel; may be NULL) gets the distance along the optical axis of what the ray through a
 * pixel's centre meets, INFINITY for the sky, 0 where the lens images nothing. Both are created here. */
int sim_camera_render(const struct sim_scene *scene, const struct lumi_lens *lens, const struct lumi_pose *pose,
                      int threads, struct lumi_raster *color, struct lumi_raster *depth, struct lumi_error *error);

#endif
