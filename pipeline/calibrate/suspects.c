/* What is wrong with pictures before anything is solved. */
#include "pipeline/calibrate/calibration.h"

#include "proto/base/sort.h"

#include <string.h>

#define BLACK 0.02        /* of full brightness: less is a lens cap, or a shutter that did not open */
#define FEW_FEATURES 20   /* in a picture that is not black */
#define BLURRED 0.55      /* of the sharpness of the other cameras; one that sees clouds alone has 0.66 */
#define FEWEST_MATCHES 15 /* with all neighbours together */
#define FREELY_FOUND 20   /* matches that two pictures have in common by more than chance */

static double median_of(GArray *values)
{
    return lumi_sort_median((double *)(void *)values->data, (int)values->len);
}

static void find_black(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c)
{
    for (int i = 0; i < run->count; i++) {
        const struct lumi_frame_evidence *f = &e->frames[i];
        if (f->mean >= BLACK || f->features >= FEW_FEATURES)
            continue;
        g_autofree char *what = g_strdup_printf("frame %s", run->sources[i].name);
        lumi_calibration_drop(c, i, "black: its mean brightness is %.1f %%", 100 * f->mean);
        lumi_calibration_find(c, 1, what,
                              "is black (mean brightness %.1f %%, %d features) and not used: look at the camera's "
                              "trigger, shutter and lens cap, and take it again",
                              100 * f->mean, f->features);
    }
}

/* The median sharpness of a camera's pictures that are not black. */
static double camera_sharpness(const struct lumi_run *run, const struct lumi_evidence *e,
                               const struct lumi_calibration *c, int camera)
{
    g_autoptr(GArray) values = g_array_new(FALSE, FALSE, sizeof(double));

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].camera == camera && c->frames[i].used)
            g_array_append_val(values, e->frames[i].sharpness);
    return median_of(values);
}

static void find_blurred(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c)
{
    g_autoptr(GArray) all = g_array_new(FALSE, FALSE, sizeof(double));
    int cameras = 0;

    for (int i = 0; i < run->count; i++)
        cameras = MAX(cameras, run->sources[i].camera + 1);
    for (int camera = 0; camera < cameras; camera++) {
        double sharpness = camera_sharpness(run, e, c, camera);
        if (sharpness > 0)
            g_array_append_val(all, sharpness);
    }
    if (all->len < 2)
        return;
    /* Of two cameras the sharper one says what is sharp. */
    double usual = median_of(all);
    for (int camera = 0; camera < cameras; camera++) {
        double sharpness = camera_sharpness(run, e, c, camera);
        int lost = 0, first = -1;
        if (!(sharpness > 0) || sharpness >= BLURRED * usual)
            continue;
        for (int i = 0; i < run->count; i++)
            if (run->sources[i].camera == camera) {
                first = first < 0 ? i : first;
                lost += c->frames[i].used;
                lumi_calibration_drop(c, i, "unfocused: its camera's pictures are %.0f %% as sharp as the others'",
                                      100 * sharpness / usual);
            }
        g_autofree char *what = g_strdup_printf("camera %s", run->sources[first].camera_name);
        lumi_calibration_find(
            c, lost, what,
            "is unfocused: its pictures are %.0f %% as sharp as the other cameras'; they are not used. "
            "Focus it and take them again",
            100 * sharpness / usual);
    }
}

/* Matches a picture of a camera's with pictures of other cameras; of those that are used. */
static double camera_overlap(const struct lumi_run *run, const struct lumi_evidence *e,
                             const struct lumi_calibration *c, int camera)
{
    int matches = 0, pictures = 0;

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].camera == camera && c->frames[i].used) {
            matches += e->frames[i].foreign;
            pictures++;
        }
    return pictures ? (double)matches / pictures : -1;
}

/* Whether its pictures, matched without their prior, show what other cameras show. */
static bool seen_by_others(const struct lumi_run *run, const struct lumi_evidence *e, int camera)
{
    int tried = 0, found = 0;

    for (int i = 0; i < e->motion_count; i++) {
        const struct lumi_motion *m = &e->motions[i];
        int a = run->sources[m->a].camera, b = run->sources[m->b].camera;
        if (a == b || (a != camera && b != camera))
            continue;
        tried++;
        found += m->free_count >= FREELY_FOUND;
    }
    return found > 0 && found >= MIN(tried / 4, 3);
}

static void find_isolated(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c)
{
    g_autoptr(GArray) all = g_array_new(FALSE, FALSE, sizeof(double));
    int cameras = 0;

    for (int i = 0; i < run->count; i++)
        cameras = MAX(cameras, run->sources[i].camera + 1);
    for (int camera = 0; camera < cameras; camera++) {
        double overlap = camera_overlap(run, e, c, camera);
        if (overlap >= 0)
            g_array_append_val(all, overlap);
    }
    const double usual = median_of(all);
    if (all->len < 3 || usual < 2 * FEWEST_MATCHES)
        return;
    for (int camera = 0; camera < cameras; camera++) {
        const double overlap = camera_overlap(run, e, c, camera);
        int lost = 0, first = -1;
        if (overlap < 0 || overlap >= FEWEST_MATCHES || seen_by_others(run, e, camera))
            continue;
        for (int i = 0; i < run->count; i++)
            if (run->sources[i].camera == camera) {
                first = first < 0 ? i : first;
                lost += c->frames[i].used;
                lumi_calibration_drop(c, i, "its camera shares nothing with the others");
            }
        g_autofree char *what = g_strdup_printf("camera %s", run->sources[first].camera_name);
        lumi_calibration_find(
            c, lost, what,
            "shares nothing with the other cameras (%.0f points a picture, the others %.0f): its "
            "pictures are not used. Are they of this place, upright, not mirrored, in focus, and does "
            "it look where its neighbours look? Turn it towards them, and take them again",
            overlap, usual);
    }
}

static void find_alone(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c)
{
    for (int i = 0; i < run->count; i++)
        if (e->frames[i].matches < FEWEST_MATCHES)
            lumi_calibration_drop(c, i, "only %d matches with its neighbours", e->frames[i].matches);
}

int lumi_calibration_suspects(const struct lumi_run *run, const struct lumi_evidence *e, struct lumi_calibration *c,
                              struct lumi_error *error)
{
    lumi_calibration_missing(run, c);
    find_black(run, e, c);
    find_blurred(run, e, c);
    find_isolated(run, e, c);
    LUMI_TRY(lumi_calibration_wrong_priors(run, e, c, error));
    find_alone(run, e, c);
    return LUMI_OK;
}
