/* The kernels of casting for AVX2: eight rays at a time, operation by operation what plain C does. */
#include "render/cpu/dense_cast_priv.h"

#include <float.h>
#include <immintrin.h>

#define LANES 8

static inline __m256 above(__m256 a, __m256 b)
{
    return _mm256_cmp_ps(a, b, _CMP_GT_OQ);
}

static inline __m256 dot(const float *r, __m256 x, __m256 y, __m256 z)
{
    __m256 xy = _mm256_add_ps(_mm256_mul_ps(_mm256_set1_ps(r[0]), x), _mm256_mul_ps(_mm256_set1_ps(r[1]), y));

    return _mm256_add_ps(xy, _mm256_mul_ps(_mm256_set1_ps(r[2]), z));
}

/* |u| as a share of the disk's extent on its side. */
static inline __m256 share_of(__m256 u, float negative, float positive, float scale)
{
    __m256 side = _mm256_cmp_ps(u, _mm256_setzero_ps(), _CMP_LT_OQ);
    __m256 extent = _mm256_blendv_ps(_mm256_set1_ps(scale * positive), _mm256_set1_ps(scale * negative), side);

    return _mm256_div_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0f), u), extent);
}

static inline __m256 weight_of(const struct lumi_disk *disk, const struct cast_disk *how, __m256 u, __m256 v)
{
    if (how->shape == LUMI_DISK_OVAL && how->kernel == LUMI_KERNEL_LINEAR) {
        const __m256 one = _mm256_set1_ps(1);
        __m256 a = share_of(u, disk->u_neg, disk->u_pos, how->scale);
        __m256 b = share_of(v, disk->v_neg, disk->v_pos, how->scale);
        __m256 r = _mm256_sqrt_ps(_mm256_add_ps(_mm256_mul_ps(a, a), _mm256_mul_ps(b, b)));
        return _mm256_and_ps(_mm256_sub_ps(one, r), _mm256_cmp_ps(r, one, _CMP_LT_OQ));
    }
    float us[LANES], vs[LANES], w[LANES];
    _mm256_storeu_ps(us, u);
    _mm256_storeu_ps(vs, v);
    for (int i = 0; i < LANES; i++)
        w[i] = lumi_disk_weight(disk, how->shape, how->kernel, how->scale, us[i], vs[i]);
    return _mm256_loadu_ps(w);
}

/* Lowest and highest so far, a lane each. */
struct wide {
    __m256 low, high;
};

static inline void widen(struct wide *wide, __m256 value, __m256 counts)
{
    wide->low = _mm256_min_ps(wide->low, _mm256_blendv_ps(_mm256_set1_ps(FLT_MAX), value, counts));
    wide->high = _mm256_max_ps(wide->high, _mm256_blendv_ps(_mm256_set1_ps(-FLT_MAX), value, counts));
}

static void narrow(const struct wide *wide, float range[2])
{
    float low[LANES], high[LANES];

    _mm256_storeu_ps(low, wide->low);
    _mm256_storeu_ps(high, wide->high);
    range[0] = low[0], range[1] = high[0];
    for (int i = 1; i < LANES; i++) {
        range[0] = low[i] < range[0] ? low[i] : range[0];
        range[1] = high[i] > range[1] ? high[i] : range[1];
    }
}

