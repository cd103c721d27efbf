/* The light that falls on a rig's camera while its shutter is open and the platform turns. */
#ifndef LUMI_SIM_EXPOSURE_H
#define LUMI_SIM_EXPOSURE_H

#include "proto/base/raster.h"
#include "proto/mechanism/rig.h"
#include "sim/scene.h"

struct sim_moment {
    double angle, drop;           /* of platform and arm at the exposure's middle, radians */
    double moved;                 /* radians that the platform turns meanwhile; 0: it stands */
    double askew;                 /* radians that somebody has turned the camera aside, to its right */
    const struct lumi_pose *pose; /* of the camera at the exposure's middle, where it is not what the rig says; NULL */
};

/* Linear RGB, F32, created here: the mean of what is seen on the way, at most nine pictures, one for every half pixel
 * of smear. `threads` 0: as many as there are. */
int sim_exposure_render(const struct sim_scene *scene, const struct lumi_rig *rig, int camera,
                        const struct sim_moment *moment, int threads, struct lumi_raster *picture,
                        struct lumi_error *error);

#endif
