/* The topology of the simplifier's triangulation. */
#include "pipeline/geometry/surface_priv.h"

#include "proto/base/memory.h"

static int lattice_size(int tiles, int pixels)
{
    int last = pixels - LUMI_TILE * (tiles - 1);

    return LATTICE * (tiles - 1) + (last * LATTICE + LUMI_TILE - 1) / LUMI_TILE;
}

int surface_init(struct surface *s, const struct lumi_grid *grid, int triangle_limit)
{
    const int cols = grid->cols, rows = grid->rows;

    s->cols = cols;
    s->rows = rows;
    s->width = grid->width;
    s->height = grid->height;
    s->right = lattice_size(cols, grid->width);
    s->bottom = lattice_size(rows, grid->height);
    s->triangle_limit = triangle_limit + 2 * cols * rows + 8;
    s->vertex_limit = s->triangle_limit + (cols + 1) * (rows + 1);
    s->vertices = lumi_calloc((size_t)s->vertex_limit, sizeof *s->vertices);
    s->triangles = lumi_calloc((size_t)s->triangle_limit, sizeof *s->triangles);
    s->tile_triangles = lumi_calloc((size_t)cols * (size_t)rows, sizeof *s->tile_triangles);
    if (!s->vertices || !s->triangles || !s->tile_triangles)
        return LUMI_ERR_NOMEM;
    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= cols; i++)
            s->vertices[j * (cols + 1) + i] =
                (struct surface_vertex){i < cols ? i * LATTICE : s->right, j < rows ? j * LATTICE : s->bottom, 0, 0};
    s->vertex_count = (cols + 1) * (rows + 1);
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < cols; i++) {
            const int tile = j * cols + i, a = j * (cols + 1) + i, t = 2 * tile;
            /* Upper right (a, b, d) and lower left (a, d, c) halves. */
            s->triangles[t] =
                (struct surface_triangle){{a, a + 1, a + cols + 2},
                                          {i + 1 < cols ? t + 3 : -1, t + 1, j > 0 ? t - 2 * cols + 1 : -1},
                                          tile,
                                          0,
                                          0};
            s->triangles[t + 1] = (struct surface_triangle){
                {a, a + cols + 2, a + cols + 1}, {j + 1 < rows ? t + 2 * cols : -1, i > 0 ? t - 2 : -1, t}, tile, 0, 0};
            s->vertices[a].triangle = s->vertices[a + 1].triangle = t;
            s->vertices[a + cols + 2].triangle = t;
            s->vertices[a + cols + 1].triangle = t + 1;
            s->tile_triangles[tile] = 2;
        }
    s->triangle_count = s->alive = 2 * cols * rows;
    s->clock = 0;
    return LUMI_OK;
}

void surface_finish(struct surface *s)
{
    lumi_free(s->vertices);
    lumi_free(s->triangles);
    lumi_free(s->tile_triangles);
    s->vertices = NULL;
    s->triangles = NULL;
    s->tile_triangles = NULL;
}

static int corner_of(const struct surface_triangle *t, int vertex)
{
    return t->v[0] == vertex ? 0 : t->v[1] == vertex ? 1 : 2;
}

/* Which edge of `t` leads to triangle `neighbour`. */
static int edge_to(const struct surface_triangle *t, int neighbour)
{
    return t->n[0] == neighbour ? 0 : t->n[1] == neighbour ? 1 : 2;
}

bool surface_star(const struct surface *s, int vertex, struct star *star)
{
    const int first = s->vertices[vertex].triangle;
    int t = first;

    star->count = 0;
    /* Clockwise: across the edge from the vertex to v[corner + 2]; at the image's edge back to the start and on the
     * other way. */
    for (int way = 0; way < 2; way++) {
        while (t >= 0) {
            const int corner = corner_of(&s->triangles[t], vertex);
            if (way == 0 || t != first) {
                if (star->count == STAR_LIMIT)
                    return false;
                star->triangles[star->count] = t;
                star->corners[star->count++] = corner;
            }
            t = s->triangles[t].n[(corner + (way == 0 ? 1 : 2)) % 3];
            if (t == first)
                return true;
        }
        t = first;
    }
    return true;
}