static bool cross(const struct lumi_surface_view *place, const struct cast_disk *disk, const float *x, const float *y,
                  const float *z, struct cast_cell *cell, struct cast_reach *reach)
{
    const __m256 one = _mm256_set1_ps(1), zero = _mm256_setzero_ps();
    const __m256 ex = _mm256_set1_ps(place->ex), ey = _mm256_set1_ps(place->ey), ez = _mm256_set1_ps(place->ez);
    const struct wide nothing = {_mm256_set1_ps(FLT_MAX), _mm256_set1_ps(-FLT_MAX)};
    struct wide wide_ax = nothing, wide_ay = nothing, wide_u = nothing, wide_v = nothing;
    int any = 0;

    for (int i = 0; i < LUMI_CELL_PIXELS; i += LANES) {
        const __m256 dx = _mm256_loadu_ps(x + i), dy = _mm256_loadu_ps(y + i), dz = _mm256_loadu_ps(z + i);
        __m256 cz = dot(place->rt + 6, dx, dy, dz), ahead = above(cz, _mm256_set1_ps(1e-6f));
        __m256 over = _mm256_div_ps(one, _mm256_blendv_ps(one, cz, ahead));
        __m256 ax = _mm256_mul_ps(dot(place->rt, dx, dy, dz), over);
        __m256 ay = _mm256_mul_ps(dot(place->rt + 3, dx, dy, dz), over);
        __m256 u = _mm256_sub_ps(ex, _mm256_mul_ps(ez, ax)), v = _mm256_sub_ps(ey, _mm256_mul_ps(ez, ay));
        __m256 weight = _mm256_and_ps(weight_of(&place->view->disk, disk, u, v), ahead);
        __m256 counts = above(weight, zero);
        _mm256_storeu_ps(cell->ax + i, ax);
        _mm256_storeu_ps(cell->ay + i, ay);
        _mm256_storeu_ps(cell->u + i, u);
        _mm256_storeu_ps(cell->v + i, v);
        _mm256_storeu_ps(cell->weight + i, weight);
        any |= _mm256_movemask_ps(counts);
        widen(&wide_ax, ax, counts);
        widen(&wide_ay, ay, counts);
        widen(&wide_u, u, counts);
        widen(&wide_v, v, counts);
    }
    narrow(&wide_ax, reach->ax);
    narrow(&wide_ay, reach->ay);
    narrow(&wide_u, reach->u);
    narrow(&wide_v, reach->v);
    return any != 0;
}

static inline __m256 position(const struct cast_axis *axis, const struct cast_lines *lines, __m256 tangent,
                              __m256 *slope)
{
    if (lines->hold) {
        const __m256 first = _mm256_cmp_ps(tangent, _mm256_set1_ps(lines->border), _CMP_LT_OQ);
        *slope = _mm256_blendv_ps(_mm256_set1_ps(lines->slope[1]), _mm256_set1_ps(lines->slope[0]), first);
        const __m256 offset =
            _mm256_blendv_ps(_mm256_set1_ps(lines->offset[1]), _mm256_set1_ps(lines->offset[0]), first);
        return _mm256_add_ps(offset, _mm256_mul_ps(*slope, tangent));
    }
    __m256 at = _mm256_mul_ps(_mm256_sub_ps(tangent, _mm256_set1_ps(axis->origin)), _mm256_set1_ps(axis->scale));

    /* max gives its second operand, 0, for what is not a number */
    at = _mm256_max_ps(at, _mm256_setzero_ps());
    at = _mm256_min_ps(at, _mm256_set1_ps(CAST_AXIS_CELLS - 1));
    const __m256i index = _mm256_cvttps_epi32(at);
    *slope = _mm256_i32gather_ps(axis->slope, index, 4);
    return _mm256_add_ps(_mm256_i32gather_ps(axis->offset, index, 4), _mm256_mul_ps(*slope, tangent));
}

struct look {
    __m256 px, py, slope_x, slope_y, w00, w10, w01, w11, fx, fy;
};

/* The pixel at or before a position, and how far beyond it. */
static inline __m256i before(__m256 at, int size, __m256 *share)
{
    __m256 x = _mm256_max_ps(_mm256_sub_ps(at, _mm256_set1_ps(0.5f)), _mm256_setzero_ps());

    x = _mm256_min_ps(x, _mm256_set1_ps((float)(size - 1)));
    const __m256i index = _mm256_min_epi32(_mm256_cvttps_epi32(x), _mm256_set1_epi32(size - 2));
    *share = _mm256_sub_ps(x, _mm256_cvtepi32_ps(index));
    return index;
}

static inline __m256 mix(__m256 a, __m256 b, __m256 share)
{
    return _mm256_add_ps(a, _mm256_mul_ps(share, _mm256_sub_ps(b, a)));
}

