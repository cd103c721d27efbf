/* Poses of a rig that is known to be other than its capture says: it turned the other way, or two of its cameras are in
 * each other's place. */
#include "pipeline/run/sources.h"

#include "proto/mechanism/kinematics.h"

#include <glib.h>
#include <string.h>

static int rig_camera(const struct lumi_rig *rig, const char *name)
{
    for (int i = 0; i < rig->camera_count; i++)
        if (!strcmp(rig->cameras[i].name, name))
            return i;
    return -1;
}

/* Where the mechanism has the camera that the source says it is of. */
static void place(const struct lumi_rig *rig, struct lumi_source *source)
{
    const int camera = rig_camera(rig, source->camera_name);

    if (camera < 0)
        return;
    lumi_rig_camera_pose_at(rig, camera, source->turn_angle, source->drop, &source->pose);
    source->prior = source->pose;
}

static void turn_round(struct lumi_run *run)
{
    run->rig->direction = -run->rig->direction;
    for (int i = 0; i < run->count; i++) {
        run->sources[i].turn_angle = 2 * run->rig->index - run->sources[i].turn_angle;
        place(run->rig, &run->sources[i]);
    }
}

/* What makes a source one of a camera's. */
static void take_camera(struct lumi_source *source, const struct lumi_source *from)
{
    source->camera = from->camera;
    source->lens_slot = from->lens_slot;
    source->lens = from->lens;
    memcpy(source->camera_name, from->camera_name, sizeof source->camera_name);
}

static const struct lumi_source *find_camera(const struct lumi_run *run, const char *name)
{
    for (int i = 0; i < run->count; i++)
        if (!strcmp(run->sources[i].camera_name, name))
            return &run->sources[i];
    return NULL;
}

static int exchange(struct lumi_run *run, const char *text, struct lumi_error *error)
{
    g_auto(GStrv) names = g_strsplit(text, ":", -1);
    const struct lumi_source *found[2] = {NULL, NULL};
    struct lumi_source kept[2];

    if (g_strv_length(names) != 2 || !strcmp(names[0], names[1]))
        return lumi_fail(error, LUMI_ERR_ARG, "--exchange %s: two cameras wanted, as c02:c03", text);
    for (int k = 0; k < 2; k++) {
        found[k] = find_camera(run, names[k]);
        if (!found[k] || rig_camera(run->rig, names[k]) < 0)
            return lumi_fail(error, LUMI_ERR_ARG, "--exchange %s: the capture has no camera %s", text, names[k]);
        kept[k] = *found[k];
    }
    for (int i = 0; i < run->count; i++) {
        struct lumi_source *source = &run->sources[i];
        const int k = !strcmp(source->camera_name, names[0]) ? 1 : !strcmp(source->camera_name, names[1]) ? 0 : -1;
        if (k < 0)
            continue;
        take_camera(source, &kept[k]);
        place(run->rig, source);
    }
    return LUMI_OK;
}

int lumi_sources_mend(struct lumi_run *run, struct lumi_error *error)
{
    const struct lumi_parameters *p = &run->parameters;

    if (!p->backwards && !p->exchange)
        return LUMI_OK;
    bool priors = run->rig != NULL;
    for (int i = 0; i < run->count; i++)
        priors = priors && run->sources[i].pose_source == LUMI_POSE_PRIOR;
    if (!priors)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "%s: its poses are not those of a rig: --backwards and --exchange change nothing",
                         run->capture);
    if (p->backwards)
        turn_round(run);
    g_auto(GStrv) pairs = g_strsplit(p->exchange ? p->exchange : "", ",", -1);
    for (int i = 0; pairs[i]; i++)
        LUMI_TRY(exchange(run, pairs[i], error));
    return LUMI_OK;
}
