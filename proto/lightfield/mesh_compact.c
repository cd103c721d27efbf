/* The compact form of a view's meshes (docs/lumi-format.md, "Geometry", has the bytes).
 *
 * 1. A tile's vertices stand in the order: corners (top left, top right, bottom left, bottom right), top, left, right
 *    and bottom edge, inside; edges by their coordinate, the inside by row, then column.
 * 2. What a tile shares with the tiles to its left and above is coded once, there.
 * 3. Triangles follow from each other: from the first edge of the top on, each edge that has no triangle yet gets its
 *    third vertex, coded as its rank among the vertices on that side, those that see the edge under the widest angle
 *    first (rank 0 throughout is a Delaunay triangulation), or outright where the rank is over MAX_RANK.
 * 4. Coding and decoding are the same walk: code_number and its like write what they are given, or replace it with what
 *    they read. */
#include "proto/lightfield/mesh_compact.h"

#include "proto/base/memory.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/range_coder.h"

#include <string.h>

enum {
    SPAN = 255,           /* lattice steps of a whole tile */
    MAX_VERTICES = 600,   /* a tile */
    MAX_RANK = 31,        /* of a triangle's third vertex */
    VERTICES_A_BYTE = 16, /* more than that, beyond the corners, no honest stream holds */
    HASH = 8192           /* directed edges of a tile: over twice 3 · 2 · MAX_VERTICES */
};

/* How many vertices a tile has in each group after its four corners. */
struct counts {
    int top, left, right, bottom, inside;
};

struct walk {
    bool writing, failed;
    struct lumi_range_encoder encoder;
    struct lumi_range_decoder decoder;
    int cols, rows;
    int right, bottom; /* extent of the last column's and row's tiles */
    struct counts *counts;
    struct lumi_view_mesh *mesh;
    struct lumi_bit_model shift[9][16], column[256];
    struct lumi_number_model edge_count[2], inside_count[2], edge_step, row_step, column_step, depth[6], rank;
    bool known[MAX_VERTICES];
    int code[MAX_VERTICES];
    int hash_bits;
    uint32_t edges[HASH]; /* directed edges that have their triangle: (from << 16 | to) + 1; 0: free */
    uint16_t third[HASH]; /* writing: the third vertex of every directed edge's triangle */
    uint32_t gates[4 * MAX_VERTICES * 2];
};

static int code_number(struct walk *walk, struct lumi_number_model *model, int value)
{
    if (!walk->writing)
        return (int)lumi_range_decode_number(&walk->decoder, model);
    if (value < 0 || value > 65535) {
        walk->failed = true;
        value = 0;
    }
    lumi_range_encode_number(&walk->encoder, model, (unsigned)value);
    return value;
}

static int code_tree(struct walk *walk, struct lumi_bit_model *models, int bits, int value)
{
    if (!walk->writing)
        return (int)lumi_range_decode_tree(&walk->decoder, models, bits);
    lumi_range_encode_tree(&walk->encoder, models, bits, (unsigned)value);
    return value;
}

static int code_raw(struct walk *walk, int bits, int value)
{
    if (!walk->writing)
        return (int)lumi_range_decode_raw(&walk->decoder, bits);
    lumi_range_encode_raw(&walk->encoder, (uint32_t)value & ((1u << bits) - 1), bits);
    return value;
}

static int extent_x(const struct walk *walk, int tile)
{
    return tile % walk->cols + 1 < walk->cols ? SPAN : walk->right;
}

static int extent_y(const struct walk *walk, int tile)
{
    return tile / walk->cols + 1 < walk->rows ? SPAN : walk->bottom;
}

static int vertex_total(const struct counts *c)
{
    return 4 + c->top + c->left + c->right + c->bottom + c->inside;
}

/* Euler: a triangulation of v vertices, b of them on its rim, has 2 v − b − 2 triangles. */
static int triangle_total(const struct counts *c)
{
    return 2 * vertex_total(c) - (4 + c->top + c->left + c->right + c->bottom) - 2;
}

static void init(struct walk *walk, int cols, int rows)
{
    walk->cols = cols;
    walk->rows = rows;
    lumi_bit_models_init(walk->shift[0], 9 * 16);
    lumi_bit_models_init(walk->column, 256);
    for (int i = 0; i < 2; i++) {
        lumi_number_model_init(&walk->edge_count[i]);
        lumi_number_model_init(&walk->inside_count[i]);
    }
    lumi_number_model_init(&walk->edge_step);
    lumi_number_model_init(&walk->row_step);
    lumi_number_model_init(&walk->column_step);
    for (int i = 0; i < 6; i++)
        lumi_number_model_init(&walk->depth[i]);
    lumi_number_model_init(&walk->rank);
}

