/* Tracks: sets of features that matches join (Moulon, Monasse: Unordered Feature Tracking Made Fast and Easy, 2012). */
#include "pipeline/calibrate/track_join.h"

#include "proto/base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Tiles of a picture in which tracks compete. */
enum { COLUMNS = 8, ROWS = 6, TILES = COLUMNS * ROWS };

struct chain {
    int first, count; /* of the nodes, sorted by chain */
};

void lumi_track_graph_finish(struct lumi_track_graph *graph)
{
    for (int i = 0; graph->images && i < graph->image_count; i++)
        lumi_free(graph->images[i].places);
    lumi_free(graph->images);
    lumi_free(graph->parent);
    lumi_free(graph->edges);
    *graph = (struct lumi_track_graph){0};
}

void lumi_tracks_finish(struct lumi_tracks *tracks)
{
    lumi_free(tracks->tracks);
    lumi_free(tracks->observations);
    *tracks = (struct lumi_tracks){0};
}

static int root_of(struct lumi_track_graph *graph, int node)
{
    while (graph->parent[node] != node)
        node = graph->parent[node] = graph->parent[graph->parent[node]];
    return node;
}

static void unite(struct lumi_track_graph *graph, int a, int b)
{
    a = root_of(graph, a);
    b = root_of(graph, b);
    /* The lower number stays, so that the order of joining does not matter. */
    if (a < b)
        graph->parent[b] = a;
    else
        graph->parent[a] = b;
}

int lumi_track_graph_begin(struct lumi_track_graph *graph)
{
    graph->node_count = 0;
    for (int i = 0; i < graph->image_count; i++) {
        graph->images[i].first = graph->node_count;
        graph->node_count += graph->images[i].count;
    }
    graph->parent = lumi_alloc((size_t)(graph->node_count ? graph->node_count : 1), sizeof *graph->parent);
    if (!graph->parent)
        return LUMI_ERR_NOMEM;
    for (int i = 0; i < graph->image_count; i++) {
        const struct lumi_track_image *image = &graph->images[i];
        for (int k = 0; k < image->count; k++) {
            const struct lumi_track_place *a = &image->places[k], *b = k > 0 ? a - 1 : a;
            const bool same = k > 0 && a->x == b->x && a->y == b->y;
            graph->parent[image->first + k] = same ? graph->parent[image->first + k - 1] : image->first + k;
        }
    }
    return LUMI_OK;
}

/* The first of those of a picture that are in the same place. */
static int number_of(const struct lumi_track_graph *graph, int image, uint32_t feature)
{
    const struct lumi_track_image *own = &graph->images[image];

    while (feature > 0 && own->places[feature].x == own->places[feature - 1].x &&
           own->places[feature].y == own->places[feature - 1].y)
        feature--;
    return own->first + (int)feature;
}

int lumi_track_graph_join(struct lumi_track_graph *graph, int i, uint32_t a, int k, uint32_t b)
{
    if (i < 0 || k < 0 || i >= graph->image_count || k >= graph->image_count || a >= (uint32_t)graph->images[i].count ||
        b >= (uint32_t)graph->images[k].count)
        return LUMI_ERR_FORMAT;
    if (graph->edge_count == graph->edge_room) {
        const int room = graph->edge_room ? 2 * graph->edge_room : 4096;
        struct lumi_track_edge *edges = lumi_realloc(graph->edges, (size_t)room, sizeof *edges);
        if (!edges)
            return LUMI_ERR_NOMEM;
        graph->edges = edges;
        graph->edge_room = room;
    }
    graph->edges[graph->edge_count++] = (struct lumi_track_edge){number_of(graph, i, a), number_of(graph, k, b)};
    return LUMI_OK;
}

/* Whether something that matches a also matches b: three pictures that agree are hardly ever wrong. */
static bool supported(const int *begin, const int *others, int a, int b)
{
    for (int i = begin[a]; i < begin[a + 1]; i++)
        for (int k = begin[b]; k < begin[b + 1]; k++)
            if (others[i] == others[k])
                return true;
    return false;
}

