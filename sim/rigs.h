/* Where cameras stand: the rigs that can be simulated, and poses for judging.
 *
 * 1. A planar grid lies in the plane y = 0, its middle in the origin, and looks along +Y; rows from the top (+Z) down,
 *    columns from −X to +X. A sphere's rows lie evenly in elevation, from the top down, none at a pole; columns by
 *    azimuth, column 0 at +X, counter-clockwise seen from above.
 * 2. A scale shrinks counts and resolution alike, so that the parallax from one view to the next stays the same number
 *    of pixels. What the cameras cover stays. */
#ifndef LUMI_SIM_RIGS_H
#define LUMI_SIM_RIGS_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/mechanism/rig.h"

#include <stdint.h>

enum sim_lens_kind { SIM_LENS_DEFAULT, SIM_LENS_PINHOLE, SIM_LENS_BROWN, SIM_LENS_FISHEYE };

struct sim_rig_options {
    double scale;            /* 0 < scale ≤ 1 */
    int width, height;       /* of the pictures, after scaling; 0: the rig's own */
    double fov;              /* horizontal, degrees; 0: the rig's own */
    enum sim_lens_kind lens; /* planar and sphere only */
    bool inward;             /* sphere only: looks at its centre */
};
void sim_rig_options_init(struct sim_rig_options *options);

struct sim_view {
    struct lumi_lens lens;
    struct lumi_pose pose;  /* the true one */
    struct lumi_pose prior; /* what the rig believes; of rigs that are `shaken` only */
    int row, column;
    int camera, position, turn; /* of the rig; 0, the number and 0 where there is no mechanism */
    int64_t step;
    double turn_angle, drop; /* as the rig believes */
};

struct sim_rig {
    struct sim_view *views;
    int count, rows, columns, cameras;
    bool plane;            /* of what the camera centres lie on; otherwise a sphere */
    bool mechanism;        /* `profile` is set */
    double radius;         /* of the sphere, or half of the plane's smaller side */
    double half_x, half_z; /* of the plane */
    bool inward;
    bool shaken; /* views have priors (sim/errors.h) */
    struct lumi_rig profile;
};

/* "arc16", "arc16x2", "bar2", "arc:CAMERASxPOSITIONS:RADIUS" (held by its brake), "planar:ROWSxCOLS:SPACING",
 * "sphere:ROWSxCOLS:RADIUS"; metres. Release with sim_rig_finish. LUMI_ERR_ARG says what is wrong. */
int sim_rig_init(struct sim_rig *rig, const char *text, const struct sim_rig_options *options,
                 struct lumi_error *error);
void sim_rig_finish(struct sim_rig *rig);
/* Appends a view at a pose of the caller's; `rig` may be all zero to begin with. */
int sim_rig_add(struct sim_rig *rig, const struct lumi_lens *lens, const struct lumi_pose *pose,
                struct lumi_error *error);
/* The frames of a capture that a simulation made: their lenses, poses, rows and columns. */
int sim_rig_from_capture(struct sim_rig *rig, const char *path, struct lumi_error *error);

/* `count` views that a light field from this rig should be able to show: eyes within `volume` metres of the centre (0:
 * 0.6 of the radius), or inside the grid; directions up to 45° above and below the horizon, or 8° off straight ahead.
 */
struct sim_random_options {
    int count;
    int width, height;   /* 0: 4 by 3, in the middle as many pixels a radian as the rig's own pictures have */
    double fov, volume;  /* degrees, metres */
    double eye_distance; /* metres; above 0 the second view is the right eye of the first and comes on top of `count` */
    uint64_t seed;
};
int sim_rig_random(const struct sim_rig *around, const struct sim_random_options *options, struct sim_rig *result,
                   struct lumi_error *error);

#endif
