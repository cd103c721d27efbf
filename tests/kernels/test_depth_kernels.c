/* The matching kernels of this processor against plain C, bit for bit: the arithmetic is the same, operation by
 * operation. Usage: test_depth_kernels [SEED] [--bench] */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

enum { PLANES = 96, GUARD = 32, ROUNDS = 4000 };

static uint64_t seed = 1;

static uint32_t random_bits(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(seed >> 32);
}

static float random_between(float low, float high)
{
    return low + (high - low) * (float)(random_bits() >> 8) / 16777216.0f;
}

static void build_axis(struct mvs_axis *axis, bool linear, int size)
{
    *axis = (struct mvs_axis){.origin = -1, .scale = MVS_AXIS_CELLS / 2.0f, .linear = linear};
    for (int i = 0; i < MVS_AXIS_CELLS; i++) {
        axis->b[i] = 0.4f * (float)size * (1 + 0.1f * (float)i / MVS_AXIS_CELLS);
        axis->a[i] = 0.5f * (float)size;
    }
}

/* Shifts so large that some planes lie behind the neighbour or outside its image. */
static void build_target(struct mvs_target *target, bool linear)
{
    target->width = 61;
    target->height = 47;
    target->pixels = lumi_alloc((size_t)target->width * (size_t)target->height, sizeof(uint32_t));
    assert_non_null(target->pixels);
    for (int i = 0; i < target->width * target->height; i++)
        target->pixels[i] = random_bits();
    build_axis(&target->x, linear, target->width);
    build_axis(&target->y, linear, target->height);
    for (int i = 0; i < 3; i++)
        target->shift[i] = random_between(-0.5f, 0.5f);
    mvs_target_planes(target, PLANES, 0, 4.0f / PLANES);
}

static void check_sweep(bool linear)
{
    const struct mvs_kernels *mine = mvs_kernels();
    struct mvs_target *target = lumi_calloc(1, sizeof(*target));
    int inside = 0, outside = 0;

    assert_non_null(target);
    for (int round = 0; round < ROUNDS; round++) {
        uint8_t expected[PLANES + GUARD], got[PLANES + GUARD];
        if (round % 100 == 0) {
            lumi_free(target->pixels);
            build_target(target, linear);
        }
        const float ray[3] = {random_between(-1, 1), random_between(-1, 1), random_between(-0.2f, 1)};
        const uint32_t colour = random_bits() & (round & 1 ? 0xffffffff : 0x3f3f3f3f);
        memset(expected, 77, sizeof(expected));
        memset(got, 77, sizeof(got));
        mvs_kernels_c.sweep(target, ray, colour, PLANES, expected);
        mine->sweep(target, ray, colour, PLANES, got);
        assert_memory_equal(expected, got, sizeof(got));
        for (int k = 0; k < PLANES; k++) {
            inside += got[k] != MVS_INVALID;
            outside += got[k] == MVS_INVALID;
        }
    }
    assert_true(inside > ROUNDS && outside > ROUNDS);
    lumi_free(target->pixels);
    lumi_free(target);
}

static void sweeping_a_pinhole_gives_the_numbers_of_plain_c(void **state)
{
    (void)state;
    check_sweep(true);
}

static void sweeping_a_tabled_lens_gives_the_numbers_of_plain_c(void **state)
{
    (void)state;
    check_sweep(false);
}