/* Steps and counts of all tiles; `shifts` are the tiles'. Totals go to *vertices. */
static void code_counts(struct walk *walk, int *shifts, long *vertices)
{
    *vertices = 0;
    for (int i = 0; i < walk->cols * walk->rows && !walk->failed; i++) {
        struct counts *c = &walk->counts[i];
        const bool has_left = i % walk->cols > 0, has_above = i >= walk->cols;
        const int near = has_left ? shifts[i - 1] : has_above ? shifts[i - walk->cols] : 4;
        shifts[i] = code_tree(walk, walk->shift[near], 4, shifts[i]);
        if (has_above)
            c->top = walk->counts[i - walk->cols].bottom;
        else
            c->top = code_number(walk, &walk->edge_count[0], c->top);
        if (has_left)
            c->left = walk->counts[i - 1].right;
        else
            c->left = code_number(walk, &walk->edge_count[0], c->left);
        c->right = code_number(walk, &walk->edge_count[c->left > 0], c->right);
        c->bottom = code_number(walk, &walk->edge_count[c->top > 0], c->bottom);
        c->inside = code_number(walk, &walk->inside_count[c->top + c->left + c->right + c->bottom > 0], c->inside);
        if (shifts[i] > 8 || c->top > SPAN || c->left > SPAN || c->right > SPAN || c->bottom > SPAN ||
            vertex_total(c) > MAX_VERTICES)
            walk->failed = true;
        *vertices += vertex_total(c) - 4;
    }
}

/* The positions along an edge, rising, strictly between 0 and `extent`; in s or in t. */
static void code_edge(struct walk *walk, struct lumi_mesh_vertex *v, int count, int extent, bool vertical, int fixed)
{
    int before = 0;

    for (int k = 0; k < count && !walk->failed; k++) {
        const int now = vertical ? v[k].t : v[k].s;
        const int place = before + 1 + code_number(walk, &walk->edge_step, now - before - 1);
        if (place >= extent) {
            walk->failed = true;
            return;
        }
        v[k].s = (uint8_t)(vertical ? fixed : place);
        v[k].t = (uint8_t)(vertical ? place : fixed);
        before = place;
    }
}

static void code_inside(struct walk *walk, struct lumi_mesh_vertex *v, int count, int right, int bottom)
{
    int row = 1, column = 0;

    for (int k = 0; k < count && !walk->failed; k++) {
        const int step = code_number(walk, &walk->row_step, v[k].t - row);
        if (step == 0)
            column += 1 + code_number(walk, &walk->column_step, v[k].s - column - 1);
        else
            column = code_tree(walk, walk->column, 8, v[k].s);
        row += step;
        if (row >= bottom || column >= right || column < 1) {
            walk->failed = true;
            return;
        }
        v[k].s = (uint8_t)column;
        v[k].t = (uint8_t)row;
    }
}

/* Takes over a neighbour's edge: positions and codes, which are known then. */
static void copy_edge(struct walk *walk, struct lumi_mesh_vertex *to, int first, int from_tile, int from_first,
                      int count, bool vertical)
{
    const struct lumi_tile_mesh *from = &walk->mesh->tiles[from_tile];

    for (int k = 0; k < count; k++) {
        const struct lumi_mesh_vertex *v = &from->vertices[from_first + k];
        const uint8_t column = vertical ? 0 : v->s, line = vertical ? v->t : 0;
        if (walk->writing && (to[first + k].s != column || to[first + k].t != line))
            walk->failed = true; /* a crack */
        to[first + k].s = column;
        to[first + k].t = line;
        walk->code[first + k] = from->base + (v->d << from->shift);
        walk->known[first + k] = true;
    }
}

