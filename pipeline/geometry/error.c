/* How far the simplifier's triangles are from the depth map: sums over the pixels of a triangle. The error of a pixel
 * that is e pixels of disparity off is weight · e² / (1 + e²/cap²). */
#include "pipeline/geometry/surface_priv.h"

#include <math.h>

enum { ROWS = LUMI_TILE + 2 };

/* The pixels of a triangle, row by row, and its height at pixel centres: base + across · column + down · row. */
struct spans {
    int top, rows;
    int first[ROWS], last[ROWS]; /* last is one past */
    float base, across, down;
};

static int first_centre(double x)
{
    return (int)ceil(x - 0.5);
}

/* Where the edge crosses the row of pixel centres at y. Ends in a fixed order, so that both triangles at the edge come
 * to the same number. */
static double crossing(const struct surface_vertex *a, const struct surface_vertex *b, double y)
{
    const struct surface_vertex *p = a, *q = b;

    if (q->y < p->y || (q->y == p->y && q->x < p->x))
        p = b, q = a;
    return (p->x + (y / PIXEL - p->y) * (q->x - p->x) / (q->y - p->y)) * PIXEL;
}

static void plane(const struct surface_vertex *const p[3], struct spans *spans)
{
    const double x1 = (p[1]->x - p[0]->x) * PIXEL, y1 = (p[1]->y - p[0]->y) * PIXEL;
    const double x2 = (p[2]->x - p[0]->x) * PIXEL, y2 = (p[2]->y - p[0]->y) * PIXEL;
    const double h1 = (double)p[1]->height - p[0]->height, h2 = (double)p[2]->height - p[0]->height;
    const double determinant = x1 * y2 - x2 * y1;
    const double across = (h1 * y2 - h2 * y1) / determinant, down = (x1 * h2 - x2 * h1) / determinant;

    spans->across = (float)across;
    spans->down = (float)down;
    spans->base = (float)(p[0]->height + across * (0.5 - p[0]->x * PIXEL) + down * (0.5 - p[0]->y * PIXEL));
}

static int clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

static void scan(const struct surface *s, const int v[3], struct spans *spans)
{
    const struct surface_vertex *const p[3] = {&s->vertices[v[0]], &s->vertices[v[1]], &s->vertices[v[2]]};
    int top = 0;

    for (int i = 1; i < 3; i++)
        if (p[i]->y < p[top]->y)
            top = i;
    /* Clockwise from the top: the right side runs top → next, the left side top → previous. */
    const struct surface_vertex *a = p[top], *r = p[(top + 1) % 3], *l = p[(top + 2) % 3];
    const int bottom = r->y > l->y ? r->y : l->y;
    const int y0 = clamp(first_centre(a->y * PIXEL), 0, s->height);
    const int y1 = clamp(first_centre(bottom * PIXEL), 0, s->height);

    plane(p, spans);
    spans->top = y0;
    spans->rows = y1 - y0;
    for (int y = y0; y < y1; y++) {
        const double centre = y + 0.5;
        const double left = l->y * PIXEL > centre ? crossing(a, l, centre) : crossing(l, r, centre);
        const double right = r->y * PIXEL > centre ? crossing(a, r, centre) : crossing(r, l, centre);
        spans->first[y - y0] = clamp(first_centre(left), 0, s->width);
        spans->last[y - y0] = clamp(first_centre(right), 0, s->width);
    }
}

