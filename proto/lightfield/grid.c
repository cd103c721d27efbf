/* The lens of a view. */
#include "proto/lightfield/grid.h"

#include <math.h>

static bool init_size(struct lumi_grid *grid, int width, int height)
{
    if (width < 1 || height < 1 || width > LUMI_TILE * LUMI_GRID_MAX || height > LUMI_TILE * LUMI_GRID_MAX)
        return false;
    *grid = (struct lumi_grid){.width = width,
                               .height = height,
                               .cols = (width + LUMI_TILE - 1) / LUMI_TILE,
                               .rows = (height + LUMI_TILE - 1) / LUMI_TILE};
    return true;
}

static void fill_equiangular(double *tangents, int tiles, int pixels, double fov)
{
    for (int i = 0; i <= tiles; i++)
        tangents[i] = tan(((double)i * LUMI_TILE / pixels - 0.5) * fov);
}

bool lumi_grid_init_equiangular(struct lumi_grid *grid, int width, int height, double fov_x, double fov_y)
{
    if (!init_size(grid, width, height))
        return false;
    fill_equiangular(grid->tan_x, grid->cols, width, fov_x);
    fill_equiangular(grid->tan_y, grid->rows, height, fov_y);
    return lumi_grid_valid(grid);
}

bool lumi_grid_init_pinhole(struct lumi_grid *grid, int width, int height, double fx, double fy, double cx, double cy)
{
    if (!init_size(grid, width, height))
        return false;
    for (int i = 0; i <= grid->cols; i++)
        grid->tan_x[i] = (i * LUMI_TILE - cx) / fx;
    for (int i = 0; i <= grid->rows; i++)
        grid->tan_y[i] = (i * LUMI_TILE - cy) / fy;
    return lumi_grid_valid(grid);
}

static bool rises(const double *tangents, int tiles)
{
    for (int i = 0; i <= tiles; i++)
        if (!isfinite(tangents[i]) || (i > 0 && !(tangents[i] > tangents[i - 1])))
            return false;
    return true;
}

bool lumi_grid_valid(const struct lumi_grid *grid)
{
    return grid->width >= 1 && grid->height >= 1 && grid->cols >= 1 && grid->rows >= 1 && grid->cols <= LUMI_GRID_MAX &&
           grid->rows <= LUMI_GRID_MAX && grid->cols == (grid->width + LUMI_TILE - 1) / LUMI_TILE &&
           grid->rows == (grid->height + LUMI_TILE - 1) / LUMI_TILE && rises(grid->tan_x, grid->cols) &&
           rises(grid->tan_y, grid->rows);
}

/* Pixel position of a tangent: binary search for the tile, linear within; outermost tiles go on. */
static double position(const double *tangents, int tiles, double tangent)
{
    int low = 0, high = tiles;

    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (tangent < tangents[middle])
            high = middle;
        else
            low = middle;
    }
    return LUMI_TILE * (low + (tangent - tangents[low]) / (tangents[low + 1] - tangents[low]));
}

static double tangent(const double *tangents, int tiles, double pixel)
{
    int tile = pixel <= 0 ? 0 : (int)fmin(pixel / LUMI_TILE, tiles - 1);

    return tangents[tile] + (pixel / LUMI_TILE - tile) * (tangents[tile + 1] - tangents[tile]);
}

bool lumi_grid_project(const struct lumi_grid *grid, struct lumi_vec3 direction, double *x, double *y)
{
    if (!(direction.z > 1e-12 * (fabs(direction.x) + fabs(direction.y))))
        return false;
    *x = position(grid->tan_x, grid->cols, direction.x / direction.z);
    *y = position(grid->tan_y, grid->rows, direction.y / direction.z);
    return true;
}

void lumi_grid_unproject(const struct lumi_grid *grid, double x, double y, double *tan_x, double *tan_y)
{
    *tan_x = tangent(grid->tan_x, grid->cols, x);
    *tan_y = tangent(grid->tan_y, grid->rows, y);
}

bool lumi_grid_init_half(struct lumi_grid *half, const struct lumi_grid *grid)
{
    if (!init_size(half, (grid->width + 1) / 2, (grid->height + 1) / 2))
        return false;
    for (int i = 0; i <= half->cols; i++)
        half->tan_x[i] = tangent(grid->tan_x, grid->cols, 2.0 * LUMI_TILE * i);
    for (int i = 0; i <= half->rows; i++)
        half->tan_y[i] = tangent(grid->tan_y, grid->rows, 2.0 * LUMI_TILE * i);
    return lumi_grid_valid(half);
}