/* Joins what three pictures agree on. */
static int join_edges(struct lumi_track_graph *graph)
{
    int *begin = lumi_calloc((size_t)graph->node_count + 2, sizeof *begin);
    int *others = lumi_alloc(2 * (size_t)graph->edge_count + 1, sizeof *others);

    if (!begin || !others) {
        lumi_free(begin);
        lumi_free(others);
        return LUMI_ERR_NOMEM;
    }
    for (int i = 0; i < graph->edge_count; i++) {
        begin[graph->edges[i].a + 2]++;
        begin[graph->edges[i].b + 2]++;
    }
    for (int i = 2; i <= graph->node_count + 1; i++)
        begin[i] += begin[i - 1];
    for (int i = 0; i < graph->edge_count; i++) {
        others[begin[graph->edges[i].a + 1]++] = graph->edges[i].b;
        others[begin[graph->edges[i].b + 1]++] = graph->edges[i].a;
    }
    for (int i = 0; i < graph->edge_count; i++)
        if (supported(begin, others, graph->edges[i].a, graph->edges[i].b))
            unite(graph, graph->edges[i].a, graph->edges[i].b);
    lumi_free(begin);
    lumi_free(others);
    return LUMI_OK;
}

/* A feature of a track. */
struct node {
    int root, image, feature;
};

static int by_root(const void *left, const void *right)
{
    const struct node *a = left, *b = right;

    if (a->root != b->root)
        return a->root < b->root ? -1 : 1;
    if (a->image != b->image)
        return a->image < b->image ? -1 : 1;
    return a->feature - b->feature;
}

static int by_length(const void *left, const void *right)
{
    const struct chain *a = left, *b = right;

    if (a->count != b->count)
        return a->count > b->count ? -1 : 1;
    return a->first < b->first ? -1 : 1;
}

static bool same_place(const struct lumi_track_graph *graph, const struct node *a, const struct node *b)
{
    const struct lumi_track_place *p = &graph->images[a->image].places[a->feature];
    const struct lumi_track_place *q = &graph->images[b->image].places[b->feature];

    return p->x == q->x && p->y == q->y;
}

/* What is left of one set: its features once each, or nothing where two places of one picture are in it. */
static int clean(const struct lumi_track_graph *graph, struct node *nodes, int count)
{
    int kept = 0;

    for (int i = 0; i < count; i++) {
        if (kept > 0 && nodes[kept - 1].image == nodes[i].image) {
            if (!same_place(graph, &nodes[kept - 1], &nodes[i]))
                return 0;
            continue;
        }
        nodes[kept++] = nodes[i];
    }
    return kept;
}

static int find_chains(struct lumi_track_graph *graph, int shortest, struct node *nodes, struct chain *chains)
{
    int count = 0, at = 0;

    for (int i = 0; i < graph->image_count; i++)
        for (int k = 0; k < graph->images[i].count; k++)
            nodes[at++] = (struct node){root_of(graph, graph->images[i].first + k), i, k};
    qsort(nodes, (size_t)at, sizeof *nodes, by_root);
    for (int i = 0; i < at;) {
        int end = i + 1;
        while (end < at && nodes[end].root == nodes[i].root)
            end++;
        const int kept = end - i > 1 ? clean(graph, nodes + i, end - i) : 0;
        if (kept >= shortest && kept >= 2)
            chains[count++] = (struct chain){i, kept};
        i = end;
    }
    qsort(chains, (size_t)count, sizeof *chains, by_length);
    return count;
}

/* How many tracks the pictures and their tiles have. */
struct census {
    int *images, *tiles;
};

static int tile_of(const struct lumi_track_graph *graph, const struct node *node)
{
    const struct lumi_track_image *image = &graph->images[node->image];
    const struct lumi_track_place *place = &image->places[node->feature];
    const int column = (int)fmin(COLUMNS - 1, place->x * COLUMNS / (float)image->width);
    const int row = (int)fmin(ROWS - 1, place->y * ROWS / (float)image->height);

    return node->image * TILES + row * COLUMNS + column;
}