/* Eight sums side by side: the compiler keeps them in vector registers. */
static float row_error(const float *target, const float *weight, int count, float height, float across, float inverse)
{
    float sums[8] = {0};
    int i = 0;

    for (; i + 8 <= count; i += 8)
        for (int k = 0; k < 8; k++) {
            const float e = height + across * (float)(i + k) - target[i + k], q = e * e;
            sums[k] += weight[i + k] * q / (1 + q * inverse);
        }
    for (int k = 0; i + k < count; k++) {
        const float e = height + across * (float)(i + k) - target[i + k], q = e * e;
        sums[k] += weight[i + k] * q / (1 + q * inverse);
    }
    return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

float surface_triangle_error(const struct surface *s, const int v[3])
{
    struct spans spans;
    const float inverse = 1 / (s->cap * s->cap);
    float sum = 0;

    scan(s, v, &spans);
    for (int j = 0; j < spans.rows; j++) {
        const int y = spans.top + j, x = spans.first[j];
        const size_t at = (size_t)y * (size_t)s->width + (size_t)x;
        if (x < spans.last[j])
            sum += row_error(s->target + at, s->weight + at, spans.last[j] - x,
                             spans.base + spans.down * (float)y + spans.across * (float)x, spans.across, inverse);
    }
    return sum;
}

float surface_star_error(const struct surface *s, const struct star *star)
{
    float sum = 0;

    for (int k = 0; k < star->count; k++)
        sum += surface_triangle_error(s, s->triangles[star->triangles[k]].v);
    return sum;
}

static bool is_vertex(const struct surface *s, const int v[3], int x, int y)
{
    for (int i = 0; i < 3; i++)
        if (fabs(s->vertices[v[i]].x * PIXEL - (x + 0.5)) < 0.6 && fabs(s->vertices[v[i]].y * PIXEL - (y + 0.5)) < 0.6)
            return true;
    return false;
}

bool surface_worst_pixel(const struct surface *s, int triangle, int *x, int *y)
{
    const int *v = s->triangles[triangle].v;
    struct spans spans;
    float worst = 0;

    scan(s, v, &spans);
    for (int j = 0; j < spans.rows; j++) {
        const int row = spans.top + j;
        const size_t at = (size_t)row * (size_t)s->width;
        const float height = spans.base + spans.down * (float)row;
        for (int i = spans.first[j]; i < spans.last[j]; i++) {
            const float e = height + spans.across * (float)i - s->target[at + (size_t)i];
            if (s->weight[at + (size_t)i] * e * e > worst && !is_vertex(s, v, i, row)) {
                worst = s->weight[at + (size_t)i] * e * e;
                *x = i;
                *y = row;
            }
        }
    }
    return worst > 0;
}

/* One step of iteratively reweighted least squares: the error function's majoriser at the present heights. */
float surface_best_height(const struct surface *s, const struct star *star, int vertex)
{
    const float inverse = 1 / (s->cap * s->cap);
    double numerator = 0, denominator = 1e-9;

    for (int k = 0; k < star->count; k++) {
        const int *v = s->triangles[star->triangles[k]].v;
        struct spans spans, share;
        scan(s, v, &spans);
        /* The vertex's share in the height of each pixel is the plane that is 1 there and 0 at the others. */
        struct surface_vertex unit[3] = {s->vertices[v[0]], s->vertices[v[1]], s->vertices[v[2]]};
        for (int i = 0; i < 3; i++)
            unit[i].height = v[i] == vertex ? 1 : 0;
        plane((const struct surface_vertex *const[3]){&unit[0], &unit[1], &unit[2]}, &share);
        for (int j = 0; j < spans.rows; j++) {
            const int y = spans.top + j;
            const size_t at = (size_t)y * (size_t)s->width;
            const float height = spans.base + spans.down * (float)y, part = share.base + share.down * (float)y;
            float up = 0, low = 0;
            for (int x = spans.first[j]; x < spans.last[j]; x++) {
                const float b = part + share.across * (float)x;
                const float e = s->target[at + (size_t)x] - (height + spans.across * (float)x);
                const float damp = 1 + e * e * inverse, w = s->weight[at + (size_t)x] / (damp * damp);
                up += w * b * e;
                low += w * b * b;
            }
            numerator += (double)up;
            denominator += (double)low;
        }
    }
    return s->vertices[vertex].height + (float)(numerator / denominator);
}
