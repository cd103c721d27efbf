/* The stage "calibrate": files in and out. */
#include "pipeline/calibrate/calibrate_stage.h"

#include "pipeline/calibrate/calibration.h"
#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"
#include "pipeline/calibrate/tracks.h"
#include "pipeline/run/places.h"
#include "proto/base/file.h"

#include <math.h>
#include <string.h>

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.calibrate;
}

static int key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)index;
    (void)error;
    lumi_key_int(key, run->count);
    lumi_key_int(key, run->rig != NULL);
    lumi_key_int(key, run->parameters.rolling_shutter);
    if (run->rig) {
        g_autofree char *text = g_malloc(LUMI_RIG_TEXT_MAX);
        lumi_rig_print(run->rig, text, LUMI_RIG_TEXT_MAX);
        lumi_key_bytes(key, text, strlen(text));
    }
    for (int i = 0; i < run->count; i++) {
        const struct lumi_source *source = &run->sources[i];
        lumi_key_bytes(key, source->name, strlen(source->name) + 1);
        lumi_key_bytes(key, source->camera_name, strlen(source->camera_name) + 1);
        lumi_key_int(key, source->lens_slot);
        lumi_key_int(key, source->position);
        lumi_key_double(key, source->turn_angle);
        lumi_key_double(key, source->drop);
        lumi_key_lens(key, &source->lens);
        lumi_key_pose(key, &source->prior);
        lumi_key_input(key, run, lumi_stage_features.name, i);
        lumi_key_input(key, run, lumi_stage_pairs.name, i);
    }
    return LUMI_OK;
}

static void take_motion(GArray *motions, int a, int b, const struct lumi_pair *pair)
{
    struct lumi_motion motion = {a, b, pair->free_count, pair->free_outside, {0}, pair->direction};

    memcpy(motion.rotation, pair->rotation, sizeof motion.rotation);
    g_array_append_val(motions, motion);
}

static int read_pairs(const struct lumi_run *run, int index, GHashTable *names, struct lumi_frame_evidence *frames,
                      GArray *motions, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, lumi_stage_pairs.name, index, lumi_stage_pairs.extension);
    struct lumi_pair_list list;

    LUMI_TRY(lumi_pairs_read(path, &list, error));
    for (int i = 0; i < list.count; i++) {
        const struct lumi_pair *pair = &list.items[i];
        int other = GPOINTER_TO_INT(g_hash_table_lookup(names, pair->name)) - 1;
        if (other < 0)
            continue;
        frames[index].partners += pair->match_count > 0;
        frames[other].partners += pair->match_count > 0;
        frames[index].matches += pair->match_count;
        frames[other].matches += pair->match_count;
        if (run->sources[index].camera != run->sources[other].camera) {
            frames[index].foreign += pair->match_count;
            frames[other].foreign += pair->match_count;
        }
        take_motion(motions, index, other, pair);
    }
    lumi_pairs_finish(&list);
    return LUMI_OK;
}

static int read_evidence(const struct lumi_run *run, struct lumi_frame_evidence *frames, GArray *motions,
                         struct lumi_error *error)
{
    g_autoptr(GHashTable) names = g_hash_table_new(g_str_hash, g_str_equal);

    for (int i = 0; i < run->count; i++) {
        g_autofree char *path = lumi_run_path(run, lumi_stage_features.name, i, lumi_stage_features.extension);
        struct lumi_features features;
        LUMI_TRY(lumi_features_read(path, &features, error));
        frames[i].features = features.count;
        frames[i].mean = features.mean;
        frames[i].sharpness = features.sharpness;
        lumi_features_finish(&features);
        g_hash_table_insert(names, run->sources[i].name, GINT_TO_POINTER(i + 1));
    }
    for (int i = 0; i < run->count; i++)
        LUMI_TRY(read_pairs(run, i, names, frames, motions, error));
    return LUMI_OK;
}

static int write_places(const struct lumi_run *run, const struct lumi_calibration *c, const char *path,
                        struct lumi_error *error)
{
    struct lumi_places places = {0};
    int code = LUMI_OK;