bool surface_hard(const struct surface *s, int triangle, int i)
{
    const struct surface_triangle *t = &s->triangles[triangle];

    return t->n[i] < 0 || s->triangles[t->n[i]].tile != t->tile;
}

static void relink(struct surface *s, int triangle, int from, int to)
{
    if (triangle >= 0)
        s->triangles[triangle].n[edge_to(&s->triangles[triangle], from)] = to;
}

static void set(struct surface *s, int t, int a, int b, int c, int na, int nb, int nc, int tile)
{
    struct surface_triangle *triangle = &s->triangles[t];

    *triangle = (struct surface_triangle){{a, b, c}, {na, nb, nc}, tile, 0, ++s->clock};
    s->vertices[a].triangle = s->vertices[b].triangle = s->vertices[c].triangle = t;
}

static int new_triangle(struct surface *s, int tile)
{
    s->alive++;
    s->tile_triangles[tile]++;
    return s->triangle_count++;
}

static void split_inside(struct surface *s, int t, int v)
{
    const struct surface_triangle o = s->triangles[t];
    const int t1 = new_triangle(s, o.tile), t2 = new_triangle(s, o.tile);

    set(s, t, o.v[0], o.v[1], v, t1, t2, o.n[2], o.tile);
    set(s, t1, o.v[1], o.v[2], v, t2, t, o.n[0], o.tile);
    set(s, t2, o.v[2], o.v[0], v, t, t1, o.n[1], o.tile);
    relink(s, o.n[0], t, t1);
    relink(s, o.n[1], t, t2);
}

static void split_edge(struct surface *s, int t, int i, int v)
{
    const struct surface_triangle o = s->triangles[t];
    const int a = o.v[i], b = o.v[(i + 1) % 3], c = o.v[(i + 2) % 3];
    const int nb = o.n[(i + 1) % 3], nc = o.n[(i + 2) % 3], u = o.n[i];
    const int t1 = new_triangle(s, o.tile);
    int u1 = -1;

    if (u >= 0) {
        const struct surface_triangle p = s->triangles[u];
        const int k = edge_to(&p, t), e = p.v[k]; /* p is (e, c, b) from k on */
        u1 = new_triangle(s, p.tile);
        const int nc_u = p.n[(k + 1) % 3], nb_u = p.n[(k + 2) % 3]; /* across (b, e) and (e, c) */
        set(s, u, e, c, v, t1, u1, nb_u, p.tile);
        set(s, u1, e, v, b, t, nc_u, u, p.tile);
        relink(s, nc_u, u, u1);
    }
    set(s, t, a, b, v, u1, t1, nc, o.tile);
    set(s, t1, a, v, c, u, nb, t, o.tile);
    relink(s, nb, t, t1);
}

bool surface_insert(struct surface *s, int triangle, int x, int y, float height, int *vertex)
{
    const struct surface_triangle *t = &s->triangles[triangle];
    const int v = s->vertex_count;
    int edge = -1, zeros = 0;

    if (s->triangle_count + 2 > s->triangle_limit || s->vertex_count >= s->vertex_limit)
        return false;
    s->vertices[v] = (struct surface_vertex){x, y, height, triangle};
    for (int i = 0; i < 3; i++) {
        const int side = surface_cross(s, t->v[(i + 1) % 3], t->v[(i + 2) % 3], v);
        if (side < 0)
            return false;
        if (side == 0)
            edge = i, zeros++;
    }
    if (zeros > 1 || s->tile_triangles[t->tile] >= TILE_TRIANGLES_LIMIT)
        return false;
    if (edge >= 0 && t->n[edge] >= 0 && s->tile_triangles[s->triangles[t->n[edge]].tile] >= TILE_TRIANGLES_LIMIT)
        return false;
    s->vertex_count++;
    if (edge < 0)
        split_inside(s, triangle, v);
    else
        split_edge(s, triangle, edge, v);
    *vertex = v;
    return true;
}

