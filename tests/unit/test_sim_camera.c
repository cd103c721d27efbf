/* Pictures of geometry that is known, through every lens. */
#include "sim/camera.h"
#include "sim/place.h"
#include "sim/shade.h"
#include "sim/shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void make_lens(int kind, struct lumi_lens *lens)
{
    lumi_lens_init_pinhole(lens, 80, 60, 70 * LUMI_PI / 180);
    lens->cx = 41.3;
    lens->cy = 28.6;
    if (kind == 1) {
        lens->k1 = -0.15;
        lens->k2 = 0.03;
        lens->p1 = 0.002;
        lens->p2 = -0.001;
    } else if (kind == 2) {
        lens->model = LUMI_LENS_FISHEYE;
        lens->fx = lens->fy = 45;
        lens->k1 = 0.02;
        lens->k2 = -0.003;
    }
}

static struct sim_scene *wall(float distance)
{
    struct sim_scene *scene;
    struct sim_material m;

    assert_int_equal(sim_scene_create(&scene, NULL), LUMI_OK);
    sim_material_init(&m);
    int grey = sim_scene_material(scene, &m);
    sim_quad(scene, v3(-50, distance, -50), v3(100, 0, 0), v3(0, 0, 100), 20, grey);
    assert_int_equal(sim_scene_commit(scene, NULL), LUMI_OK);
    return scene;
}

static void depth_of_a_wall_is_its_distance_along_the_axis(void **state)
{
    struct sim_scene *scene = wall(2);
    struct lumi_pose pose;

    (void)state;
    lumi_pose_look(lumi_vec3(0.1, 0.25, -0.2), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &pose);
    for (int kind = 0; kind < 3; kind++) {
        struct lumi_lens lens;
        struct lumi_raster color, depth;
        make_lens(kind, &lens);
        assert_int_equal(sim_camera_render(scene, &lens, &pose, 1, &color, &depth, NULL), LUMI_OK);
        for (int y = 0; y < lens.height; y++)
            for (int x = 0; x < lens.width; x++)
                assert_true(fabsf(lumi_row_f32(&depth, y)[x] - 1.75f) < 1e-4f);
        lumi_raster_finish(&color);
        lumi_raster_finish(&depth);
    }
    /* Away from the wall there is only sky. */
    struct lumi_lens lens;
    struct lumi_raster color, depth;
    make_lens(0, &lens);
    lumi_pose_look(lumi_vec3(0, 0, 0), lumi_vec3(0, -1, 0), lumi_vec3(0, 0, 1), &pose);
    assert_int_equal(sim_camera_render(scene, &lens, &pose, 1, &color, &depth, NULL), LUMI_OK);
    assert_true(isinf(lumi_row_f32(&depth, 30)[40]));
    lumi_raster_finish(&color);
    lumi_raster_finish(&depth);
    sim_scene_destroy(scene);
}

/* A shining ball appears where the lens projects its middle. */
static void points_appear_where_the_lens_projects_them(void **state)
{
    static const float places[][3] = {{0, 2, 0}, {0.8f, 2, 0.5f}, {-0.9f, 1.8f, -0.6f}};

    (void)state;
    for (int kind = 0; kind < 3; kind++)
        for (int i = 0; i < 3; i++) {
            struct sim_scene *scene;
            struct sim_material m;
            struct lumi_lens lens;
            struct lumi_pose pose;
            struct lumi_raster color;
            double px, py, sum = 0, sx = 0, sy = 0;
            struct sim_v3 p = v3(places[i][0], places[i][1], places[i][2]);
            assert_int_equal(sim_scene_create(&scene, NULL), LUMI_OK);
            sim_material_init(&m);
            m.color = v3_grey(0);
            m.emission = v3_grey(1);
            sim_ball(scene, p, 0.06f, 24, sim_scene_material(scene, &m));
            assert_int_equal(sim_scene_commit(scene, NULL), LUMI_OK);
            make_lens(kind, &lens);
            lumi_pose_look(lumi_vec3(0, 0, 0), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &pose);
            assert_int_equal(sim_camera_render(scene, &lens, &pose, 1, &color, NULL, NULL), LUMI_OK);
            for (int y = 0; y < lens.height; y++)
                for (int x = 0; x < lens.width; x++) {
                    float v = lumi_row_f32(&color, y)[3 * x];
                    sum += v;
                    sx += v * (x + 0.5);
                    sy += v * (y + 0.5);
                }
            assert_true(lumi_lens_project(&lens, lumi_to_camera(&pose, lumi_vec3(p.x, p.y, p.z)), &px, &py));
            assert_true(sum > 1);
            assert_true(fabs(sx / sum - px) < 0.1);
            assert_true(fabs(sy / sum - py) < 0.1);
            lumi_raster_finish(&color);
            sim_scene_destroy(scene);
        }
}