static void code_positions(struct walk *walk, int tile, struct lumi_mesh_vertex *v)
{
    const struct counts *c = &walk->counts[tile];
    const int right = extent_x(walk, tile), bottom = extent_y(walk, tile), total = vertex_total(c);
    const int left_tile = tile % walk->cols > 0 ? tile - 1 : -1, above = tile - walk->cols;
    const struct lumi_mesh_vertex corners[4] = {
        {0, 0, 0}, {(uint8_t)right, 0, 0}, {0, (uint8_t)bottom, 0}, {(uint8_t)right, (uint8_t)bottom, 0}};
    int at = 4;

    for (int k = 0; k < total; k++)
        walk->known[k] = false;
    for (int k = 0; k < 4; k++) {
        v[k].s = corners[k].s;
        v[k].t = corners[k].t;
    }
    if (above >= 0) {
        const struct counts *a = &walk->counts[above];
        copy_edge(walk, v, 0, above, 2, 2, false);
        copy_edge(walk, v, at, above, 4 + a->top + a->left + a->right, c->top, false);
    } else {
        code_edge(walk, v + at, c->top, right, false, 0);
    }
    at += c->top;
    if (left_tile >= 0) {
        const struct counts *l = &walk->counts[left_tile];
        copy_edge(walk, v, 0, left_tile, 1, 1, true);
        copy_edge(walk, v, 2, left_tile, 3, 1, true);
        copy_edge(walk, v, at, left_tile, 4 + l->top + l->left, c->left, true);
    } else {
        code_edge(walk, v + at, c->left, bottom, true, 0);
    }
    at += c->left;
    code_edge(walk, v + at, c->right, bottom, true, right);
    at += c->right;
    code_edge(walk, v + at, c->bottom, right, false, bottom);
    code_inside(walk, v + at + c->bottom, c->inside, right, bottom);
}

/* The coarsest step among the tiles that have this vertex: its code is a multiple of it. */
static int coarsest(const struct walk *walk, int tile, const struct lumi_mesh_vertex *v)
{
    const int column = tile % walk->cols, row = tile / walk->cols;
    const int x0 = v->s == 0 && column > 0 ? column - 1 : column, y0 = v->t == 0 && row > 0 ? row - 1 : row;
    const int x1 = v->s == SPAN && column + 1 < walk->cols ? column + 1 : column;
    const int y1 = v->t == SPAN && row + 1 < walk->rows ? row + 1 : row;
    int shift = 0;

    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++)
            if (walk->mesh->tiles[y * walk->cols + x].shift > shift)
                shift = walk->mesh->tiles[y * walk->cols + x].shift;
    return shift;
}

/* The known vertex nearest to vertex k, or −1. */
static int nearest_known(const struct walk *walk, const struct lumi_mesh_vertex *v, int count, int k)
{
    int best = -1, least = 1 << 20;

    for (int i = 0; i < count; i++) {
        const int dx = v[i].s - v[k].s, dy = v[i].t - v[k].t, distance = dx * dx + dy * dy;
        if (walk->known[i] && distance < least) {
            least = distance;
            best = i;
        }
    }
    return best;
}

/* The depths of the vertices not known yet: the difference to the nearest known one's, modulo the number of codes. */
static void code_depths(struct walk *walk, int tile, struct lumi_mesh_vertex *v, int count)
{
    const struct lumi_tile_mesh *t = &walk->mesh->tiles[tile];
    int least = 65536, most = 0;

    for (int k = 0; k < count; k++) {
        if (!walk->known[k]) {
            const int shift = coarsest(walk, tile, &v[k]), codes = (65535 >> shift) + 1;
            const int other = nearest_known(walk, v, count, k);
            const int guess = (other >= 0 ? walk->code[other] : 0) >> shift;
            const int now = (t->base + (v[k].d << t->shift)) >> shift;
            int difference = now - guess;
            if (difference >= (codes + 1) / 2)
                difference -= codes;
            if (difference < -(codes / 2))
                difference += codes;
            const int group = k < 4 ? 0 : k < count - walk->counts[tile].inside ? 1 : 2;
            const bool steep = t->shift > 5;
            const int read = code_number(walk, &walk->depth[2 * group + steep], (int)lumi_zigzag(difference));
            const int sum = guess + (int)lumi_unzigzag((uint64_t)read);
            const int value = sum < 0 ? sum + codes : sum >= codes ? sum - codes : sum;
            if (value < 0 || value >= codes) {
                walk->failed = true;
                return;
            }
            walk->code[k] = value << shift;
            walk->known[k] = true;
        }
        least = walk->code[k] < least ? walk->code[k] : least;
        most = walk->code[k] > most ? walk->code[k] : most;
    }
    for (int k = 0; walk->writing && k < count; k++)
        if (walk->code[k] != t->base + (v[k].d << t->shift))
            walk->failed = true; /* a crack, or a code finer than a neighbour's step */
    if (walk->failed || most - least > SPAN << t->shift || least % (1 << t->shift) ||
        (walk->writing && least != t->base)) {
        walk->failed = true;
        return;
    }
    if (!walk->writing) {
        walk->mesh->tiles[tile].base = (uint16_t)least;
        for (int k = 0; k < count; k++)
            v[k].d = (uint8_t)((walk->code[k] - least) >> t->shift);
    }
}

