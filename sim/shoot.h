/* A capture of a place, as a rig's daemon would have stored it, with true poses or those the rig believes. */
#ifndef LUMI_SIM_SHOOT_H
#define LUMI_SIM_SHOOT_H

#include "sim/takes.h"
#include "sim/truth.h"

/* What is written, beside the capture, of a rig that is not where it believes to be; NULL: not. */
struct sim_shoot_truth {
    const char *poses;   /* a transforms.json */
    const char *capture; /* a second capture: the same pictures with their true poses */
};

/* `takes`: how the pictures are taken; NULL: one good shot each. Brackets are shots of one position; frames of all but
 * the one at 0 stops (else the first) are called NAMEe1, NAMEe2 … Renders every frame of the rig into a new capture at
 * `path`, which appears when it is whole. The metadata say what was simulated and on which surface the cameras are.
 * Depth maps go to output->depth_dir, one NAME.exr a frame, if set. The poses of a rig that is `shaken` are priors. */
int sim_shoot(const struct sim_scene *scene, const char *place, const struct sim_rig *rig,
              const struct sim_output *output, const struct sim_takes *takes, const struct sim_shoot_truth *truth,
              const char *path, struct lumi_error *error);

#endif
