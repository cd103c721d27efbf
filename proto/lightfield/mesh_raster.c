/* Meshes drawn into the view they belong to. */
#include "proto/lightfield/mesh_raster.h"

#include "proto/lightfield/grid.h"

#include <math.h>

struct lumi_mesh_point lumi_mesh_point(const struct lumi_view_mesh *mesh, int tile,
                                       const struct lumi_mesh_vertex *vertex)
{
    struct lumi_mesh_point p = {
        (tile % mesh->cols) * LUMI_TILE + vertex->s * (LUMI_TILE / 255.0),
        (tile / mesh->cols) * LUMI_TILE + vertex->t * (LUMI_TILE / 255.0),
        lumi_mesh_inverse_depth(mesh, &mesh->tiles[tile], vertex->d),
    };

    return p;
}

/* Within a tile the lens is rectilinear, so inverse depth is linear in the image. Edges count as inside on both sides:
 * the two triangles agree there. */
static void fill_triangle(const struct lumi_mesh_point c[3], const struct lumi_raster *out)
{
    double area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);

    if (area == 0)
        return;
    int x0 = (int)fmax(0, ceil(fmin(fmin(c[0].x, c[1].x), c[2].x) - 0.5));
    int y0 = (int)fmax(0, ceil(fmin(fmin(c[0].y, c[1].y), c[2].y) - 0.5));
    int x1 = (int)fmin(out->width - 1, floor(fmax(fmax(c[0].x, c[1].x), c[2].x) - 0.5));
    int y1 = (int)fmin(out->height - 1, floor(fmax(fmax(c[0].y, c[1].y), c[2].y) - 0.5));
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            double px = x + 0.5, py = y + 0.5;
            double a = ((c[1].x - px) * (c[2].y - py) - (c[1].y - py) * (c[2].x - px)) / area;
            double b = ((c[2].x - px) * (c[0].y - py) - (c[2].y - py) * (c[0].x - px)) / area;
            if (a < -1e-9 || b < -1e-9 || a + b > 1 + 1e-9)
                continue;
            float w = (float)(a * c[0].w + b * c[1].w + (1 - a - b) * c[2].w);
            float *there = &lumi_row_f32(out, y)[x];
            if (!(*there >= w)) /* nearer, or nothing yet */
                *there = w;
        }
}

int lumi_mesh_rasterize(const struct lumi_view_mesh *mesh, int width, int height, struct lumi_raster *inverse_depth)
{
    LUMI_TRY(lumi_raster_create(inverse_depth, width, height, 1, LUMI_F32));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            lumi_row_f32(inverse_depth, y)[x] = NAN;
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        for (int t = 0; t < tile->triangle_count; t++) {
            struct lumi_mesh_point c[3];
            for (int k = 0; k < 3; k++)
                c[k] = lumi_mesh_point(mesh, i, &tile->vertices[tile->indices[3 * t + k]]);
            fill_triangle(c, inverse_depth);
        }
    }
    return LUMI_OK;
}