/* The slot of a directed edge in the table: where it is, or the free one where it belongs. */
static uint32_t slot_of(const struct walk *walk, int from, int to)
{
    const uint32_t edge = ((uint32_t)from << 16 | (uint32_t)to) + 1;
    uint32_t slot = edge * 2654435761u >> (32 - walk->hash_bits);

    while (walk->edges[slot] != 0 && (walk->edges[slot] & 0x7fffffffu) != edge)
        slot = (slot + 1) & ((1u << walk->hash_bits) - 1);
    return slot;
}

/* Writing, the table first holds every directed edge with its third vertex; the highest bit marks those that have been
 * coded. Reading, an edge is in the table once it has its triangle, marked. */
#define DONE 0x80000000u

static bool done(const struct walk *walk, int from, int to)
{
    return walk->edges[slot_of(walk, from, to)] & DONE;
}

static void mark(struct walk *walk, int from, int to)
{
    walk->edges[slot_of(walk, from, to)] = (((uint32_t)from << 16 | (uint32_t)to) + 1) | DONE;
}

/* True for an edge on the rim of the tile: nothing lies behind it. */
static bool on_rim(const struct lumi_mesh_vertex *a, const struct lumi_mesh_vertex *b, int right, int bottom)
{
    return (a->s == b->s && (a->s == 0 || a->s == right)) || (a->t == b->t && (a->t == 0 || a->t == bottom));
}

struct sight {
    long dot, cross;
    int vertex;
};

/* True if a sees the edge under a wider angle than b: the cotangent is smaller. */
static bool wider(const struct sight *a, const struct sight *b)
{
    const long long left = (long long)a->dot * b->cross, right = (long long)b->dot * a->cross;

    return left != right ? left < right : a->vertex < b->vertex;
}

/* Codes the third vertex of the triangle at a → b: among the vertices on its side whose edges with a and b are free. */
static int code_third(struct walk *walk, const struct lumi_mesh_vertex *v, int count, int a, int b)
{
    const uint32_t slot = slot_of(walk, a, b);
    const int wanted = walk->writing && walk->edges[slot] ? walk->third[slot] : -1;
    struct sight ranks[MAX_RANK + 1];
    int found = 0;

    for (int c = 0; c < count; c++) {
        const long ax = v[a].s - v[c].s, ay = v[a].t - v[c].t, bx = v[b].s - v[c].s, by = v[b].t - v[c].t;
        const struct sight sight = {ax * bx + ay * by, ax * by - ay * bx, c};
        if (sight.cross <= 0)
            continue;
        if (found == MAX_RANK + 1 && !wider(&sight, &ranks[MAX_RANK]))
            continue;
        if (done(walk, b, c) || done(walk, c, a))
            continue;
        int k = found <= MAX_RANK ? found++ : MAX_RANK;
        for (; k > 0 && wider(&sight, &ranks[k - 1]); k--)
            ranks[k] = ranks[k - 1];
        ranks[k] = sight;
    }
    int rank = 0;
    while (walk->writing && rank < found && ranks[rank].vertex != wanted)
        rank++;
    if (walk->writing && rank == found)
        rank = MAX_RANK + 1;
    rank = code_number(walk, &walk->rank, rank);
    if (rank < found)
        return ranks[rank].vertex;
    /* Too far down: its number outright. */
    const int vertex = code_raw(walk, 10, wanted);
    if (rank != MAX_RANK + 1 || vertex < 0 || vertex >= count)
        walk->failed = true;
    return vertex;
}

