/* The simplifier: greedy insertion (Garland and Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields",
 * 1995) with triangulations that follow the data (Dyn, Levin and Rippa, "Data Dependent Triangulations for Piecewise
 * Linear Interpolation", 1990), more vertices than wanted; then the least useful are taken out again by collapsing
 * edges, cheapest first, as Lindstrom and Turk do (1998), but with the true error of the triangles they leave; between
 * and after that vertices move to where the error is least, and heights are fitted by least squares. */
#include "pipeline/geometry/simplify.h"

#include "pipeline/geometry/surface_priv.h"
#include "proto/base/memory.h"

#include <math.h>

/* Four times the triangles wanted, then half as many again: measured on the view of docs/geometry.md, an eighth more in
 * every round leaves twice the error, three rounds a fifth less in half as much time again. */
enum { FLIPS_LIMIT = 64, FIRST_EXCESS = 4, ROUNDS = 2 };

/* What waits in a heap: triangles with the largest error first, or collapses with the smallest cost first. */
struct entry {
    float key;
    int item, other;
    unsigned stamp;
};

struct heap {
    struct entry *entries;
    int count, capacity;
    bool failed;
};

static bool before(const struct entry *a, const struct entry *b)
{
    return a->key != b->key ? a->key > b->key : a->item < b->item;
}

static void push(struct heap *heap, struct entry entry)
{
    if (heap->count == heap->capacity) {
        int capacity = 2 * heap->capacity + 256;
        struct entry *grown = lumi_realloc(heap->entries, (size_t)capacity, sizeof *grown);
        if (!grown) {
            heap->failed = true;
            return;
        }
        heap->entries = grown;
        heap->capacity = capacity;
    }
    int i = heap->count++;
    for (; i > 0 && before(&entry, &heap->entries[(i - 1) / 2]); i = (i - 1) / 2)
        heap->entries[i] = heap->entries[(i - 1) / 2];
    heap->entries[i] = entry;
}

static bool pop(struct heap *heap, struct entry *entry)
{
    if (heap->count == 0)
        return false;
    *entry = heap->entries[0];
    const struct entry last = heap->entries[--heap->count];
    int i = 0;
    for (;;) {
        int child = 2 * i + 1;
        if (child + 1 < heap->count && before(&heap->entries[child + 1], &heap->entries[child]))
            child++;
        if (child >= heap->count || !before(&heap->entries[child], &last))
            break;
        heap->entries[i] = heap->entries[child];
        i = child;
    }
    heap->entries[i] = last;
    return true;
}

static void measure(struct surface *s, int t)
{
    s->triangles[t].error = surface_triangle_error(s, s->triangles[t].v);
    s->triangles[t].stamp = ++s->clock;
}

/* True if the circle through p, b, c holds q: the Delaunay criterion, exact on the lattice. */
static bool circle_holds(const struct surface *s, int p, int b, int c, int q)
{
    const struct surface_vertex *o = &s->vertices[q];
    const int v[3] = {p, b, c};
    long long x[3], y[3], r[3];

    for (int i = 0; i < 3; i++) {
        x[i] = s->vertices[v[i]].x - o->x;
        y[i] = s->vertices[v[i]].y - o->y;
        r[i] = x[i] * x[i] + y[i] * y[i];
    }
    return r[0] * (x[1] * y[2] - x[2] * y[1]) + r[1] * (x[2] * y[0] - x[0] * y[2]) +
               r[2] * (x[0] * y[1] - x[1] * y[0]) >
           0;
}

/* Flips the edge if that lowers the error, or hardly changes it and gives rounder triangles. */
static bool improve_edge(struct surface *s, int t, int i)
{
    if (!surface_can_flip(s, t, i))
        return false;
    const int u = s->triangles[t].n[i], *v = s->triangles[t].v, *w = s->triangles[u].v;
    const int p = v[i], b = v[(i + 1) % 3], c = v[(i + 2) % 3];
    const int q = w[0] != b && w[0] != c ? w[0] : w[1] != b && w[1] != c ? w[1] : w[2];
    const int first[3] = {p, b, q}, second[3] = {p, q, c};
    const float now = s->triangles[t].error + s->triangles[u].error;
    const float error_first = surface_triangle_error(s, first), error_second = surface_triangle_error(s, second);
    const float then = error_first + error_second, slack = 1e-3f * now + 1e-4f;

    if (then > now + slack || (then > now - slack && !circle_holds(s, p, b, c, q)))
        return false;
    surface_flip(s, t, i);
    s->triangles[t].error = error_first;
    s->triangles[u].error = error_second;
    return true;
}

