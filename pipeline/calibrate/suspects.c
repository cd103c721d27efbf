/* What is wrong with pictures before anything is solved. */
#include "pipeline/calibrate/calibration.h"

#include "proto/base/sort.h"

#include <string.h>

#define BLACK 0.02        /* of full brightness: less is a lens cap, or a shutter that did not open */
#define FEW_FEATURES 20   /* in a picture that is not black */
#define BLURRED 0.5       /* of the sharpness of the other cameras */
#define FEWEST_MATCHES 15 /* with all neighbours together */

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

static void find_missing_rows(const struct lumi_run *run, struct lumi_calibration *c)
{
    if (!run->rig)
        return;
    for (int camera = 0; camera < run->rig->camera_count; camera++)
        for (int turn = 0; turn < run->rig->turns; turn++) {
            int there = 0;
            for (int i = 0; i < run->count; i++)
                there += run->sources[i].turn == turn && lumi_calibration_rig_camera(run, i) == camera;
            if (there == run->rig->positions || (there > 0 && there > run->rig->positions / 2))
                continue;
            g_autofree char *what = g_strdup_printf("camera %s", run->rig->cameras[camera].name);
            lumi_calibration_find(c, 0, what,
                                  "has %d of %d pictures in turn %d%s; the light field is thin there. Take the row "
                                  "again, or import it if it was forgotten",
                                  there, run->rig->positions, turn, there ? "" : ": a missing row");
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
    find_missing_rows(run, c);
    find_black(run, e, c);
    find_blurred(run, e, c);
    LUMI_TRY(lumi_calibration_wrong_priors(run, e, c, error));
    find_alone(run, e, c);
    return LUMI_OK;
}
