/* pipeline/compress: the search for the quality of a field of a wanted size, over made-up sizes. */
#include "pipeline/compress/size_search.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

struct sizes {
    long long size[101];
    double bias; /* of the estimate */
    int estimated, measured;
};

static int estimate(void *context, int quality, long long *size, struct lumi_error *error)
{
    struct sizes *sizes = context;

    (void)error;
    assert_in_range(quality, 0, 100);
    sizes->estimated++;
    /* Off by a share that drifts a little. */
    *size = (long long)((double)sizes->size[quality] * sizes->bias * (1 + 0.0002 * (quality - 50)));
    return LUMI_OK;
}

static int measure(void *context, int quality, long long *size, struct lumi_error *error)
{
    struct sizes *sizes = context;

    (void)error;
    assert_in_range(quality, 0, 100);
    sizes->measured++;
    *size = sizes->size[quality];
    return LUMI_OK;
}

/* As codecs do: growth that rises with quality, a plateau at every fifth step. */
static void codec_like(struct sizes *sizes, double bias)
{
    double log_size = log(40000);

    *sizes = (struct sizes){.bias = bias};
    for (int q = 0; q <= 100; q++) {
        sizes->size[q] = (long long)exp(log_size);
        log_size += q % 5 == 4 ? 0 : 0.02 + 0.0005 * q;
    }
}

static int search(struct sizes *sizes, long long target, bool with_estimate)
{
    int quality = -2;

    sizes->estimated = sizes->measured = 0;
    assert_int_equal(compress_size_search(target, with_estimate ? estimate : NULL, measure, sizes, &quality, NULL),
                     LUMI_OK);
    if (quality >= 0)
        assert_true(sizes->size[quality] <= target);
    return quality;
}

static void a_good_estimate_leaves_a_coding_or_two(void **state)
{
    const double bias[] = {0.93, 0.99, 1, 1.01, 1.08};
    struct sizes sizes;
    int total = 0, searches = 0;

    (void)state;
    for (int b = 0; b < 5; b++) {
        codec_like(&sizes, bias[b]);
        for (long long target = 45000; target < 1000000; target = target * 21 / 20) {
            int quality = search(&sizes, target, true);
            assert_in_range(quality, 0, 100);
            assert_true(sizes.measured <= 4 && sizes.estimated <= 5);
            assert_true(quality == 100 || (double)sizes.size[quality] > 0.92 * (double)target);
            total += sizes.measured;
            searches++;
        }
    }
    print_message("%.2f codings a search\n", (double)total / searches);
    assert_true(total <= 2 * searches);
}

static void without_an_estimate_a_handful_of_codings_find_it(void **state)
{
    struct sizes sizes;
    int total = 0, searches = 0;

    (void)state;
    codec_like(&sizes, 1);
    for (long long target = 45000; target < 1000000; target = target * 21 / 20) {
        int quality = search(&sizes, target, false);
        assert_in_range(quality, 0, 100);
        assert_true(sizes.measured <= 8);
        total += sizes.measured;
        searches++;
        assert_true(quality == 100 || (double)sizes.size[quality] > 0.92 * (double)target);
    }
    print_message("%.2f codings a search\n", (double)total / searches);
    assert_true(2 * total <= 7 * searches);
}

static void no_size_is_met_from_above_whatever_the_sizes_are(void **state)
{
    struct sizes sizes = {.bias = 1};

    (void)state;
    srand(1);
    for (int trial = 0; trial < 300; trial++) {
        long long size = 1000;
        for (int q = 0; q <= 100; q++) {
            sizes.size[q] = size;
            size += rand() % 3 ? rand() % 50 : rand() % 5000;
        }
        sizes.bias = 0.5 + rand() % 100 / 100.0;
        long long target = 900 + rand() % 100000;
        int quality = search(&sizes, target, trial % 2), found = search(&sizes, target, trial % 2);
        assert_int_equal(quality, found);
        assert_true(quality >= 0 || sizes.size[0] > target);
        assert_true(sizes.measured <= 12);
    }
}

static void the_ends_of_the_scale_are_ends(void **state)
{
    struct sizes sizes;

    (void)state;
    codec_like(&sizes, 1.02);
    for (int with = 0; with < 2; with++) {
        assert_int_equal(search(&sizes, 30000, with), -1);
        assert_in_range(sizes.measured, 1, 3);
        assert_int_equal(search(&sizes, 100000000, with), 100);
        assert_in_range(sizes.measured, 1, 2);
        assert_int_equal(search(&sizes, sizes.size[0], with), 0);
    }
}

static int refuse(void *context, int quality, long long *size, struct lumi_error *error)
{
    (void)context;
    (void)size;
    return lumi_fail(error, LUMI_ERR_NOSPACE, "quality %d", quality);
}

static void a_coding_that_fails_ends_the_search(void **state)
{
    struct lumi_error error = {0};
    struct sizes sizes;
    int quality;

    (void)state;
    codec_like(&sizes, 1);
    assert_int_equal(compress_size_search(50000, NULL, refuse, &sizes, &quality, &error), LUMI_ERR_NOSPACE);
    assert_string_equal(error.text, "quality 70");
    assert_int_equal(compress_size_search(50000, refuse, measure, &sizes, &quality, &error), LUMI_ERR_NOSPACE);
    assert_int_equal(sizes.measured, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_estimate_leaves_a_coding_or_two),
        cmocka_unit_test(without_an_estimate_a_handful_of_codings_find_it),
        cmocka_unit_test(no_size_is_met_from_above_whatever_the_sizes_are),
        cmocka_unit_test(the_ends_of_the_scale_are_ends),
        cmocka_unit_test(a_coding_that_fails_ends_the_search),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
