/* A view's mesh as a picture of inverse depth: drawn by the renderer, from the view's own centre. */
#include "pipeline/prefilter/view_filter.h"
#include "proto/base/memory.h"
#include "render/cpu/raster_block.h"

#include <string.h>

/* The rays of a block of the view, in its own frame; zero beyond the picture. */
static void fill_block(const struct lumi_grid *grid, int x0, int y0, struct lumi_rays *rays)
{
    memset(rays->x, 0, LUMI_BLOCK_PIXELS * sizeof(float));
    memset(rays->y, 0, LUMI_BLOCK_PIXELS * sizeof(float));
    memset(rays->z, 0, LUMI_BLOCK_PIXELS * sizeof(float));
    for (int y = y0; y < y0 + LUMI_BLOCK && y < grid->height; y++)
        for (int x = x0; x < x0 + LUMI_BLOCK && x < grid->width; x++) {
            const size_t at = lumi_rays_at(rays, x - x0, y - y0);
            double tx, ty;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tx, &ty);
            const double length = sqrt(tx * tx + ty * ty + 1);
            rays->x[at] = (float)(tx / length), rays->y[at] = (float)(ty / length), rays->z[at] = (float)(1 / length);
        }
    lumi_rays_bound(rays, 0);
}

static void take_block(const struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int x0, int y0,
                       struct lumi_raster *surface)
{
    for (int y = y0; y < y0 + LUMI_BLOCK && y < surface->height; y++)
        for (int x = x0; x < x0 + LUMI_BLOCK && x < surface->width; x++) {
            const size_t at = lumi_rays_at(rays, x - x0, y - y0);
            /* 1 / distance along the ray; z is the ray's share along the axis. A hair's gap is infinity. */
            lumi_row_f32(surface, y)[x] = buffer->nearness[at] > 0 ? buffer->nearness[at] / rays->z[at] : 0;
        }
}

int lumi_prefilter_surface(const struct lumi_grid *grid, const struct lumi_view_mesh *mesh, struct lumi_raster *surface,
                           struct lumi_error *error)
{
    const struct lumi_view view = {
        .grid = grid, .pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}}, .disk = {1, 1, 1, 1}, .mesh = mesh};
    struct lumi_surface_view placed;
    struct lumi_block_buffer *buffer = lumi_calloc(1, sizeof *buffer);
    struct lumi_rays rays = {0};
    int code = LUMI_OK;

    *surface = (struct lumi_raster){0};
    lumi_surface_place(&placed, &view, view.pose.t, 1);
    if (!buffer || lumi_raster_create(surface, grid->width, grid->height, 1, LUMI_F32) != LUMI_OK ||
        lumi_rays_init_blocks(&rays, 1, NULL) != LUMI_OK || lumi_surface_build(&placed) != LUMI_OK)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a view's surface");
    for (int y0 = 0; code == LUMI_OK && y0 < grid->height; y0 += LUMI_BLOCK)
        for (int x0 = 0; code == LUMI_OK && x0 < grid->width; x0 += LUMI_BLOCK) {
            fill_block(grid, x0, y0, &rays);
            lumi_block_clear(buffer);
            for (int p = 0; code == LUMI_OK && p < placed.patch_count; p++)
                code = lumi_block_draw(buffer, &rays, 0, &placed, &placed.patches[p]);
            if (code != LUMI_OK)
                lumi_fail(error, code, "no memory for a view's surface");
            else
                take_block(buffer, &rays, x0, y0, surface);
        }
    lumi_surface_finish(&placed);
    lumi_rays_finish(&rays);
    if (buffer)
        lumi_block_finish(buffer);
    lumi_free(buffer);
    if (code != LUMI_OK)
        lumi_raster_finish(surface);
    return code;
}