/* Flips around the triangles in `stack` until nothing is gained; changed triangles go to `heap` (may be NULL). */
static void improve(struct surface *s, int *stack, int count, struct heap *heap)
{
    for (int flips = 0; count > 0 && flips < FLIPS_LIMIT;) {
        const int t = stack[--count];
        for (int i = 0; i < 3; i++) {
            const int u = s->triangles[t].n[i];
            if (!improve_edge(s, t, i))
                continue;
            flips++;
            stack[count++] = t;
            stack[count++] = u;
            if (heap) {
                push(heap, (struct entry){s->triangles[t].error, t, 0, s->triangles[t].stamp});
                push(heap, (struct entry){s->triangles[u].error, u, 0, s->triangles[u].stamp});
            }
            break;
        }
    }
}

/* Moves a place on an edge of a tile that is at most half a pixel away, if the triangle has that edge. */
static void snap(const struct surface *s, int triangle, int *x, int *y)
{
    const struct surface_triangle *t = &s->triangles[triangle];

    for (int i = 0; i < 3; i++) {
        if (!surface_hard(s, triangle, i))
            continue;
        const struct surface_vertex *a = &s->vertices[t->v[(i + 1) % 3]], *b = &s->vertices[t->v[(i + 2) % 3]];
        const bool vertical = a->x == b->x;
        const int off = vertical ? *x - a->x : *y - a->y, along = vertical ? *y : *x;
        const int from = vertical ? a->y : a->x, to = vertical ? b->y : b->x;
        if (off > 2 || off < -2 || (along - from) * (to - along) <= 0)
            continue;
        *(vertical ? x : y) = vertical ? a->x : a->y;
        return;
    }
}

static bool refine(struct surface *s, int t, struct heap *heap)
{
    int px, py, vertex, stack[2 * FLIPS_LIMIT + STAR_LIMIT];
    struct star star;

    if (!surface_worst_pixel(s, t, &px, &py))
        return false;
    const float height = s->target[(size_t)py * (size_t)s->width + (size_t)px];
    int x = (int)((px + 0.5) / PIXEL + 0.5), y = (int)((py + 0.5) / PIXEL + 0.5);
    const int inside_x = x, inside_y = y;
    snap(s, t, &x, &y);
    if (!surface_insert(s, t, x, y, height, &vertex) &&
        !((x != inside_x || y != inside_y) && surface_insert(s, t, inside_x, inside_y, height, &vertex)))
        return false;
    surface_star(s, vertex, &star);
    for (int k = 0; k < star.count; k++) {
        measure(s, star.triangles[k]);
        stack[k] = star.triangles[k];
        push(heap, (struct entry){s->triangles[stack[k]].error, stack[k], 0, s->triangles[stack[k]].stamp});
    }
    improve(s, stack, star.count, heap);
    return true;
}

/* Inserts where the error is largest until there are `limit` triangles. */
static void insert_until(struct surface *s, int limit, struct heap *heap)
{
    struct entry entry;

    heap->count = 0;
    for (int t = 0; t < s->triangle_count; t++)
        if (s->triangles[t].tile >= 0)
            push(heap, (struct entry){s->triangles[t].error, t, 0, s->triangles[t].stamp});
    while (s->alive + 2 <= limit && !heap->failed && pop(heap, &entry) && entry.key > 0)
        if (s->triangles[entry.item].tile >= 0 && s->triangles[entry.item].stamp == entry.stamp)
            refine(s, entry.item, heap);
}

