/* Depth from one view to another: every pixel a vertex, every four a surface unless depth jumps between them. */
#include "pipeline/synthesize/view_synthesis.h"
#include "proto/base/memory.h"

#include <string.h>

/* Neighbouring pixels that come to lie farther apart, in pixels of the new view, are of different surfaces. */
#define JUMP 2.0f
/* Pixels a surface seen from nearer may be stretched to before it counts as cut. */
#define NEARER 3.0f

struct vertex {
    float x, y, w; /* place and inverse depth in the new view; w < 0: none */
};

struct carrying {
    const struct lumi_synthesis_source *source;
    const struct lumi_grid *grid; /* the new view's */
    double m[9];                  /* from the source's directions to the view's */
    struct lumi_vec3 offset;      /* the source's centre in the view */
    double *tan_x;                /* of the source's columns */
    struct lumi_raster *depth;
};

static void place_row(const struct carrying *job, int y, struct vertex *row)
{
    const struct lumi_synthesis_source *source = job->source;
    const float *depth = lumi_row_f32(&source->depth, y);
    const uint8_t *blocked = source->blocked ? source->blocked + (size_t)y * (size_t)source->grid->width : NULL;
    double tan_x, tan_y;

    lumi_grid_unproject(source->grid, 0, y + 0.5, &tan_x, &tan_y);
    for (int x = 0; x < source->grid->width; x++) {
        const double w = depth[x];
        const struct lumi_vec3 q =
            lumi_add(lumi_rotate(job->m, lumi_vec3(job->tan_x[x], tan_y, 1)), lumi_scale(job->offset, w));
        double px, py;
        row[x].w = -1;
        if ((blocked && blocked[x]) || !(w >= 0) || !(q.z > 1e-3) || !lumi_grid_project(job->grid, q, &px, &py))
            continue;
        if (px < -8 || py < -8 || px > job->grid->width + 8 || py > job->grid->height + 8)
            continue;
        row[x] = (struct vertex){(float)px, (float)py, (float)(w / q.z)};
    }
}

static void put(struct lumi_raster *depth, int x, int y, float w)
{
    if (x < 0 || y < 0 || x >= depth->width || y >= depth->height)
        return;
    float *at = &lumi_row_f32(depth, y)[x];
    if (w > *at)
        *at = w;
}

static bool near(const struct vertex *a, const struct vertex *b)
{
    const float most = fabsf(a->w - b->w) < 0.02f * (a->w + b->w) ? NEARER : JUMP;

    return a->w >= 0 && b->w >= 0 && fabsf(a->x - b->x) <= most && fabsf(a->y - b->y) <= most;
}

static void draw(struct lumi_raster *depth, const struct vertex *a, const struct vertex *b, const struct vertex *c)
{
    const float area = (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
    const int x0 = (int)ceilf(fminf(a->x, fminf(b->x, c->x)) - 0.5f),
              y0 = (int)ceilf(fminf(a->y, fminf(b->y, c->y)) - 0.5f);
    const int x1 = (int)floorf(fmaxf(a->x, fmaxf(b->x, c->x)) - 0.5f);
    const int y1 = (int)floorf(fmaxf(a->y, fmaxf(b->y, c->y)) - 0.5f);

    if (!(area > 1e-6f)) /* it turned its back to the view */
        return;
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            const float px = (float)x + 0.5f, py = (float)y + 0.5f;
            const float u = (b->x - px) * (c->y - py) - (b->y - py) * (c->x - px);
            const float v = (c->x - px) * (a->y - py) - (c->y - py) * (a->x - px);
            if (u >= 0 && v >= 0 && u + v <= area)
                put(depth, x, y, (u * a->w + v * b->w + (area - u - v) * c->w) / area);
        }
}

static void join_rows(const struct carrying *job, const struct vertex *above, const struct vertex *below)
{
    for (int x = 0; x + 1 < job->source->grid->width; x++) {
        const struct vertex *const corners[4] = {&above[x], &above[x + 1], &below[x + 1], &below[x]};
        bool whole = true;
        for (int i = 0; i < 4; i++)
            whole = whole && near(corners[i], corners[(i + 1) & 3]);
        if (whole) {
            draw(job->depth, corners[0], corners[1], corners[2]);
            draw(job->depth, corners[0], corners[2], corners[3]);
            continue;
        }
        /* What is a pixel wide has no surface: it shows as the pixels it was. */
        for (int i = 0; i < 4; i++)
            if (corners[i]->w >= 0)
                put(job->depth, (int)floorf(corners[i]->x), (int)floorf(corners[i]->y), corners[i]->w);
    }
}

int lumi_synthesis_carry(const struct lumi_synthesis_source *source, const struct lumi_grid *grid,
                         const struct lumi_pose *pose, struct lumi_raster *depth)
{
    struct carrying job = {.source = source, .grid = grid, .depth = depth};
    const int width = source->grid->width;
    struct vertex *rows = lumi_alloc(2 * (size_t)width, sizeof *rows);
    double tan_y;

    job.tan_x = lumi_alloc((size_t)width, sizeof *job.tan_x);
    int code = rows && job.tan_x ? lumi_raster_create(depth, grid->width, grid->height, 1, LUMI_F32) : LUMI_ERR_NOMEM;
    if (code == LUMI_OK) {
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                job.m[3 * i + k] = lumi_dot(lumi_axis(pose, i), lumi_axis(&source->pose, k));
        job.offset = lumi_to_camera(pose, source->pose.t);
        for (int x = 0; x < width; x++)
            lumi_grid_unproject(source->grid, x + 0.5, 0, &job.tan_x[x], &tan_y);
        for (int y = 0; y < grid->height; y++)
            for (int x = 0; x < grid->width; x++)
                lumi_row_f32(depth, y)[x] = -1;
        for (int y = 0; y < source->grid->height; y++) {
            struct vertex *below = rows + (size_t)(y & 1) * (size_t)width;
            place_row(&job, y, below);
            if (y > 0)
                join_rows(&job, rows + (size_t)(~y & 1) * (size_t)width, below);
        }
    }
    lumi_free(rows);
    lumi_free(job.tan_x);
    return code;
}
