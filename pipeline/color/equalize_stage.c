/* The stage `equalize`: matches and pictures in, gains and vignetting out. */
#include "pipeline/color/equalize_stage.h"

#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"
#include "pipeline/color/equalize.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/base/sort.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <string.h>

enum { MATCHES = 40, FEW = 10 }; /* taken of a pair; points below which a picture is named */

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.equalize;
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)index;
    (void)error;
    lumi_key_int(k, run->dense);
    for (int i = 0; i < run->dense; i++) {
        lumi_key_bytes(k, run->sources[i].name, strlen(run->sources[i].name) + 1);
        lumi_key_lens(k, &run->sources[i].lens);
        lumi_key_image(k, run, i);
        lumi_key_white(k, &run->sources[i]);
        lumi_key_input(k, run, "features", i);
        lumi_key_input(k, run, "pairs", i);
    }
    return LUMI_OK;
}

/* One end of a match: a feature of a picture, and what is seen there. */
struct end {
    float x, y, scale;
    float light[3], sigma, r2;
    bool seen;
};

struct looking {
    const struct lumi_run *run;
    struct lumi_same_point *points;
    struct end *ends; /* of point i: 2 i and 2 i + 1 */
    int count;
    GArray **of;               /* a picture: which ends are its */
    struct lumi_error *errors; /* a picture */
};

/* Features are told by their number: what a picture's matches need of them. */
static int place_ends(struct looking *looking, int index, const struct lumi_features *features,
                      struct lumi_error *error)
{
    for (guint i = 0; i < looking->of[index]->len; i++) {
        const int at = g_array_index(looking->of[index], int, i);
        struct end *end = &looking->ends[at];
        /* Until now x holds the feature's number, which is below 2²⁴. */
        const int number = (int)end->x;
        if (number < 0 || number >= features->count)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a match is of a feature that is not there",
                             looking->run->sources[index].name);
        end->x = features->items[number].x;
        end->y = features->items[number].y;
        end->scale = features->items[number].scale;
    }
    return LUMI_OK;
}

static int read_linear(const struct lumi_run *run, int index, struct lumi_raster *linear, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_image(run, index);
    struct lumi_raster raster;

    LUMI_TRY(lumi_source_read(&run->sources[index], path, &raster, error));
    if (raster.sample == LUMI_F32) {
        *linear = raster;
        return LUMI_OK;
    }
    int code = lumi_raster_convert(&raster, LUMI_F32, linear);
    lumi_raster_finish(&raster);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "%s: no memory to read it", path);
}

static int look_at(void *context, int index, int thread)
{
    struct looking *looking = context;
    const struct lumi_source *source = &looking->run->sources[index];
    g_autofree char *path = lumi_run_path(looking->run, "features", index, ".feat");
    struct lumi_features features = {0};
    struct lumi_raster picture = {0};
    int code;

    (void)thread;
    if (looking->of[index]->len == 0)
        return LUMI_OK;
    LUMI_GOTO(code, done, lumi_features_read(path, &features, &looking->errors[index]));
    LUMI_GOTO(code, done, place_ends(looking, index, &features, &looking->errors[index]));
    LUMI_GOTO(code, done, read_linear(looking->run, index, &picture, &looking->errors[index]));
    for (guint i = 0; i < looking->of[index]->len; i++) {
        struct end *end = &looking->ends[g_array_index(looking->of[index], int, i)];
        end->seen = lumi_light_around(&picture, source->part_count == 0, (double)end->x, (double)end->y,
                                      (double)end->scale, end->light, &end->sigma);
        end->r2 = (float)lumi_vignetting_radius2(&source->lens, (double)end->x, (double)end->y);
    }
done:
    lumi_raster_finish(&picture);
    lumi_features_finish(&features);
    return code;
}

/* The matches of a picture with its partners, MATCHES of each, evenly from all. */
static int list_matches(const struct lumi_run *run, int index, GHashTable *by_name, GArray *points, GArray *ends,
                        struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "pairs", index, ".pairs");
    struct lumi_pair_list list;

    LUMI_TRY(lumi_pairs_read(path, &list, error));
    for (int p = 0; p < list.count; p++) {
        const struct lumi_pair *pair = &list.items[p];
        const int partner = GPOINTER_TO_INT(g_hash_table_lookup(by_name, pair->name)) - 1;
        const int taken = MIN(pair->match_count, MATCHES);
        for (int i = 0; partner >= 0 && partner != index && i < taken; i++) {
            const struct lumi_match *match = &pair->matches[(long long)i * pair->match_count / taken];
            const struct lumi_same_point point = {.a = index, .b = partner};
            const struct end both[2] = {{.x = (float)MIN(match->a, 1u << 23)}, {.x = (float)MIN(match->b, 1u << 23)}};
            g_array_append_val(points, point);
            g_array_append_vals(ends, both, 2);
        }
    }
    lumi_pairs_finish(&list);
    return LUMI_OK;
}

static int look_at_all(struct looking *looking, struct lumi_error *error)
{
    const struct lumi_run *run = looking->run;
    int code;

    looking->of = g_new(GArray *, run->dense);
    looking->errors = g_new0(struct lumi_error, run->dense);
    for (int i = 0; i < run->dense; i++)
        looking->of[i] = g_array_new(FALSE, FALSE, sizeof(int));
    for (int i = 0; i < 2 * looking->count; i++) {
        const struct lumi_same_point *point = &looking->points[i / 2];
        g_array_append_val(looking->of[i % 2 ? point->b : point->a], i);
    }
    code = lumi_parallel_for(run->dense, run->threads, look_at, looking);
    for (int i = 0; code != LUMI_OK && i < run->dense; i++)
        if (looking->errors[i].code == code && error) {
            *error = looking->errors[i];
            break;
        }
    for (int i = 0; i < run->dense; i++)
        g_array_unref(looking->of[i]);
    g_free(looking->of);
    g_free(looking->errors);
    return code;
}

