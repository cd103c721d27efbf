/* From lens and pose to pixels, tile by tile. */
#include "sim/camera.h"

#include "proto/base/parallel.h"
#include "sim/shade.h"

#include <string.h>

#define TILE 32
#define RIM (TILE + 2) /* a tile and the pixels around it */
#define COARSE 2       /* rays a side of a pixel, everywhere */
#define FINE 4         /* and where the coarse ones differ */

/* Rays differ when a channel's brightest and darkest, as the eye sees them (about a square root), are further apart
 * than this: the rays of a pixel, and those of a pixel and its neighbours, between which an edge may pass unseen. */
#define CONTRAST 0.05f
#define CONTRAST_AROUND 0.15f

struct job {
    const struct sim_scene *scene;
    const struct lumi_lens *lens;
    const struct lumi_pose *pose;
    struct lumi_raster *color, *depth;
    int columns; /* of tiles */
};

/* Directions (world) at the corners of the pixels of a tile and around it; between them they are linear to 1e-4 of a
 * pixel. Pixel (0, 0) is the one left of and above the tile. */
struct corners {
    struct sim_v3 direction[RIM + 1][RIM + 1];
    bool imaged[RIM + 1][RIM + 1];
};

static void find_corners(const struct job *job, int x0, int y0, int width, int height, struct corners *corners)
{
    for (int j = 0; j <= height + 2; j++)
        for (int i = 0; i <= width + 2; i++) {
            struct lumi_vec3 d = {0};
            corners->imaged[j][i] = lumi_lens_unproject(job->lens, x0 + i - 1, y0 + j - 1, &d);
            corners->direction[j][i] = v3_of(lumi_rotate(job->pose->r, d));
        }
}

static bool imaged(const struct corners *c, int i, int j)
{
    return c->imaged[j][i] && c->imaged[j][i + 1] && c->imaged[j + 1][i] && c->imaged[j + 1][i + 1];
}

/* Where along an axis of the pixel, 0..1 from edge to edge, share u of its response lies: a tent a pixel wide to either
 * side, a square pixel behind a lens that blurs as much again. */
static float tent(float u)
{
    return u < 0.5f ? sqrtf(2 * u) - 0.5f : 1.5f - sqrtf(2 - 2 * u);
}

/* The ray through (a, b) of the pixel (i, j). */
static void pixel_ray(const struct job *job, const struct corners *c, int i, int j, float a, float b,
                      struct sim_ray *ray)
{
    struct sim_v3 top = v3_mix(c->direction[j][i], c->direction[j][i + 1], a);
    struct sim_v3 bottom = v3_mix(c->direction[j + 1][i], c->direction[j + 1][i + 1], a);
    struct sim_v3 diagonal = v3_sub(c->direction[j + 1][i + 1], c->direction[j][i]);

    ray->origin = v3_of(job->pose->t);
    ray->direction = v3_unit(v3_mix(top, bottom, b));
    ray->spread = 0.70710678f * v3_length(diagonal);
}

/* The first thing along the ray that a camera sees. */
static void look(const struct job *job, const struct sim_ray *ray, struct sim_hit *hit)
{
    float near = 1e-3f;

    for (;;) {
        sim_trace(job->scene, ray, near, hit);
        if (hit->triangle < 0 || !job->scene->unseen || (size_t)hit->triangle < job->scene->unseen)
            return;
        near = hit->distance + 1e-4f;
    }
}

struct range {
    struct sim_v3 sum, low, high;
};

static void take(struct range *range, struct sim_v3 c)
{
    range->sum = v3_add(range->sum, c);
    range->low = v3(fminf(range->low.x, c.x), fminf(range->low.y, c.y), fminf(range->low.z, c.z));
    range->high = v3(fmaxf(range->high.x, c.x), fmaxf(range->high.y, c.y), fmaxf(range->high.z, c.z));
}

static struct range sample_pixel(const struct job *job, const struct corners *corners, int i, int j, int side)
{
    /* Fine rays take all sixteen points of the sun in turn, coarse ones four far apart on its rim: where those agree,
     * so do the others. */
    static const int rim[COARSE * COARSE] = {5, 8, 10, 13};
    struct range range = {v3_grey(0), v3_grey(INFINITY), v3_grey(0)};
    struct sim_ray ray;
    struct sim_hit hit;
    const float n = (float)(side * side);

