/* Joining matches to tracks and choosing among them, in memory: what tracks.h does with a run's files. */
#ifndef LUMI_PIPELINE_CALIBRATE_TRACK_JOIN_H
#define LUMI_PIPELINE_CALIBRATE_TRACK_JOIN_H

#include "pipeline/calibrate/tracks.h"

/* A feature's place; those of one picture that have the very same place are one (a point with two directions). */
struct lumi_track_place {
    float x, y, scale;
};

struct lumi_track_image {
    int width, height, count;
    struct lumi_track_place *places;
    int first; /* number of its first feature among all */
};

struct lumi_track_edge {
    int a, b; /* features, numbered among all */
};

struct lumi_track_graph {
    int image_count;
    struct lumi_track_image *images; /* owned, places too */
    int node_count;                  /* features of all */
    int *parent;                     /* owned; of lumi_track_graph_begin */
    int edge_count, edge_room;
    struct lumi_track_edge *edges; /* owned */
};

/* After the images are filled: numbers the features. LUMI_ERR_NOMEM. */
int lumi_track_graph_begin(struct lumi_track_graph *graph);
void lumi_track_graph_finish(struct lumi_track_graph *graph);

/* Feature a of picture i and b of picture k match. LUMI_ERR_FORMAT: there are no such features. */
int lumi_track_graph_join(struct lumi_track_graph *graph, int i, uint32_t a, int k, uint32_t b);

/* What matches join, chosen by the settings. LUMI_ERR_NOMEM. */
int lumi_track_graph_choose(struct lumi_track_graph *graph, const struct lumi_tracks_settings *settings,
                            struct lumi_tracks *tracks);

#endif
