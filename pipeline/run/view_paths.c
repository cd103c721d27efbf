/* Which file stands for a picture, after which stages; and which views a placed run has. */
#include "pipeline/run/key.h"
#include "pipeline/run/places.h"
#include "pipeline/run/run_priv.h"
#include "pipeline/run/sources.h"
#include "proto/image/image.h"

#include <glib.h>
#include <string.h>

void lumi_key_lens(struct lumi_key *key, const struct lumi_lens *lens)
{
    const double numbers[] = {lens->fx, lens->fy, lens->cx, lens->cy, lens->k1,
                              lens->k2, lens->k3, lens->k4, lens->p1, lens->p2};

    lumi_key_int(key, lens->model);
    lumi_key_int(key, lens->width);
    lumi_key_int(key, lens->height);
    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        lumi_key_double(key, numbers[i]);
}

void lumi_key_pose(struct lumi_key *key, const struct lumi_pose *pose)
{
    for (int i = 0; i < 9; i++)
        lumi_key_double(key, pose->r[i]);
    lumi_key_double(key, pose->t.x);
    lumi_key_double(key, pose->t.y);
    lumi_key_double(key, pose->t.z);
}

void lumi_key_grid(struct lumi_key *key, const struct lumi_grid *grid)
{
    lumi_key_int(key, grid->width);
    lumi_key_int(key, grid->height);
    for (int i = 0; i <= grid->cols; i++)
        lumi_key_double(key, grid->tan_x[i]);
    for (int i = 0; i <= grid->rows; i++)
        lumi_key_double(key, grid->tan_y[i]);
}

int lumi_run_check_view(const struct lumi_run *run, const struct lumi_raster *raster, const char *path,
                        struct lumi_error *error)
{
    if (raster->width == run->grid.width && raster->height == run->grid.height)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is %d × %d pixels, the views are %d × %d", path, raster->width,
                     raster->height, run->grid.width, run->grid.height);
}

char *lumi_run_image(const struct lumi_run *run, int index)
{
    const struct lumi_source *source = &run->sources[index];

    return source->part_count ? lumi_run_path(run, "merge", index, ".exr") : g_strdup(source->path);
}

int lumi_source_read(const struct lumi_source *source, const char *path, struct lumi_raster *raster,
                     struct lumi_error *error)
{
    struct lumi_image_development development = {{0}, false};

    memcpy(development.white, source->white, sizeof development.white);
    return lumi_image_read_developed(path, 3, &development, raster, NULL, error);
}

void lumi_key_white(struct lumi_key *key, const struct lumi_source *source)
{
    for (int c = 0; source->white[1] > 0 && c < 3; c++)
        lumi_key_double(key, source->white[c]);
}

void lumi_key_image(struct lumi_key *key, const struct lumi_run *run, int index)
{
    const struct lumi_source *source = &run->sources[index];

    if (source->part_count)
        lumi_key_input(key, run, "merge", index);
    else
        lumi_key_bytes(key, source->sha256, strlen(source->sha256));
    if (!source->part_count)
        lumi_key_white(key, source);
}

static const char *stage_of(const struct lumi_run *run, int index, enum lumi_view_part part)
{
    const struct lumi_source *source = &run->sources[index];
    const bool filled = source->synthetic || source->masked;

    if (part == LUMI_VIEW_FINAL && run->wants.color)
        return "color";
    if (part >= LUMI_VIEW_FILTERED && run->wants.prefilter)
        return "prefilter";
    if (filled)
        return "synthesize";
    return part == LUMI_VIEW_DEPTH ? "depth" : "equiangular";
}

char *lumi_run_view(const struct lumi_run *run, int index, enum lumi_view_part part)
{
    return lumi_run_path(run, stage_of(run, index, part), index, ".exr");
}

void lumi_key_view(struct lumi_key *key, const struct lumi_run *run, int index, enum lumi_view_part part)
{
    lumi_key_input(key, run, stage_of(run, index, part), index);
}

