/* render/cpu: rays of the caller's own. */
#include "render/cpu/ray_renderer.h"

#include "tests/unit/analytic_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct scene_set room;

/* A lens's rays by themselves, block by block, but only every third of them. */
static void take_blocks(const struct lumi_rays *rays, struct lumi_rays *table)
{
    const int blocks = rays->block_cols * rays->block_rows;

    assert_int_equal(lumi_rays_init_blocks(table, (blocks + 2) / 3, NULL), LUMI_OK);
    for (int b = 0; b < blocks; b += 3) {
        const size_t from = (size_t)b * LUMI_BLOCK_PIXELS, to = (size_t)(b / 3) * LUMI_BLOCK_PIXELS;
        memcpy(table->x + to, rays->x + from, LUMI_BLOCK_PIXELS * sizeof(float));
        memcpy(table->y + to, rays->y + from, LUMI_BLOCK_PIXELS * sizeof(float));
        memcpy(table->z + to, rays->z + from, LUMI_BLOCK_PIXELS * sizeof(float));
        lumi_rays_bound(table, b / 3);
    }
}

static void a_table_of_a_lens_own_rays_gives_its_picture_to_the_byte(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_picture picture;
    struct lumi_rays rays, table;
    struct lumi_sums sums;
    struct lumi_pose pose;
    struct lumi_lens lens;

    (void)state;
    lumi_lens_init_pinhole(&lens, 200, 150, 1.3);
    lumi_pose_look(lumi_vec3(0.1, -0.05, 0.08), lumi_vec3(-0.3, 1, 0.2), lumi_vec3(0, 0, 1), &pose);
    lumi_disk_settings_default(&settings);
    settings.linear_light = true;
    settings.sample = LUMI_F32;
    assert_int_equal(lumi_render_disks(room.set, &lens, &pose, &settings, &picture, NULL), LUMI_OK);
    assert_int_equal(lumi_rays_init(&rays, &lens, &pose, 1, NULL), LUMI_OK);
    take_blocks(&rays, &table);
    assert_int_equal(lumi_sums_create(&sums, table.pixels, NULL), LUMI_OK);
    assert_int_equal(lumi_render_rays(room.set, &table, pose.t, &settings, &sums, NULL), LUMI_OK);
    long compared = 0;
    for (int y = 0; y < lens.height; y++)
        for (int x = 0; x < lens.width; x++) {
            const size_t at = lumi_rays_at(&rays, x, y), block = at / LUMI_BLOCK_PIXELS;
            if (block % 3)
                continue;
            const size_t i = block / 3 * LUMI_BLOCK_PIXELS + at % LUMI_BLOCK_PIXELS;
            const float *color = lumi_row_f32(&picture.color, y) + 3 * (size_t)x;
            const float mine[4] = {sums.r[i] / sums.weight[i], sums.g[i] / sums.weight[i], sums.b[i] / sums.weight[i],
                                   sums.nearness[i] / sums.weight[i]};
            assert_memory_equal(mine, color, 3 * sizeof(float));
            assert_memory_equal(&sums.weight[i], lumi_row_f32(&picture.weight, y) + x, sizeof(float));
            assert_memory_equal(&mine[3], lumi_row_f32(&picture.inverse_distance, y) + x, sizeof(float));
            compared++;
        }
    assert_true(compared > 9000);
    lumi_sums_finish(&sums);
    lumi_rays_finish(&table);
    lumi_rays_finish(&rays);
    lumi_picture_finish(&picture);
}

static void a_ray_without_a_direction_sees_nothing(void **state)
{
    struct lumi_rays table;
    struct lumi_sums sums;

    (void)state;
    assert_int_equal(lumi_rays_init_blocks(&table, 2, NULL), LUMI_OK);
    for (int i = 0; i < LUMI_BLOCK_PIXELS; i++) /* the first block has none, the second is one ray and none */
        table.x[LUMI_BLOCK_PIXELS + i] = i == 77;
    lumi_rays_bound(&table, 1);
    assert_int_equal(lumi_sums_create(&sums, table.pixels, NULL), LUMI_OK);
    assert_int_equal(lumi_render_rays(room.set, &table, lumi_vec3(0, 0, 0), NULL, &sums, NULL), LUMI_OK);
    for (int i = 0; i < 2 * LUMI_BLOCK_PIXELS; i++)
        assert_int_equal(sums.weight[i] > 0, i == LUMI_BLOCK_PIXELS + 77);
    assert_int_equal(lumi_rays_init_blocks(&(struct lumi_rays){0}, 0, NULL), LUMI_ERR_ARG);
    lumi_sums_finish(&sums);
    lumi_rays_finish(&table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_of_a_lens_own_rays_gives_its_picture_to_the_byte),
        cmocka_unit_test(a_ray_without_a_direction_sees_nothing),
    };

    if (scene_open(&room, SCENE_ROOM, true) != LUMI_OK)
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    scene_close(&room);
    return failed;
}
