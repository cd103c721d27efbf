/* Drawing a view's triangles into one block of pixels.
 *
 * With V_k the direction from the eye to vertex k, a ray e lies in the triangle's cone where the three determinants
 * det(V_a, V_b, e) = (V_a × V_b) · e are positive; then e = Σ λ_k V_k with λ_k the opposite edge's determinant over
 * det(V_a, V_b, V_c), and since the vertices are V_k / w_k away, e's own inverse distance is Σ λ_k w_k. */
#include "render/cpu/raster_block.h"

#include "proto/base/memory.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Any strict order in which both triangles of an edge agree. */
static bool comes_first(const struct lumi_surface_vertex *a, const struct lumi_surface_vertex *b)
{
    if (a->tx != b->tx)
        return a->tx < b->tx;
    if (a->ty != b->ty)
        return a->ty < b->ty;
    return a->depth < b->depth;
}

/* V_a × V_b, computed the same way round for both triangles that share the edge, so that one's value is exactly the
 * other's negative; where it is exactly zero, the pixel goes to the triangle that has the edge in canonical order. */
static void edge(struct lumi_triangle *triangle, int k, const struct lumi_surface_vertex *a,
                 const struct lumi_surface_vertex *b)
{
    bool canonical = comes_first(a, b);
    const struct lumi_surface_vertex *p = canonical ? a : b, *q = canonical ? b : a;
    double sign = canonical ? 1 : -1;
    double nx = (double)p->y * q->z - (double)p->z * q->y, ny = (double)p->z * q->x - (double)p->x * q->z,
           nz = (double)p->x * q->y - (double)p->y * q->x;

    triangle->edge[k][0] = (float)(sign * nx);
    triangle->edge[k][1] = (float)(sign * ny);
    triangle->edge[k][2] = (float)(sign * nz);
    triangle->length[k] = (float)sqrt(nx * nx + ny * ny + nz * nz);
    triangle->threshold[k] = canonical ? -FLT_MIN : 0;
}

bool lumi_triangle_init(struct lumi_triangle *triangle, const struct lumi_surface_vertex *a,
                        const struct lumi_surface_vertex *b, const struct lumi_surface_vertex *c)
{
    edge(triangle, 0, b, c);
    edge(triangle, 1, c, a);
    edge(triangle, 2, a, b);
    double det =
        (double)triangle->edge[0][0] * a->x + (double)triangle->edge[0][1] * a->y + (double)triangle->edge[0][2] * a->z;
    if (!(det > 1e-14))
        return false;
    for (int i = 0; i < 3; i++)
        triangle->depth[i] = (float)(((double)triangle->edge[0][i] * a->w + (double)triangle->edge[1][i] * b->w +
                                      (double)triangle->edge[2][i] * c->w) /
                                     det);
    return true;
}

void lumi_block_clear(struct lumi_block_buffer *buffer)
{
    for (int i = 0; i < LUMI_BLOCK_PIXELS; i++) {
        buffer->nearness[i] = -1;
        buffer->record[i] = -1;
    }
    buffer->record_count = 0;
}

void lumi_block_finish(struct lumi_block_buffer *buffer)
{
    lumi_free(buffer->records);
    memset(buffer, 0, sizeof *buffer);
}

static bool outside(const struct lumi_triangle *t, const struct lumi_cone *cone)
{
    for (int k = 0; k < 3; k++)
        if (lumi_cone_behind(cone, t->edge[k][0], t->edge[k][1], t->edge[k][2], t->length[k]))
            return true;
    return cone->cosine > 1;
}

