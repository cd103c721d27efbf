/* The shift between two shots: Lucas and Kanade, "An iterative image registration technique", 1981, in the inverse
 * compositional form (Baker and Matthews 2004), on logarithms of light, over a pyramid. Differences are weighted
 * (Huber) so that what moved in the picture does not pull the whole. */
#include "pipeline/hdr/shot_align.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <math.h>
#include <string.h>

enum { LEVELS = 7, ROUNDS = 12, LEAST_SIDE = 24, LEAST_PIXELS = 300, RATIO_PIXELS = 65536 };
#define DARK 0.008f  /* of a shot's white: below is mostly noise */
#define BRIGHT 0.93f /* and above it may be clipped */

/* One plane of logarithms; NaN where the pixel tells nothing. */
struct plane {
    int width, height;
    float *values;
};

static float brightness(const float *pixel)
{
    float most = fmaxf(pixel[0], fmaxf(pixel[1], pixel[2]));
    float mean = (pixel[0] + pixel[1] + pixel[2]) / 3;

    return most < BRIGHT && mean > DARK ? mean : NAN;
}

static int make_plane(const struct lumi_raster *picture, float scale, struct plane *plane)
{
    *plane = (struct plane){picture->width, picture->height, NULL};
    plane->values = lumi_alloc((size_t)picture->width * (size_t)picture->height, sizeof *plane->values);
    if (!plane->values)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < picture->height; y++)
        for (int x = 0; x < picture->width; x++)
            plane->values[(size_t)y * (size_t)picture->width + (size_t)x] =
                logf(brightness(lumi_row_f32(picture, y) + 3 * x) * scale);
    return LUMI_OK;
}

/* Half as wide and high; a pixel of which fewer than three quarters tell something tells nothing. */
static int halve(const struct plane *from, struct plane *to)
{
    *to = (struct plane){from->width / 2, from->height / 2, NULL};
    to->values = lumi_alloc((size_t)to->width * (size_t)to->height, sizeof *to->values);
    if (!to->values)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < to->height; y++)
        for (int x = 0; x < to->width; x++) {
            float sum = 0;
            int count = 0;
            for (int i = 0; i < 4; i++) {
                float v = from->values[(size_t)(2 * y + i / 2) * (size_t)from->width + (size_t)(2 * x + i % 2)];
                sum += isfinite(v) ? v : 0;
                count += isfinite(v);
            }
            to->values[(size_t)y * (size_t)to->width + (size_t)x] = count >= 3 ? sum / (float)count : NAN;
        }
    return LUMI_OK;
}

/* Bilinear; NaN outside and where a neighbour is. */
static float sample(const struct plane *plane, double x, double y)
{
    double fx = floor(x), fy = floor(y);

    if (!(fx >= 0 && fy >= 0 && fx + 1 < plane->width && fy + 1 < plane->height))
        return NAN;
    const float *p = plane->values + (size_t)fy * (size_t)plane->width + (size_t)fx;
    float u = (float)(x - fx), v = (float)(y - fy);
    return (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[plane->width] + u * p[plane->width + 1]);
}

/* Sums over the picture for one step of the shift. */
struct sums {
    double xx, xy, yy, x, y, cost;
    long pixels;
};

static struct sums look(const struct plane *reference, const struct plane *shot, double dx, double dy)
{
    struct sums s = {0};
    const int width = reference->width;

    for (int y = 1; y < reference->height - 1; y++) {
        const float *row = reference->values + (size_t)y * (size_t)width;
        for (int x = 1; x < width - 1; x++) {
            float gx = (row[x + 1] - row[x - 1]) / 2, gy = (row[x + width] - row[x - width]) / 2;
            float difference = sample(shot, x + dx, y + dy) - row[x];
            if (!isfinite(gx) || !isfinite(gy) || !isfinite(difference))
                continue;
            float away = fabsf(difference), weight = away < 0.1f ? 1 : 0.1f / away;
            s.xx += (double)(weight * gx * gx);
            s.xy += (double)(weight * gx * gy);
            s.yy += (double)(weight * gy * gy);
            s.x += (double)(weight * gx * difference);
            s.y += (double)(weight * gy * difference);
            s.cost += (double)(away < 0.1f ? away * away : 0.2f * away - 0.01f);
            s.pixels++;
        }
    }
    if (s.pixels > 0)
        s.cost /= (double)s.pixels;
    return s;
}

static bool tells(const struct sums *s)
{
    double trace = s->xx + s->yy, determinant = s->xx * s->yy - s->xy * s->xy;

    /* The smaller eigenvalue, a pixel: an edge in one direction alone tells only half. */
    return s->pixels >= LEAST_PIXELS && determinant / (trace + 1e-30) > 2e-6 * (double)s->pixels;
}

/* From the coarsest plane to the finest. */
static void find(const struct plane *reference, const struct plane *shot, int levels, double most,
                 struct lumi_shot_shift *shift)
{
    double dx = 0, dy = 0;
    bool told = false;