/* A shining bar one and a half pixels wide adds its width to every row, wherever it lies between the pixels. */
static void thin_bars_are_antialiased(void **state)
{
    struct lumi_lens lens;
    struct lumi_pose pose;
    struct lumi_raster color;
    struct sim_scene *scene;
    struct sim_material m;

    (void)state;
    lumi_lens_init_pinhole(&lens, 32, 32, 0.5);
    lumi_pose_look(lumi_vec3(0, 0, 0), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &pose);
    double pixel = 2 / lens.fx;
    assert_int_equal(sim_scene_create(&scene, NULL), LUMI_OK);
    sim_material_init(&m);
    m.color = v3_grey(0);
    m.emission = v3_grey(1);
    int bright = sim_scene_material(scene, &m);
    /* Leans by a pixel over the picture, so that it takes every place within a pixel. */
    sim_bar(scene, v3(0, 2, -1), v3((float)(4 * pixel), 2, 1), (float)(0.75 * pixel), 12, bright);
    assert_int_equal(sim_scene_commit(scene, NULL), LUMI_OK);
    assert_int_equal(sim_camera_render(scene, &lens, &pose, 1, &color, NULL, NULL), LUMI_OK);
    for (int y = 2; y < 30; y++) {
        float sum = 0;
        for (int x = 0; x < 32; x++)
            sum += lumi_row_f32(&color, y)[3 * x];
        assert_true(fabsf(sum - 1.5f) < 0.3f);
    }
    lumi_raster_finish(&color);
    sim_scene_destroy(scene);
}

/* What a pixel shows of a bright half-plane whose edge lies `t` pixels beyond the pixel's centre: the integral of a
 * tent a pixel wide to either side. */
static float tent_covered(float t)
{
    if (t <= -1 || t >= 1)
        return t < 0 ? 0 : 1;
    return t < 0 ? (1 + t) * (1 + t) / 2 : 1 - (1 - t) * (1 - t) / 2;
}

/* Wherever the edge lies within a pixel, also where no ray of the pixel itself sees both of its sides. */
static void edges_are_as_soft_as_a_pixel(void **state)
{
    struct lumi_lens lens;
    struct lumi_pose pose;

    (void)state;
    lumi_lens_init_pinhole(&lens, 16, 8, 0.2);
    lumi_pose_look(lumi_vec3(0, 0, 0), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &pose);
    for (int i = 0; i < 10; i++) {
        struct sim_scene *scene;
        struct sim_material m;
        struct lumi_raster color;
        float edge = 0.1f * (float)i; /* pixels right of the image's middle */
        assert_int_equal(sim_scene_create(&scene, NULL), LUMI_OK);
        sim_material_init(&m);
        m.color = v3_grey(0);
        m.emission = v3_grey(1);
        sim_quad(scene, v3(-5, 2, -5), v3(5 + (float)(2 * edge / lens.fx), 0, 0), v3(0, 0, 10), 20,
                 sim_scene_material(scene, &m));
        assert_int_equal(sim_scene_commit(scene, NULL), LUMI_OK);
        assert_int_equal(sim_camera_render(scene, &lens, &pose, 1, &color, NULL, NULL), LUMI_OK);
        for (int y = 0; y < 8; y++)
            for (int x = 0; x < 16; x++) {
                float shown = lumi_row_f32(&color, y)[3 * x], wanted = tent_covered(8 + edge - ((float)x + 0.5f));
                assert_true(fabsf(shown - wanted) < 0.05f);
            }
        lumi_raster_finish(&color);
        sim_scene_destroy(scene);
    }
}

