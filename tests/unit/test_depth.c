/* Multi-view stereo on a scene that is known in closed form: a textured square before a textured wall. */
#include "pipeline/depth/mvs.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { VIEWS = 9, CENTRE = 4 };

#define WALL 3.0    /* z of the wall in the world */
#define SQUARE 1.5  /* z of the square */
#define HALF 0.3    /* half of its side */
#define SPACING 0.1 /* between cameras */

struct scene {
    struct lumi_grid grid;
    struct lumi_pose poses[VIEWS];
    struct lumi_mvs_view views[VIEWS];
    struct lumi_raster images[VIEWS], maps[VIEWS];
};

static double hash(int x, int y, int seed)
{
    unsigned h = (unsigned)x * 374761393u + (unsigned)y * 668265263u + (unsigned)seed * 2246822519u;

    h = (h ^ h >> 13) * 1274126177u;
    return (double)((h ^ h >> 16) & 0xffff) / 65535;
}

static double noise(double x, double y, int seed)
{
    int i = (int)floor(x), j = (int)floor(y);
    double u = x - i, v = y - j;

    u = u * u * (3 - 2 * u);
    v = v * v * (3 - 2 * v);
    return (1 - v) * ((1 - u) * hash(i, j, seed) + u * hash(i + 1, j, seed)) +
           v * ((1 - u) * hash(i, j + 1, seed) + u * hash(i + 1, j + 1, seed));
}

static double texture(double x, double y, int seed)
{
    return 0.5 * noise(8 * x, 8 * y, seed) + 0.3 * noise(19 * x, 19 * y, seed + 7) +
           0.2 * noise(43 * x, 43 * y, seed + 13);
}

/* Colour along a ray from a camera, and the inverse depth there. */
static double trace(const struct lumi_pose *pose, double tan_x, double tan_y, double colour[3])
{
    struct lumi_vec3 ray = lumi_rotate(pose->r, lumi_vec3(tan_x, tan_y, 1));
    double z = (SQUARE - pose->t.z) / ray.z;
    double x = pose->t.x + z * ray.x, y = pose->t.y + z * ray.y;
    int seed = 100;

    if (fabs(x) > HALF || fabs(y) > HALF) {
        z = (WALL - pose->t.z) / ray.z;
        x = pose->t.x + z * ray.x;
        y = pose->t.y + z * ray.y;
        seed = 200;
    }
    /* The square is reddish, the wall bluish. */
    for (int c = 0; c < 3; c++)
        colour[c] = (seed == 100 ? 200 - 50 * c : 60 + 50 * c) * (0.4 + 0.9 * texture(x, y, seed + c));
    return 1 / z;
}

static void shoot(const struct lumi_grid *grid, const struct lumi_pose *pose, struct lumi_raster *image)
{
    enum { SAMPLES = 3 };

    assert_int_equal(lumi_raster_create(image, grid->width, grid->height, 3, LUMI_U8), 0);
    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++) {
            double sum[3] = {0}, colour[3], tan_x, tan_y;
            for (int s = 0; s < SAMPLES * SAMPLES; s++) {
                lumi_grid_unproject(grid, x + (s % SAMPLES + 0.5) / SAMPLES,
                                    y + ((double)(s / SAMPLES) + 0.5) / SAMPLES, &tan_x, &tan_y);
                trace(pose, tan_x, tan_y, colour);
                for (int c = 0; c < 3; c++)
                    sum[c] += colour[c] / (SAMPLES * SAMPLES);
            }
            for (int c = 0; c < 3; c++)
                lumi_row_u8(image, y)[3 * x + c] = (uint8_t)fmin(255, sum[c] + 0.5);
        }
}

static void build(struct scene *scene)
{
    for (int i = 0; i < VIEWS; i++) {
        shoot(&scene->grid, &scene->poses[i], &scene->images[i]);
        scene->views[i] =
            (struct lumi_mvs_view){.grid = &scene->grid, .pose = scene->poses[i], .image = scene->images[i]};
    }
}