    for (int level = levels - 1; level >= 0; level--) {
        dx *= 2;
        dy *= 2;
        told = false;
        for (int round = 0; round < ROUNDS; round++) {
            struct sums s = look(&reference[level], &shot[level], dx, dy);
            told = tells(&s);
            if (!told)
                break;
            double determinant = s.xx * s.yy - s.xy * s.xy;
            double step_x = (s.yy * s.x - s.xy * s.y) / determinant, step_y = (s.xx * s.y - s.xy * s.x) / determinant;
            double length = sqrt(step_x * step_x + step_y * step_y), bound = length > 2 ? 2 / length : 1;
            dx -= bound * step_x;
            dy -= bound * step_y;
            if (length < 0.002)
                break;
        }
        if (!told || fabs(dx) * ldexp(1, level) > most || fabs(dy) * ldexp(1, level) > most)
            dx = dy = 0;
    }
    struct sums stays = look(&reference[0], &shot[0], 0, 0), moved = look(&reference[0], &shot[0], dx, dy);
    *shift = (struct lumi_shot_shift){.told = told};
    if (told && moved.cost < 0.97 * stays.cost) {
        shift->x = dx;
        shift->y = dy;
    }
}

int lumi_shot_shift(const struct lumi_raster *reference, const struct lumi_raster *shot, double scale,
                    struct lumi_shot_shift *shift, struct lumi_error *error)
{
    struct plane a[LEVELS] = {{0}}, b[LEVELS] = {{0}};
    const double most = LUMI_SHIFT_MOST * fmax(reference->width, reference->height);
    int levels = 1;

    *shift = (struct lumi_shot_shift){0};
    int code = make_plane(reference, 1, &a[0]);
    if (code == LUMI_OK)
        code = make_plane(shot, (float)scale, &b[0]);
    while (code == LUMI_OK && levels < LEVELS && ldexp(1, levels - 1) < most &&
           fmin(a[levels - 1].width, a[levels - 1].height) >= 2 * LEAST_SIDE) {
        code = halve(&a[levels - 1], &a[levels]);
        if (code == LUMI_OK)
            code = halve(&b[levels - 1], &b[levels]);
        levels++;
    }
    if (code == LUMI_OK)
        find(a, b, levels, most, shift);
    for (int i = 0; i < LEVELS; i++) {
        lumi_free(a[i].values);
        lumi_free(b[i].values);
    }
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "no memory to align a bracket");
}

static int clamp(int value, int size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

/* Catmull and Rom's weights (1974) for the four samples around a place `t` beyond the second. */
static void cubic(float t, float weights[4])
{
    weights[0] = t * (-0.5f + t * (1 - 0.5f * t));
    weights[1] = 1 + t * t * (-2.5f + 1.5f * t);
    weights[2] = t * (0.5f + t * (2 - 1.5f * t));
    weights[3] = t * t * (-0.5f + 0.5f * t);
}

static void move_pixel(const struct lumi_raster *shot, int x, int y, const float across[4], const float down[4],
                       float out[3])
{
    for (int c = 0; c < 3; c++) {
        float sum = 0, low = INFINITY, high = -INFINITY;
        for (int j = 0; j < 4; j++) {
            const float *row = lumi_row_f32(shot, clamp(y - 1 + j, shot->height));
            float line = 0;
            for (int i = 0; i < 4; i++) {
                float v = row[3 * clamp(x - 1 + i, shot->width) + c];
                line += across[i] * v;
                if ((i == 1 || i == 2) && (j == 1 || j == 2)) {
                    low = fminf(low, v);
                    high = fmaxf(high, v);
                }
            }
            sum += down[j] * line;
        }
        out[c] = fminf(fmaxf(sum, low), high);
    }
}

int lumi_shot_move(const struct lumi_raster *shot, const struct lumi_shot_shift *shift, struct lumi_raster *moved,
                   struct lumi_error *error)
{
    const int whole_x = (int)floor(shift->x), whole_y = (int)floor(shift->y);
    float across[4], down[4];

    if (lumi_raster_create(moved, shot->width, shot->height, 3, LUMI_F32) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to align a bracket");
    cubic((float)(shift->x - whole_x), across);
    cubic((float)(shift->y - whole_y), down);
    for (int y = 0; y < shot->height; y++)
        for (int x = 0; x < shot->width; x++)
            move_pixel(shot, x + whole_x, y + whole_y, across, down, lumi_row_f32(moved, y) + 3 * x);
    return LUMI_OK;
}

double lumi_shot_ratio(const struct lumi_raster *reference, const struct lumi_raster *shot, long *pixels)
{
    int step = 1;
    long count = 0;

    while ((long)(reference->width / step) * (reference->height / step) > RATIO_PIXELS)
        step++;
    float *ratios =
        lumi_alloc((size_t)(reference->width / step + 1) * (size_t)(reference->height / step + 1), sizeof *ratios);
    *pixels = 0;
    if (!ratios)
        return 0;
    for (int y = step / 2; y < reference->height; y += step)
        for (int x = step / 2; x < reference->width; x += step) {
            float ratio = brightness(lumi_row_f32(shot, y) + 3 * x) / brightness(lumi_row_f32(reference, y) + 3 * x);
            if (isfinite(ratio))
                ratios[count++] = ratio;
        }
    lumi_sort_floats(ratios, (int)count);
    double median = count ? (double)ratios[count / 2] : 0;
    lumi_free(ratios);
    *pixels = count;
    return median;
}
