/* The dense inverse depth that meshes stand for. */
#include "pipeline/geometry/simplify.h"

#include <math.h>

/* Fills the pixels whose centres lie in the triangle, edges included (with some slack, so that rounding leaves no pixel
 * on an edge to neither side). In pixels of the tile. */
static void fill(const double x[3], const double y[3], const double w[3], int left, int top, struct lumi_raster *out)
{
    const double slack = 1e-9;
    const double determinant = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    const int y0 = (int)fmax(0, ceil(fmin(fmin(y[0], y[1]), y[2]) - 0.5));
    const int y1 = (int)fmin(out->height - 1 - top, floor(fmax(fmax(y[0], y[1]), y[2]) - 0.5));
    const int x0 = (int)fmax(0, ceil(fmin(fmin(x[0], x[1]), x[2]) - 0.5));
    const int x1 = (int)fmin(out->width - 1 - left, floor(fmax(fmax(x[0], x[1]), x[2]) - 0.5));

    if (determinant == 0)
        return;
    for (int j = y0; j <= y1; j++)
        for (int i = x0; i <= x1; i++) {
            const double px = i + 0.5 - x[0], py = j + 0.5 - y[0];
            const double b = (px * (y[2] - y[0]) - (x[2] - x[0]) * py) / determinant;
            const double c = ((x[1] - x[0]) * py - px * (y[1] - y[0])) / determinant;
            if (b >= -slack && c >= -slack && b + c <= 1 + slack)
                lumi_row_f32(out, top + j)[left + i] = (float)(w[0] + b * (w[1] - w[0]) + c * (w[2] - w[0]));
        }
}

int lumi_mesh_rasterize(const struct lumi_view_mesh *mesh, int width, int height, struct lumi_raster *inverse_depth)
{
    LUMI_TRY(lumi_raster_create(inverse_depth, width, height, 1, LUMI_F32));
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        for (int k = 0; k < tile->triangle_count; k++) {
            double x[3], y[3], w[3];
            for (int c = 0; c < 3; c++) {
                const struct lumi_mesh_vertex *v = &tile->vertices[tile->indices[3 * k + c]];
                x[c] = v->s * (LUMI_TILE / 255.0);
                y[c] = v->t * (LUMI_TILE / 255.0);
                w[c] = (double)lumi_mesh_inverse_depth(mesh, tile, v->d);
            }
            fill(x, y, w, i % mesh->cols * LUMI_TILE, i / mesh->cols * LUMI_TILE, inverse_depth);
        }
    }
    return LUMI_OK;
}
