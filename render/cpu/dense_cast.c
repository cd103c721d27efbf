/* Rays that meet dense depth: which views a block sees, and between which depths it has to search. */
#include "render/cpu/dense_cast_priv.h"

#include "proto/base/memory.h"

#include <float.h>
#include <math.h>
#include <string.h>

struct lumi_cast {
    struct lumi_viewset *set;
    struct cast_disk disk;
    enum lumi_filter filter;
    const struct cast_kernels *kernels;
    int count, held; /* views; those acquired so far */
    struct cast_view *views;
    struct cast_axis *axes; /* two a different grid */
    int axis_count;
};

struct lumi_cast_eye {
    struct lumi_surface_view places[1]; /* one a view */
};

static void fill_axis(struct cast_axis *axis, const struct lumi_grid *grid, bool vertical)
{
    const double *tangents = vertical ? grid->tan_y : grid->tan_x;
    const int tiles = vertical ? grid->rows : grid->cols;
    const double low = tangents[0], cell = (tangents[tiles] - low) / CAST_AXIS_CELLS;

    *axis = (struct cast_axis){.origin = (float)low, .scale = (float)(1 / cell)};
    for (int i = 0; i < CAST_AXIS_CELLS; i++) {
        double t0 = low + i * cell, t1 = t0 + cell, x0, y0, x1, y1;
        lumi_grid_project(grid, vertical ? lumi_vec3(0, t0, 1) : lumi_vec3(t0, 0, 1), &x0, &y0);
        lumi_grid_project(grid, vertical ? lumi_vec3(0, t1, 1) : lumi_vec3(t1, 0, 1), &x1, &y1);
        const double p0 = vertical ? y0 : x0, p1 = vertical ? y1 : x1, slope = (p1 - p0) / cell;
        axis->slope[i] = (float)slope;
        axis->offset[i] = (float)(p0 - slope * t0);
    }
    axis->tiles = tiles;
    for (int i = 0; i < tiles; i++) {
        const double slope = LUMI_TILE / (tangents[i + 1] - tangents[i]);
        axis->tile_tangent[i] = (float)tangents[i];
        axis->tile_slope[i] = (float)slope;
        axis->tile_offset[i] = (float)(LUMI_TILE * i - slope * tangents[i]);
    }
}

/* The tables of a grid, made once for all views that share it. */
static void find_axes(struct lumi_cast *cast, int index)
{
    struct cast_view *view = &cast->views[index];

    for (int i = 0; i < index; i++)
        if (cast->views[i].view->grid == view->view->grid) {
            view->x = cast->views[i].x;
            view->y = cast->views[i].y;
            return;
        }
    view->x = &cast->axes[cast->axis_count++];
    view->y = &cast->axes[cast->axis_count++];
    fill_axis(view->x, view->view->grid, false);
    fill_axis(view->y, view->view->grid, true);
}

/* Lowest and highest depth of the pixels [x0, x1) × [y0, y1). */
static void bound(const struct cast_view *view, int x0, int y0, int x1, int y1, float *lowest, float *highest)
{
    float low = FLT_MAX, high = 0;

    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            float w = view->depth[y * view->pitch + x];
            low = w < low ? w : low;
            high = w > high ? w : high;
        }
    *lowest = low;
    *highest = high;
}

