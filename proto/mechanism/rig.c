/* The rig profile: built-in rigs. */
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
    lumi_rig_control_init(&rig->control);
    rig->control.safety.driver_fault_fitted = true;
    rig->control.safety.supply_minimum = 10;
    rig->control.safety.overspeed = 90 * DEGREE;
}

/* A string has its switches. */
static void fit_string(struct lumi_rig_safety *safety)
{
    safety->slack_fitted = true;
    safety->string_end_fitted = true;
    safety->wound_fitted = true;
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
    /* Action cameras: they take single frames on their channel, or record by themselves; the brake is what holds the
     * arm for one row. */
    rig->control.safety.brake_fitted = true;
    if (turns > 1)
        fit_string(&rig->control.safety);
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
    /* Mirrorless cameras with manual lenses and silent shutters: bracketed quickly, each on its own feedback input. The
     * bar hangs and swings a little longer. */
    for (int i = 0; i < 2; i++) {
        rig->control.triggers[i].shutter_lag = i == 0 ? 0.045 : 0.05;
        rig->control.triggers[i].busy = 0.08;
        rig->control.triggers[i].feedback = i;
    }
    rig->control.motion.settle = 0.5;
    fit_string(&rig->control.safety);
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