static inline __m256 look(const struct cast_view *view, const struct cast_search *search, __m256 tx, __m256 ty,
                          struct look *l)
{
    l->px = position(view->x, &search->x, tx, &l->slope_x);
    l->py = position(view->y, &search->y, ty, &l->slope_y);
    const __m256i ix = before(l->px, view->width, &l->fx), iy = before(l->py, view->height, &l->fy);
    const __m256i at = _mm256_add_epi32(_mm256_mullo_epi32(iy, _mm256_set1_epi32(view->pitch)), ix);
    l->w00 = _mm256_i32gather_ps(view->depth, at, 4);
    l->w10 = _mm256_i32gather_ps(view->depth + 1, at, 4);
    l->w01 = _mm256_i32gather_ps(view->depth + view->pitch, at, 4);
    l->w11 = _mm256_i32gather_ps(view->depth + view->pitch + 1, at, 4);
    return mix(mix(l->w00, l->w10, l->fx), mix(l->w01, l->w11, l->fx), l->fy);
}

/* Eight rays of a cell. */
struct eight {
    __m256 ax, ay, u, v;
};

static inline __m256 look_at(const struct cast_view *view, const struct cast_search *search, const struct eight *e,
                             __m256 w, struct look *l)
{
    return look(view, search, _mm256_add_ps(e->ax, _mm256_mul_ps(w, e->u)),
                _mm256_add_ps(e->ay, _mm256_mul_ps(w, e->v)), l);
}

static inline __m256 find(const struct cast_view *view, const struct cast_search *search, const struct eight *e,
                          __m256 counts)
{
    const __m256 zero = _mm256_setzero_ps();
    struct look l;

    if (search->steps == 0) {
        __m256 w = _mm256_set1_ps(0.5f * (search->lo + search->hi));
        for (int i = 0; i < search->looks; i++)
            w = look_at(view, search, e, w, &l);
        return w;
    }
    const float step = (search->hi - search->lo) / (float)search->steps;
    __m256 result = _mm256_set1_ps(search->lo), open = counts, near = _mm256_set1_ps(search->hi);
    __m256 last = _mm256_sub_ps(look_at(view, search, e, near, &l), near);
    for (int k = 1; k <= search->steps && _mm256_movemask_ps(open); k++) {
        const __m256 w = _mm256_set1_ps(search->hi - (float)k * step);
        const __m256 gap = _mm256_sub_ps(look_at(view, search, e, w, &l), w);
        const __m256 met = _mm256_and_ps(open, _mm256_cmp_ps(gap, zero, _CMP_GE_OQ));
        if (_mm256_movemask_ps(met)) {
            const __m256 span = _mm256_sub_ps(last, gap);
            __m256 share = _mm256_and_ps(_mm256_div_ps(last, span), _mm256_cmp_ps(span, zero, _CMP_LT_OQ));
            share = _mm256_max_ps(share, zero);
            const __m256 found = _mm256_add_ps(near, _mm256_mul_ps(share, _mm256_sub_ps(w, near)));
            result = _mm256_blendv_ps(result, found, met);
            open = _mm256_andnot_ps(met, open);
        }
        near = w;
        last = gap;
    }
    return result;
}

/* Where the point lies within the image. */
static inline __m256 inside(const struct cast_view *view, const struct look *l)
{
    const __m256 zero = _mm256_setzero_ps();
    __m256 in = _mm256_and_ps(_mm256_cmp_ps(l->px, zero, _CMP_GE_OQ), _mm256_cmp_ps(l->py, zero, _CMP_GE_OQ));

    in = _mm256_and_ps(in, _mm256_cmp_ps(l->px, _mm256_set1_ps((float)view->width), _CMP_LE_OQ));
    return _mm256_and_ps(in, _mm256_cmp_ps(l->py, _mm256_set1_ps((float)view->height), _CMP_LE_OQ));
}

