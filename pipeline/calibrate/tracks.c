/* Tracks from the files of the stages "features" and "pairs". */
#include "pipeline/calibrate/tracks.h"

#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/track_join.h"
#include "proto/base/memory.h"

#include <glib.h>

void lumi_tracks_defaults(struct lumi_tracks_settings *settings)
{
    *settings = (struct lumi_tracks_settings){.per_image = 400, .shortest = 3};
}

static int read_image(const struct lumi_run *run, int index, struct lumi_track_image *image, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, lumi_stage_features.name, index, lumi_stage_features.extension);
    struct lumi_features features;

    LUMI_TRY(lumi_features_read(path, &features, error));
    *image = (struct lumi_track_image){features.width, features.height, features.count, NULL, 0};
    image->places = lumi_alloc((size_t)(features.count ? features.count : 1), sizeof *image->places);
    for (int i = 0; image->places && i < features.count; i++)
        image->places[i] = (struct lumi_track_place){features.items[i].x, features.items[i].y, features.items[i].scale};
    lumi_features_finish(&features);
    return image->places ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", path);
}

static int read_pairs(const struct lumi_run *run, int index, GHashTable *names, struct lumi_track_graph *graph,
                      struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, lumi_stage_pairs.name, index, lumi_stage_pairs.extension);
    struct lumi_pair_list list;
    int code = LUMI_OK;

    LUMI_TRY(lumi_pairs_read(path, &list, error));
    for (int i = 0; i < list.count && code == LUMI_OK; i++) {
        const struct lumi_pair *pair = &list.items[i];
        const int other = GPOINTER_TO_INT(g_hash_table_lookup(names, pair->name)) - 1;
        for (int k = 0; k < pair->match_count && code == LUMI_OK; k++)
            code = lumi_track_graph_join(graph, index, pair->matches[k].a, other, pair->matches[k].b);
    }
    lumi_pairs_finish(&list);
    if (code == LUMI_ERR_FORMAT)
        return lumi_fail(error, code, "%s: matches features that are not there", path);
    return code == LUMI_OK ? code : lumi_fail(error, code, "not enough memory to join tracks");
}

int lumi_tracks_build(const struct lumi_run *run, const struct lumi_tracks_settings *settings,
                      struct lumi_tracks *tracks, struct lumi_error *error)
{
    g_autoptr(GHashTable) names = g_hash_table_new(g_str_hash, g_str_equal);
    struct lumi_track_graph graph = {.image_count = run->count};
    int code = LUMI_OK;

    *tracks = (struct lumi_tracks){0};
    graph.images = lumi_calloc((size_t)run->count, sizeof *graph.images);
    if (!graph.images)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to join tracks");
    for (int i = 0; i < run->count && code == LUMI_OK; i++) {
        g_hash_table_insert(names, run->sources[i].name, GINT_TO_POINTER(i + 1));
        code = read_image(run, i, &graph.images[i], error);
    }
    if (code == LUMI_OK && lumi_track_graph_begin(&graph) != LUMI_OK)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to join tracks");
    for (int i = 0; i < run->count && code == LUMI_OK; i++)
        code = read_pairs(run, i, names, &graph, error);
    if (code == LUMI_OK && lumi_track_graph_choose(&graph, settings, tracks) != LUMI_OK)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to join tracks");
    lumi_track_graph_finish(&graph);
    return code;
}
