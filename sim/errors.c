/* True poses of a rig that is not quite what its profile says. */
#include "sim/errors.h"

#include "proto/mechanism/kinematics.h"
#include "sim/random.h"

#include <glib.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)
#define MM 1e-3

/* What a random number is for; the index beside it is a frame, a camera or a stop. */
enum purpose { FRAME, CAMERA = 16, STOP = 32, WHOLE = 48 };

static double unit(uint64_t seed, int index, unsigned channel)
{
    return sim_random_unit(sim_random(seed, (uint64_t)index, channel));
}

/* A standard normal deviate (Box and Muller, 1958). */
static double normal(uint64_t seed, int index, unsigned channel)
{
    return sqrt(-2 * log(unit(seed, index, 2 * channel + 1000))) *
           cos(2 * LUMI_PI * unit(seed, index, 2 * channel + 1001));
}

static double sign(uint64_t seed, unsigned channel)
{
    return unit(seed, 0, WHOLE + channel) < 0.5 ? -1 : 1;
}

int sim_errors_parse(const char *text, struct sim_mechanism_error *m, struct lumi_error *error)
{
    const struct {
        const char *name;
        double *value, unit, usual;
    } keys[] = {
        {"axis", &m->axis, DEGREE, 0.3},         {"wobble", &m->wobble, DEGREE, 0.1}, {"centre", &m->centre, MM, 2},
        {"radius", &m->radius, MM, 4},           {"arm", &m->arm, DEGREE, 0.2},       {"drop", &m->drop, DEGREE, 0.3},
        {"backlash", &m->backlash, DEGREE, 0.2}, {"pan", &m->pan, DEGREE, 0.3},       {"tilt", &m->tilt, DEGREE, 0.3},
        {"roll", &m->roll, DEGREE, 0.3},
    };
    g_auto(GStrv) parts = g_strsplit(*text ? text : " ", ",", -1);

    *m = (struct sim_mechanism_error){0};
    for (size_t k = 0; k < G_N_ELEMENTS(keys) && !strcmp(text, "yes"); k++)
        *keys[k].value = keys[k].usual * keys[k].unit;
    for (int i = 0; parts[i] && strcmp(text, "yes") != 0; i++) {
        char *equals = strchr(parts[i], '='), *end = NULL;
        size_t k = 0;
        while (equals && k < G_N_ELEMENTS(keys) &&
               (strlen(keys[k].name) != (size_t)(equals - parts[i]) ||
                strncmp(keys[k].name, parts[i], strlen(keys[k].name)) != 0))
            k++;
        double value = equals ? g_ascii_strtod(equals + 1, &end) : 0;
        if (!equals || k == G_N_ELEMENTS(keys) || end == equals + 1 || *end || !(value >= 0 && value <= 90))
            return lumi_fail(error, LUMI_ERR_ARG,
                             "mechanism error '%s': yes, or a list of axis, wobble, centre, radius, arm, drop, "
                             "backlash, pan, tilt, roll, each with =NUMBER in degrees or mm, 0 to 90, wanted",
                             parts[i]);
        *keys[k].value = value * keys[k].unit;
    }
    return LUMI_OK;
}

static bool mechanism_wrong(const struct sim_mechanism_error *m)
{
    return m->axis > 0 || m->wobble > 0 || m->centre > 0 || m->radius > 0 || m->arm > 0 || m->drop > 0 ||
           m->backlash > 0 || m->pan > 0 || m->tilt > 0 || m->roll > 0;
}

/* The rotation by the length of v about v. */
static void rotation_about(struct lumi_vec3 v, double r[9])
{
    double angle = lumi_length(v), s = angle > 0 ? sin(angle / 2) / angle : 0.5;
    const double q[4] = {cos(angle / 2), v.x * s, v.y * s, v.z * s};

    lumi_rotation_from_quaternion(q, r);
}

/* The rig as it is: what does not change while it turns. */
static void true_profile(const struct sim_errors *e, const struct lumi_rig *nominal, struct lumi_rig *rig)
{
    const struct sim_mechanism_error *m = &e->mechanism;
    double further = sign(e->seed, 0) * m->radius;

    *rig = *nominal;
    for (int i = 0; i < rig->camera_count; i++) {
        struct lumi_rig_camera *c = &rig->cameras[i];
        c->radius += further + m->radius / 3 * normal(e->seed, i, CAMERA);
        c->angle += m->arm * normal(e->seed, i, CAMERA + 1);
        c->pan += m->pan * normal(e->seed, i, CAMERA + 2);
        c->tilt += m->tilt * normal(e->seed, i, CAMERA + 3);
        c->roll += m->roll * normal(e->seed, i, CAMERA + 4);
    }
}

