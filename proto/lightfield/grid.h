/* The lens of a view: locally linear, equiangular or rectilinear (Overbeck et al. 2018, section 7.1, "Equiangular
 * conversion"). Tile corners sit at chosen directions; within a 64×64 tile the mapping is rectilinear, so a tile with
 * its mesh is an ordinary textured surface. Both axes are separable: the tangent x/z depends on the column only. */
#ifndef LUMI_PROTO_LIGHTFIELD_GRID_H
#define LUMI_PROTO_LIGHTFIELD_GRID_H

#include "proto/base/geometry.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_TILE 64      /* pixels a side */
#define LUMI_GRID_MAX 128 /* tiles a side, at most */

/* width × height pixels in cols × rows tiles; where the size is no multiple of 64, the last tiles are cut (their corner
 * tangents go on beyond the image). tan_x[i] is x/z at the left edge of tile column i (pixel 64 i), tan_y[i] is y/z at
 * the top of tile row i; both rise strictly. */
struct lumi_grid {
    int width, height;
    int cols, rows; /* ceil(width / 64), ceil(height / 64) */
    double tan_x[LUMI_GRID_MAX + 1], tan_y[LUMI_GRID_MAX + 1];
};

/* Equal angles between tile corners: `fov_x` radians over `width` pixels, centred (so fov_y follows for height). */
bool lumi_grid_init_equiangular(struct lumi_grid *grid, int width, int height, double fov_x, double fov_y);
/* The plain pinhole with these focal lengths and principal point: pixels map one to one. */
bool lumi_grid_init_pinhole(struct lumi_grid *grid, int width, int height, double fx, double fy, double cx, double cy);

/* The same view at half resolution (sizes rounded up): its tiles span two of the grid's each way, and are rectilinear
 * as every tile is, so its pixels are not simply pairs of the grid's. */
bool lumi_grid_init_half(struct lumi_grid *half, const struct lumi_grid *grid);

/* Sizes in range, tangents finite and rising. */
bool lumi_grid_valid(const struct lumi_grid *grid);

/* Image position of a direction in the camera's frame. False behind the camera; the position may lie outside the image
 * (the outermost tiles' mapping is continued). */
bool lumi_grid_project(const struct lumi_grid *grid, struct lumi_vec3 direction, double *x, double *y);
/* Tangents x/z, y/z of an image position (the direction is (tan_x, tan_y, 1)). */
void lumi_grid_unproject(const struct lumi_grid *grid, double x, double y, double *tan_x, double *tan_y);

#ifdef __cplusplus
}
#endif
#endif