bool surface_can_flip(const struct surface *s, int triangle, int i)
{
    if (surface_hard(s, triangle, i))
        return false;
    const struct surface_triangle *t = &s->triangles[triangle], *u = &s->triangles[t->n[i]];
    const int p = t->v[i], b = t->v[(i + 1) % 3], c = t->v[(i + 2) % 3], q = u->v[edge_to(u, triangle)];

    return surface_cross(s, p, b, q) > 0 && surface_cross(s, p, q, c) > 0;
}

void surface_flip(struct surface *s, int triangle, int i)
{
    const struct surface_triangle t = s->triangles[triangle];
    const int other = t.n[i];
    const struct surface_triangle u = s->triangles[other];
    const int k = edge_to(&u, triangle), p = t.v[i], b = t.v[(i + 1) % 3], c = t.v[(i + 2) % 3], q = u.v[k];
    const int across_cp = t.n[(i + 1) % 3], across_pb = t.n[(i + 2) % 3];
    const int across_bq = u.n[(k + 1) % 3], across_qc = u.n[(k + 2) % 3]; /* u is (q, c, b) from k on */

    set(s, triangle, p, b, q, across_bq, other, across_pb, t.tile);
    set(s, other, p, q, c, across_qc, across_cp, triangle, t.tile);
    relink(s, across_bq, other, triangle);
    relink(s, across_cp, triangle, other);
}

/* A vertex on a tile's edge may only slide along it; a tile's corner stays. */
static bool on_vertical(const struct surface *s, const struct surface_vertex *v)
{
    return v->x % LATTICE == 0 || v->x == s->right;
}

static bool on_horizontal(const struct surface *s, const struct surface_vertex *v)
{
    return v->y % LATTICE == 0 || v->y == s->bottom;
}

bool surface_can_collapse(const struct surface *s, const struct star *star, int v, int u)
{
    const struct surface_vertex *from = &s->vertices[v], *to = &s->vertices[u];
    int shared = 0;

    if ((on_vertical(s, from) && from->x != to->x) || (on_horizontal(s, from) && from->y != to->y))
        return false;
    for (int k = 0; k < star->count; k++) {
        const struct surface_triangle *t = &s->triangles[star->triangles[k]];
        const int b = t->v[(star->corners[k] + 1) % 3], c = t->v[(star->corners[k] + 2) % 3];
        if (b == u || c == u) {
            shared++;
            continue;
        }
        if (surface_cross(s, u, b, c) <= 0)
            return false;
    }
    return shared >= 1 && shared <= 2 && star->count > shared;
}

void surface_collapse(struct surface *s, const struct star *star, int v, int u)
{
    for (int k = 0; k < star->count; k++) {
        const int index = star->triangles[k], corner = star->corners[k];
        struct surface_triangle *t = &s->triangles[index];
        if (t->v[(corner + 1) % 3] != u && t->v[(corner + 2) % 3] != u) {
            t->v[corner] = u;
            t->stamp = ++s->clock;
            continue;
        }
        /* Dies: the triangles across its two edges that fall together become neighbours. */
        const int u_corner = t->v[(corner + 1) % 3] == u ? (corner + 1) % 3 : (corner + 2) % 3;
        const int across_v = t->n[corner], across_u = t->n[u_corner]; /* opposite v and opposite u */
        relink(s, across_v, index, across_u);
        relink(s, across_u, index, across_v);
        const int third = t->v[3 - corner - u_corner];
        const int heir = across_u >= 0 ? across_u : across_v;
        s->vertices[third].triangle = heir;
        s->vertices[u].triangle = heir;
        s->alive--;
        s->tile_triangles[t->tile]--;
        t->tile = -1;
        t->stamp = ++s->clock;
    }
    s->vertices[v].triangle = -1;
}
