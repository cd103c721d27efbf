/* pipeline/prefilter: views taken anew of scenes whose every ray is known. */
#include "pipeline/prefilter/aperture.h"
#include "pipeline/prefilter/display.h"
#include "pipeline/prefilter/sequence.h"
#include "pipeline/prefilter/view_filter.h"
#include "render/cpu/dense_cast.h"
#include "render/cpu/ray_renderer.h"
#include "tests/unit/analytic_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* A scene's views with dense depth and pictures in display's numbers. */
struct dense_scene {
    struct scene_set scene;
    struct lumi_raster pictures[SCENE_MAX_VIEWS];
    struct lumi_viewset *set;
};

static struct dense_scene wall, room;

static void open_dense(struct dense_scene *s, enum scene_kind kind)
{
    assert_int_equal(scene_open(&s->scene, kind, false), LUMI_OK);
    for (int i = 0; i < s->scene.count; i++) {
        struct lumi_raster *to = &s->pictures[i];
        assert_int_equal(lumi_raster_create(to, s->scene.grid.width, s->scene.grid.height, 3, LUMI_F32), LUMI_OK);
        for (int y = 0; y < to->height; y++)
            for (int x = 0; x < 3 * to->width; x++)
                lumi_row_f32(to, y)[x] = (float)lumi_row_u8(&s->scene.images[i], y)[x] / 255;
    }
    assert_int_equal(lumi_viewset_create(s->scene.count, s->scene.views, s->pictures, LUMI_DISK_OVAL,
                                         LUMI_KERNEL_LINEAR, &s->set, NULL),
                     LUMI_OK);
}

static int open_scenes(void **state)
{
    (void)state;
    open_dense(&wall, SCENE_WALL);
    open_dense(&room, SCENE_ROOM);
    return 0;
}

static int close_scenes(void **state)
{
    struct dense_scene *scenes[] = {&wall, &room};

    (void)state;
    for (int k = 0; k < 2; k++) {
        lumi_viewset_destroy(scenes[k]->set);
        for (int i = 0; i < scenes[k]->scene.count; i++)
            lumi_raster_finish(&scenes[k]->pictures[i]);
        scene_close(&scenes[k]->scene);
    }
    return 0;
}

static void casting_meets_what_drawing_meets(void **state)
{
    struct dense_scene *scenes[] = {&wall, &room};

    (void)state;
    for (int k = 0; k < 2; k++) {
        const struct lumi_view *view = &scenes[k]->scene.views[k ? 30 : 4];
        struct lumi_pose pose = view->pose;
        struct lumi_lens lens;
        struct lumi_rays rays;
        struct lumi_sums drawn, cast_sums;
        struct lumi_cast *cast;
        struct lumi_cast_eye *eye;
        struct lumi_disk_settings settings;
        lumi_disk_settings_default(&settings);
        settings.linear_light = true;
        pose.t = lumi_to_world(&view->pose, lumi_vec3(0.04, -0.03, 0));
        lumi_lens_init_pinhole(&lens, 128, 96, 0.8);
        assert_int_equal(lumi_rays_init(&rays, &lens, &pose, 1, NULL), LUMI_OK);
        assert_int_equal(lumi_sums_create(&drawn, rays.pixels, NULL), LUMI_OK);
        assert_int_equal(lumi_sums_create(&cast_sums, rays.pixels, NULL), LUMI_OK);
        assert_int_equal(lumi_render_rays(scenes[k]->set, &rays, pose.t, &settings, &drawn, NULL), LUMI_OK);
        assert_int_equal(lumi_cast_create(scenes[k]->set, &settings, &cast, NULL), LUMI_OK);
        assert_int_equal(lumi_cast_eye_create(cast, pose.t, &eye, NULL), LUMI_OK);
        for (size_t at = 0; at < rays.pixels; at += LUMI_BLOCK_PIXELS) {
            struct lumi_sums block = {cast_sums.r + at, cast_sums.g + at, cast_sums.b + at, cast_sums.weight + at,
                                      cast_sums.nearness + at};
            lumi_cast_block(cast, eye, rays.x + at, rays.y + at, rays.z + at, &block);
        }
        long other = 0;
        for (size_t i = 0; i < rays.pixels; i++) {
            const bool known = drawn.weight[i] > 0.05f;
            if (!known)
                continue;
            const float d = fabsf(drawn.r[i] / drawn.weight[i] - cast_sums.r[i] / cast_sums.weight[i]);
            const float n = fabsf(drawn.nearness[i] / drawn.weight[i] - cast_sums.nearness[i] / cast_sums.weight[i]);
            other += !(d < 1.0f / 255) || !(n < 0.01f);
        }
        print_message("%ld of %zu rays differ\n", other, rays.pixels);
        assert_true((double)other < 0.02 * (double)rays.pixels);
        lumi_cast_eye_destroy(eye);
        lumi_cast_destroy(cast);
        lumi_sums_finish(&drawn);
        lumi_sums_finish(&cast_sums);
        lumi_rays_finish(&rays);
    }
}