static void code_triangles(struct walk *walk, int tile, const struct lumi_mesh_vertex *v, int count)
{
    const struct lumi_tile_mesh *t = &walk->mesh->tiles[tile];
    const int right = extent_x(walk, tile), bottom = extent_y(walk, tile);
    uint16_t *indices = lumi_mesh_indices(walk->mesh, tile);
    int gates = 0, made = 0;

    for (walk->hash_bits = 5; 1 << walk->hash_bits < 8 * count && 1 << walk->hash_bits < HASH;)
        walk->hash_bits++;
    memset(walk->edges, 0, sizeof *walk->edges << walk->hash_bits);
    for (int k = 0; walk->writing && k < t->triangle_count; k++)
        for (int i = 0; i < 3; i++) {
            const int a = indices[3 * k + i], b = indices[3 * k + (i + 1) % 3];
            const uint32_t slot = slot_of(walk, a, b);
            if (walk->edges[slot]) {
                walk->failed = true;
                return;
            }
            walk->edges[slot] = ((uint32_t)a << 16 | (uint32_t)b) + 1;
            walk->third[slot] = indices[3 * k + (i + 2) % 3];
        }
    walk->gates[gates++] = walk->counts[tile].top > 0 ? 4 : 1; /* from vertex 0 */
    while (gates > 0 && !walk->failed) {
        const int a = (int)(walk->gates[--gates] >> 16), b = (int)(walk->gates[gates] & 0xffff);
        if (done(walk, a, b))
            continue;
        const int c = made < t->triangle_count ? code_third(walk, v, count, a, b) : -1;
        if (c < 0 || walk->failed) {
            walk->failed = true;
            return;
        }
        indices[3 * made] = (uint16_t)a;
        indices[3 * made + 1] = (uint16_t)b;
        indices[3 * made++ + 2] = (uint16_t)c;
        mark(walk, a, b);
        mark(walk, b, c);
        mark(walk, c, a);
        if (!on_rim(&v[a], &v[c], right, bottom))
            walk->gates[gates++] = (uint32_t)a << 16 | (uint32_t)c;
        if (!on_rim(&v[c], &v[b], right, bottom))
            walk->gates[gates++] = (uint32_t)c << 16 | (uint32_t)b;
    }
    if (made != t->triangle_count)
        walk->failed = true;
}

static void code_tiles(struct walk *walk)
{
    for (int i = 0; i < walk->cols * walk->rows && !walk->failed; i++) {
        struct lumi_mesh_vertex *v = lumi_mesh_vertices(walk->mesh, i);
        const int count = vertex_total(&walk->counts[i]);
        code_positions(walk, i, v);
        if (!walk->failed)
            code_depths(walk, i, v, count);
        if (!walk->failed)
            code_triangles(walk, i, v, count);
    }
}

/* The group of a vertex (invariant 1): 0 a corner, 1 top, 2 left, 3 right, 4 bottom, 5 inside. */
static int group_of(const struct lumi_mesh_vertex *v, int right, int bottom)
{
    const bool side = v->s == 0 || v->s == right, end = v->t == 0 || v->t == bottom;

    if (side && end)
        return 0;
    return v->t == 0 ? 1 : v->s == 0 ? 2 : v->s == right ? 3 : v->t == bottom ? 4 : 5;
}

/* Counts the groups of a tile's vertices; false if they are not in order, or too many, or lie outside. */
static bool count_groups(const struct walk *walk, int tile, struct counts *c)
{
    const struct lumi_tile_mesh *t = &walk->mesh->tiles[tile];
    const int right = extent_x(walk, tile), bottom = extent_y(walk, tile);
    int counts[6] = {0}, last = -1;

    if (t->vertex_count < 4 || t->vertex_count > MAX_VERTICES)
        return false;
    for (int k = 0; k < t->vertex_count; k++) {
        const struct lumi_mesh_vertex *v = &t->vertices[k];
        const int group = group_of(v, right, bottom), order = group << 16 | v->t << 8 | v->s;
        if (v->s > right || v->t > bottom || order <= last)
            return false;
        last = order;
        counts[group]++;
    }
    *c = (struct counts){counts[1], counts[2], counts[3], counts[4], counts[5]};
    return counts[0] == 4 && t->triangle_count == triangle_total(c);
}

