/* From step and turn to the pose of every camera. */
#include "proto/mechanism/kinematics.h"

#include <math.h>

double lumi_rig_steps_per_turn(const struct lumi_rig *rig)
{
    return (double)rig->motor_steps * rig->microsteps * rig->gear_motor / rig->gear_platform;
}

double lumi_rig_step_turns(const struct lumi_rig *rig, int64_t step)
{
    return (double)step / lumi_rig_steps_per_turn(rig);
}

int64_t lumi_rig_position_step(const struct lumi_rig *rig, int position)
{
    /* In whole numbers: the products stay below 2^52 for every rig that lumi_rig_check lets through. */
    int64_t steps = (int64_t)rig->motor_steps * rig->microsteps * rig->gear_motor;
    int64_t parts = (int64_t)rig->gear_platform * rig->positions;

    return (2 * steps * position + parts) / (2 * parts);
}

double lumi_rig_turn_angle(const struct lumi_rig *rig, double turns)
{
    return rig->index + rig->direction * turns * 2 * LUMI_PI;
}

/* Length of the straight string between its rod and its hold at an arm angle, by the law of cosines. */
static double straight_length(const struct lumi_rig_string *string, double angle)
{
    double h = string->anchor, a = string->hold;

    return sqrt(fmax(h * h + a * a - 2 * h * a * sin(angle), 0));
}

double lumi_rig_drop(const struct lumi_rig *rig, double turns)
{
    const struct lumi_rig_string *string = &rig->string;

    if (string->held)
        return 0;
    if (string->run == LUMI_RIG_RUN_ARC)
        return fmin(turns * string->per_turn, string->length) / string->hold;

    /* sin(angle) = (h² + a² − s²) / (2 h a); the hold falls from hold_angle towards straight down. */
    double h = string->anchor, a = string->hold;
    double s = fmax(fmin(straight_length(string, string->hold_angle) + turns * string->per_turn, string->length), 0);
    double sine = (h * h + a * a - s * s) / (2 * h * a);
    return string->hold_angle - asin(fmax(-1, fmin(1, sine)));
}

double lumi_rig_drop_turns(const struct lumi_rig *rig, double drop)
{
    const struct lumi_rig_string *string = &rig->string;

    if (string->held)
        return 0;
    if (string->run == LUMI_RIG_RUN_ARC)
        return drop * string->hold / string->per_turn;
    return (straight_length(string, string->hold_angle - drop) - straight_length(string, string->hold_angle)) /
           string->per_turn;
}

void lumi_rig_camera_pose_at(const struct lumi_rig *rig, int camera, double turn_angle, double drop,
                             struct lumi_pose *pose)
{
    const struct lumi_rig_camera *c = &rig->cameras[camera];
    double a = c->angle - drop, heading = turn_angle + c->azimuth;
    double ca = cos(a), sa = sin(a), ch = cos(heading), sh = sin(heading);
    struct lumi_vec3 forward = lumi_vec3(ca * ch, ca * sh, sa);
    struct lumi_vec3 rising = lumi_vec3(-sa * ch, -sa * sh, ca); /* d forward / d angle */
    struct lumi_vec3 right = lumi_cross(forward, rising);
    const double nominal[9] = {right.x,   -rising.x, forward.x, right.y,  -rising.y,
                               forward.y, right.z,   -rising.z, forward.z};
    double cr = cos(c->roll), sr = sin(c->roll), cp = cos(c->pan), sp = sin(c->pan);
    double ct = cos(c->tilt), st = sin(c->tilt);
    /* Camera axes in the nominal frame: roll about z, then pan about y (positive turns right), then tilt about x. */
    const double roll[9] = {cr, -sr, 0, sr, cr, 0, 0, 0, 1};
    const double pan[9] = {cp, 0, sp, 0, 1, 0, -sp, 0, cp};
    const double tilt[9] = {1, 0, 0, 0, ct, -st, 0, st, ct};
    double mount[9], turned[9];

    lumi_rotation_multiply(roll, pan, turned);
    lumi_rotation_multiply(turned, tilt, mount);
    lumi_rotation_multiply(nominal, mount, pose->r);
    pose->t = lumi_add(lumi_scale(forward, c->radius), lumi_scale(right, c->offset_m));
}

void lumi_rig_camera_pose(const struct lumi_rig *rig, int camera, double turns, struct lumi_pose *pose)
{
    lumi_rig_camera_pose_at(rig, camera, lumi_rig_turn_angle(rig, turns), lumi_rig_drop(rig, turns), pose);
}

int lumi_rig_rows(const struct lumi_rig *rig)
{
    return rig->camera_count * rig->turns;
}

/* Height, as a share of the radius, at the middle of a turn: what orders the rows. */
static double row_height(const struct lumi_rig *rig, int camera, int turn)
{
    return sin(rig->cameras[camera].angle - lumi_rig_drop(rig, turn + 0.5));
}

int lumi_rig_row(const struct lumi_rig *rig, int camera, int turn)
{
    double height = row_height(rig, camera, turn);
    int above = 0;

    for (int t = 0; t < rig->turns; t++)
        for (int c = 0; c < rig->camera_count; c++) {
            double other = row_height(rig, c, t);
            if (other > height || (other == height && (t < turn || (t == turn && c < camera))))
                above++;
        }
    return above;
}

int lumi_rig_column(const struct lumi_rig *rig, int camera, int position)
{
    const struct lumi_rig_camera *c = &rig->cameras[camera];
    double turns = (double)(position % rig->positions) / rig->positions;
    double heading = lumi_rig_turn_angle(rig, turns) + c->azimuth + (cos(c->angle) < 0 ? LUMI_PI : 0);
    /* A little more than a half, so that a camera midway between two columns always falls on the same side. */
    int64_t column = (int64_t)floor(heading / (2 * LUMI_PI) * rig->positions + 0.5 + 1e-6) % rig->positions;

    return (int)(column < 0 ? column + rig->positions : column);
}