/* Points whose both ends tell something, at the front. */
static int keep_seen(struct looking *looking)
{
    int kept = 0;

    for (int i = 0; i < looking->count; i++) {
        const struct end *a = &looking->ends[2 * i], *b = &looking->ends[2 * i + 1];
        struct lumi_same_point point = looking->points[i];
        if (!a->seen || !b->seen)
            continue;
        point.r2_a = a->r2;
        point.r2_b = b->r2;
        point.sigma = hypotf(a->sigma, b->sigma);
        for (int c = 0; c < 3; c++)
            point.difference[c] = logf(a->light[c] / b->light[c]);
        looking->points[kept++] = point;
    }
    return kept;
}

/* Median gain of a camera's pictures, in stops of the mean of the channels. */
static double camera_stops(const struct lumi_run *run, const struct lumi_gains *gains, int camera, int *count)
{
    g_autofree double *values = g_new(double, run->dense);

    *count = 0;
    for (int i = 0; i < run->dense; i++) {
        const struct lumi_gain *gain = lumi_gains_find(gains, run->sources[i].name);
        if (run->sources[i].camera == camera && gain)
            values[(*count)++] = log2(gain->gain[0] * gain->gain[1] * gain->gain[2]) / 3;
    }
    return lumi_sort_median(values, *count);
}

static int write_report(const struct lumi_run *run, const struct lumi_gains *gains,
                        const struct lumi_equalize_report *report, int points, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(run->work, "equalize", "report.txt", NULL);
    g_autoptr(GString) text = g_string_new(NULL);
    int cameras = 0, count;

    g_string_append_printf(text,
                           "%d points in %d pictures; what two pictures say of one differs by %.1f %%, before by "
                           "%.1f %%\n",
                           points, run->dense, 100 * report->spread, 100 * report->before);
    for (int k = 0; k < gains->lens_count; k++)
        g_string_append_printf(text, "lens %d: its corners get %.1f %% of the light\n", k,
                               100 * exp(lumi_vignetting_log(gains->vignetting[k], 1)));
    for (int i = 0; i < run->dense; i++)
        cameras = MAX(cameras, run->sources[i].camera + 1);
    for (int camera = 0; camera < cameras; camera++) {
        double stops = camera_stops(run, gains, camera, &count);
        int first = 0;
        while (count > 0 && run->sources[first].camera != camera)
            first++;
        if (count > 0)
            g_string_append_printf(text, "camera %s: %+.2f stops\n", run->sources[first].camera_name, stops);
    }
    for (int i = 0; i < run->dense; i++)
        if (report->points[i] < FEW)
            g_string_append_printf(text, "%s: only %d points are shared with others: %s\n", run->sources[i].name,
                                   report->points[i],
                                   report->points[i] ? "its gain is uncertain" : "it stays as it is");
    return lumi_file_write(path, text->str, text->len, false, error);
}

/* Equal lenses of the calibration are one. */
static int number_lenses(const struct lumi_run *run, int *lenses)
{
    g_autofree int *first = g_new(int, run->dense);
    int count = 0;

    for (int i = 0; i < run->dense; i++) {
        int k = 0;
        while (k < count && !lumi_lens_equal(&run->sources[first[k]].lens, &run->sources[i].lens))
            k++;
        if (k == count)
            first[count++] = i;
        lenses[i] = k;
    }
    return count;
}

static int solve(const struct lumi_run *run, const struct looking *looking, int points, const char *path,
                 struct lumi_error *error)
{
    g_autofree int *lenses = g_new(int, run->dense), *seen = g_new0(int, run->dense);
    g_autofree const char **names = g_new(const char *, run->dense);
    struct lumi_equalize_report report = {.points = seen};
    struct lumi_gains gains;

    for (int i = 0; i < run->dense; i++)
        names[i] = run->sources[i].name;
    const int lens_count = number_lenses(run, lenses);
    LUMI_TRY(lumi_equalize(looking->points, points, names, lenses, run->dense, lens_count, &gains, &report, error));
    int code = lumi_gains_write(path, &gains, error);
    if (code == LUMI_OK)
        code = write_report(run, &gains, &report, points, error);
    lumi_gains_finish(&gains);
    return code;
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    g_autoptr(GHashTable) by_name = g_hash_table_new(g_str_hash, g_str_equal);
    g_autoptr(GArray) points = g_array_new(FALSE, TRUE, sizeof(struct lumi_same_point));
    g_autoptr(GArray) ends = g_array_new(FALSE, TRUE, sizeof(struct end));
    struct looking looking = {.run = run};

    (void)state;
    (void)index;
    (void)thread;
    for (int i = 0; i < run->dense; i++)
        g_hash_table_insert(by_name, run->sources[i].name, GINT_TO_POINTER(i + 1));
    for (int i = 0; i < run->dense; i++)
        LUMI_TRY(list_matches(run, i, by_name, points, ends, error));
    looking.points = (struct lumi_same_point *)(void *)points->data;
    looking.ends = (struct end *)(void *)ends->data;
    looking.count = (int)points->len;
    LUMI_TRY(look_at_all(&looking, error));
    return solve(run, &looking, keep_seen(&looking), path, error);
}

const struct lumi_stage lumi_stage_equalize = {
    .name = "equalize",
    .title = "exposure and vignetting",
    .version = 2,
    .extension = ".json",
    .whole = true,
    .set = LUMI_SET_DENSE,
    .wanted = wanted,
    .key = key,
    .make = make,
    .bytes_per_pixel = 30,
};