    for (int k = 0; k < side * side; k++) {
        /* Each in its cell of side × side, and alone in its row and column of n × n. */
        int column = k % side, row = k / side;
        float a = (float)(column * side + row) + 0.5f, b = (float)(row * side + column) + 0.5f;
        pixel_ray(job, corners, i, j, tent(a / n), tent(b / n), &ray);
        look(job, &ray, &hit);
        int sun = side == FINE ? k * 7 % SIM_SUN_POINTS : rim[k];
        struct sim_v3 c = sim_shade(job->scene, &ray, &hit, sun);
        take(&range, c);
    }
    range.sum = v3_scale(range.sum, 1 / n);
    return range;
}

static float spread(struct sim_v3 low, struct sim_v3 high)
{
    float red = sqrtf(high.x) - sqrtf(low.x), green = sqrtf(high.y) - sqrtf(low.y), blue = sqrtf(high.z) - sqrtf(low.z);

    return fmaxf(red, fmaxf(green, blue));
}

/* Does the pixel (i, j), or what lies between it and its neighbours, want more rays? */
static bool differs(const struct range ranges[RIM][RIM], int i, int j)
{
    struct range all = ranges[j][i];

    if (spread(all.low, all.high) > CONTRAST)
        return true;
    for (int dj = -1; dj <= 1; dj++)
        for (int di = -1; di <= 1; di++) {
            take(&all, ranges[j + dj][i + di].low);
            take(&all, ranges[j + dj][i + di].high);
        }
    return spread(all.low, all.high) > CONTRAST_AROUND;
}

static float pixel_depth(const struct job *job, int x, int y)
{
    struct lumi_vec3 d;
    struct sim_hit hit;

    if (!lumi_lens_unproject(job->lens, x + 0.5, y + 0.5, &d))
        return 0;
    struct sim_ray ray = {.origin = v3_of(job->pose->t), .direction = v3_of(lumi_rotate(job->pose->r, d))};
    look(job, &ray, &hit);
    return hit.triangle < 0 ? INFINITY : hit.distance * (float)d.z;
}

/* The coarse rays of a tile and of the pixels around it; what is not imaged has the range of nothing. */
static void render_coarse(const struct job *job, const struct corners *corners, int width, int height,
                          struct range ranges[RIM][RIM])
{
    for (int j = 0; j < height + 2; j++)
        for (int i = 0; i < width + 2; i++)
            ranges[j][i] = imaged(corners, i, j) ? sample_pixel(job, corners, i, j, COARSE)
                                                 : (struct range){v3_grey(0), v3_grey(INFINITY), v3_grey(0)};
}

static int render_tile(void *context, int index, int thread)
{
    const struct job *job = context;
    int x0 = index % job->columns * TILE, y0 = index / job->columns * TILE;
    int width = job->lens->width - x0, height = job->lens->height - y0;
    struct corners corners;
    struct range ranges[RIM][RIM];

    (void)thread;
    width = width < TILE ? width : TILE;
    height = height < TILE ? height : TILE;
    find_corners(job, x0, y0, width, height, &corners);
    render_coarse(job, &corners, width, height, ranges);
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            if (job->depth)
                lumi_row_f32(job->depth, y0 + j)[x0 + i] = pixel_depth(job, x0 + i, y0 + j);
            if (!imaged(&corners, i + 1, j + 1))
                continue;
            struct sim_v3 sum = ranges[j + 1][i + 1].sum;
            if (differs(ranges, i + 1, j + 1))
                sum = sample_pixel(job, &corners, i + 1, j + 1, FINE).sum;
            float *to = lumi_row_f32(job->color, y0 + j) + 3 * (size_t)(x0 + i);
            to[0] = sum.x;
            to[1] = sum.y;
            to[2] = sum.z;
        }
    return LUMI_OK;
}

int sim_camera_render(const struct sim_scene *scene, const struct lumi_lens *lens, const struct lumi_pose *pose,
                      int threads, struct lumi_raster *color, struct lumi_raster *depth, struct lumi_error *error)
{
    int columns = (lens->width + TILE - 1) / TILE, rows = (lens->height + TILE - 1) / TILE;
    struct job job = {scene, lens, pose, color, depth, columns};

    if (depth)
        *depth = (struct lumi_raster){0};
    int code = lumi_raster_create(color, lens->width, lens->height, 3, LUMI_F32);
    if (code == LUMI_OK && depth)
        code = lumi_raster_create(depth, lens->width, lens->height, 1, LUMI_F32);
    if (code == LUMI_OK)
        code = lumi_parallel_for(columns * rows, threads, render_tile, &job);
    if (code == LUMI_OK)
        return LUMI_OK;
    lumi_raster_finish(color);
    if (depth)
        lumi_raster_finish(depth);
    return lumi_fail(error, code, "no memory for a picture of %d x %d", lens->width, lens->height);
}