/* The error that moving v onto its neighbour u adds; HUGE_VALF where that cannot be. */
static float collapse_cost(struct surface *s, const struct star *star, int v, int u, float now)
{
    const struct surface_vertex saved = s->vertices[v];
    float then = 0;

    if (!surface_can_collapse(s, star, v, u))
        return HUGE_VALF;
    for (int k = 0; k < star->count; k++) {
        int c[3] = {s->triangles[star->triangles[k]].v[0], s->triangles[star->triangles[k]].v[1],
                    s->triangles[star->triangles[k]].v[2]};
        if (c[0] == u || c[1] == u || c[2] == u)
            continue;
        c[star->corners[k]] = u;
        then += surface_triangle_error(s, c);
    }
    s->vertices[v] = saved;
    return then - now;
}

/* The cheapest collapse of v. */
static bool cheapest(struct surface *s, int v, struct star *star, int *u, float *cost)
{
    float now = 0;

    *cost = HUGE_VALF;
    *u = -1;
    if (s->vertices[v].triangle < 0 || !surface_star(s, v, star))
        return false;
    for (int k = 0; k < star->count; k++)
        now += s->triangles[star->triangles[k]].error;
    for (int k = 0; k < star->count; k++)
        for (int side = 1; side <= 2; side++) {
            const int other = s->triangles[star->triangles[k]].v[(star->corners[k] + side) % 3];
            if (side == 2 && !(s->triangles[star->triangles[k]].n[(star->corners[k] + 1) % 3] < 0))
                continue; /* the next triangle has it as its first */
            const float c = collapse_cost(s, star, v, other, now);
            if (c < *cost) {
                *cost = c;
                *u = other;
            }
        }
    return *cost < HUGE_VALF;
}

/* The sum of the stamps around a vertex: another after any change there, but for rare chance. */
static unsigned star_stamp(const struct surface *s, const struct star *star)
{
    unsigned sum = 0;

    for (int k = 0; k < star->count; k++)
        sum += s->triangles[star->triangles[k]].stamp;
    return sum;
}

static void queue_collapse(struct surface *s, int v, struct heap *heap)
{
    struct star star;
    int u;
    float cost;

    if (cheapest(s, v, &star, &u, &cost))
        push(heap, (struct entry){-cost, v, u, star_stamp(s, &star)});
}

/* Collapses v onto u and flips around it. */
static void collapse(struct surface *s, const struct star *star, int v, int u)
{
    int stack[2 * FLIPS_LIMIT + STAR_LIMIT], count = 0;

    surface_collapse(s, star, v, u);
    for (int k = 0; k < star->count; k++)
        if (s->triangles[star->triangles[k]].tile >= 0) {
            measure(s, star->triangles[k]);
            stack[count++] = star->triangles[k];
        }
    improve(s, stack, count, NULL);
}

/* Collapses the cheapest edges until there are at most `limit` triangles, or nothing more can be collapsed: what could
 * not be may have become possible once all others have been tried. */
static void collapse_until(struct surface *s, int limit, struct heap *heap)
{
    struct entry entry;
    struct star star;

    for (bool again = true; again && s->alive > limit && !heap->failed;) {
        again = false;
        heap->count = 0;
        for (int v = 0; v < s->vertex_count; v++)
            queue_collapse(s, v, heap);
        while (s->alive > limit && !heap->failed && pop(heap, &entry)) {
            const int v = entry.item, u = entry.other;
            if (s->vertices[v].triangle < 0 || !surface_star(s, v, &star))
                continue;
            if (star_stamp(s, &star) != entry.stamp || !surface_can_collapse(s, &star, v, u)) {
                queue_collapse(s, v, heap);
                continue;
            }
            collapse(s, &star, v, u);
            again = true;
        }
    }
}

static bool upright(const struct surface *s, const struct star *star)
{
    for (int k = 0; k < star->count; k++) {
        const int *v = s->triangles[star->triangles[k]].v;
        if (surface_cross(s, v[0], v[1], v[2]) <= 0)
            return false;
    }
    return true;
}

/* Tries vertex v at (x, y) with `height`; keeps it if the error falls below *error. */
static bool try_at(struct surface *s, const struct star *star, int v, int x, int y, float height, float *error)
{
    const struct surface_vertex saved = s->vertices[v];

    s->vertices[v].x = x;
    s->vertices[v].y = y;
    s->vertices[v].height = height;
    if (upright(s, star)) {
        const float then = surface_star_error(s, star);
        if (then < *error * (1 - 1e-4f)) {
            *error = then;
            return true;
        }
    }
    s->vertices[v] = saved;
    return false;
}