/* Nine cameras in a plane, all looking along +z of the world. */
static void build_planar(struct scene *scene)
{
    memset(scene, 0, sizeof(*scene));
    assert_true(lumi_grid_init_pinhole(&scene->grid, 200, 150, 170, 170, 100, 75));
    for (int i = 0; i < VIEWS; i++)
        scene->poses[i] =
            (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {SPACING * (i % 3 - 1), SPACING * (double)(i / 3 - 1), 0}};
    build(scene);
}

/* Nine cameras on a sphere, each looking outwards through an equiangular lens of 90°. */
static void build_spherical(struct scene *scene)
{
    memset(scene, 0, sizeof(*scene));
    assert_true(lumi_grid_init_equiangular(&scene->grid, 256, 192, 1.57, 1.18));
    for (int i = 0; i < VIEWS; i++) {
        double a = 0.2 * (i % 3 - 1), b = 0.2 * (double)(i / 3 - 1);
        struct lumi_vec3 out = lumi_vec3(sin(a) * cos(b), sin(b), cos(a) * cos(b));
        lumi_pose_look(lumi_scale(out, 0.4), out, lumi_vec3(0, -1, 0), &scene->poses[i]);
    }
    build(scene);
}

static void finish(struct scene *scene)
{
    for (int i = 0; i < VIEWS; i++) {
        lumi_raster_finish(&scene->images[i]);
        lumi_raster_finish(&scene->maps[i]);
    }
}

static int neighbours_of(const struct scene *scene, int index, struct lumi_mvs_view *neighbours)
{
    int indices[LUMI_MVS_NEIGHBOURS];
    int count = lumi_mvs_neighbours(VIEWS, scene->poses, index, 0, indices);

    for (int i = 0; i < count; i++)
        neighbours[i] = scene->views[indices[i]];
    return count;
}

static void match(struct scene *scene, int index, int threads)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings;
    struct lumi_error error = {0};
    int count = neighbours_of(scene, index, neighbours);

    lumi_mvs_defaults(&settings);
    assert_int_equal(
        lumi_mvs_match(&scene->views[index], count, neighbours, &settings, threads, &scene->maps[index], &error), 0);
    scene->views[index].depth = scene->maps[index];
}

static void refine(const struct scene *scene, int index, int threads, struct lumi_raster *result)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_error error = {0};
    int count = neighbours_of(scene, index, neighbours);

    assert_int_equal(lumi_mvs_refine(&scene->views[index], count, neighbours, threads, result, &error), 0);
}

/* Share of the pixels whose inverse depth is right to `tolerance` (1/m), or is right for a place at most two pixels
 * away: edges may be that far off. */
static double share_right(const struct scene *scene, int index, const struct lumi_raster *map, double tolerance)
{
    long right = 0;

    for (int y = 0; y < map->height; y++)
        for (int x = 0; x < map->width; x++) {
            bool good = false;
            for (int k = 0; k < 25 && !good; k++) {
                double tan_x, tan_y, colour[3];
                lumi_grid_unproject(&scene->grid, x + k % 5 - 1.5, y + (double)(k / 5) - 1.5, &tan_x, &tan_y);
                double truth = trace(&scene->poses[index], tan_x, tan_y, colour);
                good = fabs(truth - lumi_row_f32(map, y)[x]) <= tolerance;
            }
            right += good;
        }
    return (double)right / ((double)map->width * map->height);
}

static void check_scene(struct scene *scene)
{
    struct lumi_raster refined;

    for (int i = 0; i < VIEWS; i++)
        match(scene, i, 0);
    /* 0.02/m is 0.34 pixels in the planar neighbours next to it. */
    assert_true(share_right(scene, CENTRE, &scene->maps[CENTRE], 0.02) > 0.95);
    refine(scene, CENTRE, 0, &refined);
    assert_true(share_right(scene, CENTRE, &refined, 0.02) > 0.97);
    lumi_raster_finish(&refined);
    refine(scene, 0, 0, &refined); /* a corner: neighbours on one side only */
    assert_true(share_right(scene, 0, &refined, 0.03) > 0.93);
    lumi_raster_finish(&refined);
    finish(scene);
}

