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
}

/* Every group, or two runs of them with a gap between. */
static void build_ends(struct mvs_ends *ends, const struct mvs_target *target, bool gap)
{
    *ends = (struct mvs_ends){.groups = PLANES / MVS_GROUP};
    ends->column = (struct mvs_line){random_bits() & 1, 0.5f * (float)target->width, 0.4f * (float)target->width};
    ends->row = (struct mvs_line){random_bits() & 1, 0.5f * (float)target->height, 0.4f * (float)target->height};
    for (int i = 0; i < ends->groups; i++) {
        ends->end[i] = (uint8_t)(i + (gap && i > 3));
        ends->count = ends->end[i] + 2;
    }
    ends->count = (ends->count + 7) / 8 * 8;
    for (int e = 0; e < ends->count; e++) {
        float w = (float)e * 4.0f / PLANES * MVS_GROUP;
        ends->x[e] = w * target->shift[0];
        ends->y[e] = w * target->shift[1];
        ends->z[e] = w * target->shift[2];
    }
}

static void check_sweep(bool linear)
{
    const struct mvs_kernels *mine = mvs_kernels();
    struct mvs_target *target = lumi_calloc(1, sizeof(*target));
    struct mvs_ends ends = {0};
    int inside = 0, outside = 0;

    assert_non_null(target);
    for (int round = 0; round < ROUNDS; round++) {
        uint8_t expected[PLANES + GUARD], got[PLANES + GUARD];
        if (round % 100 == 0) {
            lumi_free(target->pixels);
            build_target(target, linear);
            build_ends(&ends, target, round % 200 == 0);
        }
        const float ray[3] = {random_between(-1, 1), random_between(-1, 1), random_between(-0.2f, 1)};
        const uint32_t colour = random_bits() & (round & 1 ? 0xffffffff : 0x3f3f3f3f);
        memset(expected, 77, sizeof(expected));
        memset(got, 77, sizeof(got));
        mvs_kernels_c.sweep(target, &ends, ray, colour, expected);
        mine->sweep(target, &ends, ray, colour, got);
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

/* What one variant of a step reads and writes. */
struct step_data {
    uint8_t before[MVS_PATHS][PLANES + GUARD], path[MVS_PATHS][PLANES + GUARD];
    uint16_t sum[PLANES + GUARD];
    struct mvs_step step;
};

static void point_step(struct step_data *data, const uint8_t *cost, const uint8_t *below, const uint8_t *above)
{
    data->step.lanes = PLANES;
    data->step.cost = cost;
    data->step.below = below;
    data->step.above = above;
    data->step.sum = data->sum;
    for (int d = 0; d < MVS_PATHS; d++) {
        data->step.previous[d] = data->before[d] + GUARD / 2;
        data->step.path[d] = data->path[d];
    }
}

/* Costs and paths as they come about: a path is at most a cost and a jump, or 255 where its pixel had no such plane. */
static void build_step(struct step_data *data, uint8_t *cost, uint8_t *below, uint8_t *above)
{
    memset(data, 0, sizeof(*data));
    for (int k = 0; k < PLANES; k++) {
        cost[k] = (uint8_t)(random_bits() % (MVS_COST_MAX + 1));
        below[k] = random_bits() % 8 ? 4 : 255;
        above[k] = random_bits() % 8 ? 4 : 255;
    }
    for (int k = 0; k < PLANES + GUARD; k++)
        data->sum[k] = (uint16_t)(random_bits() % 1000);
    for (int d = 0; d < MVS_PATHS; d++) {
        const bool begins = random_bits() % 8 == 0;
        int lowest = 255;
        for (int k = 0; k < PLANES + GUARD; k++) {
            data->before[d][k] = (uint8_t)(begins || random_bits() % 4 == 0 ? 255 : random_bits() % 181);
            if (k >= GUARD / 2 && k < GUARD / 2 + PLANES && data->before[d][k] < lowest)
                lowest = data->before[d][k];
        }
        data->step.lowest[d] = begins ? 0 : lowest;
        data->step.p2[d] = begins ? 0 : 12 + (int)(random_bits() % 49);
    }
    data->step.add = random_bits() & 1;
    point_step(data, cost, below, above);
}

static void a_step_of_the_paths_gives_the_numbers_of_plain_c(void **state)
{
    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        struct step_data expected, got;
        uint8_t cost[PLANES], below[PLANES], above[PLANES];
        build_step(&expected, cost, below, above);
        got = expected;
        point_step(&got, cost, below, above);
        mvs_kernels_c.step(&expected.step);
        mvs_kernels()->step(&got.step);
        assert_memory_equal(expected.path, got.path, sizeof(got.path));
        assert_memory_equal(expected.sum, got.sum, sizeof(got.sum));
        assert_memory_equal(expected.step.lowest, got.step.lowest, sizeof(got.step.lowest));
    }
}

static void the_smallest_sum_is_the_one_plain_c_finds(void **state)
{
    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        uint16_t sum[PLANES];
        const uint32_t different = 1 + random_bits() % (round & 1 ? 2000 : 4);
        for (int k = 0; k < PLANES; k++)
            sum[k] = (uint16_t)(random_bits() % different + (round % 3 == 0 ? 63000 : 0));
        assert_int_equal(mvs_kernels_c.smallest(sum, PLANES), mvs_kernels()->smallest(sum, PLANES));
    }
}

static void combining_neighbours_gives_the_numbers_of_plain_c(void **state)
{
    const struct mvs_kernels *mine = mvs_kernels();
    bool seen[256] = {false};

    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], result[2][PLANES + GUARD];
        const int invalid = (int)(random_bits() % 9), best = 1 + (int)(random_bits() % 4);
        memset(result, 77, sizeof(result));
        for (int n = 0; n < LUMI_MVS_NEIGHBOURS; n++)
            for (int k = 0; k < PLANES; k++)
                cost[n][k] =
                    (int)(random_bits() % 8) < invalid ? MVS_INVALID : (uint8_t)(random_bits() % (MVS_COST_MAX + 1));
        mvs_kernels_c.combine(cost, best, PLANES, result[0]);
        mine->combine(cost, best, PLANES, result[1]);
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
static double time_sweep(const struct mvs_kernels *kernels, const struct mvs_target *target,
                         const struct mvs_ends *ends)
{
    const float ray[3] = {0.1f, -0.1f, 3};
    uint8_t cost[PLANES];
    double best = 1;

    for (int run = 0; run < 50; run++) {
        double start = seconds();
        for (int i = 0; i < 1000; i++)
            kernels->sweep(target, ends, ray, (uint32_t)i, cost);
        double time = (seconds() - start) / (1000.0 * PLANES);
        best = time < best ? time : best;
    }
    return best * 1e9;
}

static int bench(void)
{
    struct mvs_target *target = lumi_calloc(1, sizeof(*target));
    struct mvs_ends ends;

    for (int linear = 0; linear < 2; linear++) {
        build_target(target, linear);
        build_ends(&ends, target, false);
        double c = time_sweep(&mvs_kernels_c, target, &ends), mine = time_sweep(mvs_kernels(), target, &ends);
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
        cmocka_unit_test(a_step_of_the_paths_gives_the_numbers_of_plain_c),
        cmocka_unit_test(the_smallest_sum_is_the_one_plain_c_finds),
    };

    if (argc > 1 && strtoull(argv[1], NULL, 10))
        seed = strtoull(argv[1], NULL, 10);
    if (argc > 1 && !strcmp(argv[argc - 1], "--bench"))
        return bench();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
