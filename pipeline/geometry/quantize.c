/* From the simplifier's surface to a view's quantised meshes. */
#include "pipeline/geometry/surface_priv.h"

#include "proto/base/memory.h"

#include <math.h>
#include <stdlib.h>

/* Depth is stored to about this many pixels of disparity where a tile's range allows: finer steps would cost bytes and
 * show nothing. */
#define FINEST_STEP 0.03

struct codes {
    int *code;       /* of each vertex */
    int *shift;      /* of each tile */
    int *low, *high; /* of each tile's codes */
    int *coarsest;   /* shift among the tiles of each vertex */
};

/* Rounds each vertex to the coarsest step of its tiles; raises the step of tiles whose range is over 255 steps, until
 * none is. At shift 8 every range fits, so it ends. */
static void choose_steps(const struct surface *s, const double *exact, struct codes *c)
{
    for (bool again = true; again;) {
        again = false;
        for (int v = 0; v < s->vertex_count; v++)
            c->coarsest[v] = 0;
        for (int t = 0; t < s->triangle_count; t++)
            for (int i = 0; s->triangles[t].tile >= 0 && i < 3; i++) {
                const int v = s->triangles[t].v[i], shift = c->shift[s->triangles[t].tile];
                if (shift > c->coarsest[v])
                    c->coarsest[v] = shift;
            }
        for (int v = 0; v < s->vertex_count; v++) {
            const int step = 1 << c->coarsest[v], most = 65535 / step;
            const int q = (int)floor(exact[v] / step + 0.5);
            c->code[v] = (q < 0 ? 0 : q > most ? most : q) * step;
        }
        for (int i = 0; i < s->cols * s->rows; i++)
            c->low[i] = 65536, c->high[i] = -1;
        for (int t = 0; t < s->triangle_count; t++)
            for (int i = 0; s->triangles[t].tile >= 0 && i < 3; i++) {
                const int tile = s->triangles[t].tile, code = c->code[s->triangles[t].v[i]];
                c->low[tile] = code < c->low[tile] ? code : c->low[tile];
                c->high[tile] = code > c->high[tile] ? code : c->high[tile];
            }
        for (int i = 0; i < s->cols * s->rows; i++)
            if (c->high[i] - c->low[i] > 255 << c->shift[i]) {
                c->shift[i]++;
                again = true;
            }
    }
}

/* A tile's vertices: corners first (row by row), then its edges top, left, right, bottom, then the inside; each by
 * row, then column. */
static int rank(const struct lumi_mesh_vertex *v, int right, int bottom)
{
    const bool side = v->s == 0 || v->s == right, end = v->t == 0 || v->t == bottom;

    if (side && end)
        return 0;
    if (v->t == 0)
        return 1;
    if (v->s == 0)
        return 2;
    if (v->s == right)
        return 3;
    return v->t == bottom ? 4 : 5;
}

struct local {
    int vertex, order;
};

static int by_order(const void *a, const void *b)
{
    const struct local *p = a, *q = b;

    return p->order != q->order ? (p->order < q->order ? -1 : 1) : 0;
}

/* Collects the triangles of every tile: starts[tile] .. starts[tile + 1] in `members`. */
static void group(const struct surface *s, int *starts, int *members)
{
    const int tiles = s->cols * s->rows;

    for (int i = 0; i <= tiles; i++)
        starts[i] = 0;
    for (int t = 0; t < s->triangle_count; t++)
        if (s->triangles[t].tile >= 0)
            starts[s->triangles[t].tile + 1]++;
    for (int i = 0; i < tiles; i++)
        starts[i + 1] += starts[i];
    for (int t = 0; t < s->triangle_count; t++)
        if (s->triangles[t].tile >= 0)
            members[starts[s->triangles[t].tile]++] = t;
    for (int i = tiles; i > 0; i--)
        starts[i] = starts[i - 1];
    starts[0] = 0;
}

struct tiles {
    int *starts, *members;
    int *seen;           /* of each vertex: the last tile + 1 that had it */
    int *slot;           /* of each vertex in that tile */
    struct local *order; /* the tile's vertices */
};

/* Fills tiles.order with the tile's vertices, each once; returns how many. */
static int tile_vertices(const struct surface *s, struct tiles *t, int tile)
{
    const int left = tile % s->cols * LATTICE, top = tile / s->cols * LATTICE;
    const int right = (left + LATTICE < s->right ? left + LATTICE : s->right) - left;
    const int bottom = (top + LATTICE < s->bottom ? top + LATTICE : s->bottom) - top;
    int count = 0;

    for (int k = t->starts[tile]; k < t->starts[tile + 1]; k++)
        for (int i = 0; i < 3; i++) {
            const int v = s->triangles[t->members[k]].v[i];
            if (t->seen[v] == tile + 1)
                continue;
            t->seen[v] = tile + 1;
            const struct lumi_mesh_vertex place = {(uint8_t)(s->vertices[v].x - left),
                                                   (uint8_t)(s->vertices[v].y - top), 0};
            t->order[count++] = (struct local){v, rank(&place, right, bottom) << 16 | place.t << 8 | place.s};
        }
    qsort(t->order, (size_t)count, sizeof *t->order, by_order);
    for (int k = 0; k < count; k++)
        t->slot[t->order[k].vertex] = k;
    return count;
}

