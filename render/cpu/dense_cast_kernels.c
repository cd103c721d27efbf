/* The kernels of casting in plain C: the definition of what the variants compute. */
#include "render/cpu/dense_cast_priv.h"

#include <float.h>
#include <math.h>

static void widen(float range[2], float value)
{
    range[0] = value < range[0] ? value : range[0];
    range[1] = value > range[1] ? value : range[1];
}

static bool cross(const struct lumi_surface_view *place, const struct cast_disk *disk, const float *x, const float *y,
                  const float *z, struct cast_cell *cell, struct cast_reach *reach)
{
    const float *r = place->rt;
    bool any = false;

    *reach = (struct cast_reach){{FLT_MAX, -FLT_MAX}, {FLT_MAX, -FLT_MAX}, {FLT_MAX, -FLT_MAX}, {FLT_MAX, -FLT_MAX}};
    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        float cx = r[0] * x[i] + r[1] * y[i] + r[2] * z[i], cy = r[3] * x[i] + r[4] * y[i] + r[5] * z[i];
        float cz = r[6] * x[i] + r[7] * y[i] + r[8] * z[i];
        bool ahead = cz > 1e-6f;
        float over = 1 / (ahead ? cz : 1);
        cell->ax[i] = cx * over;
        cell->ay[i] = cy * over;
        cell->u[i] = place->ex - place->ez * cell->ax[i];
        cell->v[i] = place->ey - place->ez * cell->ay[i];
        cell->weight[i] =
            ahead ? lumi_disk_weight(&place->view->disk, disk->shape, disk->kernel, disk->scale, cell->u[i], cell->v[i])
                  : 0;
        if (!(cell->weight[i] > 0))
            continue;
        any = true;
        widen(reach->ax, cell->ax[i]);
        widen(reach->ay, cell->ay[i]);
        widen(reach->u, cell->u[i]);
        widen(reach->v, cell->v[i]);
    }
    return any;
}

static float position(const struct cast_axis *axis, const struct cast_lines *lines, float tangent, float *slope)
{
    if (lines->hold) {
        const int side = tangent < lines->border ? 0 : 1;
        *slope = lines->slope[side];
        return lines->offset[side] + *slope * tangent;
    }
    float at = (tangent - axis->origin) * axis->scale;
    at = at > 0 ? at : 0;
    at = at < CAST_AXIS_CELLS - 1 ? at : CAST_AXIS_CELLS - 1;
    *slope = axis->slope[(int)at];
    return axis->offset[(int)at] + *slope * tangent;
}

/* A look at a view's depth: where, what, and how it rises across a pixel. */
struct look {
    float px, py, slope_x, slope_y;
    float w00, w10, w01, w11, fx, fy;
};

static float look(const struct cast_view *view, const struct cast_search *search, float tx, float ty, struct look *l)
{
    l->px = position(view->x, &search->x, tx, &l->slope_x);
    l->py = position(view->y, &search->y, ty, &l->slope_y);
    float x = l->px - 0.5f, y = l->py - 0.5f;
    x = x > 0 ? x : 0;
    y = y > 0 ? y : 0;
    x = x < (float)(view->width - 1) ? x : (float)(view->width - 1);
    y = y < (float)(view->height - 1) ? y : (float)(view->height - 1);
    int ix = (int)x, iy = (int)y;
    ix = ix < view->width - 2 ? ix : view->width - 2;
    iy = iy < view->height - 2 ? iy : view->height - 2;
    l->fx = x - (float)ix;
    l->fy = y - (float)iy;
    const float *at = view->depth + iy * view->pitch + ix;
    l->w00 = at[0], l->w10 = at[1], l->w01 = at[view->pitch], l->w11 = at[view->pitch + 1];
    float top = l->w00 + l->fx * (l->w10 - l->w00), bottom = l->w01 + l->fx * (l->w11 - l->w01);
    return top + l->fy * (bottom - top);
}

static float find(const struct cast_view *view, const struct cast_search *search, float ax, float ay, float u, float v)
{
    struct look l;

    if (search->steps == 0) {
        float w = 0.5f * (search->lo + search->hi);
        for (int i = 0; i < search->looks; i++)
            w = look(view, search, ax + w * u, ay + w * v, &l);
        return w;
    }
    const float step = (search->hi - search->lo) / (float)search->steps;
    float near = search->hi, before = look(view, search, ax + near * u, ay + near * v, &l) - near;
    for (int k = 1; k <= search->steps; k++) {
        float w = search->hi - (float)k * step, gap = look(view, search, ax + w * u, ay + w * v, &l) - w;
        if (gap >= 0) {
            float span = before - gap, share = span < 0 ? before / span : 0;
            share = share > 0 ? share : 0;
            return near + share * (w - near);
        }
        near = w;
        before = gap;
    }
    return search->lo;
}

static void meet(const struct cast_view *view, const struct cast_search *search, float stretch, struct cast_cell *cell)
{
    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        struct look l;
        const float u = cell->u[i], v = cell->v[i];
        if (!(cell->weight[i] > 0))
            continue;
        float w = find(view, search, cell->ax[i], cell->ay[i], u, v);
        look(view, search, cell->ax[i] + w * u, cell->ay[i] + w * v, &l);
        bool inside = l.px >= 0 && l.py >= 0 && l.px <= (float)view->width && l.py <= (float)view->height;
        /* As stretch_factor of view_shade.c, with the slope of the bilinear depth at the point. */
        float left = l.w10 - l.w00, right = l.w11 - l.w01, up = l.w01 - l.w00, down = l.w11 - l.w10;
        float gx = (left + l.fy * (right - left)) * l.slope_x, gy = (up + l.fx * (down - up)) * l.slope_y;
        float over = (u * gx + v * gy) * -stretch;
        over = over > 0 ? over : 0;
        float factor = 1 / (1 + over * over);
        factor = factor > 1e-4f ? factor : 1e-4f;
        cell->w[i] = w;
        cell->px[i] = l.px;
        cell->py[i] = l.py;
        cell->weight[i] = inside ? cell->weight[i] * factor : 0;
    }
}

static void shade(const struct cast_view *view, enum lumi_filter filter, const struct cast_cell *cell,
                  struct lumi_sums *sums, size_t at)
{
    const struct lumi_source_image image = {.pixels = view->pixels, .filter = filter, .linear = true};

    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        const float weight = cell->weight[i];
        float color[3];
        if (!(weight > 0))
            continue;
        lumi_sample_image(&image, cell->px[i], cell->py[i], color);
        sums->r[at + (size_t)i] += weight * color[0];
        sums->g[at + (size_t)i] += weight * color[1];
        sums->b[at + (size_t)i] += weight * color[2];
        sums->weight[at + (size_t)i] += weight;
    }
}

const struct cast_kernels cast_kernels_c = {cross, meet, shade};

const struct cast_kernels *cast_kernels(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return &cast_kernels_avx2;
#endif
    return &cast_kernels_c;
}
