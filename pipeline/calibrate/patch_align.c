/* Least squares matching of two patches. */
#include "pipeline/calibrate/patch_align.h"

#include <math.h>
#include <string.h>

#define HALF 6 /* of what is matched */
#define SIDE (2 * HALF + 1)
#define COUNT (SIDE * SIDE)
#define ROUNDS 12
#define FARTHEST 1.0      /* pixels: a feature is nearer than that to what it is */
#define SMALL_STEP 0.003  /* pixels */
#define LEAST_CONTRAST 2. /* grey levels, root mean square */
#define LEAST_CORRELATION 0.85
#define LEAST_PULL 1e-2 /* of the weaker axis, against the stronger one: on an edge the shift along it is not known */

void lumi_patch_cut(const float *grey, int width, int height, double x, double y, struct lumi_patch_pixels *patch)
{
    patch->left = (int)floor(x) - LUMI_PATCH_RADIUS;
    patch->top = (int)floor(y) - LUMI_PATCH_RADIUS;
    patch->there = patch->left >= 0 && patch->top >= 0 && patch->left + LUMI_PATCH_SIZE <= width &&
                   patch->top + LUMI_PATCH_SIZE <= height;
    if (!patch->there)
        return;
    for (int j = 0; j < LUMI_PATCH_SIZE; j++) {
        const float *row = grey + (long)(patch->top + j) * width + patch->left;
        for (int i = 0; i < LUMI_PATCH_SIZE; i++) {
            const float value = row[i] + 0.5F;
            patch->pixels[j][i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
        }
    }
}

/* Weights of four neighbours (Keys' cubic, a = −1/2) and their derivatives, for a place t past the second. */
static void cubic(double t, double w[4], double d[4])
{
    w[0] = t * (-0.5 + t * (1 - 0.5 * t));
    w[1] = 1 + t * t * (-2.5 + 1.5 * t);
    w[2] = t * (0.5 + t * (2 - 1.5 * t));
    w[3] = t * t * (-0.5 + 0.5 * t);
    d[0] = -0.5 + t * (2 - 1.5 * t);
    d[1] = t * (-5 + 4.5 * t);
    d[2] = 0.5 + t * (4 - 4.5 * t);
    d[3] = t * (-1 + 1.5 * t);
}

/* Value and slopes at a place of the picture; false outside of what is kept. */
static bool sample(const struct lumi_patch_pixels *patch, double x, double y, double value[3])
{
    const double u = x - 0.5 - patch->left, v = y - 0.5 - patch->top;
    const int i = (int)floor(u), j = (int)floor(v);
    double wx[4], wy[4], dx[4], dy[4];

    if (!(u >= 1 && v >= 1 && u < LUMI_PATCH_SIZE - 2 && v < LUMI_PATCH_SIZE - 2))
        return false;
    cubic(u - i, wx, dx);
    cubic(v - j, wy, dy);
    memset(value, 0, 3 * sizeof *value);
    for (int b = 0; b < 4; b++) {
        const uint8_t *row = &patch->pixels[j - 1 + b][i - 1];
        const double across = row[0] * wx[0] + row[1] * wx[1] + row[2] * wx[2] + row[3] * wx[3];
        const double slope = row[0] * dx[0] + row[1] * dx[1] + row[2] * dx[2] + row[3] * dx[3];
        value[0] += wy[b] * across;
        value[1] += wy[b] * slope;
        value[2] += dy[b] * across;
    }
    return true;
}

/* What is searched for: values about the place, and how much each counts. */
struct template
{
    double values[COUNT], weights[COUNT], sum, mean, square; /* sums of the weights; weighted mean and variance */
};

static bool take_template(const struct lumi_patch_pixels *reference, double x, double y, struct template *t)
{
    *t = (struct template){0};
    for (int k = 0; k < COUNT; k++) {
        const int i = k % SIDE - HALF, j = k / SIDE - HALF;
        double value[3];
        if (!sample(reference, x + i, y + j, value))
            return false;
        t->values[k] = value[0];
        t->weights[k] = exp(-(i * i + j * j) / (2. * 4 * 4));
        t->sum += t->weights[k];
        t->mean += t->weights[k] * value[0];
    }
    t->mean /= t->sum;
    for (int k = 0; k < COUNT; k++)
        t->square += t->weights[k] * (t->values[k] - t->mean) * (t->values[k] - t->mean);
    t->square /= t->sum;
    return t->square > LEAST_CONTRAST * LEAST_CONTRAST;
}

/* One look at the other picture: weighted sums over what lies there. */
struct look {
    double mean, square, with; /* of the other's values; covariance with the template */
    double xx, xy, yy, bx, by; /* of its slopes, less their part in gain and offset */
    double error;              /* weighted mean square of what is left, grey levels of the other */
};

static bool gather(const struct template *t, const struct lumi_patch_pixels *other, const double stretch[4], double x,
                   double y, double values[COUNT][3], struct look *l)
{
    *l = (struct look){0};
    for (int k = 0; k < COUNT; k++) {
        const double i = k % SIDE - HALF, j = k / SIDE - HALF;
        if (!sample(other, x + stretch[0] * i + stretch[1] * j, y + stretch[2] * i + stretch[3] * j, values[k]))
            return false;
        l->mean += t->weights[k] * values[k][0];
    }
    l->mean /= t->sum;
    for (int k = 0; k < COUNT; k++) {
        l->square += t->weights[k] * (values[k][0] - l->mean) * (values[k][0] - l->mean);
        l->with += t->weights[k] * (values[k][0] - l->mean) * (t->values[k] - t->mean);
    }
    l->square /= t->sum;
    l->with /= t->sum;
    return l->square > 0;
}

/* Gauss and Newton's step of the shift; gain and offset are solved for on the way. */
static bool step(const struct template *t, double values[COUNT][3], struct look *l, double shift[2])
{
    const double gain = l->with / t->square; /* of the template, to look like the other */
    double gx = 0, gy = 0, tx = 0, ty = 0;

    for (int k = 0; k < COUNT; k++) {
        gx += t->weights[k] * values[k][1];
        gy += t->weights[k] * values[k][2];
        tx += t->weights[k] * values[k][1] * (t->values[k] - t->mean);
        ty += t->weights[k] * values[k][2] * (t->values[k] - t->mean);
    }
    gx /= t->sum, gy /= t->sum;
    tx /= t->sum * t->square, ty /= t->sum * t->square;
    for (int k = 0; k < COUNT; k++) {
        const double w = t->weights[k] / t->sum, about = t->values[k] - t->mean;
        const double x = values[k][1] - gx - tx * about, y = values[k][2] - gy - ty * about;
        const double left = gain * about - (values[k][0] - l->mean);
        l->xx += w * x * x;
        l->xy += w * x * y;
        l->yy += w * y * y;
        l->bx += w * x * left;
        l->by += w * y * left;
        l->error += w * left * left;
    }
    const double det = l->xx * l->yy - l->xy * l->xy, trace = l->xx + l->yy;
    if (!(gain > 0.2 && gain < 5 && det > LEAST_PULL * trace * trace / 4))
        return false;
    shift[0] = (l->yy * l->bx - l->xy * l->by) / det;
    shift[1] = (l->xx * l->by - l->xy * l->bx) / det;
    return true;
}

bool lumi_patch_align(const struct lumi_patch_pixels *reference, double x, double y,
                      const struct lumi_patch_pixels *other, const double stretch[4], struct lumi_patch_match *match)
{
    const double from[2] = {match->x, match->y};
    double values[COUNT][3], shift[2] = {1, 1};
    struct template t;
    struct look l;

    if (!reference->there || !other->there || !take_template(reference, x, y, &t))
        return false;
    for (int round = 0; round < ROUNDS && hypot(shift[0], shift[1]) > SMALL_STEP; round++) {
        if (!gather(&t, other, stretch, match->x, match->y, values, &l) || !step(&t, values, &l, shift))
            return false;
        match->x += shift[0];
        match->y += shift[1];
        if (!(hypot(match->x - from[0], match->y - from[1]) < FARTHEST))
            return false;
    }
    match->correlation = l.with / sqrt(l.square * t.square);
    /* The noise of both is in what is left; the weights are worth so many pixels. */
    const double pixels = t.sum, det = l.xx * l.yy - l.xy * l.xy;
    match->sigma = sqrt(l.error * (l.xx + l.yy) / (2 * det * pixels));
    return hypot(shift[0], shift[1]) <= SMALL_STEP && match->correlation > LEAST_CORRELATION;
}