int lumi_run_frames_places(const struct lumi_run *run, struct lumi_places *places, struct lumi_error *error)
{
    int code = LUMI_OK;

    *places = (struct lumi_places){0};
    for (int i = 0; code == LUMI_OK && i < run->count; i++) {
        const struct lumi_source *source = &run->sources[i];
        struct lumi_place place = {.pose = source->pose, .used = true, .kept = true};
        g_strlcpy(place.name, source->name, sizeof place.name);
        code = lumi_places_add_lens(places, &source->lens, &place.lens, error);
        if (code == LUMI_OK)
            code = lumi_places_add(places, &place, error);
    }
    if (code != LUMI_OK)
        lumi_places_finish(places);
    return code;
}

static int read_places(const struct lumi_run *run, const char *stage, struct lumi_places *places,
                       struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, stage, -1, ".places");

    if (!g_file_test(path, G_FILE_TEST_EXISTS))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: stage '%s' has not been run", run->work, stage);
    return lumi_places_read(path, places, error);
}

int lumi_run_calibrated_places(const struct lumi_run *run, struct lumi_places *places, struct lumi_error *error)
{
    return run->wants.calibrate ? read_places(run, "calibrate", places, error)
                                : lumi_run_frames_places(run, places, error);
}

/* The source that a place speaks of, moved out of the run; or a new one. */
static int take_source(struct lumi_run *run, GHashTable *by_name, const struct lumi_places *places,
                       const struct lumi_place *place, struct lumi_source *source, struct lumi_error *error)
{
    const int at = GPOINTER_TO_INT(g_hash_table_lookup(by_name, place->name)) - 1;

    if (place->synthetic) {
        if (at >= 0)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a synthetic view has the name of the frame %s", run->work,
                             place->name);
        *source = (struct lumi_source){.row = -1, .column = -1, .camera = -1};
        g_strlcpy(source->name, place->name, sizeof source->name);
    } else {
        if (at < 0)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a place is given for %s, which the capture does not have",
                             run->work, place->name);
        *source = run->sources[at];
        run->sources[at].path = NULL;
        run->sources[at].parts = NULL;
        run->sources[at].part_count = 0;
    }
    source->lens = places->lenses[place->lens];
    source->pose = place->pose;
    source->synthetic = place->synthetic;
    source->masked = place->masked;
    source->kept = place->kept;
    return LUMI_OK;
}

static int place_sources(struct lumi_run *run, const struct lumi_places *places, struct lumi_error *error)
{
    g_autoptr(GHashTable) by_name = g_hash_table_new(g_str_hash, g_str_equal);
    struct lumi_source *sources = g_new0(struct lumi_source, places->count + 1);
    int count = 0, code = LUMI_OK;

    for (int i = 0; i < run->count; i++)
        g_hash_table_insert(by_name, run->sources[i].name, GINT_TO_POINTER(i + 1));
    for (int synthetic = 0; synthetic < 2; synthetic++) {
        for (int i = 0; code == LUMI_OK && i < places->count; i++) {
            const struct lumi_place *place = &places->items[i];
            if (place->used && place->synthetic == (bool)synthetic) {
                code = take_source(run, by_name, places, place, &sources[count], error);
                count += code == LUMI_OK;
            }
        }
        run->dense = synthetic ? run->dense : count;
    }
    for (int i = 0; i < run->count; i++)
        sources_free(&run->sources[i]);
    g_free(run->sources);
    run->sources = sources;
    run->count = count;
    return code;
}

void run_list_kept(struct lumi_run *run)
{
    g_free(run->kept);
    run->kept = g_new(int, run->count + 1);
    run->kept_count = 0;
    for (int i = 0; i < run->count; i++)
        if (run->sources[i].kept)
            run->kept[run->kept_count++] = i;
}

int lumi_run_place(struct lumi_run *run, struct lumi_error *error)
{
    struct lumi_places places;
    int code;

    if (run->placed)
        return LUMI_OK;
    if (run->wants.subsample || run->wants.synthesize)
        LUMI_TRY(read_places(run, "subsample", &places, error));
    else
        LUMI_TRY(lumi_run_calibrated_places(run, &places, error));
    code = place_sources(run, &places, error);
    lumi_places_finish(&places);
    run_list_kept(run);
    if (code == LUMI_OK && (run->dense == 0 || run->kept_count == 0))
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: none of its pictures can be used%s", run->capture,
                         run->wants.calibrate ? ": calibrate/report.txt in the work directory says why" : "");
    run->placed = code == LUMI_OK;
    return code;
}
