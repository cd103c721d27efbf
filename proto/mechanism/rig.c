/* The rig profile: built-in rigs, and which rigs there cannot be. */
#include "proto/mechanism/rig.h"

#include "proto/base/raster.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)

const char *const lumi_rig_builtin_names[] = {"arc16", "arc16x2", "bar2", NULL};

/* Pixel density the same in both directions; an equidistant lens has no more to it. */
static void equidistant(struct lumi_lens *lens, int width, int height, double fov_x, double fov_y)
{
    memset(lens, 0, sizeof *lens);
    lens->model = LUMI_LENS_FISHEYE;
    lens->width = width;
    lens->height = height;
    lens->fx = width / fov_x;
    lens->fy = height / fov_y;
    lens->cx = width / 2.0;
    lens->cy = height / 2.0;
}

/* What both rigs of the paper share: a stepper with 200 steps, 16 microsteps and a belt of 9:1, so 28,800 microsteps a
 * turn, 400 between two of 72 positions. */
static void common(struct lumi_rig *rig, int positions, int turns)
{
    memset(rig, 0, sizeof *rig);
    rig->motor_steps = 200;
    rig->microsteps = 16;
    rig->gear_motor = 9;
    rig->gear_platform = 1;
    rig->direction = 1;
    rig->positions = positions;
    rig->turns = turns;
    rig->lens_count = 1;
    rig->uncertainty.position_m = 0.005;
    rig->uncertainty.rotation = 0.5 * DEGREE;
    rig->uncertainty.turn = 0.1 * DEGREE;
    rig->uncertainty.drop = 0.5 * DEGREE;
}

int lumi_rig_arc(struct lumi_rig *rig, int cameras, int positions, int turns, double radius, int width, int height,
                 double fov_x, double fov_y, struct lumi_error *error)
{
    if (cameras < 1 || cameras > LUMI_RIG_CAMERAS)
        return lumi_fail(error, LUMI_ERR_ARG, "a rig of %d cameras: 1 to %d wanted", cameras, LUMI_RIG_CAMERAS);
    common(rig, positions, turns);
    snprintf(rig->name, sizeof rig->name, "arc%d", cameras);
    snprintf(rig->lenses[0].name, sizeof rig->lenses[0].name, "wide");
    equidistant(&rig->lenses[0].lens, width, height, fov_x, fov_y);
    rig->camera_count = cameras;
    /* One turn: rows half a spacing from the poles. Several: the arm falls by one spacing in all, from just below the
     * pole (an eighth) to just above the other, so that the rows of all turns interleave and none meets a pole. */
    double spacing = turns > 1 ? LUMI_PI / (cameras + 0.25) : LUMI_PI / cameras;
    for (int i = 0; i < cameras; i++) {
        struct lumi_rig_camera *camera = &rig->cameras[i];
        snprintf(camera->name, sizeof camera->name, "c%02d", i);
        camera->angle = LUMI_PI / 2 - spacing * (i + (turns > 1 ? 0.125 : 0.5));
        camera->radius = radius;
    }
    rig->string.held = turns == 1;
    rig->string.hold = radius;
    rig->string.per_turn = spacing / (turns > 1 ? turns : 2) * radius;
    rig->string.length = LUMI_PI * radius;
    return lumi_rig_check(rig, error) == LUMI_OK ? LUMI_OK : LUMI_ERR_ARG;
}

