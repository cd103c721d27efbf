/* Solving for gains and vignetting: iteratively reweighted least squares, each round by conjugate gradients (Hestenes
 * and Stiefel 1952) with the diagonal as preconditioner, over the points themselves.
 *
 * The unknowns are three logarithms of gains a picture and three coefficients a lens, which all channels share. Weak
 * priors (a gain of 1 ± a stop, coefficients of 0 ± 0.5) hold what no point tells, and the common factor. */
#include "pipeline/color/equalize.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <math.h>
#include <string.h>

enum { ROUNDS = 14, STEPS = 400 };
#define PRIOR_GAIN 0.7
#define PRIOR_COEFFICIENT 0.5
#define LEAST_SPREAD 0.003

struct problem {
    const struct lumi_same_point *points;
    int point_count, count, lens_count, size;
    const int *lenses;
    double *weights;                      /* a point */
    double *x;                            /* gains, 3 a picture; coefficients, 3 a lens */
    double *b, *diagonal, *r, *z, *p, *q; /* for the conjugate gradients */
    double *sizes;                        /* of residuals, for medians */
    double prior_gain, prior_coefficient;
};

static void powers(double r2, double out[3])
{
    out[0] = r2;
    out[1] = r2 * r2;
    out[2] = r2 * r2 * r2;
}

/* What the unknowns say of a point, a channel. */
static void predict(const struct problem *s, const double *x, const struct lumi_same_point *p, double out[3])
{
    const double *ca = x + 3 * (s->count + s->lenses[p->a]), *cb = x + 3 * (s->count + s->lenses[p->b]);
    double pa[3], pb[3], vignetting = 0;

    powers((double)p->r2_a, pa);
    powers((double)p->r2_b, pb);
    for (int i = 0; i < 3; i++)
        vignetting += ca[i] * pa[i] - cb[i] * pb[i];
    for (int c = 0; c < 3; c++)
        out[c] = x[3 * p->a + c] - x[3 * p->b + c] + vignetting;
}

/* Adds the transpose of that, times a residual a channel. */
static void scatter(const struct problem *s, double *x, const struct lumi_same_point *p, const double value[3])
{
    double *ca = x + 3 * (s->count + s->lenses[p->a]), *cb = x + 3 * (s->count + s->lenses[p->b]);
    const double sum = value[0] + value[1] + value[2];
    double pa[3], pb[3];

    powers((double)p->r2_a, pa);
    powers((double)p->r2_b, pb);
    for (int c = 0; c < 3; c++) {
        x[3 * p->a + c] += value[c];
        x[3 * p->b + c] -= value[c];
    }
    for (int i = 0; i < 3; i++) {
        ca[i] += sum * pa[i];
        cb[i] -= sum * pb[i];
    }
}

static void add_priors(const struct problem *s, const double *x, double *out)
{
    for (int i = 0; i < s->size; i++)
        out[i] = (i < 3 * s->count ? s->prior_gain : s->prior_coefficient) * x[i];
}

/* q = (JᵀWJ + priors) x */
static void multiply(const struct problem *s, const double *x, double *out)
{
    add_priors(s, x, out);
    for (int i = 0; i < s->point_count; i++) {
        double value[3];
        predict(s, x, &s->points[i], value);
        for (int c = 0; c < 3; c++)
            value[c] *= s->weights[i];
        scatter(s, out, &s->points[i], value);
    }
}

static void prepare(struct problem *s)
{
    memset(s->b, 0, (size_t)s->size * sizeof *s->b);
    for (int i = 0; i < s->size; i++)
        s->diagonal[i] = i < 3 * s->count ? s->prior_gain : s->prior_coefficient;
    for (int i = 0; i < s->point_count; i++) {
        const struct lumi_same_point *p = &s->points[i];
        double value[3], pa[3], pb[3], w = s->weights[i];
        powers((double)p->r2_a, pa);
        powers((double)p->r2_b, pb);
        for (int c = 0; c < 3; c++) {
            value[c] = w * (double)p->difference[c];
            s->diagonal[3 * p->a + c] += w;
            s->diagonal[3 * p->b + c] += w;
            s->diagonal[3 * (s->count + s->lenses[p->a]) + c] += 3 * w * pa[c] * pa[c];
            s->diagonal[3 * (s->count + s->lenses[p->b]) + c] += 3 * w * pb[c] * pb[c];
        }
        scatter(s, s->b, p, value);
    }
}

