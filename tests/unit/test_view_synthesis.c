/* A view out of others: a square before a wall, seen from a ring of cameras; the new one is in its middle. */
#include "pipeline/synthesize/view_synthesis.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 96, HEIGHT = 64, CAMERAS = 10 };
#define WALL 0.4f /* inverse depths */
#define SQUARE 1.0f

static struct lumi_grid grid;

/* What lies at a place: the square of 0.4 m, red, or the wall with its stripes. */
static void paint(double x, double y, double w, float colour[3])
{
    colour[0] = w > 0.7 ? 0.8f : 0.2f + 0.1f * (float)sin(6 * x);
    colour[1] = w > 0.7 ? 0.1f : 0.4f + 0.1f * (float)sin(5 * y);
    colour[2] = w > 0.7 ? 0.1f : 0.6f;
}

static float look(struct lumi_vec3 from, double tan_x, double tan_y, float colour[3])
{
    const double x = from.x + tan_x / SQUARE, y = from.y + tan_y / SQUARE;
    const float w = fabs(x) < 0.2 && fabs(y) < 0.2 ? SQUARE : WALL;

    paint(from.x + tan_x / w, from.y + tan_y / w, w, colour);
    return w;
}

static void photograph(struct lumi_vec3 from, struct lumi_synthesis_source *view)
{
    *view = (struct lumi_synthesis_source){.grid = &grid, .pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, from}};
    assert_int_equal(lumi_raster_create(&view->image, WIDTH, HEIGHT, 3, LUMI_F32), LUMI_OK);
    assert_int_equal(lumi_raster_create(&view->depth, WIDTH, HEIGHT, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double tan_x, tan_y;
            lumi_grid_unproject(&grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            lumi_row_f32(&view->depth, y)[x] = look(from, tan_x, tan_y, lumi_row_f32(&view->image, y) + 3 * (size_t)x);
        }
}

struct scene {
    struct lumi_synthesis_source views[CAMERAS], truth;
    struct lumi_raster image, depth;
};

static int set_up(void **state)
{
    static struct scene scene;

    assert_true(lumi_grid_init_pinhole(&grid, WIDTH, HEIGHT, 80, 80, WIDTH / 2.0, HEIGHT / 2.0));
    for (int i = 0; i < CAMERAS; i++) {
        const double turn = 2 * LUMI_PI * i / CAMERAS;
        photograph(lumi_vec3(0.1 * cos(turn), 0.1 * sin(turn), 0), &scene.views[i]);
    }
    photograph(lumi_vec3(0, 0, 0), &scene.truth);
    assert_int_equal(lumi_raster_create(&scene.image, WIDTH, HEIGHT, 3, LUMI_F32), LUMI_OK);
    assert_int_equal(lumi_raster_create(&scene.depth, WIDTH, HEIGHT, 1, LUMI_F32), LUMI_OK);
    *state = &scene;
    return 0;
}

static int tear_down(void **state)
{
    struct scene *scene = *state;

    for (int i = 0; i < CAMERAS; i++) {
        lumi_raster_finish(&scene->views[i].image);
        lumi_raster_finish(&scene->views[i].depth);
    }
    lumi_raster_finish(&scene->truth.image);
    lumi_raster_finish(&scene->truth.depth);
    lumi_raster_finish(&scene->image);
    lumi_raster_finish(&scene->depth);
    return 0;
}

static long synthesize(struct scene *scene, const uint8_t *wanted, int threads)
{
    struct lumi_error error;
    long filled;

    assert_int_equal(lumi_synthesize_view(&grid, &scene->truth.pose, CAMERAS, scene->views, wanted, threads,
                                          &scene->image, &scene->depth, &filled, &error),
                     LUMI_OK);
    return filled;
}

/* Pixels that are neither what is there nor next to an edge of it. */
static int count_wrong(const struct scene *scene)
{
    int wrong = 0;

    for (int y = 1; y + 1 < HEIGHT; y++)
        for (int x = 1; x + 1 < WIDTH; x++) {
            bool right = false;
            for (int k = 0; k < 9; k++) {
                const int tx = x + k % 3 - 1, ty = y + k / 3 - 1;
                const float *a = lumi_row_f32(&scene->image, y) + 3 * x;
                const float *b = lumi_row_f32(&scene->truth.image, ty) + 3 * tx;
                right =
                    right || (fabsf(a[0] - b[0]) < 0.02f && fabsf(a[1] - b[1]) < 0.02f && fabsf(a[2] - b[2]) < 0.02f);
            }
            wrong += !right;
        }
    return wrong;
}

static void a_view_in_the_middle_is_what_a_camera_would_see(void **state)
{
    struct scene *scene = *state;
    double sum = 0;

    synthesize(scene, NULL, 1);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < 3 * WIDTH; x++) {
            const double d = lumi_row_f32(&scene->image, y)[x] - lumi_row_f32(&scene->truth.image, y)[x];
            sum += d * d;
        }
    assert_true(-10 * log10(sum / (3 * WIDTH * HEIGHT)) > 34);
    assert_int_equal(count_wrong(scene), 0);
}