static int fill_bounds(struct cast_view *view)
{
    view->bound_cols = (view->width + CAST_BOUND - 1) / CAST_BOUND;
    view->bound_rows = (view->height + CAST_BOUND - 1) / CAST_BOUND;
    const size_t cells = (size_t)view->bound_cols * (size_t)view->bound_rows;
    view->lowest = lumi_alloc(cells, sizeof(float));
    view->highest = lumi_alloc(cells, sizeof(float));
    if (!view->lowest || !view->highest)
        return LUMI_ERR_NOMEM;
    for (int r = 0; r < view->bound_rows; r++)
        for (int c = 0; c < view->bound_cols; c++) {
            int x0 = c * CAST_BOUND - 1, y0 = r * CAST_BOUND - 1, x1 = x0 + CAST_BOUND + 2, y1 = y0 + CAST_BOUND + 2;
            const int at = r * view->bound_cols + c;
            x0 = x0 > 0 ? x0 : 0;
            y0 = y0 > 0 ? y0 : 0;
            x1 = x1 < view->width ? x1 : view->width;
            y1 = y1 < view->height ? y1 : view->height;
            bound(view, x0, y0, x1, y1, &view->lowest[at], &view->highest[at]);
        }
    bound(view, 0, 0, view->width, view->height, &view->all_lowest, &view->all_highest);
    return LUMI_OK;
}