static struct lumi_prefilter_view view_of(const struct dense_scene *s, int index, const struct lumi_raster *surface)
{
    const struct lumi_view *view = &s->scene.views[index];

    return (struct lumi_prefilter_view){.grid = view->grid,
                                        .pose = view->pose,
                                        .disk = view->disk,
                                        .shape = LUMI_DISK_OVAL,
                                        .kernel = LUMI_KERNEL_LINEAR,
                                        .surface = surface ? surface : &s->scene.depths[index],
                                        .picture = &s->pictures[index]};
}

/* Differences in grey levels, and how much of the picture's own detail is left (mean squared step between pixels). */
static double psnr(const struct lumi_raster *a, const struct lumi_raster *b)
{
    double squares = 0;

    for (int y = 0; y < a->height; y++)
        for (int i = 0; i < 3 * a->width; i++) {
            const double d = lumi_row_f32(a, y)[i] - lumi_row_f32(b, y)[i];
            squares += d * d;
        }
    return -10 * log10(squares / (3.0 * a->width * a->height));
}

static double detail(const struct lumi_raster *a)
{
    double squares = 0;

    for (int y = 0; y < a->height; y++)
        for (int i = 3; i < 3 * a->width; i++) {
            const double d = lumi_row_f32(a, y)[i] - lumi_row_f32(a, y)[i - 3];
            squares += d * d;
        }
    return squares;
}