static bool needed(const struct lumi_track_graph *graph, const struct census *census, const struct node *nodes,
                   int count, int per_image, bool poor)
{
    int wanting = 0;

    for (int i = 0; i < count; i++)
        wanting += poor ? census->images[nodes[i].image] < per_image / 4
                        : census->tiles[tile_of(graph, &nodes[i])] < (per_image + TILES - 1) / TILES;
    return poor ? wanting > 0 : 2 * wanting >= count;
}

/* First tracks that half of their pictures still want where they lie, then whatever a poor picture has. The chosen ones
 * get a negative count. */
static void choose(const struct lumi_track_graph *graph, const struct node *nodes, struct chain *chains, int count,
                   int per_image, struct census *census)
{
    for (int round = 0; round < 2; round++)
        for (int i = 0; i < count; i++) {
            const struct node *own = nodes + chains[i].first;
            if (chains[i].count < 0 ||
                (per_image > 0 && !needed(graph, census, own, chains[i].count, per_image, round == 1)))
                continue;
            for (int k = 0; k < chains[i].count; k++) {
                census->images[own[k].image]++;
                census->tiles[tile_of(graph, &own[k])]++;
            }
            chains[i].count = -chains[i].count;
        }
}

/* What SIFT's places are good for: an eighth of a pixel, and a share of how large the feature is (docs/features.md).
 */
static float sigma_of(float scale)
{
    return hypotf(0.13f, 0.06f * scale);
}

static int gather(const struct lumi_track_graph *graph, const struct node *nodes, const struct chain *chains, int count,
                  struct lumi_tracks *tracks)
{
    size_t chosen = 0, observations = 0;

    for (int i = 0; i < count; i++)
        if (chains[i].count < 0) {
            chosen++;
            observations += (size_t)-chains[i].count;
        }
    tracks->tracks = lumi_alloc(chosen ? chosen : 1, sizeof *tracks->tracks);
    tracks->observations = lumi_alloc(observations ? observations : 1, sizeof *tracks->observations);
    if (!tracks->tracks || !tracks->observations)
        return LUMI_ERR_NOMEM;
    for (int i = 0; i < count; i++) {
        if (chains[i].count >= 0)
            continue;
        tracks->tracks[tracks->track_count++] = (struct lumi_track){tracks->observation_count, -chains[i].count};
        for (int k = 0; k < -chains[i].count; k++) {
            const struct node *node = &nodes[chains[i].first + k];
            const struct lumi_track_place *place = &graph->images[node->image].places[node->feature];
            tracks->observations[tracks->observation_count++] =
                (struct lumi_observation){node->image, node->feature, place->x, place->y, sigma_of(place->scale)};
        }
    }
    return LUMI_OK;
}

int lumi_track_graph_choose(struct lumi_track_graph *graph, const struct lumi_tracks_settings *settings,
                            struct lumi_tracks *tracks)
{
    const size_t nodes_count = (size_t)(graph->node_count ? graph->node_count : 1);
    const size_t images = (size_t)(graph->image_count ? graph->image_count : 1);
    struct node *nodes = lumi_alloc(nodes_count, sizeof *nodes);
    struct chain *chains = lumi_alloc(nodes_count / 2 + 1, sizeof *chains);
    struct census census = {lumi_calloc(images, sizeof(int)), lumi_calloc(images * TILES, sizeof(int))};
    int code = LUMI_ERR_NOMEM;

    *tracks = (struct lumi_tracks){0};
    if (nodes && chains && census.images && census.tiles && join_edges(graph) == LUMI_OK) {
        const int count = find_chains(graph, settings->shortest, nodes, chains);
        choose(graph, nodes, chains, count, settings->per_image, &census);
        code = gather(graph, nodes, chains, count, tracks);
    }
    if (code != LUMI_OK)
        lumi_tracks_finish(tracks);
    lumi_free(nodes);
    lumi_free(chains);
    lumi_free(census.images);
    lumi_free(census.tiles);
    return code;
}