static int prepare(struct lumi_cast *cast, int index, struct lumi_error *error)
{
    struct cast_view *view = &cast->views[index];
    const struct lumi_raster *depth;

    view->view = lumi_viewset_view(cast->set, index);
    depth = view->view->inverse_depth;
    LUMI_TRY(lumi_viewset_acquire(cast->set, index, &view->pixels, NULL, error));
    cast->held = index + 1;
    view->width = view->pixels.width;
    view->height = view->pixels.height;
    if (!depth || view->pixels.sample != LUMI_F32 || view->width < 2 || view->height < 2)
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: casting wants dense depth and floating-point pixels", index);
    view->depth = depth->data;
    view->pitch = (int)(depth->stride / sizeof(float));
    find_axes(cast, index);
    if (fill_bounds(view) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to bound a view's depths");
    return LUMI_OK;
}

int lumi_cast_create(struct lumi_viewset *set, const struct lumi_disk_settings *settings, struct lumi_cast **result,
                     struct lumi_error *error)
{
    struct lumi_disk_settings defaults;
    struct lumi_cast *cast = lumi_calloc(1, sizeof *cast);
    const int count = lumi_viewset_count(set);
    int code = LUMI_OK;

    *result = NULL;
    if (!cast)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to cast rays");
    lumi_disk_settings_default(&defaults);
    settings = settings ? settings : &defaults;
    lumi_shade_tables();
    cast->set = set;
    cast->count = count;
    cast->filter = settings->filter;
    cast->kernels = cast_kernels();
    cast->disk = (struct cast_disk){.shape = lumi_viewset_shape(set),
                                    .kernel = settings->kernel >= 0 ? (enum lumi_disk_kernel)settings->kernel
                                                                    : lumi_viewset_kernel(set),
                                    .scale = settings->disk_scale,
                                    .stretch = settings->stretch > 0 ? 1 / settings->stretch : 0};
    cast->views = lumi_calloc((size_t)count, sizeof *cast->views);
    cast->axes = lumi_calloc(2 * (size_t)count, sizeof *cast->axes);
    if (!cast->views || !cast->axes)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory to cast rays");
    for (int i = 0; code == LUMI_OK && i < count; i++)
        code = prepare(cast, i, error);
    if (code != LUMI_OK) {
        lumi_cast_destroy(cast);
        return code;
    }
    *result = cast;
    return LUMI_OK;
}

void lumi_cast_destroy(struct lumi_cast *cast)
{
    if (!cast)
        return;
    for (int i = 0; i < cast->held; i++) {
        lumi_viewset_release(cast->set, i);
        lumi_free(cast->views[i].lowest);
        lumi_free(cast->views[i].highest);
    }
    lumi_free(cast->views);
    lumi_free(cast->axes);
    lumi_free(cast);
}

int lumi_cast_eye_create(const struct lumi_cast *cast, struct lumi_vec3 eye, struct lumi_cast_eye **result,
                         struct lumi_error *error)
{
    *result = lumi_alloc((size_t)cast->count, sizeof(struct lumi_surface_view));
    if (!*result)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to cast rays");
    for (int i = 0; i < cast->count; i++)
        lumi_surface_place(&(*result)->places[i], cast->views[i].view, eye, cast->disk.scale);
    return LUMI_OK;
}

void lumi_cast_eye_destroy(struct lumi_cast_eye *eye)
{
    lumi_free(eye);
}

static float pixel_of(const struct cast_axis *axis, float tangent)
{
    float at = fminf(fmaxf((tangent - axis->origin) * axis->scale, 0), CAST_AXIS_CELLS - 1);

    return axis->offset[(int)at] + axis->slope[(int)at] * tangent;
}

/* First and last pixel of tangents a + w · b, w in [lo, hi]; false where they miss the image. */
static bool pixel_range(const struct cast_axis *axis, const float a[2], const float b[2],
                        const struct cast_search *search, int size, float range[2])
{
    const float low = a[0] + fminf(search->lo * b[0], search->hi * b[0]);
    const float high = a[1] + fmaxf(search->lo * b[1], search->hi * b[1]);

    range[0] = pixel_of(axis, low);
    range[1] = pixel_of(axis, high);
    if (range[1] < 0 || range[0] > (float)size)
        return false;
    range[0] = fminf(fmaxf(range[0], 0), (float)size - 1);
    range[1] = fminf(fmaxf(range[1], 0), (float)size - 1);
    return true;
}

/* Narrows what is to be searched by the depths of the pixels that can be met, whose first and last are left in x and y;
 * false where none can. */
static bool narrow(const struct cast_view *view, const struct cast_reach *reach, float nearest,
                   struct cast_search *search, float x[2], float y[2])
{
    search->lo = fminf(view->all_lowest, nearest);
    search->hi = fminf(view->all_highest, nearest);
    for (int round = 0; round < 4; round++) {
        if (!pixel_range(view->x, reach->ax, reach->u, search, view->width, x) ||
            !pixel_range(view->y, reach->ay, reach->v, search, view->height, y))
            return false;
        float lo = FLT_MAX, hi = 0;
        for (int r = (int)y[0] / CAST_BOUND; r <= (int)y[1] / CAST_BOUND; r++)
            for (int c = (int)x[0] / CAST_BOUND; c <= (int)x[1] / CAST_BOUND; c++) {
                const int at = r * view->bound_cols + c;
                lo = view->lowest[at] < lo ? view->lowest[at] : lo;
                hi = view->highest[at] > hi ? view->highest[at] : hi;
            }
        lo = fmaxf(lo, search->lo);
        hi = fmaxf(fminf(hi, search->hi), lo);
        if (lo == search->lo && hi == search->hi)
            break;
        search->lo = lo;
        search->hi = hi;
    }
    return true;
}

/* The lines of the tiles that a range of pixels lies in; returns the steeper slope. */
static float find_lines(const struct cast_axis *axis, const float range[2], struct cast_lines *lines)
{
    const int first = (int)range[0] / LUMI_TILE, last = (int)range[1] / LUMI_TILE;
    float steepest = 0;

    *lines = (struct cast_lines){.hold = last <= first + 1,
                                 .border = axis->tile_tangent[last],
                                 .offset = {axis->tile_offset[first], axis->tile_offset[last]},
                                 .slope = {axis->tile_slope[first], axis->tile_slope[last]}};
    for (int i = first; i <= last; i++)
        steepest = fmaxf(steepest, axis->tile_slope[i]);
    return steepest;
}

/* How the search is done: by steps of a pixel, or, where all lies within one, by looking where the depth says. */
static void plan_search(const struct cast_view *view, const struct cast_reach *reach, const float x[2],
                        const float y[2], struct cast_search *search)
{
    const float u = fmaxf(fabsf(reach->u[0]), fabsf(reach->u[1])), v = fmaxf(fabsf(reach->v[0]), fabsf(reach->v[1]));
    const float steep_x = find_lines(view->x, x, &search->x), steep_y = find_lines(view->y, y, &search->y);
    const float way = (search->hi - search->lo) * fmaxf(u * steep_x, v * steep_y);

    search->steps = way <= 1 ? 0 : (int)fminf(ceilf(way), CAST_STEPS_MAX);
    search->looks = way <= 0.5f ? 1 : 2;
}

#define LANES 8

/* The smallest cone about the mean direction, or one that bounds nothing (as lumi_cone_around, in eight lanes). */
static struct lumi_cone block_cone(const float *x, const float *y, const float *z)
{
    float sx[LANES] = {0}, sy[LANES] = {0}, sz[LANES] = {0}, least[LANES];
    float cx = 0, cy = 0, cz = 0, cosine = 1;

    for (int i = 0; i < LUMI_BLOCK_PIXELS; i += LANES)
        for (int k = 0; k < LANES; k++) {
            sx[k] += x[i + k];
            sy[k] += y[i + k];
            sz[k] += z[i + k];
        }
    for (int k = 0; k < LANES; k++)
        cx += sx[k], cy += sy[k], cz += sz[k];
    const float length = sqrtf(cx * cx + cy * cy + cz * cz);
    if (!(length > 0))
        return (struct lumi_cone){0, 0, 1, -1, 2};
    cx /= length, cy /= length, cz /= length;
    for (int k = 0; k < LANES; k++)
        least[k] = 1;
    for (int i = 0; i < LUMI_BLOCK_PIXELS; i += LANES)
        for (int k = 0; k < LANES; k++) {
            const float dot = x[i + k] * cx + y[i + k] * cy + z[i + k] * cz;
            least[k] = dot < least[k] ? dot : least[k];
        }
    for (int k = 0; k < LANES; k++)
        cosine = fminf(cosine, least[k]);
    /* Rays that are none have dot 0, and bound nothing either. */
    if (cosine < 0.1f)
        return (struct lumi_cone){0, 0, 1, -1, 2};
    const float sine = sqrtf(fmaxf(0, 1 - cosine * cosine)) + 1e-4f;
    return (struct lumi_cone){cx, cy, cz, sqrtf(fmaxf(0, 1 - sine * sine)), sine};
}

static void cast_cell(const struct lumi_cast *cast, const struct cast_view *view, const struct lumi_surface_view *place,
                      const float *x, const float *y, const float *z, struct lumi_sums *sums, size_t at)
{
    struct cast_cell cell;
    struct cast_search search;
    struct cast_reach reach;
    float px[2], py[2];

    if (!cast->kernels->cross(place, &cast->disk, x + at, y + at, z + at, &cell, &reach))
        return;
    /* What is met lies ahead of the eye. */
    const float nearest = place->ez > 0 ? 0.999f / place->ez : FLT_MAX;
    if (!narrow(view, &reach, nearest, &search, px, py))
        return;
    plan_search(view, &reach, px, py, &search);
    cast->kernels->meet(view, &search, cast->disk.stretch, &cell);
    cast->kernels->shade(view, cast->filter, &cell, sums, at);
    for (int i = 0; sums->nearness && i < LUMI_CELL_PIXELS; i++) {
        const size_t k = at + (size_t)i;
        if (!(cell.weight[i] > 0))
            continue;
        float cz = place->rt[6] * x[k] + place->rt[7] * y[k] + place->rt[8] * z[k];
        sums->nearness[k] += cell.weight[i] * (cell.w[i] * cz / (1 - cell.w[i] * place->ez));
    }
}

void lumi_cast_block(const struct lumi_cast *cast, const struct lumi_cast_eye *eye, const float *x, const float *y,
                     const float *z, struct lumi_sums *sums)
{
    const struct lumi_cone cone = block_cone(x, y, z);

    for (int v = 0; v < cast->count; v++) {
        if (lumi_surface_hidden(&eye->places[v], &cone))
            continue;
        for (size_t at = 0; at < LUMI_BLOCK_PIXELS; at += LUMI_CELL_PIXELS)
            cast_cell(cast, &cast->views[v], &eye->places[v], x, y, z, sums, at);
    }
}