/* One 8×8 cell; returns whether any pixel was taken. */
static int draw_cell(const struct lumi_triangle *t, const float *restrict x, const float *restrict y,
                     const float *restrict z, float *restrict nearness, int *restrict record, int id)
{
    const float a0 = t->edge[0][0], a1 = t->edge[0][1], a2 = t->edge[0][2], at = t->threshold[0];
    const float b0 = t->edge[1][0], b1 = t->edge[1][1], b2 = t->edge[1][2], bt = t->threshold[1];
    const float c0 = t->edge[2][0], c1 = t->edge[2][1], c2 = t->edge[2][2], ct = t->threshold[2];
    const float d0 = t->depth[0], d1 = t->depth[1], d2 = t->depth[2];
    int drawn = 0;

    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        float a = a0 * x[i] + a1 * y[i] + a2 * z[i] - at;
        float b = b0 * x[i] + b1 * y[i] + b2 * z[i] - bt;
        float c = c0 * x[i] + c1 * y[i] + c2 * z[i] - ct;
        float s = d0 * x[i] + d1 * y[i] + d2 * z[i];
        s = s > 0 ? s : 0; /* at infinity rounding may go below */
        int take = (a > 0) & (b > 0) & (c > 0) & (s > nearness[i]);
        nearness[i] = take ? s : nearness[i];
        record[i] = take ? id : record[i];
        drawn |= take;
    }
    return drawn;
}

static int new_record(struct lumi_block_buffer *buffer, const struct lumi_patch *patch,
                      const struct lumi_surface_vertex *a, const struct lumi_surface_vertex *b,
                      const struct lumi_surface_vertex *c)
{
    if (buffer->record_count == buffer->record_capacity) {
        int capacity = buffer->record_capacity ? 2 * buffer->record_capacity : 256;
        void *grown = lumi_realloc(buffer->records, (size_t)capacity, sizeof *buffer->records);
        if (!grown)
            return LUMI_ERR_NOMEM;
        buffer->records = grown;
        buffer->record_capacity = capacity;
    }
    double bx = (double)b->tx - a->tx, by = (double)b->ty - a->ty, bd = (double)b->depth - a->depth;
    double cx = (double)c->tx - a->tx, cy = (double)c->ty - a->ty, cd = (double)c->depth - a->depth;
    double area = bx * cy - by * cx;
    struct lumi_triangle_record *record = &buffer->records[buffer->record_count];
    record->tile = patch->tile;
    record->gx = area != 0 ? (float)((bd * cy - by * cd) / area) : 0;
    record->gy = area != 0 ? (float)((bx * cd - bd * cx) / area) : 0;
    return buffer->record_count++;
}

int lumi_block_draw_one(struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                        const struct lumi_surface_view *surface, const struct lumi_patch *patch, int triangle)
{
    const struct lumi_surface_vertex *v = surface->vertices + patch->first_vertex;
    const uint16_t *index = patch->indices + 3 * triangle;
    const struct lumi_surface_vertex *a = v + index[0], *b = v + index[1], *c = v + index[2];
    struct lumi_triangle t;
    int drawn = 0;

    if (!lumi_triangle_init(&t, a, b, c) || outside(&t, &rays->blocks[block]))
        return 0;
    int id = new_record(buffer, patch, a, b, c);
    if (id < 0)
        return id;
    for (int cell = 0; cell < LUMI_BLOCK_CELLS; cell++) {
        if (outside(&t, &rays->cells[block * LUMI_BLOCK_CELLS + cell]))
            continue;
        size_t at = (size_t)block * LUMI_BLOCK_PIXELS + (size_t)cell * LUMI_CELL_PIXELS;
        drawn |= draw_cell(&t, rays->x + at, rays->y + at, rays->z + at, buffer->nearness + cell * LUMI_CELL_PIXELS,
                           buffer->record + cell * LUMI_CELL_PIXELS, id);
    }
    if (!drawn)
        buffer->record_count--;
    return drawn;
}

int lumi_block_draw(struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                    const struct lumi_surface_view *surface, const struct lumi_patch *patch)
{
    if (lumi_cones_apart(&patch->cone, &rays->blocks[block]))
        return LUMI_OK;
    for (int i = 0; i < patch->triangle_count; i++) {
        int drawn = lumi_block_draw_one(buffer, rays, block, surface, patch, i);
        if (drawn < 0)
            return drawn;
    }
    return LUMI_OK;
}
