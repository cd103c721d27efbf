/* Which rigs there cannot be. Also linked into firmware: no stdio. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/rig_priv.h"

#include <math.h>
#include <string.h>

bool rig_name_ok(const char *name)
{
    size_t length = strnlen(name, LUMI_RIG_NAME);

    if (length == 0 || length == LUMI_RIG_NAME || name[0] == '.')
        return false;
    for (const char *c = name; *c; c++)
        if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || *c == '.' ||
              *c == '_' || *c == '-'))
            return false;
    return true;
}

double rig_string_start(const struct lumi_rig *rig)
{
    double h = rig->string.anchor, a = rig->string.hold;

    if (rig->string.run != LUMI_RIG_RUN_STRAIGHT)
        return 0;
    return sqrt(fmax(h * h + a * a - 2 * h * a * sin(rig->string.hold_angle), 0));
}

static int check_drive(const struct lumi_rig *rig, struct lumi_error *error)
{
    if (rig->motor_steps == 0 || rig->microsteps == 0 || rig->gear_motor == 0 || rig->gear_platform == 0)
        RIG_REFUSE("a ratio of the drive is zero");
    if (rig->motor_steps < 0 || rig->motor_steps > 10000 || rig->microsteps < 0 || rig->microsteps > 256 ||
        rig->gear_motor < 0 || rig->gear_motor > 10000 || rig->gear_platform < 0 || rig->gear_platform > 10000)
        RIG_REFUSE("a ratio of the drive is out of range");
    if (rig->direction != 1 && rig->direction != -1)
        RIG_REFUSE("direction %d: 1 or -1 wanted", rig->direction);
    if (!rig_within(rig->index, -2 * LUMI_PI, 2 * LUMI_PI))
        RIG_REFUSE("the index angle is out of range");
    if (rig->positions < 1 || rig->positions > LUMI_RIG_POSITIONS_MAX)
        RIG_REFUSE("%d positions a turn: 1 to %d wanted", rig->positions, LUMI_RIG_POSITIONS_MAX);
    if (rig->turns < 1 || rig->turns > LUMI_RIG_TURNS_MAX)
        RIG_REFUSE("%d turns: 1 to %d wanted", rig->turns, LUMI_RIG_TURNS_MAX);
    if (lumi_rig_steps_per_turn(rig) < rig->positions)
        RIG_REFUSE("%g steps a turn cannot reach %d positions", lumi_rig_steps_per_turn(rig), rig->positions);
    return LUMI_OK;
}

static int check_string(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_string *s = &rig->string;

    if (s->run != LUMI_RIG_RUN_ARC && s->run != LUMI_RIG_RUN_STRAIGHT)
        RIG_REFUSE("the string's run is neither arc nor straight");
    if (!rig_within(s->length, 1e-3, 100) || !rig_within(s->per_turn, 1e-4, 10) || !rig_within(s->hold, 1e-3, 10))
        RIG_REFUSE("a length of the string is out of range");
    if (s->hold > s->length)
        RIG_REFUSE("the arm (%g m to the string's hold) is longer than its string of %g m", s->hold, s->length);
    if (s->run == LUMI_RIG_RUN_STRAIGHT &&
        (!rig_within(s->anchor, 1e-3, 10) || !rig_within(s->hold_angle, -LUMI_PI / 2, LUMI_PI / 2)))
        RIG_REFUSE("the string's anchor or hold angle is out of range");
    if (s->held) {
        if (rig->turns > 1)
            RIG_REFUSE("%d turns with the arm held would take the same row %d times", rig->turns, rig->turns);
        return LUMI_OK;
    }

    double end = rig_string_start(rig) + rig->turns * s->per_turn;
    if (end > s->length * (1 + 1e-9))
        RIG_REFUSE("%d turns need %g m of string, there are %g m", rig->turns, end, s->length);
    if (s->run == LUMI_RIG_RUN_STRAIGHT && end > s->anchor + s->hold)
        RIG_REFUSE("%d turns leave the arm hanging straight down on a slack string", rig->turns);
    if (lumi_rig_drop(rig, rig->turns) > LUMI_PI + 1e-9)
        RIG_REFUSE("%d turns drop the arm by more than half a circle", rig->turns);
    return LUMI_OK;
}

static int check_cameras(const struct lumi_rig *rig, struct lumi_error *error)
{
    if (rig->camera_count < 1 || rig->camera_count > LUMI_RIG_CAMERAS)
        RIG_REFUSE("%d cameras: 1 to %d wanted", rig->camera_count, LUMI_RIG_CAMERAS);
    if (rig->lens_count < 1 || rig->lens_count > LUMI_RIG_LENSES)
        RIG_REFUSE("%d lenses: 1 to %d wanted", rig->lens_count, LUMI_RIG_LENSES);
    for (int i = 0; i < rig->lens_count; i++) {
        if (!rig_name_ok(rig->lenses[i].name))
            RIG_REFUSE("lens %d has no usable name", i);
        if (!lumi_lens_valid(&rig->lenses[i].lens))
            RIG_REFUSE("lens '%s' is out of range", rig->lenses[i].name);
        if (rig->lenses[i].lens.model == LUMI_LENS_EQUIRECTANGULAR)
            RIG_REFUSE("lens '%s' is a projection, no lens", rig->lenses[i].name);
        for (int j = 0; j < i; j++)
            if (!strcmp(rig->lenses[i].name, rig->lenses[j].name))
                RIG_REFUSE("two lenses are called '%s'", rig->lenses[i].name);
    }
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_rig_camera *c = &rig->cameras[i];
        if (!rig_name_ok(c->name))
            RIG_REFUSE("camera %d has no usable name", i);
        if (c->lens < 0 || c->lens >= rig->lens_count)
            RIG_REFUSE("camera '%s' has no lens", c->name);
        if (!rig_within(c->radius, 1e-3, 10))
            RIG_REFUSE("camera '%s': radius %g m is out of range", c->name, c->radius);
        if (!rig_within(c->angle, -LUMI_PI, 2 * LUMI_PI) || !rig_within(c->azimuth, -2 * LUMI_PI, 2 * LUMI_PI) ||
            !rig_within(c->roll, -2 * LUMI_PI, 2 * LUMI_PI) || !rig_within(c->pan, -LUMI_PI, LUMI_PI) ||
            !rig_within(c->tilt, -LUMI_PI, LUMI_PI) || !rig_within(c->offset_m, -10, 10))
            RIG_REFUSE("camera '%s': an angle or the offset is out of range", c->name);
        for (int j = 0; j < i; j++)
            if (!strcmp(c->name, rig->cameras[j].name))
                RIG_REFUSE("two cameras are called '%s'", c->name);
    }
    return LUMI_OK;
}

int lumi_rig_check(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_uncertainty *u = &rig->uncertainty;

    if (!rig_name_ok(rig->name))
        RIG_REFUSE("the rig has no usable name");
    LUMI_TRY(check_cameras(rig, error));
    LUMI_TRY(check_drive(rig, error));
    LUMI_TRY(check_string(rig, error));
    if (!rig_within(u->position_m, 0, 1) || !rig_within(u->rotation, 0, LUMI_PI) || !rig_within(u->turn, 0, LUMI_PI) ||
        !rig_within(u->drop, 0, LUMI_PI))
        RIG_REFUSE("an uncertainty is out of range");
    return rig_check_control(rig, error);
}
