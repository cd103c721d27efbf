/* Features: where they are found, in pictures whose points are known; their files. */
#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/sift.h"
#include "pipeline/calibrate/sphere_warp.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIDE = 320, BLOBS = 49 };

/* Round spots on grey, as the lens shows them: each a Gaussian of the angle from its middle. */
static float *spots(const struct lumi_lens *lens, double sigma, struct lumi_vec3 ways[BLOBS])
{
    float *grey = lumi_alloc(SIDE * SIDE, sizeof *grey);

    for (int i = 0; i < BLOBS; i++) {
        const double x = SIDE * (0.1 + 0.8 * (i % 7) / 6.0) + i % 3,
                     y = SIDE * (0.1 + 0.8 * (i / 7) / 6.0) + i % 5 * 0.3 + 0.11;
        assert_true(lumi_lens_unproject(lens, x, y, &ways[i]));
    }
    for (int p = 0; p < SIDE * SIDE; p++) {
        struct lumi_vec3 d;
        double light = 90;
        if (lumi_lens_unproject(lens, p % SIDE + 0.5, p / SIDE + 0.5, &d))
            for (int i = 0; i < BLOBS; i++) {
                const double a = acos(fmin(1, lumi_dot(d, ways[i])));
                light += (i & 1 ? 100 : -60) * exp(-a * a / (2 * sigma * sigma));
            }
        grey[p] = (float)light;
    }
    return grey;
}

static double nearest(const struct lumi_feature *items, int count, double x, double y)
{
    double least = 1e9;

    for (int i = 0; i < count; i++)
        least = fmin(least, hypot(items[i].x - x, items[i].y - y));
    return least;
}

static void spots_are_found_where_they_are_to_a_fraction_of_a_pixel(void **unused)
{
    struct lumi_lens lens;
    struct lumi_vec3 ways[BLOBS];
    struct lumi_sift_settings settings;
    struct lumi_feature *items;
    int count, found;
    float sharpness;

    (void)unused;
    lumi_lens_init_pinhole(&lens, SIDE, SIDE, 0.7);
    float *grey = spots(&lens, 3 / lens.fx, ways);
    struct lumi_sift *sift = lumi_sift_create();
    lumi_sift_defaults(&settings);
    for (int octave = -1; octave <= 0; octave++) {
        settings.first_octave = octave;
        assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &items, &count, &sharpness, NULL), LUMI_OK);
        assert_in_range(count, BLOBS - 3, 4 * BLOBS);
        for (int i = found = 0; i < BLOBS; i++) {
            double x, y;
            assert_true(lumi_lens_project(&lens, ways[i], &x, &y));
            found += nearest(items, count, x, y) < 0.15;
        }
        assert_true(found >= BLOBS - 3); /* two samples of a spot that are alike are no extremum */
        lumi_free(items);
    }
    lumi_sift_destroy(sift);
    lumi_free(grey);
}

static void behind_a_fisheye_they_come_back_to_the_original_pixels(void **unused)
{
    struct lumi_lens lens = {LUMI_LENS_FISHEYE, SIDE, SIDE, 150, 150, 161, 158, 0.01, -0.003, 0, 0, 0, 0};
    struct lumi_vec3 ways[BLOBS];
    struct lumi_sphere_warp warp;
    struct lumi_sift_settings settings;
    struct lumi_feature *items;
    int count, found = 0;
    float sharpness;

    (void)unused;
    assert_true(lumi_lens_stretch(&lens) > 1.3);
    float *grey = spots(&lens, 3.0 / 150, ways);
    assert_int_equal(lumi_sphere_warp_init(&warp, &lens, NULL), LUMI_OK);
    float *warped = lumi_alloc((size_t)warp.width * (size_t)warp.height, sizeof *warped);
    lumi_sphere_warp_apply(&warp, grey, warped);
    struct lumi_sift *sift = lumi_sift_create();
    lumi_sift_defaults(&settings);
    settings.first_octave = -1;
    settings.use = warp.use;
    assert_int_equal(lumi_sift_find(sift, warped, warp.width, warp.height, &settings, &items, &count, &sharpness, NULL),
                     LUMI_OK);
    for (int i = 0; i < count; i++) {
        double x, y;
        assert_true(lumi_sphere_warp_back(&warp, items[i].x, items[i].y, &x, &y));
        items[i].x = (float)x;
        items[i].y = (float)y;
    }
    for (int i = 0; i < BLOBS; i++) {
        double x, y;
        assert_true(lumi_lens_project(&lens, ways[i], &x, &y));
        found += nearest(items, count, x, y) < 0.12;
    }
    assert_int_equal(found, BLOBS);
    lumi_free(items);
    lumi_free(warped);
    lumi_free(grey);
    lumi_sift_destroy(sift);
    lumi_sphere_warp_finish(&warp);
}

