/* Priors that the pictures contradict: motions found without any prior, against what each hypothesis has. */
#include "pipeline/calibrate/calibration.h"

#include "pipeline/calibrate/rotation.h"
#include "proto/mechanism/kinematics.h"

#include <string.h>

#define DEGREE (LUMI_PI / 180)
#define LIKELY 0.5   /* share of motions that agree with a hypothesis which is taken: by chance none do, and what */
#define BETTER 0.25  /* repeats itself in the place agrees with nothing; and so much less with the capture as it is, */
#define UNLIKELY 0.5 /* at most this */
#define OUTSIDE 0.5  /* share of a pair's matches beyond the prior's band that contradicts the prior */
#define FEWEST 6     /* motions that anything is concluded from */
#define FREE_FEWEST 12 /* matches that a motion is believed from */

/* What may have happened to the capture. */
struct hypothesis {
    int first, second; /* cameras of the rig that are in each other's place; −1: none */
    bool backwards;    /* it turned the other way */
};

static void pose_under(const struct lumi_run *run, const struct hypothesis *h, int frame, struct lumi_pose *pose)
{
    const struct lumi_source *source = &run->sources[frame];
    int camera = run->rig ? lumi_calibration_rig_camera(run, frame) : -1;

    *pose = source->prior;
    if (camera < 0 || (!h->backwards && camera != h->first && camera != h->second))
        return;
    if (h->first >= 0)
        camera = camera == h->first ? h->second : camera == h->second ? h->first : camera;
    double angle = h->backwards ? 2 * run->rig->index - source->turn_angle : source->turn_angle;
    lumi_rig_camera_pose_at(run->rig, camera, angle, source->drop, pose);
}

static bool known(const struct lumi_motion *m)
{
    return m->free_count >= FREE_FEWEST &&
           m->rotation[0] * m->rotation[0] + m->rotation[4] * m->rotation[4] + m->rotation[8] * m->rotation[8] > 0;
}

/* How far a rotation may be beside what a hypothesis has. */
static double tolerance(const struct lumi_run *run)
{
    return fmax(4 * DEGREE, 5 * (run->rig ? run->rig->uncertainty.rotation : 0.5 * DEGREE));
}

/* Whether a motion can tell the hypothesis from the capture as it is: otherwise it agrees with both. */
static bool tells(const struct lumi_run *run, const struct hypothesis *h, const struct lumi_motion *m)
{
    struct lumi_pose a, b;
    double under[9], given[9];

    pose_under(run, h, m->a, &a);
    pose_under(run, h, m->b, &b);
    lumi_rotation_between(a.r, b.r, under);
    lumi_rotation_between(run->sources[m->a].prior.r, run->sources[m->b].prior.r, given);
    return lumi_rotation_angle(under, given) > tolerance(run);
}

/* Whether the pictures moved as the hypothesis has it. Of the capture as it is the matches themselves say so: a motion
 * found from them alone has two answers where all that is seen lies in one plane, and the wrong one may be taken. */
static bool agrees(const struct lumi_run *run, const struct hypothesis *h, const struct lumi_motion *m)
{
    const struct lumi_rig_uncertainty *u = run->rig ? &run->rig->uncertainty : NULL;
    double place = u ? u->position_m : 0.005;
    struct lumi_pose a, b;
    double between[9];

    if (h->first < 0 && !h->backwards)
        return m->free_outside < OUTSIDE * m->free_count;
    pose_under(run, h, m->a, &a);
    pose_under(run, h, m->b, &b);
    lumi_rotation_between(a.r, b.r, between);
    if (lumi_rotation_angle(between, m->rotation) > tolerance(run))
        return false;
    struct lumi_vec3 moved = lumi_rotate_back(a.r, lumi_sub(b.t, a.t));
    double length = lumi_length(moved);
    if (length < 8 * place || lumi_dot(m->direction, m->direction) < 0.5)
        return true; /* too short to have a direction */
    return lumi_dot(moved, m->direction) > 0.7 * length;
}

/* Share of the motions of used pictures that agree, of those that a camera takes part in (−1: of all; of two: of
 * either). */
