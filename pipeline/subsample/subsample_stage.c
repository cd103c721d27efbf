/* The stage `subsample`: flags and synthetic views over the frames that calibration left. */
#include "pipeline/calibrate/rig_mask.h"
#include "pipeline/geometry/disks.h"
#include "pipeline/run/places.h"
#include "pipeline/subsample/poles.h"
#include "pipeline/subsample/spread.h"
#include "pipeline/subsample/stand.h"
#include "pipeline/subsample/subsample.h"

#include <glib.h>
#include <string.h>

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.subsample || run->wants.synthesize;
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)index;
    for (int i = 0; run->wants.synthesize && i < run->count; i++)
        LUMI_TRY(lumi_rig_mask_key(k, run, i, error));
    lumi_key_int(k, run->wants.subsample);
    lumi_key_int(k, run->wants.synthesize);
    lumi_key_double(k, run->parameters.density);
    lumi_key_double(k, run->parameters.stand_m);
    if (run->wants.calibrate) {
        lumi_key_input(k, run, "calibrate", -1);
        return LUMI_OK;
    }
    for (int i = 0; i < run->count; i++) {
        lumi_key_bytes(k, run->sources[i].name, strlen(run->sources[i].name) + 1);
        lumi_key_lens(k, &run->sources[i].lens);
        lumi_key_pose(k, &run->sources[i].pose);
    }
    return LUMI_OK;
}

/* The used places, and the surface their centres lie on. */
struct layout {
    int count;
    int *used; /* indices of places */
    struct lumi_vec3 *points;
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;
    bool inward;
    struct lumi_spacing spacing;
};

static void layout_init(struct layout *layout, const struct lumi_places *places)
{
    g_autofree struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)places->count + 1);
    double outward = 0;

    *layout = (struct layout){.used = g_new(int, (gsize)places->count + 1),
                              .points = g_new(struct lumi_vec3, (gsize)places->count + 1)};
    for (int i = 0; i < places->count; i++)
        if (places->items[i].used) {
            layout->used[layout->count] = i;
            poses[layout->count] = places->items[i].pose;
            layout->points[layout->count++] = places->items[i].pose.t;
        }
    if (layout->count == 0)
        return;
    lumi_surface_fit(layout->count, poses, &layout->surface, &layout->centre, &layout->radius);
    for (int i = 0; i < layout->count; i++)
        outward += lumi_dot(lumi_axis(&poses[i], 2), lumi_sub(poses[i].t, layout->centre));
    layout->inward = outward < 0;
    layout->spacing = lumi_spacing_measure(layout->count, layout->points, layout->centre);
}

static void layout_finish(struct layout *layout)
{
    g_free(layout->used);
    g_free(layout->points);
}

static void thin(const struct lumi_run *run, const struct layout *layout, struct lumi_places *places)
{
    g_autofree bool *kept = g_new(bool, (gsize)layout->count + 1);

    lumi_spread_keep(layout->count, layout->points, layout->centre, layout->spacing, run->parameters.density, kept);
    for (int i = 0; i < layout->count; i++)
        places->items[layout->used[i]].kept = kept[i];
}

/* The lens most of the photographs were taken with. */
static int common_lens(const struct layout *layout, const struct lumi_places *places)
{
    g_autofree int *uses = g_new0(int, (gsize)places->lens_count + 1);
    int most = 0;

    for (int i = 0; i < layout->count; i++)
        uses[places->items[layout->used[i]].lens]++;
    for (int i = 1; i < places->lens_count; i++)
        most = uses[i] > uses[most] ? i : most;
    return most;
}

static int add_pole(const struct lumi_run *run, const struct layout *layout, bool bottom, struct lumi_places *places,
                    struct lumi_error *error)
{
    const double gap = lumi_pole_gap(layout->count, layout->points, layout->centre, bottom);
    const int lens = common_lens(layout, places);
    g_autofree struct lumi_pose *poses = NULL;
    const int count = lumi_pole_poses(layout->centre, layout->radius, gap, bottom, layout->inward, layout->spacing,
                                      run->parameters.density, &poses);
    int code = LUMI_OK;

    for (int i = 0; code == LUMI_OK && i < count; i++) {
        struct lumi_place place = {.lens = lens, .pose = poses[i], .used = true, .kept = true, .synthetic = true};
        g_snprintf(place.name, sizeof place.name, "pole-%s-%03d", bottom ? "bottom" : "top", i);
        while (lumi_places_find(places, place.name) >= 0)
            g_strlcat(place.name, "_", sizeof place.name);
        code = lumi_places_add(places, &place, error);
    }
    return code;
}

/* Pixels of the stand are found where there is depth; here it is who may have any. */
static void mark_stand(const struct lumi_run *run, const struct layout *layout, struct lumi_places *places)
{
    const double gap = lumi_pole_gap(layout->count, layout->points, layout->centre, true);
    const double floor = layout->centre.z - layout->radius - LUMI_STAND_REACH;
    struct lumi_stand stand;

    if (run->parameters.stand_m == 0 || layout->inward ||
        !lumi_stand_place(layout->centre, layout->radius, gap, run->parameters.stand_m, floor, &stand))
        return;
    for (int i = 0; i < layout->count; i++) {
        struct lumi_place *place = &places->items[layout->used[i]];
        place->masked = lumi_stand_seen(&stand, &places->lenses[place->lens], &place->pose);
    }
}

/* And who shows the rig itself. */
static int mark_rig(const struct lumi_run *run, struct lumi_places *places, struct lumi_error *error)
{
    for (int i = 0; i < run->count; i++) {
        const int at = lumi_places_find(places, run->sources[i].name);
        struct lumi_raster mask;
        bool rig = false;

        if (at < 0 || !places->items[at].used)
            continue;
        LUMI_TRY(lumi_rig_mask_read(run, i, &mask, error));
        for (int y = 0; mask.data && y < mask.height && !rig; y++)
            rig = memchr(lumi_row_u8(&mask, y), 0, (size_t)mask.width) != NULL;
        places->items[at].masked = places->items[at].masked || rig;
        lumi_raster_finish(&mask);
    }
    return LUMI_OK;
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    struct lumi_places places;
    struct layout layout;
    int code;

    (void)state;
    (void)index;
    (void)thread;
    LUMI_TRY(lumi_run_calibrated_places(run, &places, error));
    layout_init(&layout, &places);
    if (run->wants.subsample && layout.count > 0)
        thin(run, &layout, &places);
    code = LUMI_OK;
    if (run->wants.synthesize && layout.count > 0 && layout.surface == LUMI_SURFACE_SPHERE) {
        mark_stand(run, &layout, &places);
        code = mark_rig(run, &places, error);
        if (code == LUMI_OK)
            code = add_pole(run, &layout, false, &places, error);
        if (code == LUMI_OK)
            code = add_pole(run, &layout, true, &places, error);
    }
    if (code == LUMI_OK)
        code = lumi_places_write(path, &places, error);
    layout_finish(&layout);
    lumi_places_finish(&places);
    return code;
}

const struct lumi_stage lumi_stage_subsample = {
    .name = "subsample",
    .title = "choice of views",
    .version = 2,
    .extension = ".places",
    .whole = true,
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .make = make,
};