int lumi_rig_bar(struct lumi_rig *rig, int positions, int turns, double radius, double drop_m, int width, int height,
                 double fov_x, double fov_y, struct lumi_error *error)
{
    common(rig, positions, turns);
    snprintf(rig->name, sizeof rig->name, "bar2");
    snprintf(rig->lenses[0].name, sizeof rig->lenses[0].name, "fisheye");
    equidistant(&rig->lenses[0].lens, width, height, fov_x, fov_y);
    rig->camera_count = 2;
    double start = turns * drop_m / radius;
    /* Opposite ends: the first camera comes down to the equator, the second rises to it. Its image would be upside
     * down, being on the far side of the pivot, so it is mounted turned by half a circle. */
    for (int i = 0; i < 2; i++) {
        snprintf(rig->cameras[i].name, sizeof rig->cameras[i].name, "c%02d", i);
        rig->cameras[i].angle = start + i * LUMI_PI;
        rig->cameras[i].radius = radius;
        rig->cameras[i].roll = i * LUMI_PI;
    }
    rig->string.hold = radius;
    rig->string.per_turn = drop_m;
    rig->string.length = fmax(turns * drop_m, LUMI_PI * radius);
    if (!(start <= LUMI_PI / 2))
        return lumi_fail(error, LUMI_ERR_ARG, "%d turns of %g m drop are more than a quarter circle of %g m radius",
                         turns, drop_m, radius);
    return lumi_rig_check(rig, error) == LUMI_OK ? LUMI_OK : LUMI_ERR_ARG;
}

int lumi_rig_builtin(const char *name, struct lumi_rig *rig, struct lumi_error *error)
{
    int code;

    if (!strcmp(name, "arc16"))
        code = lumi_rig_arc(rig, 16, 72, 1, 0.35, 1280, 1024, 110 * DEGREE, 88 * DEGREE, error);
    else if (!strcmp(name, "arc16x2"))
        code = lumi_rig_arc(rig, 16, 72, 2, 0.35, 1280, 1024, 110 * DEGREE, 88 * DEGREE, error);
    else if (!strcmp(name, "bar2"))
        code = lumi_rig_bar(rig, 72, 18, 0.4, 0.03, 1280, 1024, 120 * DEGREE, 96 * DEGREE, error);
    else
        return lumi_fail(error, LUMI_ERR_ARG, "no rig '%s': arc16, arc16x2 or bar2", name);
    snprintf(rig->name, sizeof rig->name, "%s", name);
    return code;
}

/* A name that can be a file's name: letters, digits, '.', '_', '-', no dot first. */
static bool name_ok(const char *name)
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

/* Written so that NaN fails. */
static bool within(double value, double low, double high)
{
    return value >= low && value <= high;
}

#define REFUSE(...) return lumi_fail(error, LUMI_ERR_FORMAT, __VA_ARGS__)

static int check_drive(const struct lumi_rig *rig, struct lumi_error *error)
{
    if (rig->motor_steps == 0 || rig->microsteps == 0 || rig->gear_motor == 0 || rig->gear_platform == 0)
        REFUSE("a ratio of the drive is zero");
    if (rig->motor_steps < 0 || rig->motor_steps > 10000 || rig->microsteps < 0 || rig->microsteps > 256 ||
        rig->gear_motor < 0 || rig->gear_motor > 10000 || rig->gear_platform < 0 || rig->gear_platform > 10000)
        REFUSE("a ratio of the drive is out of range");
    if (rig->direction != 1 && rig->direction != -1)
        REFUSE("direction %d: 1 or -1 wanted", rig->direction);
    if (!within(rig->index, -2 * LUMI_PI, 2 * LUMI_PI))
        REFUSE("the index angle is out of range");
    if (rig->positions < 1 || rig->positions > LUMI_RIG_POSITIONS_MAX)
        REFUSE("%d positions a turn: 1 to %d wanted", rig->positions, LUMI_RIG_POSITIONS_MAX);
    if (rig->turns < 1 || rig->turns > LUMI_RIG_TURNS_MAX)
        REFUSE("%d turns: 1 to %d wanted", rig->turns, LUMI_RIG_TURNS_MAX);
    if (lumi_rig_steps_per_turn(rig) < rig->positions)
        REFUSE("%g steps a turn cannot reach %d positions", lumi_rig_steps_per_turn(rig), rig->positions);
    return LUMI_OK;
}