static void an_edge_is_not_smeared_over_what_is_behind(void **state)
{
    struct scene *scene = *state;
    int off = 0;

    synthesize(scene, NULL, 1);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float w = lumi_row_f32(&scene->depth, y)[x], red = lumi_row_f32(&scene->image, y)[3 * x];
            assert_true(fabsf(w - WALL) < 0.02f || fabsf(w - SQUARE) < 0.02f); /* nothing in between */
            assert_true(red < 0.33f || red > 0.77f);
            off += fabsf(w - lumi_row_f32(&scene->truth.depth, y)[x]) > 0.1f;
        }
    assert_in_range(off, 0, 4 * 33); /* at most a pixel along the square's four sides */
}

static void a_source_whose_depth_is_wrong_is_outvoted(void **state)
{
    struct scene *scene = *state;

    for (int y = 5; y < 30; y++)
        for (int x = 5; x < 40; x++) {
            lumi_row_f32(&scene->views[3].depth, y)[x] = 0.9f;
            memset(lumi_row_f32(&scene->views[3].image, y) + 3 * x, 0, 3 * sizeof(float));
        }
    synthesize(scene, NULL, 1);
    assert_int_equal(count_wrong(scene), 0);
}

static void what_is_blocked_shows_in_no_view(void **state)
{
    static uint8_t blocked[CAMERAS][WIDTH * HEIGHT];
    struct scene *scene = *state;

    /* Something magenta stands right before every camera, at another place in each. */
    memset(blocked, 0, sizeof blocked);
    for (int i = 0; i < CAMERAS; i++) {
        for (int y = 10; y < 40; y++)
            for (int x = 7 * i; x < 7 * i + 12; x++) {
                float *at = lumi_row_f32(&scene->views[i].image, y) + 3 * x;
                at[0] = at[2] = 1;
                at[1] = 0;
                lumi_row_f32(&scene->views[i].depth, y)[x] = 4;
                blocked[i][y * WIDTH + x] = 1;
            }
        scene->views[i].blocked = blocked[i];
    }
    assert_int_equal(synthesize(scene, NULL, 1), 0);
    assert_int_equal(count_wrong(scene), 0);
}

static void a_hole_is_filled_and_never_black(void **state)
{
    static uint8_t blocked[CAMERAS][WIDTH * HEIGHT];
    struct scene *scene = *state;

    /* Nobody sees a piece of the wall beside the square. */
    memset(blocked, 0, sizeof blocked);
    for (int i = 0; i < CAMERAS; i++) {
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                double tan_x, tan_y;
                lumi_grid_unproject(&grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
                const double wx = scene->views[i].pose.t.x + tan_x / WALL, wy = scene->views[i].pose.t.y + tan_y / WALL;
                blocked[i][y * WIDTH + x] = wx > 0.5 && wx < 1 && fabs(wy) < 0.3;
            }
        scene->views[i].blocked = blocked[i];
    }
    assert_in_range(synthesize(scene, NULL, 1), 100, 500);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 68; x < 76; x++) {
            assert_true(lumi_row_f32(&scene->image, y)[3 * x] < 0.35f); /* not the square's red */
            assert_true(lumi_row_f32(&scene->image, y)[3 * x + 2] > 0.5f);
            assert_float_equal(lumi_row_f32(&scene->depth, y)[x], WALL, 0.05);
        }
}