static double share(const struct lumi_run *run, const struct lumi_evidence *e, const struct lumi_calibration *c,
                    const struct hypothesis *h, const struct hypothesis *alternative, int first, int second, int *count)
{
    int agreed = 0;

    *count = 0;
    for (int i = 0; i < e->motion_count; i++) {
        const struct lumi_motion *m = &e->motions[i];
        int a = lumi_calibration_rig_camera(run, m->a), b = lumi_calibration_rig_camera(run, m->b);
        if (!known(m) || !c->frames[m->a].used || !c->frames[m->b].used)
            continue;
        if (first >= 0 && a != first && b != first && a != second && b != second)
            continue;
        if (alternative && !tells(run, alternative, m))
            continue;
        (*count)++;
        agreed += agrees(run, h, m);
    }
    return *count ? (double)agreed / *count : 0;
}

static int drop_camera(const struct lumi_run *run, struct lumi_calibration *c, int camera, const char *why)
{
    int lost = 0;

    for (int i = 0; i < run->count; i++)
        if (lumi_calibration_rig_camera(run, i) == camera) {
            lost += c->frames[i].used;
            lumi_calibration_drop(c, i, "%s", why);
        }
    return lost;
}

/* The camera that this one is exchanged with, if both say so. */
static int find_swap(const struct lumi_run *run, const struct lumi_evidence *e, const struct lumi_calibration *c,
                     int camera, double *agreed)
{
    int best = -1, count;

    *agreed = 0;
    for (int other = 0; other < run->rig->camera_count; other++) {
        const struct hypothesis swapped = {camera, other, false}, given = {-1, -1, false};
        if (other == camera)
            continue;
        double was = share(run, e, c, &given, &swapped, camera, other, &count);
        double is = share(run, e, c, &swapped, &swapped, camera, other, &count);
        if (count >= FEWEST && is > LIKELY && is > was + BETTER && is > *agreed) {
            *agreed = is;
            best = other;
        }
    }
    return best;
}

static void find_wrong_cameras(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c,
                               double overall)
{
    const struct hypothesis given = {-1, -1, false};
    bool named[LUMI_RIG_CAMERAS] = {0};

    for (int camera = 0; camera < run->rig->camera_count; camera++) {
        int count;
        double agreed, was = share(run, e, c, &given, NULL, camera, camera, &count);
        if (named[camera] || count < FEWEST || was > UNLIKELY || overall < was + 0.1)
            continue;
        int other = find_swap(run, e, c, camera, &agreed);
        const char *name = run->rig->cameras[camera].name;
        g_autofree char *what = g_strdup_printf("camera %s", name);
        if (other >= 0) {
            const char *second = run->rig->cameras[other].name;
            g_autofree char *why = g_strdup_printf("cameras %s and %s are in each other's place", name, second);
            int lost = drop_camera(run, c, camera, why) + drop_camera(run, c, other, why);
            lumi_calibration_find(c, lost, what,
                                  "and camera %s are in each other's place: %.0f %% of what their pictures say agrees "
                                  "with that, %.0f %% with the capture as it is. They are not used; with --exchange "
                                  "%s:%s they are (or import again with their folders exchanged)",
                                  second, 100 * agreed, 100 * was, name, second);
            named[other] = true;
            continue;
        }
        int lost = drop_camera(run, c, camera, "its pictures contradict its place on the rig");
        lumi_calibration_find(c, lost, what,
                              "is not where the rig profile has it: %.0f %% of what its pictures say agrees with that. "
                              "They are not used; look at its angle, mounting and lens in the profile",
                              100 * was);
    }
}

int lumi_calibration_wrong_priors(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c,
                                  struct lumi_error *error)
{
    const struct hypothesis given = {-1, -1, false}, backwards = {-1, -1, true};
    int count;

    if (!run->rig)
        return LUMI_OK;
    const double overall = share(run, e, c, &given, NULL, -1, -1, &count);
    if (count < FEWEST)
        return LUMI_OK;
    const double was = share(run, e, c, &given, &backwards, -1, -1, &count);
    const double is = share(run, e, c, &backwards, &backwards, -1, -1, &count);
    if (count >= FEWEST && is > LIKELY && is > was + BETTER && was < UNLIKELY)
        return lumi_fail(
            error, LUMI_ERR_FORMAT,
            "%s: the rig turned the other way than its profile says: %.0f %% of what the pictures say "
            "agrees with that, %.0f %% with the capture as it is; run it with --backwards (or import again "
            "with direction = %d in the profile)",
            run->capture, 100 * is, 100 * was, -run->rig->direction);
    find_wrong_cameras(run, e, c, overall);
    return LUMI_OK;
}
