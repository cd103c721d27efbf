/* The rig as it is: the few numbers in which it differs from its profile, found from what its cameras saw, or from
 * where they were found to be. All differences are 0 where the profile is right, and its uncertainties are their
 * priors.
 *
 * What no picture can tell is not looked for: a rig that is tilted, turned or larger as a whole. */
#ifndef LUMI_PIPELINE_CALIBRATE_MECHANISM_H
#define LUMI_PIPELINE_CALIBRATE_MECHANISM_H

#include "pipeline/calibrate/bundle.h"
#include "proto/mechanism/rig.h"

/* What may differ in a camera's place and mounting, from its profile; radians and metres. */
enum lumi_mount_number {
    LUMI_MOUNT_ANGLE = 0,
    LUMI_MOUNT_AZIMUTH,
    LUMI_MOUNT_RADIUS,
    LUMI_MOUNT_OFFSET,
    LUMI_MOUNT_PAN,
    LUMI_MOUNT_TILT,
    LUMI_MOUNT_ROLL,
    LUMI_MOUNT_NUMBERS
};
extern const char *const lumi_mount_names[LUMI_MOUNT_NUMBERS];

/* And in the whole: where the arm's pivot stands beside the axis, and how the platform leans, both in the platform's
 * frame (+X along its direction). */
enum lumi_platform_number {
    LUMI_PLATFORM_X = 0,
    LUMI_PLATFORM_Y,
    LUMI_PLATFORM_LEAN_X,
    LUMI_PLATFORM_LEAN_Y,
    LUMI_PLATFORM_NUMBERS
};
extern const char *const lumi_platform_names[LUMI_PLATFORM_NUMBERS];

struct lumi_mechanism_frame {
    int camera;              /* the rig's; −1: not of the rig */
    int shot;                /* all cameras of a firing have the same */
    double turn_angle, drop; /* as the profile has them, or as they were measured */
    double turns;            /* into the sweep */
};

struct lumi_mechanism {
    struct lumi_rig rig;
    int frame_count, shot_count, knot_count;
    struct lumi_mechanism_frame *frames; /* one a camera of the bundle */
    double mount[LUMI_RIG_CAMERAS][LUMI_MOUNT_NUMBERS];
    double platform[LUMI_PLATFORM_NUMBERS];
    double *turn; /* a shot: the platform's angle, radians */
    double *drop; /* a knot: the arm's fall, radians; between knots it changes evenly; knot_step turns apart */
    double knot_step;
    /* Standard deviations of the above; of what is not known better than the profile has it, the profile's. */
    double mount_sigma[LUMI_RIG_CAMERAS][LUMI_MOUNT_NUMBERS];
    double platform_sigma[LUMI_PLATFORM_NUMBERS];
    /* By how much the cameras are beside where the mechanism has them: robust standard deviations of one axis. */
    double position_spread, rotation_spread;
};

int lumi_mechanism_init(struct lumi_mechanism *mechanism, const struct lumi_rig *rig, int frames, int shots,
                        struct lumi_error *error);
void lumi_mechanism_finish(struct lumi_mechanism *mechanism);
/* Back to the profile. */
void lumi_mechanism_reset(struct lumi_mechanism *mechanism);

/* Where the mechanism, as found, has frame `frame`; it must be of the rig. */
void lumi_mechanism_pose(const struct lumi_mechanism *mechanism, int frame, struct lumi_pose *pose);

/* The mechanism's numbers, and the bundle's points, from what was seen; frame i is the bundle's camera i. Poses of all
 * frames of the rig, used or not, are then the mechanism's. */
int lumi_mechanism_solve(struct lumi_mechanism *mechanism, struct lumi_bundle *bundle, double loss, int iterations,
                         struct lumi_error *error);
/* The mechanism's numbers from the bundle's poses (of cameras that are used), and how far these are beside. Poses stay
 * as they are. */
int lumi_mechanism_fit(struct lumi_mechanism *mechanism, const struct lumi_bundle *bundle, struct lumi_error *error);

#endif
