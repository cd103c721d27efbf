/* The rays of an output picture. */
#include "render/cpu/rays.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/base/raster.h"

#include <math.h>
#include <string.h>

struct lumi_cone lumi_cone_around(const float *x, const float *y, const float *z, int count, int stride)
{
    const struct lumi_cone empty = {0, 0, 1, 2, 0}, all = {0, 0, 1, -1, 2};
    double sx = 0, sy = 0, sz = 0;
    float cosine = 1;
    int used = 0;

    for (int i = 0; i < count * stride; i += stride) {
        sx += x[i], sy += y[i], sz += z[i];
        used += x[i] != 0 || y[i] != 0 || z[i] != 0;
    }
    if (!used)
        return empty;
    double length = sqrt(sx * sx + sy * sy + sz * sz);
    if (!(length > 1e-3 * used))
        return all;
    struct lumi_cone cone = {(float)(sx / length), (float)(sy / length), (float)(sz / length), 0, 0};
    for (int i = 0; i < count * stride; i += stride) {
        float dot = x[i] * cone.x + y[i] * cone.y + z[i] * cone.z;
        if (dot < cosine && (x[i] != 0 || y[i] != 0 || z[i] != 0))
            cosine = dot;
    }
    if (cosine < 0.1f)
        return all;
    /* Rounding of unit vectors shows in the cosine as 1e-7, in a narrow cone's angle as much more; a hair of slack. */
    cone.sine = sqrtf(fmaxf(0, 1 - cosine * cosine)) + 1e-4f;
    cone.cosine = sqrtf(fmaxf(0, 1 - cone.sine * cone.sine));
    return cone;
}

void lumi_rays_bound(struct lumi_rays *rays, int block)
{
    size_t first = (size_t)block * LUMI_BLOCK_PIXELS;

    for (int i = 0; i < LUMI_BLOCK_CELLS; i++) {
        size_t at = first + (size_t)i * LUMI_CELL_PIXELS;
        rays->cells[block * LUMI_BLOCK_CELLS + i] =
            lumi_cone_around(rays->x + at, rays->y + at, rays->z + at, LUMI_CELL_PIXELS, 1);
    }
    rays->blocks[block] = lumi_cone_around(rays->x + first, rays->y + first, rays->z + first, LUMI_BLOCK_PIXELS, 1);
}

struct fill {
    struct lumi_rays *rays;
    const struct lumi_lens *lens;
    const struct lumi_pose *pose;
    long *imaged; /* a block */
};

static int fill_block(void *context, int block, int thread)
{
    struct fill *fill = context;
    struct lumi_rays *rays = fill->rays;
    int x0 = block % rays->block_cols * LUMI_BLOCK, y0 = block / rays->block_cols * LUMI_BLOCK;

    (void)thread;
    for (int y = y0; y < y0 + LUMI_BLOCK && y < rays->height; y++)
        for (int x = x0; x < x0 + LUMI_BLOCK && x < rays->width; x++) {
            struct lumi_vec3 d;
            if (!lumi_lens_unproject(fill->lens, x + 0.5, y + 0.5, &d))
                continue;
            d = lumi_rotate(fill->pose->r, d);
            size_t at = lumi_rays_at(rays, x, y);
            rays->x[at] = (float)d.x, rays->y[at] = (float)d.y, rays->z[at] = (float)d.z;
            fill->imaged[block]++;
        }
    lumi_rays_bound(rays, block);
    return LUMI_OK;
}

/* Tables for block_cols × block_rows blocks. */
static int allocate(struct lumi_rays *rays, struct lumi_error *error)
{
    size_t blocks = (size_t)rays->block_cols * (size_t)rays->block_rows;

    rays->pixels = blocks * LUMI_BLOCK_PIXELS;
    rays->x = lumi_calloc(rays->pixels, sizeof(float));
    rays->y = lumi_calloc(rays->pixels, sizeof(float));
    rays->z = lumi_calloc(rays->pixels, sizeof(float));
    rays->blocks = lumi_calloc(blocks, sizeof *rays->blocks);
    rays->cells = lumi_calloc(blocks * LUMI_BLOCK_CELLS, sizeof *rays->cells);
    if (rays->x && rays->y && rays->z && rays->blocks && rays->cells)
        return LUMI_OK;
    const int width = rays->width, height = rays->height;
    lumi_rays_finish(rays);
    return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture of %d×%d", width, height);
}

int lumi_rays_init_blocks(struct lumi_rays *rays, int blocks, struct lumi_error *error)
{
    *rays =
        (struct lumi_rays){.width = LUMI_BLOCK, .height = LUMI_BLOCK * blocks, .block_cols = 1, .block_rows = blocks};
    if (blocks < 1 || blocks > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "a table of %d blocks of rays", blocks);
    LUMI_TRY(allocate(rays, error));
    for (int i = 0; i < blocks; i++)
        lumi_rays_bound(rays, i);
    return LUMI_OK;
}

int lumi_rays_init(struct lumi_rays *rays, const struct lumi_lens *lens, const struct lumi_pose *pose, int threads,
                   struct lumi_error *error)
{
    memset(rays, 0, sizeof *rays);
    if (!lumi_lens_valid(lens))
        return lumi_fail(error, LUMI_ERR_ARG, "the output's lens is not one: size or focal length out of range");
    if (!lumi_pose_valid(pose, 1e-3))
        return lumi_fail(error, LUMI_ERR_ARG, "the output's pose is not a rotation and a place");
    rays->width = lens->width;
    rays->height = lens->height;
    rays->block_cols = (lens->width + LUMI_BLOCK - 1) / LUMI_BLOCK;
    rays->block_rows = (lens->height + LUMI_BLOCK - 1) / LUMI_BLOCK;
    LUMI_TRY(allocate(rays, error));
    size_t blocks = (size_t)rays->block_cols * (size_t)rays->block_rows;
    long *imaged = lumi_calloc(blocks, sizeof *imaged);
    if (!imaged) {
        lumi_rays_finish(rays);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture of %d×%d", lens->width, lens->height);
    }
    struct fill fill = {rays, lens, pose, imaged};
    lumi_parallel_for((int)blocks, threads, fill_block, &fill);
    for (size_t i = 0; i < blocks; i++)
        rays->imaged += imaged[i];
    lumi_free(imaged);
    return LUMI_OK;
}

void lumi_rays_finish(struct lumi_rays *rays)
{
    lumi_free(rays->x);
    lumi_free(rays->y);
    lumi_free(rays->z);
    lumi_free(rays->blocks);
    lumi_free(rays->cells);
    memset(rays, 0, sizeof *rays);
}