static void depth_of_two_planes_is_found_by_cameras_in_a_plane(void **state)
{
    struct scene scene;

    (void)state;
    build_planar(&scene);
    check_scene(&scene);
}

static void depth_of_two_planes_is_found_by_turned_equiangular_cameras(void **state)
{
    struct scene scene;

    (void)state;
    build_spherical(&scene);
    check_scene(&scene);
}

/* Poses from structure from motion are in no unit at all. */
static void depth_is_found_whatever_the_unit_of_the_poses(void **state)
{
    static const double units[] = {0.01, 1, 1000}; /* of the poses, to the metre */
    struct scene scene;

    (void)state;
    build_planar(&scene);
    for (int k = 0; k < 3; k++) {
        struct lumi_raster *map = &scene.maps[CENTRE];
        struct lumi_pose truth[VIEWS];
        memcpy(truth, scene.poses, sizeof truth);
        for (int i = 0; i < VIEWS; i++)
            scene.views[i].pose.t = scene.poses[i].t = lumi_scale(truth[i].t, units[k]);
        match(&scene, CENTRE, 0);
        memcpy(scene.poses, truth, sizeof truth);
        for (int y = 0; y < map->height; y++)
            for (int x = 0; x < map->width; x++)
                lumi_row_f32(map, y)[x] *= (float)units[k];
        assert_true(share_right(&scene, CENTRE, map, 0.02) > 0.95);
        lumi_raster_finish(map);
    }
    finish(&scene);
}

static bool same(const struct lumi_raster *a, const struct lumi_raster *b)
{
    for (int y = 0; y < a->height; y++)
        if (memcmp(lumi_row_f32(a, y), lumi_row_f32(b, y), sizeof(float) * (size_t)a->width))
            return false;
    return true;
}

static void one_and_four_threads_give_the_same_bytes(void **state)
{
    struct lumi_raster first, second, map;
    struct scene scene;

    (void)state;
    build_spherical(&scene);
    match(&scene, CENTRE, 4);
    map = scene.maps[CENTRE];
    match(&scene, CENTRE, 1);
    for (int i = 0; i < VIEWS; i++) /* whose map it is does not matter here */
        scene.views[i].depth = scene.maps[CENTRE];
    assert_true(same(&map, &scene.maps[CENTRE]));
    lumi_raster_finish(&map);
    refine(&scene, CENTRE, 1, &first);
    refine(&scene, CENTRE, 4, &second);
    assert_true(same(&first, &second));
    lumi_raster_finish(&first);
    lumi_raster_finish(&second);
    finish(&scene);
}

static void stated_limits_hold(void **state)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings = {.near_m = 2, .far_m = 2.5, .step_px = 0.6};
    struct lumi_raster map;
    struct scene scene;

    (void)state;
    build_planar(&scene);
    int count = neighbours_of(&scene, CENTRE, neighbours);
    assert_int_equal(lumi_mvs_match(&scene.views[CENTRE], count, neighbours, &settings, 1, &map, NULL), 0);
    for (int y = 0; y < map.height; y++)
        for (int x = 0; x < map.width; x++)
            assert_true(lumi_row_f32(&map, y)[x] >= 0.3999f && lumi_row_f32(&map, y)[x] <= 0.5001f);
    lumi_raster_finish(&map);
    settings.near_m = 3;
    assert_int_equal(lumi_mvs_match(&scene.views[CENTRE], count, neighbours, &settings, 1, &map, NULL), LUMI_ERR_ARG);
    finish(&scene);
}

static void a_plain_image_has_some_finite_depth(void **state)
{
    struct lumi_raster map;
    struct scene scene;

    (void)state;
    build_planar(&scene);
    for (int i = 0; i < VIEWS; i++)
        for (int y = 0; y < scene.grid.height; y++)
            memset(lumi_row_u8(&scene.images[i], y), 128, 3 * (size_t)scene.grid.width);
    match(&scene, CENTRE, 0);
    for (int i = 0; i < VIEWS; i++)
        scene.views[i].depth = scene.maps[CENTRE];
    refine(&scene, CENTRE, 0, &map);
    for (int y = 0; y < map.height; y++)
        for (int x = 0; x < map.width; x++)
            assert_true(isfinite(lumi_row_f32(&map, y)[x]) && lumi_row_f32(&map, y)[x] >= 0);
    lumi_raster_finish(&map);
    finish(&scene);
}