/* Moves a vertex to a better place nearby, with its own height or that of the pixel it comes to, then fits its height.
 */
static void settle(struct surface *s, int v)
{
    static const int reach[] = {8, 4, 2, 1};
    const int fixed_x = s->vertices[v].x % LATTICE == 0 || s->vertices[v].x == s->right;
    const int fixed_y = s->vertices[v].y % LATTICE == 0 || s->vertices[v].y == s->bottom;
    struct star star;

    if (s->vertices[v].triangle < 0 || !surface_star(s, v, &star))
        return;
    float error = 0;
    for (int k = 0; k < star.count; k++)
        error += s->triangles[star.triangles[k]].error;
    const float start = error;
    if (error < 1e-3f)
        return;
    for (unsigned r = 0; r < sizeof reach / sizeof *reach && !(fixed_x && fixed_y); r++)
        for (int dy = -1; dy <= 1; dy++)
            for (int dx = -1; dx <= 1; dx++) {
                const int x = s->vertices[v].x + dx * reach[r], y = s->vertices[v].y + dy * reach[r];
                if ((dx == 0 && dy == 0) || (fixed_x && dx != 0) || (fixed_y && dy != 0) || x < 0 || y < 0 ||
                    x > s->right || y > s->bottom)
                    continue;
                const int px = (int)fmin(x * PIXEL, s->width - 1), py = (int)fmin(y * PIXEL, s->height - 1);
                if (!try_at(s, &star, v, x, y, s->vertices[v].height, &error))
                    try_at(s, &star, v, x, y, s->target[(size_t)py * (size_t)s->width + (size_t)px], &error);
            }
    try_at(s, &star, v, s->vertices[v].x, s->vertices[v].y, surface_best_height(s, &star, v), &error);
    if (error < start)
        for (int k = 0; k < star.count; k++)
            measure(s, star.triangles[k]);
}

/* One sweep over all vertices, then over all edges. */
static void sweep(struct surface *s)
{
    int stack[2 * FLIPS_LIMIT + 2];

    for (int v = 0; v < s->vertex_count; v++)
        settle(s, v);
    for (int t = 0; t < s->triangle_count; t++)
        if (s->triangles[t].tile >= 0) {
            stack[0] = t;
            improve(s, stack, 1, NULL);
        }
}

static void build(struct surface *s, int limit, struct heap *heap)
{
    for (int t = 0; t < s->triangle_count; t++)
        measure(s, t);
    if (limit < s->alive + 2) { /* two triangles a tile: only heights and diagonals to choose */
        for (int round = 0; round < 4 * ROUNDS; round++)
            sweep(s);
        return;
    }
    insert_until(s, FIRST_EXCESS * limit, heap);
    sweep(s);
    collapse_until(s, limit, heap);
    sweep(s);
    for (int round = 1; round < ROUNDS; round++) {
        insert_until(s, limit + limit / 2, heap);
        sweep(s);
        collapse_until(s, limit, heap);
        sweep(s);
    }
}

/* As build, without ever having more triangles than wanted: for the rare view where collapsing gets stuck above. */
static void build_within(struct surface *s, int limit, struct heap *heap)
{
    for (int t = 0; t < s->triangle_count; t++)
        measure(s, t);
    insert_until(s, limit, heap);
    sweep(s);
}

/* Corners begin at the nearest pixel's height. */
static void start_heights(struct surface *s)
{
    for (int v = 0; v < s->vertex_count; v++) {
        const int x = (int)fmin(s->vertices[v].x * PIXEL, s->width - 1);
        const int y = (int)fmin(s->vertices[v].y * PIXEL, s->height - 1);
        s->vertices[v].height = s->target[(size_t)y * (size_t)s->width + (size_t)x];
    }
}

/* A row of the picture in square-root light. */
static void square_root_row(const struct lumi_raster *colour, int y, float *result)
{
    const float *row = lumi_row_f32(colour, y);

    for (int i = 0; i < 3 * colour->width; i++)
        result[i] = sqrtf(row[i] > 0 ? row[i] : 0);
}

