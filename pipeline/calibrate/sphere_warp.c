/* Resampling to the stereographic projection. */
#include "pipeline/calibrate/sphere_warp.h"

#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

enum { SIDE_MAX = 16384 };

/* The two scales at an image position: singular values of the way from the sphere's tangent plane to pixels. */
static double stretch_at(const struct lumi_lens *lens, double x, double y)
{
    struct lumi_vec3 d;
    double a[2], b[2], c[2];
    const double h = 1e-5;

    if (!lumi_lens_unproject(lens, x, y, &d))
        return 1;
    const struct lumi_vec3 off = fabs(d.x) < 0.9 ? lumi_vec3(1, 0, 0) : lumi_vec3(0, 1, 0);
    const struct lumi_vec3 u = lumi_normalize(lumi_cross(d, off)), v = lumi_cross(d, u);
    if (!lumi_lens_project(lens, d, &a[0], &a[1]) ||
        !lumi_lens_project(lens, lumi_add(d, lumi_scale(u, h)), &b[0], &b[1]) ||
        !lumi_lens_project(lens, lumi_add(d, lumi_scale(v, h)), &c[0], &c[1]))
        return 1;
    const double j00 = (b[0] - a[0]) / h, j10 = (b[1] - a[1]) / h, j01 = (c[0] - a[0]) / h, j11 = (c[1] - a[1]) / h;
    const double sum = j00 * j00 + j01 * j01 + j10 * j10 + j11 * j11, product = fabs(j00 * j11 - j01 * j10);
    const double root = sqrt(fmax(0, sum * sum / 4 - product * product));
    return sum / 2 - root > 0 ? sqrt((sum / 2 + root) / (sum / 2 - root)) : 1;
}

double lumi_lens_stretch(const struct lumi_lens *lens)
{
    double most = 1;

    for (int i = 0; i <= 8; i++)
        for (int k = 0; k <= 8; k++)
            most = fmax(most, stretch_at(lens, lens->width * i / 8.0, lens->height * k / 8.0));
    return most;
}

static void project(double focal, struct lumi_vec3 d, double *u, double *v)
{
    const double r = hypot(d.x, d.y), theta = atan2(r, d.z);
    const double s = r > 0 ? 2 * focal * tan(fmin(theta, 150 * LUMI_PI / 180) / 2) / r : 0;

    *u = d.x * s;
    *v = d.y * s;
}

static struct lumi_vec3 unproject(double focal, double u, double v)
{
    const double a = u / (2 * focal), b = v / (2 * focal), s = 1 / (1 + a * a + b * b);

    return lumi_vec3(2 * a * s, 2 * b * s, (1 - a * a - b * b) * s);
}

/* What the picture's edge covers, with the middle as dense as the lens's. */
static void extent(struct lumi_sphere_warp *warp, double box[4])
{
    const struct lumi_lens *lens = &warp->lens;

    box[0] = box[1] = 1e9;
    box[2] = box[3] = -1e9;
    for (int i = 0; i <= 64; i++)
        for (int k = 0; k <= 64; k++) {
            struct lumi_vec3 d;
            double u, v;
            if (!lumi_lens_unproject(lens, lens->width * i / 64.0, lens->height * k / 64.0, &d))
                continue;
            project(warp->focal, d, &u, &v);
            box[0] = fmin(box[0], u);
            box[1] = fmin(box[1], v);
            box[2] = fmax(box[2], u);
            box[3] = fmax(box[3], v);
        }
}

bool lumi_sphere_warp_back(const struct lumi_sphere_warp *warp, double u, double v, double *x, double *y)
{
    return lumi_lens_project(&warp->lens, unproject(warp->focal, u - warp->cx, v - warp->cy), x, y);
}

static void fill(struct lumi_sphere_warp *warp)
{
    const double margin = 4;

    for (int row = 0; row < warp->height; row++)
        for (int column = 0; column < warp->width; column++) {
            const size_t i = (size_t)row * (size_t)warp->width + (size_t)column;
            double x, y;
            const bool seen = lumi_sphere_warp_back(warp, column + 0.5, row + 0.5, &x, &y) && x >= 0 && y >= 0 &&
                              x < warp->lens.width && y < warp->lens.height;
            warp->at[2 * i] = seen ? (float)x : NAN;
            warp->at[2 * i + 1] = seen ? (float)y : NAN;
            warp->use[i] =
                seen && x >= margin && y >= margin && x < warp->lens.width - margin && y < warp->lens.height - margin;
        }
}

int lumi_sphere_warp_init(struct lumi_sphere_warp *warp, const struct lumi_lens *lens, struct lumi_error *error)
{
    double box[4];

    *warp = (struct lumi_sphere_warp){.lens = *lens, .focal = sqrt(lens->fx * lens->fy)};
    extent(warp, box);
    /* A lens that stretches its edges without end would want an endless picture. */
    const double side = fmax(box[2] - box[0], box[3] - box[1]),
                 most = fmin(SIDE_MAX, 3.0 * fmax(lens->width, lens->height));
    const double shrink = side > most ? most / side : 1;
    warp->focal *= shrink;
    warp->cx = -box[0] * shrink;
    warp->cy = -box[1] * shrink;
    warp->width = (int)fmax(1, ceil((box[2] - box[0]) * shrink));
    warp->height = (int)fmax(1, ceil((box[3] - box[1]) * shrink));
    warp->at = lumi_alloc(2 * (size_t)warp->width * (size_t)warp->height, sizeof *warp->at);
    warp->use = lumi_alloc((size_t)warp->width, (size_t)warp->height);
    if (!warp->at || !warp->use) {
        lumi_sphere_warp_finish(warp);
        return lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to resample a picture");
    }
    fill(warp);
    return LUMI_OK;
}

void lumi_sphere_warp_finish(struct lumi_sphere_warp *warp)
{
    lumi_free(warp->at);
    lumi_free(warp->use);
    *warp = (struct lumi_sphere_warp){0};
}

static void weights(float t, float w[4])
{
    w[0] = t * (-0.5f + t * (1 - 0.5f * t));
    w[1] = 1 + t * t * (-2.5f + 1.5f * t);
    w[2] = t * (0.5f + t * (2 - 1.5f * t));
    w[3] = t * t * (-0.5f + 0.5f * t);
}

static int inside(int i, int size)
{
    return i < 0 ? 0 : i < size ? i : size - 1;
}

static float sample(const struct lumi_lens *lens, const float *grey, float x, float y)
{
    const float fx = floorf(x - 0.5f), fy = floorf(y - 0.5f);
    const int left = (int)fx - 1, top = (int)fy - 1;
    float wx[4], wy[4], sum = 0;

    weights(x - 0.5f - fx, wx);
    weights(y - 0.5f - fy, wy);
    for (int k = 0; k < 4; k++) {
        const float *row = grey + (size_t)inside(top + k, lens->height) * (size_t)lens->width;
        float across = 0;
        for (int i = 0; i < 4; i++)
            across += wx[i] * row[inside(left + i, lens->width)];
        sum += wy[k] * across;
    }
    return sum;
}

void lumi_sphere_warp_apply(const struct lumi_sphere_warp *warp, const float *grey, float *result)
{
    const size_t count = (size_t)warp->width * (size_t)warp->height;

    for (size_t i = 0; i < count; i++) {
        const float x = warp->at[2 * i], y = warp->at[2 * i + 1];
        result[i] = isnan(x) ? 0 : sample(&warp->lens, grey, x, y);
    }
}