static int check_string(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_string *s = &rig->string;

    if (s->run != LUMI_RIG_RUN_ARC && s->run != LUMI_RIG_RUN_STRAIGHT)
        REFUSE("the string's run is neither arc nor straight");
    if (!within(s->length, 1e-3, 100) || !within(s->per_turn, 1e-4, 10) || !within(s->hold, 1e-3, 10))
        REFUSE("a length of the string is out of range");
    if (s->hold > s->length)
        REFUSE("the arm (%g m to the string's hold) is longer than its string of %g m", s->hold, s->length);
    if (s->run == LUMI_RIG_RUN_STRAIGHT &&
        (!within(s->anchor, 1e-3, 10) || !within(s->hold_angle, -LUMI_PI / 2, LUMI_PI / 2)))
        REFUSE("the string's anchor or hold angle is out of range");
    if (s->held) {
        if (rig->turns > 1)
            REFUSE("%d turns with the arm held would take the same row %d times", rig->turns, rig->turns);
        return LUMI_OK;
    }

    double start = 0, h = s->anchor, a = s->hold;
    if (s->run == LUMI_RIG_RUN_STRAIGHT)
        start = sqrt(fmax(h * h + a * a - 2 * h * a * sin(s->hold_angle), 0));
    double end = start + rig->turns * s->per_turn;
    if (end > s->length * (1 + 1e-9))
        REFUSE("%d turns need %g m of string, there are %g m", rig->turns, end, s->length);
    if (s->run == LUMI_RIG_RUN_STRAIGHT && end > h + a)
        REFUSE("%d turns leave the arm hanging straight down on a slack string", rig->turns);
    if (lumi_rig_drop(rig, rig->turns) > LUMI_PI + 1e-9)
        REFUSE("%d turns drop the arm by more than half a circle", rig->turns);
    return LUMI_OK;
}

static int check_cameras(const struct lumi_rig *rig, struct lumi_error *error)
{
    if (rig->camera_count < 1 || rig->camera_count > LUMI_RIG_CAMERAS)
        REFUSE("%d cameras: 1 to %d wanted", rig->camera_count, LUMI_RIG_CAMERAS);
    if (rig->lens_count < 1 || rig->lens_count > LUMI_RIG_LENSES)
        REFUSE("%d lenses: 1 to %d wanted", rig->lens_count, LUMI_RIG_LENSES);
    for (int i = 0; i < rig->lens_count; i++) {
        if (!name_ok(rig->lenses[i].name))
            REFUSE("lens %d has no usable name", i);
        if (!lumi_lens_valid(&rig->lenses[i].lens))
            REFUSE("lens '%s' is out of range", rig->lenses[i].name);
        for (int j = 0; j < i; j++)
            if (!strcmp(rig->lenses[i].name, rig->lenses[j].name))
                REFUSE("two lenses are called '%s'", rig->lenses[i].name);
    }
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_rig_camera *c = &rig->cameras[i];
        if (!name_ok(c->name))
            REFUSE("camera %d has no usable name", i);
        if (c->lens < 0 || c->lens >= rig->lens_count)
            REFUSE("camera '%s' has no lens", c->name);
        if (!within(c->radius, 1e-3, 10))
            REFUSE("camera '%s': radius %g m is out of range", c->name, c->radius);
        if (!within(c->angle, -LUMI_PI, 2 * LUMI_PI) || !within(c->azimuth, -2 * LUMI_PI, 2 * LUMI_PI) ||
            !within(c->roll, -2 * LUMI_PI, 2 * LUMI_PI) || !within(c->pan, -LUMI_PI, LUMI_PI) ||
            !within(c->tilt, -LUMI_PI, LUMI_PI) || !within(c->offset_m, -10, 10))
            REFUSE("camera '%s': an angle or the offset is out of range", c->name);
        for (int j = 0; j < i; j++)
            if (!strcmp(c->name, rig->cameras[j].name))
                REFUSE("two cameras are called '%s'", c->name);
    }
    return LUMI_OK;
}

int lumi_rig_check(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_uncertainty *u = &rig->uncertainty;

    if (!name_ok(rig->name))
        REFUSE("the rig has no usable name");
    LUMI_TRY(check_cameras(rig, error));
    LUMI_TRY(check_drive(rig, error));
    LUMI_TRY(check_string(rig, error));
    if (!within(u->position_m, 0, 1) || !within(u->rotation, 0, LUMI_PI) || !within(u->turn, 0, LUMI_PI) ||
        !within(u->drop, 0, LUMI_PI))
        REFUSE("an uncertainty is out of range");
    return LUMI_OK;
}
