/* The casting kernels of this processor against plain C, bit for bit. Usage: test_cast_kernels [SEED] */
#include "render/cpu/dense_cast_priv.h"

#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 61, HEIGHT = 47, ROUNDS = 3000 };

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

static struct cast_view view;
static struct cast_axis axes[2];
static struct lumi_raster depth;

/* Tangents −1 to 1 over the image, a kink in the middle. */
static void build_axis(struct cast_axis *axis, int size)
{
    *axis = (struct cast_axis){.origin = -1, .scale = CAST_AXIS_CELLS / 2.0f};
    for (int i = 0; i < CAST_AXIS_CELLS; i++) {
        axis->slope[i] = 0.5f * (float)size * (i < CAST_AXIS_CELLS / 2 ? 0.9f : 1.1f);
        axis->offset[i] = 0.5f * (float)size;
    }
}

static int build_view(void **state)
{
    (void)state;
    assert_int_equal(lumi_raster_create(&view.pixels, WIDTH, HEIGHT, 3, LUMI_F32), LUMI_OK);
    assert_int_equal(lumi_raster_create(&depth, WIDTH, HEIGHT, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            lumi_row_f32(&depth, y)[x] = random_bits() % 3 ? 0.5f : random_between(0, 3);
            for (int c = 0; c < 3; c++)
                lumi_row_f32(&view.pixels, y)[3 * x + c] = random_between(0, 2);
        }
    build_axis(&axes[0], WIDTH);
    build_axis(&axes[1], HEIGHT);
    view.depth = depth.data;
    view.pitch = (int)(depth.stride / sizeof(float));
    view.width = WIDTH;
    view.height = HEIGHT;
    view.x = &axes[0];
    view.y = &axes[1];
    return 0;
}

static int free_view(void **state)
{
    (void)state;
    lumi_raster_finish(&view.pixels);
    lumi_raster_finish(&depth);
    return 0;
}

/* Rays through the disk, beside it, behind the view, and none. */
static void build_rays(float d[3][LUMI_CELL_PIXELS])
{
    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        for (int c = 0; c < 3; c++)
            d[c][i] = random_between(-1, 1);
        d[2][i] = random_bits() % 8 ? fabsf(d[2][i]) + 0.2f : d[2][i];
        if (random_bits() % 16 == 0)
            d[0][i] = d[1][i] = d[2][i] = 0;
    }
}

static void crossing_a_disk_is_the_same_to_the_bit(void **state)
{
    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        const struct lumi_view of = {.disk = {0.1f, 0.2f, 0.15f, 0.12f}};
        struct lumi_surface_view place = {.view = &of};
        const struct cast_disk disk = {.shape = (enum lumi_disk_shape)(random_bits() % 2),
                                       .kernel = (enum lumi_disk_kernel)(random_bits() % 3),
                                       .scale = random_between(0.5f, 2)};
        struct cast_cell a, b;
        struct cast_reach ra, rb;
        float d[3][LUMI_CELL_PIXELS];
        memset(&a, 0, sizeof a);
        memset(&b, 0, sizeof b);
        for (int i = 0; i < 9; i++)
            place.rt[i] = (i % 4 == 0 ? 1 : 0) + random_between(-0.1f, 0.1f);
        place.ex = random_between(-0.1f, 0.1f);
        place.ey = random_between(-0.1f, 0.1f);
        place.ez = random_between(-0.1f, 0.1f);
        build_rays(d);
        const bool any = cast_kernels_c.cross(&place, &disk, d[0], d[1], d[2], &a, &ra);
        assert_int_equal(cast_kernels()->cross(&place, &disk, d[0], d[1], d[2], &b, &rb), any);
        assert_memory_equal(&a, &b, sizeof a);
        if (any)
            assert_memory_equal(&ra, &rb, sizeof ra);
    }
}

static void build_lines(struct cast_lines *lines, int size)
{
    *lines = (struct cast_lines){.hold = random_bits() % 2,
                                 .border = random_between(-0.5f, 0.5f),
                                 .offset = {0.5f * (float)size, 0.5f * (float)size},
                                 .slope = {0.45f * (float)size, 0.55f * (float)size}};
}

/* Some without weight, some beyond the image. */
static void build_cell(struct cast_cell *cell)
{
    memset(cell, 0, sizeof *cell);
    for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
        cell->ax[i] = random_between(-1.2f, 1.2f);
        cell->ay[i] = random_between(-1.2f, 1.2f);
        cell->u[i] = random_between(-0.2f, 0.2f);
        cell->v[i] = random_between(-0.2f, 0.2f);
        cell->weight[i] = random_bits() % 4 ? random_between(0, 1) : 0;
    }
}

static void meeting_depth_and_shading_are_the_same_to_the_bit(void **state)
{
    (void)state;
    for (int round = 0; round < ROUNDS; round++) {
        struct cast_search search = {.lo = random_between(0, 1), .looks = 1 + (int)(random_bits() % 2)};
        const float stretch = random_bits() % 4 ? random_between(0, 5) : 0;
        const enum lumi_filter filter = random_bits() % 8 ? LUMI_FILTER_CUBIC : LUMI_FILTER_BILINEAR;
        float sums[2][4][LUMI_CELL_PIXELS] = {{{0}}};
        struct cast_cell a, b;
        search.hi = search.lo + random_between(0, 2);
        search.steps = (int)(random_bits() % 20);
        build_lines(&search.x, WIDTH);
        build_lines(&search.y, HEIGHT);
        build_cell(&a);
        b = a;
        cast_kernels_c.meet(&view, &search, stretch, &a);
        cast_kernels()->meet(&view, &search, stretch, &b);
        for (int i = 0; i < LUMI_CELL_PIXELS; i++) {
            assert_memory_equal(&a.weight[i], &b.weight[i], sizeof(float));
            if (!(a.weight[i] > 0))
                continue;
            assert_memory_equal(&a.w[i], &b.w[i], sizeof(float));
            assert_memory_equal(&a.px[i], &b.px[i], sizeof(float));
            assert_memory_equal(&a.py[i], &b.py[i], sizeof(float));
        }
        for (int k = 0; k < 2; k++) {
            struct lumi_sums to = {sums[k][0], sums[k][1], sums[k][2], sums[k][3], NULL};
            (k ? cast_kernels() : &cast_kernels_c)->shade(&view, filter, &a, &to, 0);
        }
        assert_memory_equal(sums[0], sums[1], sizeof sums[0]);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crossing_a_disk_is_the_same_to_the_bit),
        cmocka_unit_test(meeting_depth_and_shading_are_the_same_to_the_bit),
    };

    if (argc > 1)
        seed = strtoull(argv[1], NULL, 10);
    return cmocka_run_group_tests(tests, build_view, free_view);
}
