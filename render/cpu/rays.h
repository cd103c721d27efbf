/* The rays of an output picture, and where they point, block by block.
 *
 * Every output projection is central, so a picture is a table of directions from one eye. What can be drawn where is
 * decided among directions alone: a block of pixels is bounded by a cone, and nothing needs to know about image planes,
 * near planes or where a panorama wraps around.
 *
 * Pixels are kept in 32×32 blocks of 8×8 cells: block b's pixels are [1024 b, 1024 b + 1024), its cells 64 in a row. */
#ifndef LUMI_RENDER_CPU_RAYS_H
#define LUMI_RENDER_CPU_RAYS_H

#include "proto/base/lens.h"
#include "proto/base/result.h"

#include <stddef.h>

#define LUMI_BLOCK 32
#define LUMI_CELL 8
#define LUMI_BLOCK_PIXELS 1024
#define LUMI_CELL_PIXELS 64
#define LUMI_BLOCK_CELLS 16

#ifdef __cplusplus
extern "C" {
#endif

/* Directions within an angle of an axis. sine > 1: no bound (nothing may be concluded); cosine > 1: empty. */
struct lumi_cone {
    float x, y, z, cosine, sine;
};

struct lumi_rays {
    int width, height, block_cols, block_rows;
    size_t pixels;            /* 1024 a block, those beyond the picture included */
    float *x, *y, *z;         /* unit directions in the world; all zero where the lens images nothing */
    struct lumi_cone *blocks; /* block_cols · block_rows */
    struct lumi_cone *cells;  /* 16 a block */
    long imaged;
};

/* The smallest cone about the mean of `count` directions (zero ones are left out). */
struct lumi_cone lumi_cone_around(const float *x, const float *y, const float *z, int count, int stride);

/* True when no direction of the cone has a positive dot product with the plane normal. */
static inline int lumi_cone_behind(const struct lumi_cone *cone, float nx, float ny, float nz, float length)
{
    return nx * cone->x + ny * cone->y + nz * cone->z < -length * cone->sine;
}
/* True when two cones have no direction in common. */
static inline int lumi_cones_apart(const struct lumi_cone *a, const struct lumi_cone *b)
{
    if (a->cosine > 1 || b->cosine > 1)
        return 1;
    if (a->sine > 1 || b->sine > 1)
        return 0;
    return a->x * b->x + a->y * b->y + a->z * b->z < a->cosine * b->cosine - a->sine * b->sine - 1e-6f;
}

int lumi_rays_init(struct lumi_rays *rays, const struct lumi_lens *lens, const struct lumi_pose *pose, int threads,
                   struct lumi_error *error);
/* Room for `blocks` blocks of rays of the caller's own, all zero: a picture 32 pixels wide, block under block. Fill x,
 * y and z in the layout above, then bound every block that was filled. */
int lumi_rays_init_blocks(struct lumi_rays *rays, int blocks, struct lumi_error *error);
/* Finds the cones of a block and of its cells. */
void lumi_rays_bound(struct lumi_rays *rays, int block);
void lumi_rays_finish(struct lumi_rays *rays);

/* Where pixel (x, y) lies in the tables. */
static inline size_t lumi_rays_at(const struct lumi_rays *rays, int x, int y)
{
    size_t block = (size_t)(y / LUMI_BLOCK) * (size_t)rays->block_cols + (size_t)(x / LUMI_BLOCK);
    int cell = y % LUMI_BLOCK / LUMI_CELL * (LUMI_BLOCK / LUMI_CELL) + x % LUMI_BLOCK / LUMI_CELL;

    return block * LUMI_BLOCK_PIXELS + (size_t)(cell * LUMI_CELL_PIXELS + y % LUMI_CELL * LUMI_CELL + x % LUMI_CELL);
}

#ifdef __cplusplus
}
#endif
#endif