static double dot(const struct problem *s, const double *a, const double *b)
{
    double sum = 0;

    for (int i = 0; i < s->size; i++)
        sum += a[i] * b[i];
    return sum;
}

/* From where the last round left off. */
static void solve_linear(struct problem *s)
{
    prepare(s);
    multiply(s, s->x, s->q);
    for (int i = 0; i < s->size; i++) {
        s->r[i] = s->b[i] - s->q[i];
        s->z[i] = s->r[i] / s->diagonal[i];
        s->p[i] = s->z[i];
    }
    double rz = dot(s, s->r, s->z), stop = 1e-12 * (dot(s, s->b, s->b) + 1e-30);
    for (int step = 0; step < STEPS && dot(s, s->r, s->r) > stop; step++) {
        multiply(s, s->p, s->q);
        double alpha = rz / dot(s, s->p, s->q);
        for (int i = 0; i < s->size; i++) {
            s->x[i] += alpha * s->p[i];
            s->r[i] -= alpha * s->q[i];
            s->z[i] = s->r[i] / s->diagonal[i];
        }
        double next = dot(s, s->r, s->z);
        for (int i = 0; i < s->size; i++)
            s->p[i] = s->z[i] + next / rz * s->p[i];
        rz = next;
    }
}

/* Root mean square over the channels of what is left of a point. */
static double residual(const struct problem *s, int i)
{
    double value[3], sum = 0;

    predict(s, s->x, &s->points[i], value);
    for (int c = 0; c < 3; c++)
        sum += (value[c] - (double)s->points[i].difference[c]) * (value[c] - (double)s->points[i].difference[c]);
    return sqrt(sum / 3);
}

static double spread_of(struct problem *s)
{
    for (int i = 0; i < s->point_count; i++)
        s->sizes[i] = residual(s, i);
    return 1.4826 * lumi_sort_median(s->sizes, s->point_count);
}

/* In units of the spread, so that the priors keep their meaning. */
static void weigh(struct problem *s, double spread)
{
    for (int i = 0; i < s->point_count; i++) {
        double sigma = spread * spread + (double)s->points[i].sigma * (double)s->points[i].sigma;
        double away = residual(s, i), share = 1 / (1 + away * away / (4 * sigma));
        s->weights[i] = share * share / sigma;
    }
    s->prior_gain = 1 / (PRIOR_GAIN * PRIOR_GAIN);
    s->prior_coefficient = 1 / (PRIOR_COEFFICIENT * PRIOR_COEFFICIENT);
}

static int allocate(struct problem *s)
{
    double **arrays[] = {&s->x, &s->b, &s->diagonal, &s->r, &s->z, &s->p, &s->q};

    s->weights = lumi_calloc((size_t)s->point_count + 1, sizeof(double));
    s->sizes = lumi_calloc((size_t)s->point_count + (size_t)s->count + 1, sizeof(double));
    bool good = s->weights && s->sizes;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = lumi_calloc((size_t)s->size, sizeof(double));
        good = good && *arrays[i];
    }
    return good ? LUMI_OK : LUMI_ERR_NOMEM;
}

static void release(struct problem *s)
{
    double *arrays[] = {s->weights, s->sizes, s->x, s->b, s->diagonal, s->r, s->z, s->p, s->q};

    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        lumi_free(arrays[i]);
}

