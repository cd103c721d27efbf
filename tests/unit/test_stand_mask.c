/* The stand found by its depth: a column over a floor, seen from beside it, looking down. */
#include "pipeline/synthesize/stand_mask.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 128, HEIGHT = 96 };
#define FLOOR (-1.2)

struct scene {
    struct lumi_grid grid;
    struct lumi_pose pose;
    struct lumi_raster depth;
    uint8_t column[WIDTH * HEIGHT]; /* truth */
    struct lumi_stand stand;
};

/* A column of `radius` about the axis from the floor to z = −0.45. */
static void look_down(struct scene *scene, double radius)
{
    lumi_pose_look(lumi_vec3(0.3, 0, -0.4), lumi_vec3(-0.25, 0, -1), lumi_vec3(0, 0, 1), &scene->pose);
    assert_true(lumi_grid_init_pinhole(&scene->grid, WIDTH, HEIGHT, 90, 90, WIDTH / 2.0, HEIGHT / 2.0));
    assert_int_equal(lumi_raster_create(&scene->depth, WIDTH, HEIGHT, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double tan_x, tan_y, t;
            lumi_grid_unproject(&scene->grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            const struct lumi_vec3 d = lumi_rotate(scene->pose.r, lumi_vec3(tan_x, tan_y, 1)), o = scene->pose.t;
            const double a = d.x * d.x + d.y * d.y, b = o.x * d.x + o.y * d.y,
                         c = o.x * o.x + o.y * o.y - radius * radius;
            const double root = b * b - a * c;
            t = (FLOOR - o.z) / d.z;
            scene->column[y * WIDTH + x] = 0;
            if (root >= 0 && -b - sqrt(root) > 0) {
                const double hit = (-b - sqrt(root)) / a, z = o.z + hit * d.z;
                if (hit < t && z < -0.45) {
                    t = hit;
                    scene->column[y * WIDTH + x] = z > FLOOR + 0.025;
                }
            }
            lumi_row_f32(&scene->depth, y)[x] = (float)(1 / t);
        }
    assert_true(lumi_stand_place(lumi_vec3(0, 0, 0), 0.4, 0.15, 0.5, FLOOR, &scene->stand));
}

static void the_floor_is_found_at_its_height(void **state)
{
    struct scene scene;
    struct lumi_floor *floor = malloc(sizeof *floor);
    double height;

    (void)state;
    look_down(&scene, 0.05);
    lumi_floor_init(floor, -0.4);
    assert_false(lumi_floor_find(floor, &height)); /* nothing seen so far */
    lumi_floor_add(floor, &scene.grid, &scene.pose, &scene.depth, lumi_vec3(0, 0, 0), 2);
    assert_true(lumi_floor_find(floor, &height));
    assert_float_equal(height, FLOOR, 0.01);
    for (int i = 0; i < LUMI_FLOOR_BINS; i++) /* a slope has no height */
        floor->area[i] = 1;
    assert_false(lumi_floor_find(floor, &height));
    lumi_raster_finish(&scene.depth);
    free(floor);
}

static void the_column_is_masked_and_the_floor_is_not(void **state)
{
    struct scene scene;
    uint8_t blocked[WIDTH * HEIGHT] = {0};

    (void)state;
    look_down(&scene, 0.05);
    assert_true(lumi_stand_mask(&scene.stand, &scene.grid, &scene.pose, &scene.depth, blocked) > 300);
    assert_memory_equal(blocked, scene.column, sizeof blocked);
    assert_true(lumi_stand_share(&scene.stand, &scene.grid, &scene.pose, &scene.depth) > 0.002);
    lumi_raster_finish(&scene.depth);
}

static void what_is_too_near_to_be_matched_is_blocked_whatever_its_depth(void **state)
{
    struct scene scene;
    uint8_t blocked[WIDTH * HEIGHT] = {0};
    int at_the_head;

    (void)state;
    look_down(&scene, 1e-6); /* depth sees the floor alone */
    assert_true(lumi_stand_place(lumi_vec3(0, 0, 0), 0.4, 0.7, 0.5, FLOOR, &scene.stand));
    lumi_stand_mask(&scene.stand, &scene.grid, &scene.pose, &scene.depth, blocked);
    at_the_head = blocked[(HEIGHT - 2) * WIDTH + WIDTH / 2] + blocked[WIDTH + WIDTH / 2];
    assert_int_equal(at_the_head, 1); /* towards the axis, not away from it */
    lumi_raster_finish(&scene.depth);
}

/* The head, 4 cm below the lowest cameras and wider than the circle they go round: its picture is matched to anything.
 */
static void what_seems_to_lie_below_the_floor_is_a_head_that_is_too_near(void **state)
{
    const int axis = HEIGHT / 2 * WIDTH + WIDTH / 2;
    struct scene scene;
    uint8_t blocked[WIDTH * HEIGHT] = {0};

    (void)state;
    look_down(&scene, 1e-6);
    lumi_pose_look(lumi_vec3(0.059, 0, -0.294), lumi_vec3(0, 0, -1), lumi_vec3(1, 0, 0), &scene.pose);
    assert_true(lumi_stand_place(lumi_vec3(0, 0, 0), 0.3, 0.2, 0.5, FLOOR, &scene.stand));
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        lumi_row_f32(&scene.depth, i / WIDTH)[i % WIDTH] = (float)(1 / (-0.294 - FLOOR)); /* the floor */
    assert_true(lumi_stand_share(&scene.stand, &scene.grid, &scene.pose, &scene.depth) == 0);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        lumi_row_f32(&scene.depth, i / WIDTH)[i % WIDTH] *= 0.5f;
    assert_true(lumi_stand_share(&scene.stand, &scene.grid, &scene.pose, &scene.depth) > 0.1);
    lumi_stand_mask(&scene.stand, &scene.grid, &scene.pose, &scene.depth, blocked);
    assert_int_equal(blocked[axis], 1);
    lumi_raster_finish(&scene.depth);
}

static void without_a_column_there_is_no_stand(void **state)
{
    struct scene scene;
    uint8_t blocked[WIDTH * HEIGHT] = {0};

    (void)state;
    look_down(&scene, 1e-6);
    assert_int_equal(lumi_stand_mask(&scene.stand, &scene.grid, &scene.pose, &scene.depth, blocked), 0);
    assert_true(lumi_stand_share(&scene.stand, &scene.grid, &scene.pose, &scene.depth) == 0);
    lumi_raster_finish(&scene.depth);
}

static void a_mask_widens_by_so_many_pixels_to_all_sides(void **state)
{
    uint8_t blocked[9 * 7] = {0};

    (void)state;
    blocked[3 * 9 + 4] = 1;
    assert_int_equal(lumi_mask_widen(blocked, 9, 7, 2), LUMI_OK);
    for (int y = 0; y < 7; y++)
        for (int x = 0; x < 9; x++)
            assert_int_equal(blocked[9 * y + x], abs(x - 4) <= 2 && abs(y - 3) <= 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_floor_is_found_at_its_height),
        cmocka_unit_test(the_column_is_masked_and_the_floor_is_not),
        cmocka_unit_test(what_is_too_near_to_be_matched_is_blocked_whatever_its_depth),
        cmocka_unit_test(what_seems_to_lie_below_the_floor_is_a_head_that_is_too_near),
        cmocka_unit_test(without_a_column_there_is_no_stand),
        cmocka_unit_test(a_mask_widens_by_so_many_pixels_to_all_sides),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
