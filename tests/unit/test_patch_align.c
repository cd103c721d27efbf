/* Least squares matching of small pieces of pictures: to hundredths of a pixel, or not at all. */
#include "pipeline/calibrate/patch_align.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

enum { SIZE = 64 };

/* A smooth texture without an end, 40 to 215. */
static double texture(double x, double y)
{
    return 127 + 40 * sin(0.51 * x + 0.13 * y) + 28 * sin(0.17 * x - 0.61 * y + 1) + 19 * cos(0.83 * (x + y) / 2);
}

/* The texture, its place (px, py) at (qx, qy) of the picture, turned and stretched by the inverse of `stretch`. */
static void draw(float *grey, double px, double py, double qx, double qy, const double stretch[4], double gain)
{
    const double det = stretch[0] * stretch[3] - stretch[1] * stretch[2];

    for (int j = 0; j < SIZE; j++)
        for (int i = 0; i < SIZE; i++) {
            const double u = i + 0.5 - qx, v = j + 0.5 - qy;
            const double x = (stretch[3] * u - stretch[1] * v) / det, y = (stretch[0] * v - stretch[2] * u) / det;
            grey[j * SIZE + i] = (float)(gain * texture(px + x, py + y) + 10);
        }
}

static const double whole[4] = {1, 0, 0, 1};

static void a_piece_is_found_to_hundredths_of_a_pixel_turned_stretched_and_darker(void **state)
{
    static float first[SIZE * SIZE], second[SIZE * SIZE];
    const double stretch[4] = {1.1 * 0.94, -1.1 * 0.34, 1.1 * 0.34, 1.1 * 0.94};
    struct lumi_patch_pixels a, b;

    (void)state;
    draw(first, 30.37, 28.71, 30.37, 28.71, whole, 1);
    lumi_patch_cut(first, SIZE, SIZE, 30.37, 28.71, &a);
    for (int k = 0; k < 20; k++) {
        const double x = 31 + 0.05 * k, y = 33.4 - 0.03 * k;
        struct lumi_patch_match match = {.x = x + 0.4, .y = y - 0.3};
        draw(second, 30.37, 28.71, x, y, stretch, 0.7);
        lumi_patch_cut(second, SIZE, SIZE, match.x, match.y, &b);
        assert_true(lumi_patch_align(&a, 30.37, 28.71, &b, stretch, &match));
        assert_true(hypot(match.x - x, match.y - y) < 0.02);
        assert_true(match.sigma < 0.02 && match.correlation > 0.99);
    }
}

static void noise_shows_in_sigma(void **state)
{
    static float first[SIZE * SIZE], second[SIZE * SIZE];
    struct lumi_patch_pixels a, b;
    unsigned seed = 7;
    double squared = 0, said = 0;
    int count = 0;

    (void)state;
    for (int k = 0; k < 200; k++) {
        struct lumi_patch_match match = {.x = 32.2, .y = 31.9};
        draw(first, 32, 32, 32, 32, whole, 1);
        draw(second, 32, 32, 32, 32, whole, 1);
        for (int i = 0; i < SIZE * SIZE; i++) {
            seed = seed * 1664525u + 1013904223u;
            second[i] += (float)(seed >> 16 & 0xff) / 16 - 8; /* ±8: a standard deviation of 4.6 */
        }
        lumi_patch_cut(first, SIZE, SIZE, 32, 32, &a);
        lumi_patch_cut(second, SIZE, SIZE, 32, 32, &b);
        if (!lumi_patch_align(&a, 32, 32, &b, whole, &match))
            continue;
        squared += (match.x - 32) * (match.x - 32) + (match.y - 32) * (match.y - 32);
        said += 2 * match.sigma * match.sigma;
        count++;
    }
    assert_true(count > 190);
    const double ratio = sqrt(squared / said);
    printf("error against what sigma says: %.2f\n", ratio);
    assert_true(ratio > 0.6 && ratio < 1.5);
}

static void an_edge_a_plain_piece_and_one_too_far_away_are_not_found(void **state)
{
    static float plain[SIZE * SIZE], edge[SIZE * SIZE], first[SIZE * SIZE];
    struct lumi_patch_pixels a, b;
    struct lumi_patch_match match = {.x = 32, .y = 32};

    (void)state;
    for (int i = 0; i < SIZE * SIZE; i++) {
        plain[i] = 90;
        edge[i] = (float)(127 + 90 * tanh((i % SIZE - 31.5) / 2));
    }
    lumi_patch_cut(plain, SIZE, SIZE, 32, 32, &a);
    assert_false(lumi_patch_align(&a, 32, 32, &a, whole, &match));
    lumi_patch_cut(edge, SIZE, SIZE, 32, 32, &a);
    assert_false(lumi_patch_align(&a, 32, 32, &a, whole, &match));
    draw(first, 32, 32, 32, 32, whole, 1);
    lumi_patch_cut(first, SIZE, SIZE, 32, 32, &a);
    match = (struct lumi_patch_match){.x = 33.4, .y = 32};
    assert_false(lumi_patch_align(&a, 32, 32, &a, whole, &match));
    lumi_patch_cut(first, SIZE, SIZE, 4, 32, &b);
    assert_false(b.there);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_piece_is_found_to_hundredths_of_a_pixel_turned_stretched_and_darker),
        cmocka_unit_test(noise_shows_in_sigma),
        cmocka_unit_test(an_edge_a_plain_piece_and_one_too_far_away_are_not_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