static void a_step_of_a_path_gives_the_numbers_of_plain_c(void **state)
{
    const struct mvs_kernels *mine = mvs_kernels();

    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        int16_t before[2][PLANES + GUARD], path[2][PLANES + GUARD];
        uint16_t sum[2][PLANES + GUARD];
        uint8_t cost[PLANES];
        int lowest = INT16_MAX;
        for (int k = 0; k < PLANES + GUARD; k++) {
            before[0][k] = before[1][k] = (int16_t)(random_bits() % 250);
            path[0][k] = path[1][k] = 7;
            sum[0][k] = sum[1][k] = (uint16_t)(random_bits() % 1500);
        }
        for (int k = 0; k < PLANES; k++) {
            cost[k] = (uint8_t)(random_bits() % (MVS_COST_MAX + 1));
            lowest = before[0][GUARD / 2 + k] < lowest ? before[0][GUARD / 2 + k] : lowest;
        }
        const int p1 = (int)(random_bits() % 10), p2 = p1 + (int)(random_bits() % 90);
        int expected = mvs_kernels_c.path(cost, before[0] + GUARD / 2, lowest, p1, p2, PLANES, path[0], sum[0]);
        int got = mine->path(cost, before[1] + GUARD / 2, lowest, p1, p2, PLANES, path[1], sum[1]);
        assert_int_equal(expected, got);
        assert_memory_equal(path[0], path[1], sizeof(path[0]));
        assert_memory_equal(sum[0], sum[1], sizeof(sum[0]));
    }
}

static void combining_neighbours_gives_the_numbers_of_plain_c(void **state)
{
    const struct mvs_kernels *mine = mvs_kernels();
    bool seen[256] = {false};

    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        uint8_t cost[2][LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], result[2][PLANES + GUARD];
        const int invalid = (int)(random_bits() % 9), best = 1 + (int)(random_bits() % 4);
        memset(result, 77, sizeof(result));
        for (int n = 0; n < LUMI_MVS_NEIGHBOURS; n++)
            for (int k = 0; k < PLANES; k++)
                cost[0][n][k] = cost[1][n][k] =
                    (int)(random_bits() % 8) < invalid ? MVS_INVALID : (uint8_t)(random_bits() % (MVS_COST_MAX + 1));
        mvs_kernels_c.combine(cost[0], best, PLANES, result[0]);
        mine->combine(cost[1], best, PLANES, result[1]);
        assert_memory_equal(result[0], result[1], sizeof(result[0]));
        for (int k = 0; k < PLANES; k++) {
            assert_true(result[0][k] <= MVS_COST_MAX);
            seen[result[0][k]] = true;
        }
    }
    assert_true(seen[0] && seen[MVS_COST_MAX]);
}

static double seconds(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* The fastest of many runs, nanoseconds a plane. */
static double time_sweep(const struct mvs_kernels *kernels, const struct mvs_target *target)
{
    const float ray[3] = {0.1f, -0.1f, 1};
    uint8_t cost[PLANES];
    double best = 1;

    for (int run = 0; run < 50; run++) {
        double start = seconds();
        for (int i = 0; i < 1000; i++)
            kernels->sweep(target, ray, (uint32_t)i, PLANES, cost);
        double time = (seconds() - start) / (1000.0 * PLANES);
        best = time < best ? time : best;
    }
    return best * 1e9;
}

static int bench(void)
{
    struct mvs_target *target = lumi_calloc(1, sizeof(*target));

    for (int linear = 0; linear < 2; linear++) {
        build_target(target, linear);
        double c = time_sweep(&mvs_kernels_c, target), mine = time_sweep(mvs_kernels(), target);
        printf("sweep, %s: C %.2f ns a plane, this processor %.2f ns, ratio %.1f\n", linear ? "pinhole" : "tabled lens",
               c, mine, c / mine);
        lumi_free(target->pixels);
    }
    lumi_free(target);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sweeping_a_pinhole_gives_the_numbers_of_plain_c),
        cmocka_unit_test(sweeping_a_tabled_lens_gives_the_numbers_of_plain_c),
        cmocka_unit_test(combining_neighbours_gives_the_numbers_of_plain_c),
        cmocka_unit_test(a_step_of_a_path_gives_the_numbers_of_plain_c),
    };

    if (argc > 1 && strtoull(argv[1], NULL, 10))
        seed = strtoull(argv[1], NULL, 10);
    if (argc > 1 && !strcmp(argv[argc - 1], "--bench"))
        return bench();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