static void a_view_without_neighbours_lies_at_the_farthest_surface(void **state)
{
    struct lumi_mvs_settings settings;
    struct lumi_raster map;
    struct scene scene;
    int none[LUMI_MVS_NEIGHBOURS];

    (void)state;
    build_planar(&scene);
    assert_int_equal(lumi_mvs_neighbours(1, scene.poses, 0, 0, none), 0);
    lumi_mvs_defaults(&settings);
    settings.far_m = 8;
    assert_int_equal(lumi_mvs_match(&scene.views[0], 0, NULL, &settings, 1, &map, NULL), 0);
    for (int x = 0; x < map.width; x++)
        assert_true(lumi_row_f32(&map, 7)[x] == 0.125f);
    lumi_raster_finish(&map);
    finish(&scene);
}

static void neighbours_surround_the_view(void **state)
{
    struct lumi_pose poses[25];
    int neighbours[LUMI_MVS_NEIGHBOURS];
    bool seen[25] = {false};

    (void)state;
    for (int i = 0; i < 25; i++)
        poses[i] = (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {i % 5, (double)(i / 5), 0}};
    assert_int_equal(lumi_mvs_neighbours(25, poses, 12, 0, neighbours), 8);
    for (int i = 0; i < 8; i++)
        seen[neighbours[i]] = true;
    for (int i = 0; i < 25; i++)
        assert_int_equal(seen[i], i != 12 && abs(i % 5 - 2) <= 1 && abs(i / 5 - 2) <= 1);
    /* Four: the nearest, one in each direction of the axes. */
    assert_int_equal(lumi_mvs_neighbours(25, poses, 12, 4, neighbours), 4);
    for (int i = 0; i < 4; i++)
        assert_int_equal(abs(neighbours[i] % 5 - 2) + abs(neighbours[i] / 5 - 2), 1);
    /* One that looks the other way is none. */
    poses[13] = (struct lumi_pose){{-1, 0, 0, 0, 1, 0, 0, 0, -1}, poses[13].t};
    int count = lumi_mvs_neighbours(25, poses, 12, 0, neighbours);
    for (int i = 0; i < count; i++)
        assert_int_not_equal(neighbours[i], 13);
}

static void running_out_of_memory_is_an_error(void **state)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings = {.near_m = 1, .far_m = 4, .step_px = 4};
    struct lumi_error error;
    struct lumi_raster map;
    struct scene scene;

    (void)state;
    build_planar(&scene);
    int count = neighbours_of(&scene, CENTRE, neighbours);
    for (int i = 0; i < 40; i++) {
        lumi_alloc_fail_after(i);
        int code = lumi_mvs_match(&scene.views[CENTRE], count, neighbours, &settings, 1, &map, &error);
        lumi_alloc_fail_after(-1);
        assert_true(code == LUMI_OK || code == LUMI_ERR_NOMEM);
        lumi_raster_finish(&map);
    }
    finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(neighbours_surround_the_view),
        cmocka_unit_test(depth_of_two_planes_is_found_by_cameras_in_a_plane),
        cmocka_unit_test(depth_of_two_planes_is_found_by_turned_equiangular_cameras),
        cmocka_unit_test(depth_is_found_whatever_the_unit_of_the_poses),
        cmocka_unit_test(one_and_four_threads_give_the_same_bytes),
        cmocka_unit_test(stated_limits_hold),
        cmocka_unit_test(a_plain_image_has_some_finite_depth),
        cmocka_unit_test(a_view_without_neighbours_lies_at_the_farthest_surface),
        cmocka_unit_test(running_out_of_memory_is_an_error),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