/* Into gains, their median 1. Pictures that few points speak of stay at 1, and out of the median. */
static void finish(struct problem *s, const int *points, struct lumi_gains *gains)
{
    for (int c = 0; c < 3; c++) {
        int count = 0;
        for (int i = 0; i < s->count; i++)
            if (points[i] > 0)
                s->sizes[count++] = s->x[3 * i + c];
        double middle = lumi_sort_median(s->sizes, count);
        for (int i = 0; i < s->count; i++) {
            double most = log(LUMI_GAIN_MOST / 2.0), value = points[i] > 0 ? s->x[3 * i + c] - middle : 0;
            gains->items[i].gain[c] = exp(fmax(fmin(value, most), -most));
        }
    }
    for (int k = 0; k < s->lens_count; k++)
        for (int i = 0; i < 3; i++)
            gains->vignetting[k][i] = fmax(fmin(s->x[3 * (s->count + k) + i], 99), -99);
}

int lumi_equalize(const struct lumi_same_point *points, int point_count, const char *const *names, const int *lenses,
                  int count, int lens_count, struct lumi_gains *gains, struct lumi_equalize_report *report,
                  struct lumi_error *error)
{
    struct problem s = {.points = points,
                        .point_count = point_count,
                        .count = count,
                        .lens_count = lens_count,
                        .size = 3 * (count + lens_count),
                        .lenses = lenses};
    int *seen = lumi_calloc((size_t)count + 1, sizeof *seen);
    int code = allocate(&s);

    *gains = (struct lumi_gains){0};
    if (code != LUMI_OK || !seen) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory to even out %d pictures", count);
        goto done;
    }
    LUMI_GOTO(code, done, lumi_gains_create(gains, lens_count, count, error));
    double spread = fmax(spread_of(&s), LEAST_SPREAD);
    report->before = spread;
    for (int round = 0; round < ROUNDS; round++) {
        weigh(&s, spread);
        solve_linear(&s);
        /* The spread falls slowly, so that a good start is not lost to points that do not fit yet. */
        spread = fmax(fmax(spread_of(&s), spread / 2), LEAST_SPREAD);
    }
    report->spread = spread_of(&s);
    for (int i = 0; i < point_count; i++)
        if (residual(&s, i) < 4 * spread) {
            seen[points[i].a]++;
            seen[points[i].b]++;
        }
    finish(&s, seen, gains);
    for (int i = 0; i < count; i++) {
        memcpy(gains->items[i].name, names[i], strnlen(names[i], sizeof gains->items[i].name - 1));
        gains->items[i].lens = lenses[i];
    }
    if (report->points)
        memcpy(report->points, seen, (size_t)count * sizeof *seen);
    lumi_gains_sort(gains);
done:
    release(&s);
    lumi_free(seen);
    return code;
}

#define CLIPPED 0.9f
#define DARK 0.004f

bool lumi_light_around(const struct lumi_raster *picture, bool clips, double x, double y, double scale, float light[3],
                       float *sigma)
{
    const double s = fmin(fmax(scale, 1.5), 6);
    const int reach = (int)ceil(2 * s), cx = (int)floor(x), cy = (int)floor(y);
    double sum[3] = {0, 0, 0}, weights = 0;

    if (cx < reach || cy < reach || cx >= picture->width - reach || cy >= picture->height - reach)
        return false;
    for (int j = cy - reach; j <= cy + reach; j++) {
        const float *row = lumi_row_f32(picture, j);
        for (int i = cx - reach; i <= cx + reach; i++) {
            const double dx = i + 0.5 - x, dy = j + 0.5 - y, w = exp(-(dx * dx + dy * dy) / (2 * s * s));
            for (int c = 0; c < 3; c++) {
                if (clips && row[3 * i + c] > CLIPPED)
                    return false;
                sum[c] += w * (double)row[3 * i + c];
            }
            weights += w;
        }
    }
    for (int c = 0; c < 3; c++) {
        light[c] = (float)(sum[c] / weights);
        if (!(light[c] > DARK) || !isfinite(light[c]))
            return false;
    }
    *sigma = 0.01f + 0.001f / ((light[0] + light[1] + light[2]) / 3);
    return true;
}