static float *noise(uint64_t seed)
{
    float *grey = lumi_alloc(SIDE * SIDE, sizeof *grey);

    for (int i = 0; i < SIDE * SIDE; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        grey[i] = (float)(seed >> 56);
    }
    return grey;
}

/* Spots of many sizes everywhere. */
static float *crowd(void)
{
    float *grey = lumi_calloc(SIDE * SIDE, sizeof *grey);
    uint64_t seed = 3;

    for (int i = 0; i < 4000; i++) {
        float number[4];
        for (int k = 0; k < 4; k++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            number[k] = (float)(seed >> 40) / 16777216.0f;
        }
        const int x = (int)(number[0] * SIDE), y = (int)(number[1] * SIDE);
        const float size = 1.2f + 2 * number[2], height = 200 * (number[3] - 0.5f);
        for (int b = y < 10 ? 0 : y - 10; b < SIDE && b < y + 10; b++)
            for (int a = x < 10 ? 0 : x - 10; a < SIDE && a < x + 10; a++)
                grey[b * SIDE + a] +=
                    height * expf(-(float)((a - x) * (a - x) + (b - y) * (b - y)) / (2 * size * size));
    }
    return grey;
}

static void so_many_are_found_everywhere_and_none_where_nothing_is_used(void **unused)
{
    struct lumi_sift_settings settings;
    struct lumi_feature *items, *again;
    uint8_t *use = lumi_calloc(SIDE, SIDE);
    float *grey = crowd(), sharpness;
    int count, second, left = 0, top = 0;
    struct lumi_sift *sift = lumi_sift_create();

    (void)unused;
    for (int i = 0; i < SIDE * SIDE; i++)
        use[i] = i % SIDE >= 40;
    lumi_sift_defaults(&settings);
    settings.most = 500;
    settings.use = use;
    assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &items, &count, &sharpness, NULL), LUMI_OK);
    assert_in_range(count, 400, 500);
    for (int i = 0; i < count; i++) {
        assert_true(items[i].x > 39);
        left += items[i].x < 180;
        top += items[i].y < SIDE / 2;
    }
    assert_in_range(left, count * 4 / 10, count * 6 / 10);
    assert_in_range(top, count * 4 / 10, count * 6 / 10);
    assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &again, &second, &sharpness, NULL), LUMI_OK);
    assert_int_equal(second, count);
    assert_memory_equal(items, again, (size_t)count * sizeof *items);
    lumi_free(items);
    lumi_free(again);
    lumi_free(use);
    lumi_free(grey);
    lumi_sift_destroy(sift);
}

static void a_blurred_picture_is_less_sharp_whatever_its_light(void **unused)
{
    struct lumi_sift_settings settings;
    struct lumi_feature *items;
    float *grey = noise(2), *blurred = lumi_calloc(SIDE * SIDE, sizeof *blurred), sharp, dark, soft;
    int count;
    struct lumi_sift *sift = lumi_sift_create();

    (void)unused;
    lumi_sift_defaults(&settings);
    assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &items, &count, &sharp, NULL), LUMI_OK);
    lumi_free(items);
    for (int y = 4; y < SIDE - 4; y++)
        for (int x = 4; x < SIDE - 4; x++)
            for (int k = 0; k < 81; k++)
                blurred[y * SIDE + x] += grey[(y + k / 9 - 4) * SIDE + x + k % 9 - 4] / 81;
    assert_int_equal(lumi_sift_find(sift, blurred, SIDE, SIDE, &settings, &items, &count, &soft, NULL), LUMI_OK);
    lumi_free(items);
    for (int i = 0; i < SIDE * SIDE; i++)
        grey[i] /= 3;
    assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &items, &count, &dark, NULL), LUMI_OK);
    lumi_free(items);
    assert_true(soft < 0.5f * sharp);
    assert_true(fabsf(dark - sharp) < 0.01f * sharp);
    lumi_sift_destroy(sift);
    lumi_free(grey);
    lumi_free(blurred);
}