static void filter(const struct dense_scene *s, int index, const struct lumi_raster *surface, int base, int most,
                   uint32_t seed, int threads, struct lumi_raster *result, struct lumi_prefilter_report *report)
{
    const struct lumi_prefilter_view view = view_of(s, index, surface);
    struct lumi_prefilter_settings settings;
    struct lumi_error error = {0};

    lumi_prefilter_defaults(&settings);
    settings.base = base;
    settings.most = most;
    settings.seed = seed;
    settings.threads = threads;
    if (lumi_prefilter(s->set, &view, &settings, result, report, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static void where_the_surface_is_right_the_picture_stays(void **state)
{
    struct lumi_prefilter_report report;
    struct lumi_raster result;

    (void)state;
    filter(&room, 30, NULL, 8, 8, 1, 1, &result, &report);
    const double db = psnr(&result, &room.pictures[30]), left = detail(&result) / detail(&room.pictures[30]);
    print_message("%.2f dB, %.3f of the detail, standard error %.3f\n", db, left, 255 * report.error);
    assert_true(db > 42);
    assert_true(left > 0.97);
    assert_true(report.uncovered == 0);
    lumi_raster_finish(&result);
}

static void where_the_surface_is_wrong_the_picture_is_blurred_not_doubled(void **state)
{
    struct lumi_prefilter_report report;
    struct lumi_raster surface, result;
    const struct lumi_raster *depth = &wall.scene.depths[4];

    (void)state;
    assert_int_equal(lumi_raster_create(&surface, depth->width, depth->height, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < depth->height; y++)
        for (int x = 0; x < depth->width; x++)
            lumi_row_f32(&surface, y)[x] = 0.5f * lumi_row_f32(depth, y)[x];
    filter(&wall, 4, &surface, 64, 64, 1, 1, &result, &report);
    const double left = detail(&result) / detail(&wall.pictures[4]);
    print_message("%.3f of the detail\n", left);
    assert_true(left < 0.8);
    lumi_raster_finish(&result);
    lumi_raster_finish(&surface);
}

static void the_bytes_do_not_depend_on_the_number_of_threads(void **state)
{
    struct lumi_raster one, three;

    (void)state;
    filter(&wall, 4, NULL, 4, 16, 7, 1, &one, NULL);
    filter(&wall, 4, NULL, 4, 16, 7, 3, &three, NULL);
    for (int y = 0; y < one.height; y++)
        assert_memory_equal(lumi_row_f32(&one, y), lumi_row_f32(&three, y), (size_t)one.width * 3 * sizeof(float));
    lumi_raster_finish(&one);
    lumi_raster_finish(&three);
}

/* Root mean square over a tile is what is estimated, so that is compared, over the picture. */
static void the_standard_error_is_what_it_says(void **state)
{
    struct lumi_prefilter_report report;
    struct lumi_raster reference, result;
    double estimated = 0, found = 0;

    (void)state;
    filter(&wall, 3, NULL, 512, 512, 99, 0, &reference, NULL);
    for (uint32_t seed = 1; seed <= 8; seed++) {
        filter(&wall, 3, NULL, 8, 8, seed, 0, &result, &report);
        estimated += report.rms * report.rms;
        found += pow(10, -psnr(&result, &reference) / 10);
        lumi_raster_finish(&result);
    }
    const double ratio = sqrt(estimated / found);
    print_message("estimated %.3f, found %.3f grey levels\n", 255 * sqrt(estimated / 8), 255 * sqrt(found / 8));
    assert_true(ratio > 0.8 && ratio < 2);
    lumi_raster_finish(&reference);
}

static void blocks_that_disagree_take_more_samples(void **state)
{
    struct lumi_prefilter_report few, more;
    struct lumi_raster result;

    (void)state;
    filter(&wall, 4, NULL, 4, 4, 1, 1, &result, &few);
    lumi_raster_finish(&result);
    filter(&wall, 4, NULL, 4, 64, 1, 1, &result, &more);
    lumi_raster_finish(&result);
    assert_true(few.samples == 4);
    assert_true(more.samples > 4 && more.samples < 64);
    assert_true(more.error < few.error);
    assert_true(more.over <= few.over);
}

static void every_power_of_two_of_samples_is_spread_evenly(void **state)
{
    (void)state;
    for (uint32_t seed = 0; seed < 20; seed++)
        for (int pair = 0; pair < 2; pair++) {
            int cells[16] = {0};
            for (uint32_t i = 16; i < 32; i++) {
                double p[4];
                prefilter_point(seed, i, p);
                for (int d = 0; d < 4; d++)
                    assert_true(p[d] >= 0 && p[d] < 1);
                if (pair == 0)
                    cells[(int)(4 * p[0]) * 4 + (int)(4 * p[1])]++;
                else
                    cells[(int)(16 * p[2])]++;
            }
            for (int i = 0; i < 16; i++)
                assert_int_equal(cells[i], 1);
        }
}

static void samples_lie_on_the_disk_as_often_as_its_kernel_says(void **state)
{
    enum { COUNT = 1024 };
    const struct lumi_prefilter_view view = {.disk = {0.1f, 0.3f, 0.2f, 0.2f}};
    struct prefilter_sample samples[COUNT];
    double weight = 0, near = 0;

    (void)state;
    assert_int_equal(prefilter_samples(&view, 5, COUNT, samples), LUMI_OK);
    for (int i = 0; i < COUNT; i++) {
        const struct prefilter_sample *s = &samples[i];
        const double r = 1 - (double)lumi_disk_weight(&view.disk, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, 1, s->u, s->v);
        double taps = 0;
        assert_true(r <= 1);
        for (int k = 0; k < PREFILTER_TAPS; k++)
            taps += (double)s->x.taps[k];
        assert_true(fabs(taps - 1) < 0.03);
        weight += (double)s->weight;
        near += r < 0.5 ? (double)s->weight : 0;
    }
    /* Of a cone, half of the radius holds 3/4 − 2/8. */
    assert_true(fabs(near / weight - 0.5) < 0.01);
}

static void display_numbers_come_back_as_linear_light(void **state)
{
    struct lumi_raster r;

    (void)state;
    assert_int_equal(lumi_raster_create(&r, 8, 1, 1, LUMI_F32), LUMI_OK);
    float *v = lumi_row_f32(&r, 0);
    const float values[8] = {0, 0.001f, 0.2f, 1, 7.3f, -0.1f, (float)NAN, 60000};
    memcpy(v, values, sizeof values);
    prefilter_to_display(&r);
    assert_true(fabsf(v[2] - lumi_srgb_encode(0.2f)) < 1e-5f);
    prefilter_to_linear(&r);
    for (int i = 0; i < 8; i++)
        assert_true(i == 6 ? v[i] == 0 : fabsf(v[i] - values[i]) <= 2e-5f * fabsf(values[i]));
    lumi_raster_finish(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(casting_meets_what_drawing_meets),
        cmocka_unit_test(where_the_surface_is_right_the_picture_stays),
        cmocka_unit_test(where_the_surface_is_wrong_the_picture_is_blurred_not_doubled),
        cmocka_unit_test(the_bytes_do_not_depend_on_the_number_of_threads),
        cmocka_unit_test(the_standard_error_is_what_it_says),
        cmocka_unit_test(blocks_that_disagree_take_more_samples),
        cmocka_unit_test(every_power_of_two_of_samples_is_spread_evenly),
        cmocka_unit_test(samples_lie_on_the_disk_as_often_as_its_kernel_says),
        cmocka_unit_test(display_numbers_come_back_as_linear_light),
    };

    return cmocka_run_group_tests(tests, open_scenes, close_scenes);
}