static void pixels_that_are_not_wanted_stay(void **state)
{
    static uint8_t wanted[WIDTH * HEIGHT];
    struct scene *scene = *state;

    for (int i = 0; i < WIDTH * HEIGHT; i++)
        wanted[i] = i % WIDTH > 40;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < 3 * WIDTH; x++)
            lumi_row_f32(&scene->image, y)[x] = 7;
    synthesize(scene, wanted, 1);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            assert_int_equal(lumi_row_f32(&scene->image, y)[3 * x] == 7, x <= 40);
}

static void threads_change_nothing(void **state)
{
    static float one[HEIGHT][3 * WIDTH];
    struct scene *scene = *state;

    synthesize(scene, NULL, 1);
    for (int y = 0; y < HEIGHT; y++)
        memcpy(one[y], lumi_row_f32(&scene->image, y), sizeof one[y]);
    synthesize(scene, NULL, 5);
    for (int y = 0; y < HEIGHT; y++)
        assert_memory_equal(one[y], lumi_row_f32(&scene->image, y), sizeof one[y]);
}

static void holes_between_near_and_far_are_far(void **state)
{
    static uint8_t known[40 * 20];
    struct lumi_raster image, depth;

    (void)state;
    assert_int_equal(lumi_raster_create(&image, 40, 20, 3, LUMI_F32), LUMI_OK);
    assert_int_equal(lumi_raster_create(&depth, 40, 20, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < 20; y++)
        for (int x = 0; x < 40; x++) {
            known[40 * y + x] = x < 12 || x >= 28;
            lumi_row_f32(&image, y)[3 * x] = x < 12 ? 0.9f : 0.1f;
            lumi_row_f32(&depth, y)[x] = x < 12 ? 2.0f : 0.5f;
        }
    assert_int_equal(lumi_synthesis_fill(&image, &depth, known, 0.1), LUMI_OK);
    for (int y = 0; y < 20; y++)
        for (int x = 20; x < 40; x++) {
            assert_float_equal(lumi_row_f32(&image, y)[3 * x], 0.1, 1e-5);
            assert_float_equal(lumi_row_f32(&depth, y)[x], 0.5, 1e-5);
        }
    lumi_raster_finish(&image);
    lumi_raster_finish(&depth);
}

static void sources_lie_all_around(void **state)
{
    struct lumi_pose poses[200], view;
    int sources[LUMI_SYNTHESIS_SOURCES];
    bool side[4] = {0};

    (void)state;
    /* A row at 10 cm that is dense on one side, others far off, one that looks back. */
    for (int i = 0; i < 200; i++) {
        const double turn = i < 150 ? 0.01 * i : 2 * LUMI_PI * (i - 150) / 50, r = i < 150 ? 0.1 : 0.15;
        poses[i] = (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {r * cos(turn), r * sin(turn), 0}};
    }
    view = (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    poses[7] = (struct lumi_pose){{-1, 0, 0, 0, 1, 0, 0, 0, -1}, {0.01, 0, 0}};
    int count = lumi_synthesis_sources(200, poses, &view, -1, 0, sources);
    assert_in_range(count, 8, LUMI_SYNTHESIS_SOURCES);
    for (int i = 0; i < count; i++) {
        assert_int_not_equal(sources[i], 7);
        side[(poses[sources[i]].t.x > 0) + 2 * (poses[sources[i]].t.y > 0)] = true;
    }
    assert_true(side[0] && side[1] && side[2] && side[3]);
    poses[7] = view;
    count = lumi_synthesis_sources(200, poses, &view, 7, 0, sources);
    for (int i = 0; i < count; i++)
        assert_int_not_equal(sources[i], 7);
}

#define SCENE(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        SCENE(a_view_in_the_middle_is_what_a_camera_would_see),
        SCENE(an_edge_is_not_smeared_over_what_is_behind),
        SCENE(a_source_whose_depth_is_wrong_is_outvoted),
        SCENE(what_is_blocked_shows_in_no_view),
        SCENE(a_hole_is_filled_and_never_black),
        SCENE(pixels_that_are_not_wanted_stay),
        SCENE(threads_change_nothing),
        cmocka_unit_test(holes_between_near_and_far_are_far),
        cmocka_unit_test(sources_lie_all_around),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
