/* pipeline/evaluate: figures of merit against values worked out by hand. */
#include "pipeline/evaluate/metrics.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static struct lumi_raster flat(int width, int height, int r, int g, int b)
{
    struct lumi_raster raster;

    assert_int_equal(lumi_raster_create(&raster, width, height, 3, LUMI_U8), LUMI_OK);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const uint8_t pixel[3] = {(uint8_t)r, (uint8_t)g, (uint8_t)b};
            memcpy(lumi_row_u8(&raster, y) + 3 * x, pixel, 3);
        }
    return raster;
}

static struct lumi_comparison compare(struct lumi_raster a, struct lumi_raster b)
{
    struct lumi_comparison comparison;
    struct lumi_error error = {0};

    if (lumi_compare_pictures(&a, &b, 2, &comparison, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    lumi_raster_finish(&a);
    lumi_raster_finish(&b);
    return comparison;
}

static void identical_pictures_have_the_highest_figures(void **state)
{
    struct lumi_comparison c = compare(flat(40, 30, 10, 200, 90), flat(40, 30, 10, 200, 90));

    (void)state;
    assert_true(c.psnr_rgb == LUMI_PSNR_MAX);
    assert_true(c.psnr_yuv == LUMI_PSNR_MAX);
    assert_true(fabs(c.ssim - 1) < 1e-9);
}

static void a_grey_level_off_by_ten_has_the_psnr_of_a_hundred(void **state)
{
    struct lumi_comparison c = compare(flat(40, 30, 100, 100, 100), flat(40, 30, 110, 110, 110));

    (void)state;
    assert_true(fabs(c.psnr_rgb - 10 * log10(255.0 * 255.0 / 100)) < 1e-9);
    /* Luma alone differs, by 10: SSE = 100 W H, and there are 3/2 W H samples. */
    assert_true(fabs(c.psnr_yuv - 10 * log10(255.0 * 255.0 * 1.5 / 100)) < 1e-9);
    /* Of flat pictures only the luminance term is left: (2 a b + C1) / (a² + b² + C1). */
    double c1 = 2.55 * 2.55, expected = (2 * 100 * 110 + c1) / (100 * 100 + 110 * 110 + c1);
    assert_true(fabs(c.ssim - expected) < 1e-4);
}

static void one_channel_off_counts_a_third(void **state)
{
    struct lumi_comparison c = compare(flat(16, 16, 100, 100, 100), flat(16, 16, 100, 106, 100));

    (void)state;
    assert_true(fabs(c.psnr_rgb - 10 * log10(255.0 * 255.0 * 3 / 36)) < 1e-9);
}

/* SSIM straight from its definition, without any separation or sharing. */
static double plain_ssim(const float *a, const float *b, int width, int height)
{
    const double c1 = 2.55 * 2.55, c2 = 7.65 * 7.65;
    double weights[11][11], total = 0, sum = 0;

    for (int j = 0; j < 11; j++)
        for (int i = 0; i < 11; i++)
            total += weights[j][i] = exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / 4.5);
    for (int y = 0; y + 11 <= height; y++)
        for (int x = 0; x + 11 <= width; x++) {
            double ma = 0, mb = 0, va = 0, vb = 0, vab = 0;
            for (int j = 0; j < 11; j++)
                for (int i = 0; i < 11; i++) {
                    ma += weights[j][i] / total * a[(y + j) * width + x + i];
                    mb += weights[j][i] / total * b[(y + j) * width + x + i];
                }
            for (int j = 0; j < 11; j++)
                for (int i = 0; i < 11; i++) {
                    double da = a[(y + j) * width + x + i] - ma, db = b[(y + j) * width + x + i] - mb;
                    va += weights[j][i] / total * da * da;
                    vb += weights[j][i] / total * db * db;
                    vab += weights[j][i] / total * da * db;
                }
            sum += (2 * ma * mb + c1) * (2 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
    return sum / ((width - 10) * (height - 10));
}

static void ssim_is_what_its_definition_says(void **state)
{
    enum { W = 37, H = 29 };
    float a[W * H], b[W * H];
    uint32_t seed = 1;

    (void)state;
    for (int i = 0; i < W * H; i++) {
        seed = seed * 1664525u + 1013904223u;
        a[i] = (float)(128 + 90 * sin(i * 0.11) + (seed >> 28));
        b[i] = a[i] + (float)(seed >> 20 & 31) - 16;
    }
    double expected = plain_ssim(a, b, W, H), measured = lumi_ssim(a, b, W, H, 1);
    assert_true(expected < 0.99);
    assert_true(fabs(measured - expected) < 1e-4);
    assert_true(lumi_ssim(a, b, W, H, 3) == measured);
}

static void pictures_smaller_than_the_window_are_compared_too(void **state)
{
    struct lumi_comparison c = compare(flat(5, 3, 50, 50, 50), flat(5, 3, 50, 50, 50));

    (void)state;
    assert_true(fabs(c.ssim - 1) < 1e-6);
}

static void pictures_of_different_sizes_are_refused(void **state)
{
    struct lumi_raster a = flat(8, 8, 0, 0, 0), b = flat(8, 9, 0, 0, 0);
    struct lumi_comparison comparison;
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_compare_pictures(&a, &b, 1, &comparison, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "8×9"));
    lumi_raster_finish(&a);
    lumi_raster_finish(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identical_pictures_have_the_highest_figures),
        cmocka_unit_test(a_grey_level_off_by_ten_has_the_psnr_of_a_hundred),
        cmocka_unit_test(one_channel_off_counts_a_third),
        cmocka_unit_test(ssim_is_what_its_definition_says),
        cmocka_unit_test(pictures_smaller_than_the_window_are_compared_too),
        cmocka_unit_test(pictures_of_different_sizes_are_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