static inline __m256 stretch_factor(const struct look *l, const struct eight *e, float stretch)
{
    const __m256 one = _mm256_set1_ps(1);
    const __m256 left = _mm256_sub_ps(l->w10, l->w00), right = _mm256_sub_ps(l->w11, l->w01);
    const __m256 up = _mm256_sub_ps(l->w01, l->w00), down = _mm256_sub_ps(l->w11, l->w10);
    const __m256 gx = _mm256_mul_ps(mix(left, right, l->fy), l->slope_x);
    const __m256 gy = _mm256_mul_ps(mix(up, down, l->fx), l->slope_y);
    __m256 over = _mm256_add_ps(_mm256_mul_ps(e->u, gx), _mm256_mul_ps(e->v, gy));
    over = _mm256_max_ps(_mm256_mul_ps(over, _mm256_set1_ps(-stretch)), _mm256_setzero_ps());
    const __m256 factor = _mm256_div_ps(one, _mm256_add_ps(one, _mm256_mul_ps(over, over)));
    return _mm256_max_ps(factor, _mm256_set1_ps(1e-4f));
}

static void meet(const struct cast_view *view, const struct cast_search *search, float stretch, struct cast_cell *cell)
{
    for (int i = 0; i < LUMI_CELL_PIXELS; i += LANES) {
        const __m256 weight = _mm256_loadu_ps(cell->weight + i), counts = above(weight, _mm256_setzero_ps());
        struct look l;
        if (!_mm256_movemask_ps(counts))
            continue;
        const struct eight e = {_mm256_loadu_ps(cell->ax + i), _mm256_loadu_ps(cell->ay + i),
                                _mm256_loadu_ps(cell->u + i), _mm256_loadu_ps(cell->v + i)};
        const __m256 w = find(view, search, &e, counts);
        look_at(view, search, &e, w, &l);
        const __m256 left = _mm256_mul_ps(weight, stretch_factor(&l, &e, stretch));
        _mm256_storeu_ps(cell->w + i, w);
        _mm256_storeu_ps(cell->px + i, l.px);
        _mm256_storeu_ps(cell->py + i, l.py);
        _mm256_storeu_ps(cell->weight + i, _mm256_and_ps(left, inside(view, &l)));
    }
}

/* Catmull and Rom's weights, as view_shade.c has them. */
static inline void cubic_weights(__m256 t, float w[4][LANES])
{
    const __m256 half = _mm256_set1_ps(0.5f), one = _mm256_set1_ps(1), two = _mm256_set1_ps(2);
    const __m256 high = _mm256_set1_ps(1.5f), low = _mm256_set1_ps(-2.5f), less = _mm256_set1_ps(-0.5f);
    const __m256 tt = _mm256_mul_ps(t, t), th = _mm256_mul_ps(high, t), tl = _mm256_mul_ps(half, t);

    _mm256_storeu_ps(w[0], _mm256_mul_ps(t, _mm256_add_ps(less, _mm256_mul_ps(t, _mm256_sub_ps(one, tl)))));
    _mm256_storeu_ps(w[1], _mm256_add_ps(one, _mm256_mul_ps(tt, _mm256_add_ps(low, th))));
    _mm256_storeu_ps(w[2], _mm256_mul_ps(t, _mm256_add_ps(half, _mm256_mul_ps(t, _mm256_sub_ps(two, th)))));
    _mm256_storeu_ps(w[3], _mm256_mul_ps(tt, _mm256_add_ps(less, tl)));
}

/* Where eight rays are sampled: the first of the four taps, and weights. */
struct taps {
    int x[LANES], y[LANES];
    float wx[4][LANES], wy[4][LANES];
};