static bool encode(struct walk *walk, int *shifts, struct lumi_writer *writer)
{
    const int tiles = walk->cols * walk->rows;
    struct lumi_writer coded;
    long vertices;

    walk->right = lumi_mesh_extent(&walk->mesh->tiles[tiles - 1], false);
    walk->bottom = lumi_mesh_extent(&walk->mesh->tiles[tiles - 1], true);
    if (walk->right == 0 || walk->bottom == 0)
        return false;
    for (int i = 0; i < tiles; i++) {
        const struct counts *c = &walk->counts[i];
        if (!count_groups(walk, i, &walk->counts[i]) || (i % walk->cols > 0 && c->left != walk->counts[i - 1].right) ||
            (i >= walk->cols && c->top != walk->counts[i - walk->cols].bottom))
            return false;
        shifts[i] = walk->mesh->tiles[i].shift;
    }
    lumi_writer_init(&coded);
    lumi_range_encoder_init(&walk->encoder, &coded);
    code_counts(walk, shifts, &vertices);
    code_tiles(walk);
    lumi_range_encoder_finish(&walk->encoder);
    const bool good = !walk->failed && !coded.failed && vertices <= (long)(VERTICES_A_BYTE * coded.size);
    if (good) {
        lumi_write_u8(writer, (uint8_t)walk->right);
        lumi_write_u8(writer, (uint8_t)walk->bottom);
        lumi_write_varint(writer, coded.size);
        lumi_write_bytes(writer, coded.data, coded.size);
    }
    lumi_writer_finish(&coded);
    return good;
}

bool lumi_mesh_compact_encode(const struct lumi_view_mesh *mesh, struct lumi_writer *writer)
{
    const size_t tiles = (size_t)mesh->cols * (size_t)mesh->rows;
    struct walk *walk = lumi_calloc(1, sizeof *walk);
    struct counts *counts = lumi_calloc(tiles, sizeof *counts);
    int *numbers = lumi_calloc(tiles, sizeof *numbers);
    struct lumi_view_mesh copy = {0};
    bool good = false;

    if (walk && counts && numbers && lumi_view_mesh_copy(mesh, &copy) == LUMI_OK) {
        init(walk, mesh->cols, mesh->rows);
        walk->writing = true;
        walk->counts = counts;
        walk->mesh = &copy;
        good = encode(walk, numbers, writer);
    }
    lumi_view_mesh_finish(&copy);
    lumi_free(numbers);
    lumi_free(counts);
    lumi_free(walk);
    return good;
}

static int decode(struct walk *walk, struct lumi_reader *reader, int *numbers, struct lumi_error *error)
{
    const int tiles = walk->cols * walk->rows;
    long vertices;

    walk->right = lumi_read_u8(reader);
    walk->bottom = lumi_read_u8(reader);
    const uint64_t size = lumi_read_varint(reader);
    const uint8_t *bytes = size <= lumi_reader_left(reader) ? lumi_read_bytes(reader, (size_t)size) : NULL;
    if (reader->failed || !bytes || walk->right == 0 || walk->bottom == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: cut short");
    lumi_range_decoder_init(&walk->decoder, bytes, (size_t)size);
    code_counts(walk, numbers, &vertices);
    if (walk->failed || vertices > (long)(VERTICES_A_BYTE * size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: too many vertices");
    int *const shifts = numbers, *const counts = numbers + tiles;
    for (int i = 0; i < tiles; i++) {
        counts[i] = vertex_total(&walk->counts[i]);
        counts[tiles + i] = triangle_total(&walk->counts[i]);
    }
    if (lumi_view_mesh_create(walk->mesh, walk->cols, walk->rows, counts, counts + tiles) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "mesh: out of memory");
    for (int i = 0; i < tiles; i++)
        walk->mesh->tiles[i].shift = (uint8_t)shifts[i];
    code_tiles(walk);
    if (walk->failed) {
        lumi_view_mesh_finish(walk->mesh);
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: damaged");
    }
    return LUMI_OK;
}

int lumi_mesh_compact_decode(struct lumi_reader *reader, int cols, int rows, struct lumi_view_mesh *mesh,
                             struct lumi_error *error)
{
    const size_t tiles = (size_t)cols * (size_t)rows;
    struct walk *walk = lumi_calloc(1, sizeof *walk);
    struct counts *counts = lumi_calloc(tiles, sizeof *counts);
    int *numbers = lumi_calloc(3 * tiles, sizeof *numbers);
    int result = LUMI_ERR_NOMEM;

    *mesh = (struct lumi_view_mesh){0};
    if (walk && counts && numbers) {
        init(walk, cols, rows);
        walk->counts = counts;
        walk->mesh = mesh;
        result = decode(walk, reader, numbers, error);
    } else {
        lumi_fail(error, LUMI_ERR_NOMEM, "mesh: out of memory");
    }
    lumi_free(numbers);
    lumi_free(counts);
    lumi_free(walk);
    return result;
}