static void the_outline_of_a_mask_makes_no_picture_sharp(void **unused)
{
    struct lumi_sift_settings settings;
    struct lumi_feature *items;
    float *grey = lumi_calloc(SIDE * SIDE, sizeof *grey), sharpness[2];
    uint8_t *use = lumi_calloc(SIDE * SIDE, 1);
    struct lumi_sift *sift = lumi_sift_create();
    int count;

    (void)unused;
    lumi_sift_defaults(&settings);
    /* Soft waves; what is not used is black, with a sharp edge. */
    for (int masked = 0; masked < 2; masked++) {
        for (int i = 0; i < SIDE * SIDE; i++) {
            const int x = i % SIDE, y = i / SIDE;
            const float wave = 120 + 60 * sinf((float)x / 8) * cosf((float)y / 9);
            use[i] = !masked || (x > SIDE / 4 + 8);
            grey[i] = masked && x < SIDE / 4 ? 0 : wave;
        }
        settings.use = use;
        assert_int_equal(lumi_sift_find(sift, grey, SIDE, SIDE, &settings, &items, &count, &sharpness[masked], NULL),
                         LUMI_OK);
        lumi_free(items);
    }
    assert_true(fabsf(sharpness[1] - sharpness[0]) < 0.1f * sharpness[0]);
    lumi_sift_destroy(sift);
    lumi_free(grey);
    lumi_free(use);
}

static void a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged(void **unused)
{
    struct lumi_feature items[3] = {{1.25f, 2.5f, 1.6f, -3, {1, 2, 3}}, {99.5f, 0, 20, 6, {255}}, {3, 4, 5, 0, {0}}};
    const struct lumi_features features = {100, 50, 3, items, 0.25f, 1.5f};
    struct lumi_features back;
    struct lumi_error error = {0};
    char path[] = "/tmp/test_featuresXXXXXX";
    uint8_t *data;
    size_t size;

    (void)unused;
    close(mkstemp(path));
    assert_int_equal(lumi_features_write(path, &features, &error), LUMI_OK);
    assert_int_equal(lumi_features_read(path, &back, &error), LUMI_OK);
    assert_int_equal(back.count, 3);
    assert_memory_equal(back.items, items, sizeof items);
    assert_true(back.width == 100 && back.height == 50 && back.mean == 0.25f && back.sharpness == 1.5f);
    lumi_features_finish(&back);
    assert_int_equal(lumi_file_read(path, 1 << 20, &data, &size, &error), LUMI_OK);
    for (size_t i = 0; i < size; i += 7) {
        data[i] ^= 16;
        assert_true(lumi_features_decode(data, size, "damaged", &back, &error) < 0);
        assert_non_null(strstr(error.text, "damaged"));
        data[i] ^= 16;
    }
    for (size_t cut = 0; cut < size; cut += 5)
        assert_true(lumi_features_decode(data, cut, "cut", &back, &error) < 0);
    lumi_free(data);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spots_are_found_where_they_are_to_a_fraction_of_a_pixel),
        cmocka_unit_test(behind_a_fisheye_they_come_back_to_the_original_pixels),
        cmocka_unit_test(so_many_are_found_everywhere_and_none_where_nothing_is_used),
        cmocka_unit_test(a_blurred_picture_is_less_sharp_whatever_its_light),
        cmocka_unit_test(the_outline_of_a_mask_makes_no_picture_sharp),
        cmocka_unit_test(a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