static inline void find_taps(const struct cast_view *view, const float *px, const float *py, struct taps *taps)
{
    const __m256 half = _mm256_set1_ps(0.5f), least = _mm256_set1_ps(-1);
    __m256 x = _mm256_max_ps(_mm256_sub_ps(_mm256_loadu_ps(px), half), least);
    __m256 y = _mm256_max_ps(_mm256_sub_ps(_mm256_loadu_ps(py), half), least);

    x = _mm256_min_ps(x, _mm256_set1_ps((float)view->width));
    y = _mm256_min_ps(y, _mm256_set1_ps((float)view->height));
    const __m256 fx = _mm256_floor_ps(x), fy = _mm256_floor_ps(y);
    const __m256i one = _mm256_set1_epi32(1);
    _mm256_storeu_si256((__m256i *)(void *)taps->x, _mm256_sub_epi32(_mm256_cvttps_epi32(fx), one));
    _mm256_storeu_si256((__m256i *)(void *)taps->y, _mm256_sub_epi32(_mm256_cvttps_epi32(fy), one));
    cubic_weights(_mm256_sub_ps(x, fx), taps->wx);
    cubic_weights(_mm256_sub_ps(y, fy), taps->wy);
}

/* Sixteen pixels, none at the image's edge: each is read with the next one's red. */
static inline __m128 gather(const struct cast_view *view, const struct taps *taps, int k)
{
    const size_t stride = view->pixels.stride / sizeof(float);
    const float *at = (const float *)view->pixels.data + (size_t)taps->y[k] * stride + 3 * (size_t)taps->x[k];
    __m128 sum = _mm_setzero_ps();

    for (int j = 0; j < 4; j++) {
        __m128 row = _mm_mul_ps(_mm_set1_ps(taps->wx[0][k]), _mm_loadu_ps(at));
        row = _mm_add_ps(row, _mm_mul_ps(_mm_set1_ps(taps->wx[1][k]), _mm_loadu_ps(at + 3)));
        row = _mm_add_ps(row, _mm_mul_ps(_mm_set1_ps(taps->wx[2][k]), _mm_loadu_ps(at + 6)));
        row = _mm_add_ps(row, _mm_mul_ps(_mm_set1_ps(taps->wx[3][k]), _mm_loadu_ps(at + 9)));
        sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(taps->wy[j][k]), row));
        at += stride;
    }
    return sum;
}

static inline void add(float *sum, const float *weight, const float *value)
{
    __m256 more = _mm256_mul_ps(_mm256_loadu_ps(weight), _mm256_loadu_ps(value));

    _mm256_storeu_ps(sum, _mm256_add_ps(_mm256_loadu_ps(sum), more));
}

static void shade(const struct cast_view *view, enum lumi_filter filter, const struct cast_cell *cell,
                  struct lumi_sums *sums, size_t at)
{
    const struct lumi_source_image image = {.pixels = view->pixels, .filter = filter, .linear = true};

    for (int i = 0; i < LUMI_CELL_PIXELS; i += LANES) {
        const __m256 weight = _mm256_loadu_ps(cell->weight + i);
        const int counts = _mm256_movemask_ps(above(weight, _mm256_setzero_ps()));
        float color[3][LANES] = {{0}};
        struct taps taps;
        if (!counts)
            continue;
        find_taps(view, cell->px + i, cell->py + i, &taps);
        for (int k = 0; k < LANES; k++) {
            float rgb[4];
            if (!(counts >> k & 1))
                continue;
            if (filter == LUMI_FILTER_CUBIC && taps.x[k] >= 0 && taps.y[k] >= 0 && taps.x[k] + 4 < view->width &&
                taps.y[k] + 3 < view->height)
                _mm_storeu_ps(rgb, gather(view, &taps, k));
            else
                lumi_sample_image(&image, cell->px[i + k], cell->py[i + k], rgb);
            color[0][k] = rgb[0], color[1][k] = rgb[1], color[2][k] = rgb[2];
        }
        const size_t to = at + (size_t)i;
        add(sums->r + to, cell->weight + i, color[0]);
        add(sums->g + to, cell->weight + i, color[1]);
        add(sums->b + to, cell->weight + i, color[2]);
        _mm256_storeu_ps(sums->weight + to, _mm256_add_ps(_mm256_loadu_ps(sums->weight + to), weight));
    }
}

const struct cast_kernels cast_kernels_avx2 = {cross, meet, shade};