/* How much a pixel's depth matters. Where it is wrong by a little, the picture is wrong by as much as it changes there,
 * and that counts in square: little where nothing changes, most at the rim of something dark before something bright.
 */
static int weigh(const struct lumi_raster *colour, int width, int height, float *weight)
{
    const float floor_weight = 0.05f, full = 0.2f; /* a difference of 0.2 in square-root light counts in full */
    const size_t line = 3 * (size_t)width;
    float *roots = lumi_alloc(3 * line, sizeof(float)); /* row y at y % 3 */

    if (!roots)
        return LUMI_ERR_NOMEM;
    square_root_row(colour, 0, roots);
    for (int y = 0; y < height; y++) {
        const float *own = roots + (size_t)(y % 3) * line;
        if (y + 1 < height)
            square_root_row(colour, y + 1, roots + (size_t)((y + 1) % 3) * line);
        for (int x = 0; x < width; x++) {
            const float *a = own + 3 * x;
            float most = 0;
            for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < height; j++)
                for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < width; i++) {
                    const float *b = roots + (size_t)(j % 3) * line + 3 * i;
                    float difference = fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) + fabsf(a[2] - b[2]);
                    most = difference > most ? difference : most;
                }
            most /= 3 * full;
            const float value = floor_weight + most * most * (1 - floor_weight);
            weight[(size_t)y * (size_t)width + (size_t)x] = value < 1 ? value : 1;
        }
    }
    lumi_free(roots);
    return LUMI_OK;
}

void lumi_simplify_defaults(struct lumi_simplify_options *options)
{
    *options = (struct lumi_simplify_options){.triangles_per_tile = 10, .disparity = 30, .error_cap = 4};
}

static bool fits(const struct lumi_raster *raster, const struct lumi_grid *grid, int channels)
{
    return raster->width == grid->width && raster->height == grid->height && raster->channels == channels &&
           raster->sample == LUMI_F32;
}

int lumi_simplify(const struct lumi_raster *inverse_depth, const struct lumi_raster *colour,
                  const struct lumi_grid *grid, const struct lumi_simplify_options *options,
                  struct lumi_view_mesh *mesh, struct lumi_error *error)
{
    const size_t width = (size_t)grid->width, height = (size_t)grid->height;
    struct surface s = {.cap = (float)options->error_cap};
    struct heap heap = {0};
    int result = LUMI_ERR_NOMEM;

    *mesh = (struct lumi_view_mesh){0};
    if (!(options->triangles_per_tile >= 2) || !(options->triangles_per_tile <= 1000) || !(options->disparity > 0) ||
        !(options->error_cap > 0) || !fits(inverse_depth, grid, 1) || (colour && !fits(colour, grid, 3)))
        return lumi_fail(error, LUMI_ERR_ARG, "mesh: options out of range, or pictures that do not fit the view");
    const int limit = (int)(options->triangles_per_tile * grid->cols * grid->rows);
    float *target = lumi_alloc(width * height, sizeof *target), *weight = lumi_alloc(width * height, sizeof *weight);
    if (!target || !weight || surface_init(&s, grid, (FIRST_EXCESS + ROUNDS) * limit + 256) != LUMI_OK)
        goto done;
    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++) {
            const double h = (double)lumi_row_f32(inverse_depth, y)[x] * options->disparity;
            target[(size_t)y * width + (size_t)x] = h > 0 && h < 1e6 ? (float)h : 0;
            weight[(size_t)y * width + (size_t)x] = 1;
        }
    if (colour && weigh(colour, grid->width, grid->height, weight) != LUMI_OK)
        goto done;
    s.target = target;
    s.weight = weight;
    start_heights(&s);
    build(&s, limit, &heap);
    if (s.alive > limit) {
        surface_finish(&s);
        if (surface_init(&s, grid, limit + 256) != LUMI_OK)
            goto done;
        start_heights(&s);
        build_within(&s, limit, &heap);
    }
    result = heap.failed ? LUMI_ERR_NOMEM : surface_to_mesh(&s, 1 / options->disparity, mesh, error);
done:
    lumi_free(target);
    lumi_free(weight);
    lumi_free(heap.entries);
    surface_finish(&s);
    return result == LUMI_OK ? LUMI_OK : lumi_fail(error, result, "mesh: out of memory");
}