/* Light on the floor under a shining panel. */
static float light_under_panel(float gain)
{
    struct sim_scene *scene;
    struct sim_material m;

    assert_int_equal(sim_scene_create(&scene, NULL), LUMI_OK);
    sim_material_init(&m);
    sim_quad(scene, v3(-1, -1, 0), v3(2, 0, 0), v3(0, 2, 0), 20, sim_scene_material(scene, &m));
    m.emission = v3_grey(0.9f);
    sim_quad(scene, v3(-1, 1, 2), v3(2, 0, 0), v3(0, -2, 0), 20, sim_scene_material(scene, &m));
    sim_scene_light(scene, v3(-1, 1, 2), v3(2, 0, 0), v3(0, -2, 0), gain);
    assert_int_equal(sim_scene_commit(scene, NULL), LUMI_OK);
    float light = sim_vertex_light(scene, 0).x;
    sim_scene_destroy(scene);
    return light;
}

static void lights_give_as_much_more_as_their_gain_says(void **state)
{
    float once = light_under_panel(1);

    (void)state;
    assert_true(once > 0.05f);
    assert_true(fabsf(light_under_panel(3) - 3 * once) < 1e-4f);
}

static void pictures_do_not_depend_on_the_number_of_threads(void **state)
{
    struct lumi_lens lens;
    struct lumi_pose pose;
    struct lumi_raster a, b;

    (void)state;
    lumi_lens_init_pinhole(&lens, 72, 54, 1.4);
    lumi_pose_look(lumi_vec3(0.1, 0, 0), lumi_vec3(0.3, 1, -0.2), lumi_vec3(0, 0, 1), &pose);
    for (int i = 0; sim_places[i]; i++) {
        struct sim_scene *one, *many;
        assert_int_equal(sim_place_open(sim_places[i]->name, &one, NULL), LUMI_OK);
        assert_int_equal(sim_place_open(sim_places[i]->name, &many, NULL), LUMI_OK);
        assert_int_equal(sim_camera_render(one, &lens, &pose, 1, &a, NULL, NULL), LUMI_OK);
        assert_int_equal(sim_camera_render(many, &lens, &pose, 4, &b, NULL, NULL), LUMI_OK);
        assert_memory_equal(a.data, b.data, a.stride * 54);
        double mean = 0;
        for (int y = 0; y < 54; y++)
            for (int x = 0; x < 3 * 72; x++) {
                float v = lumi_row_f32(&a, y)[x];
                assert_true(v >= 0 && v < 50);
                mean += v / (54.0 * 3 * 72);
            }
        assert_true(mean > 0.03 && mean < 1);
        lumi_raster_finish(&a);
        lumi_raster_finish(&b);
        sim_scene_destroy(one);
        sim_scene_destroy(many);
    }
}

static void room_and_court_leave_the_rig_its_space_and_come_close(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct sim_scene *scene;
        float nearest = INFINITY;
        assert_int_equal(sim_place_open(i ? "court" : "room", &scene, NULL), LUMI_OK);
        for (size_t k = 0; k < scene->vertex_count; k++) {
            const float *p = scene->positions[k];
            nearest = fminf(nearest, v3_length(v3(p[0], p[1], p[2])));
        }
        for (int k = 0; k < 4000; k++) {
            float up = 2 * ((float)k + 0.5f) / 4000 - 1, angle = 2.3999632f * (float)k, flat = sqrtf(1 - up * up);
            struct sim_ray ray = {.direction = v3(flat * cosf(angle), flat * sinf(angle), up)};
            struct sim_hit hit;
            sim_trace(scene, &ray, 0, &hit);
            nearest = fminf(nearest, hit.distance);
        }
        assert_true(nearest > 0.45f);
        assert_true(nearest < 0.8f);
        sim_scene_destroy(scene);
    }
}

static void a_place_that_is_not_there_is_an_error(void **state)
{
    struct sim_scene *scene;
    struct lumi_error error;

    (void)state;
    assert_int_equal(sim_place_open("attic", &scene, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "attic"));
    assert_null(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(depth_of_a_wall_is_its_distance_along_the_axis),
        cmocka_unit_test(points_appear_where_the_lens_projects_them),
        cmocka_unit_test(thin_bars_are_antialiased),
        cmocka_unit_test(edges_are_as_soft_as_a_pixel),
        cmocka_unit_test(lights_give_as_much_more_as_their_gain_says),
        cmocka_unit_test(pictures_do_not_depend_on_the_number_of_threads),
        cmocka_unit_test(room_and_court_leave_the_rig_its_space_and_come_close),
        cmocka_unit_test(a_place_that_is_not_there_is_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
