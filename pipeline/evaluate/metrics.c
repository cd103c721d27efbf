/* How near one picture is to another. */
#include "pipeline/evaluate/metrics.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/lightfield/yuv.h"

#include <math.h>
#include <string.h>

#define WINDOW 11
#define MOMENTS 5 /* a, b, a², b², ab */

double lumi_psnr(double sum, double samples)
{
    if (!(sum > 0))
        return LUMI_PSNR_MAX;
    return fmin(LUMI_PSNR_MAX, 10 * log10(255.0 * 255.0 * samples / sum));
}

static void window(float *weights, int size)
{
    float total = 0;

    for (int i = 0; i < size; i++) {
        float d = (float)i - (float)(size - 1) / 2;
        total += weights[i] = expf(-d * d / (2 * 1.5f * 1.5f));
    }
    for (int i = 0; i < size; i++)
        weights[i] /= total;
}

struct ssim {
    const float *a, *b;
    int width, height, columns, window_x, window_y;
    float weights_x[WINDOW], weights_y[WINDOW];
    float *scratch; /* a thread: 5 moments of a row, filtered down */
    double *rows;   /* a row of windows: sum of the index */
};

static double ssim_index(const double m[MOMENTS])
{
    const double c1 = (0.01 * 255) * (0.01 * 255), c2 = (0.03 * 255) * (0.03 * 255);
    double va = m[2] - m[0] * m[0], vb = m[3] - m[1] * m[1], vab = m[4] - m[0] * m[1];

    return (2 * m[0] * m[1] + c1) * (2 * vab + c2) / ((m[0] * m[0] + m[1] * m[1] + c1) * (va + vb + c2));
}

static int ssim_row(void *context, int y, int thread)
{
    struct ssim *s = context;
    float *m = s->scratch + (size_t)thread * MOMENTS * (size_t)s->width;
    double sum = 0;

    memset(m, 0, MOMENTS * (size_t)s->width * sizeof *m);
    for (int j = 0; j < s->window_y; j++) {
        const float *a = s->a + (size_t)(y + j) * (size_t)s->width, *b = s->b + (size_t)(y + j) * (size_t)s->width;
        float w = s->weights_y[j];
        for (int x = 0; x < s->width; x++) {
            m[x] += w * a[x];
            m[s->width + x] += w * b[x];
            m[2 * s->width + x] += w * a[x] * a[x];
            m[3 * s->width + x] += w * b[x] * b[x];
            m[4 * s->width + x] += w * a[x] * b[x];
        }
    }
    for (int x = 0; x < s->columns; x++) {
        double moments[MOMENTS] = {0};
        for (int k = 0; k < MOMENTS; k++)
            for (int i = 0; i < s->window_x; i++)
                moments[k] += (double)s->weights_x[i] * m[k * s->width + x + i];
        sum += ssim_index(moments);
    }
    s->rows[y] = sum;
    return LUMI_OK;
}

double lumi_ssim(const float *a, const float *b, int width, int height, int threads)
{
    struct ssim s = {.a = a, .b = b, .width = width, .height = height};
    double sum = 0;

    if (threads <= 0)
        threads = lumi_thread_count();
    s.window_x = width < WINDOW ? width : WINDOW;
    s.window_y = height < WINDOW ? height : WINDOW;
    s.columns = width - s.window_x + 1;
    window(s.weights_x, s.window_x);
    window(s.weights_y, s.window_y);
    int rows = height - s.window_y + 1;
    s.scratch = lumi_alloc((size_t)threads * MOMENTS * (size_t)width, sizeof(float));
    s.rows = lumi_calloc((size_t)rows, sizeof(double));
    if (s.scratch && s.rows) {
        lumi_parallel_for(rows, threads, ssim_row, &s);
        for (int y = 0; y < rows; y++)
            sum += s.rows[y];
        sum /= (double)rows * s.columns;
    } else {
        sum = -2;
    }
    lumi_free(s.scratch);
    lumi_free(s.rows);
    return sum;
}

static double rgb_psnr(const struct lumi_raster *a, const struct lumi_raster *b)
{
    double sum = 0;

    for (int y = 0; y < a->height; y++) {
        const uint8_t *p = lumi_row_u8(a, y), *q = lumi_row_u8(b, y);
        for (int x = 0; x < 3 * a->width; x++) {
            int d = p[x] - q[x];
            sum += d * d;
        }
    }
    return lumi_psnr(sum, 3.0 * a->width * a->height);
}

static double yuv_psnr(const struct lumi_yuv *a, const struct lumi_yuv *b)
{
    double sum = 0;

    for (int plane = 0; plane < 3; plane++) {
        size_t count = (size_t)lumi_yuv_width(a, plane) * (size_t)lumi_yuv_height(a, plane);
        for (size_t i = 0; i < count; i++) {
            int d = a->plane[plane][i] - b->plane[plane][i];
            sum += d * d;
        }
    }
    return lumi_psnr(sum, 1.5 * a->width * a->height);
}

/* BT.709 luma of an sRGB picture, not rounded. */
static float *luma(const struct lumi_raster *picture)
{
    float *plane = lumi_alloc((size_t)picture->width * (size_t)picture->height, sizeof(float));

    for (int y = 0; plane && y < picture->height; y++) {
        const uint8_t *p = lumi_row_u8(picture, y);
        for (int x = 0; x < picture->width; x++)
            plane[(size_t)y * (size_t)picture->width + (size_t)x] =
                0.2126f * p[3 * x] + 0.7152f * p[3 * x + 1] + 0.0722f * p[3 * x + 2];
    }
    return plane;
}

int lumi_compare_pictures(const struct lumi_raster *a, const struct lumi_raster *b, int threads,
                          struct lumi_comparison *comparison, struct lumi_error *error)
{
    struct lumi_yuv yuv_a = {0}, yuv_b = {0};

    if (a->width != b->width || a->height != b->height || a->channels != 3 || b->channels != 3 ||
        a->sample != LUMI_U8 || b->sample != LUMI_U8)
        return lumi_fail(error, LUMI_ERR_ARG, "pictures of %d×%d and %d×%d cannot be compared", a->width, a->height,
                         b->width, b->height);
    float *luma_a = luma(a), *luma_b = luma(b);
    int code = luma_a && luma_b ? LUMI_OK : LUMI_ERR_NOMEM;
    if (code == LUMI_OK)
        code = lumi_yuv_from_raster(a, &yuv_a);
    if (code == LUMI_OK)
        code = lumi_yuv_from_raster(b, &yuv_b);
    if (code == LUMI_OK) {
        comparison->psnr_rgb = rgb_psnr(a, b);
        comparison->psnr_yuv = yuv_psnr(&yuv_a, &yuv_b);
        comparison->ssim = lumi_ssim(luma_a, luma_b, a->width, a->height, threads);
        if (comparison->ssim < -1.5)
            code = LUMI_ERR_NOMEM;
    }
    lumi_yuv_finish(&yuv_a);
    lumi_yuv_finish(&yuv_b);
    lumi_free(luma_a);
    lumi_free(luma_b);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "no memory to compare pictures");
}
