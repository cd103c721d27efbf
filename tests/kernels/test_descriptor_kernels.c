/* The distances of descriptors of this processor against plain C. Usage: test_descriptor_kernels [--bench] */
#include "pipeline/calibrate/descriptor.h"
#include "pipeline/calibrate/features.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

enum { ROUNDS = 20000 };

static uint64_t state = 1;

static uint8_t random_byte(int most)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint8_t)((state >> 40) % (unsigned)(most + 1));
}

static void the_variant_of_this_processor_gives_the_numbers_of_plain_c(void **unused)
{
    uint8_t a[LUMI_DESCRIPTOR_SIZE + 1], b[LUMI_DESCRIPTOR_SIZE + 1];

    (void)unused;
    for (int round = 0; round < ROUNDS; round++) {
        const int most = round % 3 == 0 ? 255 : 40, shift = round & 1; /* unaligned too */
        for (int i = 0; i <= LUMI_DESCRIPTOR_SIZE; i++) {
            a[i] = random_byte(most);
            b[i] = random_byte(most);
        }
        assert_int_equal(lumi_descriptor_distance()(a + shift, b), lumi_descriptor_distance_c(a + shift, b));
    }
}

static void the_largest_difference_does_not_overflow(void **unused)
{
    uint8_t a[LUMI_DESCRIPTOR_SIZE], b[LUMI_DESCRIPTOR_SIZE];

    (void)unused;
    memset(a, 255, sizeof a);
    memset(b, 0, sizeof b);
    assert_int_equal(lumi_descriptor_distance_c(a, b), LUMI_DESCRIPTOR_SIZE * 255 * 255);
    assert_int_equal(lumi_descriptor_distance()(a, b), LUMI_DESCRIPTOR_SIZE * 255 * 255);
    assert_int_equal(lumi_descriptor_distance()(b, a), LUMI_DESCRIPTOR_SIZE * 255 * 255);
}

static void measure(const char *name, lumi_descriptor_fn distance)
{
    static uint8_t items[256][LUMI_DESCRIPTOR_SIZE];
    struct timespec begin, end;
    uint32_t sum = 0;

    for (int i = 0; i < 256 * LUMI_DESCRIPTOR_SIZE; i++)
        items[i / LUMI_DESCRIPTOR_SIZE][i % LUMI_DESCRIPTOR_SIZE] = random_byte(255);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    for (int i = 0; i < 20000000; i++)
        sum += distance(items[i & 255], items[i >> 8 & 255]);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    printf("%s: %.1f ns (%u)\n", name,
           ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) / 20e6, sum);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_variant_of_this_processor_gives_the_numbers_of_plain_c),
        cmocka_unit_test(the_largest_difference_does_not_overflow),
    };

    if (argc > 1 && !strcmp(argv[1], "--bench")) {
        measure("plain C", lumi_descriptor_distance_c);
        measure("this processor's", lumi_descriptor_distance());
        return 0;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