static void fill_tile(const struct surface *s, const struct codes *c, struct tiles *t, int tile,
                      struct lumi_view_mesh *mesh)
{
    const int count = tile_vertices(s, t, tile);
    struct lumi_mesh_vertex *vertices = lumi_mesh_vertices(mesh, tile);
    uint16_t *indices = lumi_mesh_indices(mesh, tile);

    mesh->tiles[tile].base = (uint16_t)c->low[tile];
    mesh->tiles[tile].shift = (uint8_t)c->shift[tile];
    for (int k = 0; k < count; k++) {
        const int v = t->order[k].vertex;
        vertices[k] = (struct lumi_mesh_vertex){(uint8_t)(s->vertices[v].x - tile % s->cols * LATTICE),
                                                (uint8_t)(s->vertices[v].y - tile / s->cols * LATTICE),
                                                (uint8_t)((c->code[v] - c->low[tile]) >> c->shift[tile])};
    }
    for (int k = t->starts[tile]; k < t->starts[tile + 1]; k++)
        for (int i = 0; i < 3; i++)
            *indices++ = (uint16_t)t->slot[s->triangles[t->members[k]].v[i]];
}

static int build(const struct surface *s, const struct codes *c, struct tiles *t, int *counts,
                 struct lumi_view_mesh *mesh)
{
    const int tiles = s->cols * s->rows;

    group(s, t->starts, t->members);
    for (int i = 0; i < tiles; i++) {
        counts[i] = tile_vertices(s, t, i);
        counts[tiles + i] = t->starts[i + 1] - t->starts[i];
    }
    for (int v = 0; v < s->vertex_count; v++)
        t->seen[v] = 0;
    LUMI_TRY(lumi_view_mesh_create(mesh, s->cols, s->rows, counts, counts + tiles));
    for (int i = 0; i < tiles; i++)
        fill_tile(s, c, t, i, mesh);
    return LUMI_OK;
}

int surface_to_mesh(const struct surface *s, double w_per_height, struct lumi_view_mesh *mesh, struct lumi_error *error)
{
    const size_t tiles = (size_t)s->cols * (size_t)s->rows, vertices = (size_t)s->vertex_count;
    int *numbers = lumi_calloc(4 * vertices + 6 * tiles + 1 + (size_t)s->triangle_count, sizeof *numbers);
    double *exact = lumi_alloc(vertices, sizeof *exact);
    struct local *order = lumi_alloc(vertices, sizeof *order);
    double low = INFINITY, high = 0;
    int result = LUMI_ERR_NOMEM;

    if (!numbers || !exact || !order)
        goto done;
    for (int v = 0; v < s->vertex_count; v++)
        if (s->vertices[v].triangle >= 0) {
            exact[v] = fmax(0, s->vertices[v].height * w_per_height);
            low = fmin(low, exact[v]);
            high = fmax(high, exact[v]);
        }
    const float w_min = (float)low, w_step = (float)fmax((high - low) / 65535, 1e-9);
    for (int v = 0; v < s->vertex_count; v++)
        exact[v] = s->vertices[v].triangle >= 0 ? (exact[v] - w_min) / w_step : 0;
    int *at = numbers;
    struct codes codes = {.code = at, .coarsest = at + vertices};
    struct tiles work = {.seen = at + 2 * vertices, .slot = at + 3 * vertices, .order = order};
    at += 4 * vertices;
    codes.shift = at;
    codes.low = at + tiles;
    codes.high = at + 2 * tiles;
    int *counts = at + 3 * tiles;
    work.starts = at + 5 * tiles;
    work.members = at + 6 * tiles + 1;
    const double finest = log2(FINEST_STEP * w_per_height / w_step);
    for (size_t i = 0; i < tiles; i++)
        codes.shift[i] = finest >= 8 ? 8 : finest > 0 ? (int)finest : 0;
    choose_steps(s, exact, &codes);
    result = build(s, &codes, &work, counts, mesh);
    if (result == LUMI_OK) {
        mesh->w_min = w_min;
        mesh->w_step = w_step;
    }
done:
    lumi_free(numbers);
    lumi_free(exact);
    lumi_free(order);
    return result == LUMI_OK ? LUMI_OK : lumi_fail(error, result, "mesh: out of memory");
}