    for (int i = 0; i < run->count && code == LUMI_OK; i++) {
        struct lumi_place place = {.pose = c->poses[i], .used = c->frames[i].used, .kept = c->frames[i].used};
        g_strlcpy(place.name, run->sources[i].name, sizeof place.name);
        g_strlcpy(place.why, c->frames[i].why, sizeof place.why);
        code = lumi_places_add_lens(&places, &c->lenses[c->lens_of[i]].after, &place.lens, error);
        if (code == LUMI_OK)
            code = lumi_places_add(&places, &place, error);
    }
    if (code == LUMI_OK)
        code = lumi_places_write(path, &places, error);
    lumi_places_finish(&places);
    return code;
}

/* Beside the stage's output, whole or not at all. */
static int write_report(const struct lumi_run *run, const char *name, const char *text, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(run->work, lumi_stage_calibrate.name, name, NULL);

    return lumi_file_write(path, text, strlen(text), false, error);
}

/* What was found before it came to nothing is as good as a reason. */
static void refuse(const struct lumi_run *run, struct lumi_calibration *c, struct lumi_error *error)
{
    struct lumi_error reason = error ? *error : (struct lumi_error){0};
    g_autofree char *refused = lumi_calibration_refusal(c, reason.text);

    write_report(run, "report.txt", refused, NULL);
    if (c->findings->len)
        lumi_fail(error, LUMI_ERR_FORMAT, "%s; %u more to look at: %s/%s/report.txt", reason.text, c->findings->len,
                  run->work, lumi_stage_calibrate.name);
    lumi_calibration_finish(c);
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    g_autofree struct lumi_frame_evidence *frames = g_new0(struct lumi_frame_evidence, (gsize)run->count);
    g_autoptr(GArray) motions = g_array_new(FALSE, FALSE, sizeof(struct lumi_motion));
    struct lumi_tracks_settings settings;
    struct lumi_calibration c = {0};
    struct lumi_tracks tracks = {0};
    int code;

    (void)state;
    (void)index;
    (void)thread;
    lumi_tracks_defaults(&settings);
    LUMI_TRY(read_evidence(run, frames, motions, error));
    LUMI_TRY(lumi_tracks_build(run, &settings, &tracks, error));
    const struct lumi_evidence evidence = {frames, (int)motions->len, (struct lumi_motion *)(void *)motions->data,
                                           true};
    code = lumi_calibrate(run, &evidence, &tracks, &c, error);
    lumi_tracks_finish(&tracks);
    if (code == LUMI_ERR_FORMAT)
        refuse(run, &c, error);
    if (code != LUMI_OK)
        return code;
    g_autofree char *text = lumi_calibration_text(run, &c), *json = lumi_calibration_json(run, &c);
    code = write_report(run, "report.txt", text, error);
    if (code == LUMI_OK)
        code = write_report(run, "report.json", json, error);
    if (code == LUMI_OK)
        code = write_places(run, &c, path, error);
    lumi_calibration_finish(&c);
    return code;
}

static char *read_report(const struct lumi_run *run)
{
    g_autofree char *path = g_build_filename(run->work, lumi_stage_calibrate.name, "report.txt", NULL);
    char *text = NULL;

    return run->wants.calibrate && g_file_get_contents(path, &text, NULL, NULL) ? text : NULL;
}

char *lumi_calibrate_line(const struct lumi_run *run)
{
    char *text = read_report(run);

    if (text)
        text[strcspn(text, "\n")] = 0;
    return text;
}

char *lumi_calibrate_remarks(const struct lumi_run *run)
{
    g_autofree char *text = read_report(run);
    GString *remarks = g_string_new(NULL);
    const char *at = text ? strstr(text, "\n" TO_LOOK_AT "\n") : NULL;

    /* The lines of that section are indented; an empty one ends it. */
    for (at = at ? at + strlen("\n" TO_LOOK_AT "\n") : NULL; at && g_str_has_prefix(at, "  ");) {
        const size_t length = strcspn(at, "\n");
        g_string_append_len(remarks, at + 2, (gssize)length - 2);
        g_string_append_c(remarks, '\n');
        at += length + (at[length] == '\n');
    }
    return g_string_free(remarks, FALSE);
}

const struct lumi_stage lumi_stage_calibrate = {.name = "calibrate",
                                                .title = "calibrating",
                                                .version = 7,
                                                .extension = ".places",
                                                .whole = true,
                                                .set = LUMI_SET_FRAMES,
                                                .wanted = wanted,
                                                .key = key,
                                                .make = make,
                                                .serial = true};