/* A smooth function over the sweep (0..1): from 0 to about 1 at its end, with two slow waves on the way. */
static double uneven(uint64_t seed, double share)
{
    double a = 2 * LUMI_PI * unit(seed, 1, WHOLE), b = 2 * LUMI_PI * unit(seed, 2, WHOLE);

    return 0.5 * share + 0.25 * (sin(2 * LUMI_PI * share + a) - sin(a)) +
           0.15 * (sin(6 * LUMI_PI * share + b) - sin(b));
}

/* Where the mechanism truly has a view's camera. */
static void mechanism_pose(const struct sim_errors *e, const struct lumi_rig *rig, const struct sim_view *view,
                           struct lumi_pose *pose)
{
    const struct sim_mechanism_error *m = &e->mechanism;
    double sweep = (double)view->position / (rig->positions * rig->turns);
    double drop = view->drop, angle = e->backwards ? 2 * rig->index - view->turn_angle : view->turn_angle;
    double phase = 2 * LUMI_PI * unit(e->seed, 3, WHOLE);
    double lean = 2 * LUMI_PI * unit(e->seed, 4, WHOLE), aside = 2 * LUMI_PI * unit(e->seed, 5, WHOLE);
    double wobble = angle + 2 * LUMI_PI * unit(e->seed, 6, WHOLE);
    struct lumi_pose tilted = {0};
    double turned[9], fixed[9];

    if (!rig->string.held)
        drop += sign(e->seed, 1) * m->drop * uneven(e->seed, sweep);
    /* Behind in the sweep's direction: half of it by the gear's eccentricity, half by chance. */
    angle -=
        rig->direction * m->backlash * (0.25 + 0.25 * sin(angle + phase) + 0.5 * unit(e->seed, view->position, STOP));
    lumi_rig_camera_pose_at(rig, view->camera, angle, drop, pose);
    pose->t = lumi_add(pose->t, lumi_vec3(m->centre * cos(angle + aside), m->centre * sin(angle + aside), 0));
    rotation_about(lumi_scale(lumi_vec3(cos(wobble), sin(wobble), 0), m->wobble), turned);
    rotation_about(lumi_scale(lumi_vec3(cos(lean), sin(lean), 0), m->axis), fixed);
    lumi_rotation_multiply(fixed, turned, tilted.r);
    lumi_pose_multiply(&tilted, pose, pose);
}

static void shake(const struct sim_errors *e, int frame, struct lumi_pose *pose)
{
    struct lumi_pose moved;
    double v[6];

    for (unsigned i = 0; i < 6; i++)
        v[i] = normal(e->seed, frame, FRAME + i);
    rotation_about(lumi_scale(lumi_vec3(v[0], v[1], v[2]), e->rotation), moved.r);
    moved.t = lumi_scale(lumi_vec3(v[3], v[4], v[5]), e->position_m);
    lumi_pose_multiply(pose, &moved, pose);
}

int sim_errors_apply(const struct sim_errors *e, struct sim_rig *rig, struct lumi_error *error)
{
    struct lumi_rig real;

    if (!(e->position_m >= 0 && e->position_m <= 1) || !(e->rotation >= 0 && e->rotation <= LUMI_PI / 2))
        return lumi_fail(error, LUMI_ERR_ARG, "pose error: up to 1000 mm and 90 degrees wanted");
    if ((mechanism_wrong(&e->mechanism) || e->backwards) && !rig->mechanism)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "mechanism error: a rig that turns is wanted: arc16, arc16x2, bar2, arc:…");
    true_profile(e, &rig->profile, &real);
    for (int i = 0; i < rig->count; i++) {
        struct sim_view *view = &rig->views[i];
        view->prior = view->pose;
        if (rig->mechanism)
            mechanism_pose(e, &real, view, &view->pose);
        shake(e, i, &view->pose);
    }
    struct lumi_rig_uncertainty *u = &rig->profile.uncertainty;
    u->position_m = fmax(u->position_m, fmax(e->position_m, e->mechanism.radius));
    u->rotation = fmax(u->rotation, fmax(e->rotation, e->mechanism.pan));
    u->turn = fmax(u->turn, e->mechanism.backlash);
    u->drop = fmax(u->drop, e->mechanism.drop);
    rig->shaken = true;
    return LUMI_OK;
}
