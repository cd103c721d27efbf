/* A rig that is not where it believes to be: true poses beside the nominal ones.
 *
 * 1. What the mechanism gets wrong is the same for every frame of a kind (systematic); on top comes a random error a
 *    frame, in the camera's own frame, normally distributed along and about each axis.
 * 2. Both are functions of the seed and the frame's place in the rig alone.
 * 3. Of the whole, the best similarity is no error: an axis that is tilted as a whole tilts the world. */
#ifndef LUMI_SIM_ERRORS_H
#define LUMI_SIM_ERRORS_H

#include "sim/rigs.h"

/* Sizes; 0: none. Where it says "a camera" or "a stop" each has a value of its own, normally distributed with this
 * standard deviation; the rest is as large as it says, in a direction or with a sign of the seed's choosing. */
struct sim_mechanism_error {
    double axis;     /* radians: the platform's axis from the vertical */
    double wobble;   /* radians: the platform tilts towards a direction that turns with it, once a turn */
    double centre;   /* metres: the arm's pivot stands beside the axis */
    double radius;   /* metres: all cameras are further out or in, and each a third of it by itself */
    double arm;      /* radians, a camera: its place on the arm */
    double drop;     /* radians: the arm's fall over the sweep is uneven by up to this, and wrong by it at the end */
    double backlash; /* radians: the platform stands behind what is told by up to this, a stop; and once a turn */
    double pan, tilt, roll; /* radians, a camera: its mounting */
};

struct sim_errors {
    double position_m, rotation; /* of a frame, along and about each axis: one standard deviation */
    struct sim_mechanism_error mechanism;
    bool backwards; /* the platform turns the other way than it tells */
    uint64_t seed;
};

/* "yes" (what the rigs' profiles call their uncertainty), or a list: axis=DEGREES,wobble=DEGREES,centre=MM,radius=MM,
 * arm=DEGREES,drop=DEGREES,backlash=DEGREES,pan=DEGREES,tilt=DEGREES,roll=DEGREES; what is not named is 0. */
int sim_errors_parse(const char *text, struct sim_mechanism_error *mechanism, struct lumi_error *error);

/* Moves every view to where it truly is; `prior` of each keeps the nominal pose. The profile's stated uncertainty
 * becomes at least the errors'. Errors of the mechanism want a rig that has one: LUMI_ERR_ARG. */
int sim_errors_apply(const struct sim_errors *errors, struct sim_rig *rig, struct lumi_error *error);

#endif
