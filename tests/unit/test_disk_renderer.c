/* render/cpu: the disk renderer against scenes whose every ray is known. */
#include "render/cpu/disk_renderer.h"

#include "render/cpu/plane_renderer.h"
#include "tests/unit/analytic_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static struct scene_set wall, room, ball; /* meshes; shared by the tests, not changed by them */
static struct scene_set wall_dense;

static void render(struct scene_set *s, const struct lumi_lens *lens, const struct lumi_pose *pose,
                   const struct lumi_disk_settings *settings, struct lumi_picture *picture)
{
    struct lumi_error error = {0};
    int code = lumi_render_disks(s->set, lens, pose, settings, picture, &error);

    if (code != LUMI_OK)
        fail_msg("%s", error.text);
}

/* How near a picture is to the truth, over covered pixels where the truth sees something: the share that is off by more
 * than 16 of 255 (edges of depth, which a lattice of depths cannot follow), and the PSNR of the others. */
static double psnr(const struct lumi_picture *picture, enum scene_kind kind, const struct lumi_lens *lens,
                   const struct lumi_pose *pose, double *off)
{
    double sum = 0;
    long count = 0, wrong = 0;

    for (int y = 0; y < lens->height; y++)
        for (int x = 0; x < lens->width; x++) {
            struct lumi_vec3 d;
            uint8_t truth[3];
            double square = 0, worst = 0;
            if (!lumi_lens_unproject(lens, x + 0.5, y + 0.5, &d) ||
                !scene_pixel(kind, pose->t, lumi_rotate(pose->r, d), truth) ||
                !(lumi_row_f32(&picture->weight, y)[x] > 0))
                continue;
            for (int c = 0; c < 3; c++) {
                double e = (double)lumi_row_u8(&picture->color, y)[3 * x + c] - truth[c];
                square += e * e;
                worst = fmax(worst, fabs(e));
            }
            if (worst > 16)
                wrong++;
            else
                sum += square, count += 3;
        }
    *off = (double)wrong / ((double)count / 3 + (double)wrong);
    return 10 * log10(255.0 * 255.0 * (double)count / fmax(sum, 1e-9));
}

static struct lumi_lens perspective(int width, int height, double fov)
{
    struct lumi_lens lens;

    lumi_lens_init_pinhole(&lens, width, height, fov);
    return lens;
}

static struct lumi_pose look(double x, double y, double z, double dx, double dy, double dz)
{
    struct lumi_pose pose;

    lumi_pose_look(lumi_vec3(x, y, z), lumi_vec3(dx, dy, dz), fabs(dz) > 0.9 ? lumi_vec3(0, -1, 0) : lumi_vec3(0, 0, 1),
                   &pose);
    return pose;
}

static void before_a_plane_the_picture_is_the_truth(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(150, 110, 0.7);
    struct lumi_pose poses[] = {look(0.03, 0.04, 0, 0, 0, 1), look(-0.05, 0.02, 0.3, 0.1, 0, 1),
                                look(0.02, -0.03, -0.25, 0, 0.02, 1)};

    (void)state;
    lumi_disk_settings_default(&settings);
    for (int i = 0; i < 3; i++) {
        for (int dense = 0; dense < 2; dense++) {
            struct lumi_picture picture;
            render(dense ? &wall_dense : &wall, &lens, &poses[i], &settings, &picture);
            double off, db = psnr(&picture, SCENE_WALL, &lens, &poses[i], &off);
            print_message("wall, pose %d, %s: %.2f dB, %.2f %% off, %ld of %ld covered\n", i, dense ? "depth" : "mesh",
                          db, 100 * off, picture.covered, picture.imaged);
            assert_true(db > 38);
            assert_true(off < 0.03);
            assert_true((double)picture.covered > 0.99 * (double)picture.imaged);
            lumi_picture_finish(&picture);
        }
    }
}

static void inside_a_sphere_the_picture_is_the_truth(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(150, 110, 1.2);
    struct lumi_pose poses[] = {look(0, 0, 0, 1, 0, 0), look(0.1, -0.05, 0.08, -0.3, 1, 0.2),
                                look(-0.2, 0.05, 0, -0.9, -0.4, -0.3)};

    (void)state;
    lumi_disk_settings_default(&settings);
    for (int i = 0; i < 3; i++) {
        struct lumi_picture picture;
        render(&room, &lens, &poses[i], &settings, &picture);
        double off, db = psnr(&picture, SCENE_ROOM, &lens, &poses[i], &off);
        print_message("room, pose %d: %.2f dB, %.2f %% off, %ld of %ld covered\n", i, db, 100 * off, picture.covered,
                      picture.imaged);
        assert_true(db > 50);
        assert_true(off == 0);
        assert_int_equal(picture.covered, picture.imaged);
        lumi_picture_finish(&picture);
    }
}

static void outside_a_sphere_the_picture_is_the_truth(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(150, 110, 0.6);
    /* Beyond the cameras, on their sphere, and nearer than they are. */
    struct lumi_pose poses[] = {look(4, 0.5, 0.3, -4, -0.5, -0.3), look(0.4, 2.9, 0.2, -0.4, -2.9, -0.2),
                                look(-1.5, -1.5, 0.4, 1.5, 1.5, -0.4)};

    (void)state;
    lumi_disk_settings_default(&settings);
    for (int i = 0; i < 3; i++) {
        struct lumi_picture picture;
        render(&ball, &lens, &poses[i], &settings, &picture);
        double off, db = psnr(&picture, SCENE_BALL, &lens, &poses[i], &off);
        print_message("ball, pose %d: %.2f dB, %.2f %% off, %ld of %ld covered\n", i, db, 100 * off, picture.covered,
                      picture.imaged);
        assert_true(db > 32);
        assert_true(off < 0.1);
        assert_true(picture.covered > picture.imaged / 4);
        lumi_picture_finish(&picture);
    }
}

/* Seen from 60 cm aside, the panel stands before a part of the wall that its view saw: of pixels that show the panel,
 * how many have the wall's distance mixed in? */
static long mixed_pixels(struct lumi_viewset *set, enum lumi_depth_test test)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(160, 120, 0.6);
    struct lumi_pose pose = look(0.6, 0.02, 0, -0.3, 0, 1);
    struct lumi_picture picture;
    long mixed = 0, panel = 0;

    lumi_disk_settings_default(&settings);
    settings.depth_test = test;
    settings.stretch = 0;
    assert_int_equal(lumi_render_disks(set, &lens, &pose, &settings, &picture, NULL), LUMI_OK);
    for (int y = 0; y < lens.height; y++)
        for (int x = 0; x < lens.width; x++) {
            struct lumi_vec3 d;
            assert_true(lumi_lens_unproject(&lens, x + 0.5, y + 0.5, &d));
            double distance = scene_hit(SCENE_WALL, pose.t, lumi_rotate(pose.r, d));
            double z = pose.t.z + distance * lumi_rotate(pose.r, d).z;
            if (z > 2.5 || !(lumi_row_f32(&picture.weight, y)[x] > 0))
                continue;
            panel++;
            mixed += fabs((double)lumi_row_f32(&picture.inverse_distance, y)[x] * distance - 1) > 0.05;
        }
    assert_true(panel > 300);
    lumi_picture_finish(&picture);
    return mixed;
}

static void nearer_surfaces_hide_farther_ones_of_the_same_view(void **state)
{
    struct lumi_view views[2] = {wall_dense.views[3], wall_dense.views[4]};
    struct lumi_viewset *set;

    (void)state;
    for (int i = 0; i < 2; i++)
        views[i].disk = (struct lumi_disk){2, 2, 2, 2};
    assert_int_equal(
        lumi_viewset_create(2, views, wall_dense.images + 3, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &set, NULL), LUMI_OK);
    long intra = mixed_pixels(set, LUMI_DEPTH_INTRA), none = mixed_pixels(set, LUMI_DEPTH_NONE),
         inter = mixed_pixels(set, LUMI_DEPTH_INTER);
    print_message("panel pixels with the wall mixed in: intra %ld, none %ld, inter %ld\n", intra, none, inter);
    assert_true(none > 100);
    assert_true(intra < none / 4);
    assert_true(inter <= intra);
    lumi_viewset_destroy(set);
}

static void a_ray_through_a_view_s_centre_shows_that_view_alone(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = {
        .model = LUMI_LENS_BROWN, .width = 160, .height = 128, .fx = 160, .fy = 160, .cx = 80, .cy = 64};
    struct lumi_picture picture;

    (void)state;
    lumi_disk_settings_default(&settings);
    /* The middle camera: the others' disks end at its centre, so the picture is the view, pixel by pixel. */
    render(&wall, &lens, &wall.views[4].pose, &settings, &picture);
    for (int y = 0; y < 128; y++)
        for (int x = 0; x < 160; x++) {
            assert_true(fabsf(lumi_row_f32(&picture.weight, y)[x] - 1) < 1e-3f);
            for (int c = 0; c < 3; c++)
                assert_true(
                    abs(lumi_row_u8(&picture.color, y)[3 * x + c] - lumi_row_u8(&wall.images[4], y)[3 * x + c]) <= 1);
        }
    lumi_picture_finish(&picture);
}

static void weights_follow_the_kernel_and_the_disk_s_scale(void **state)
{
    const float at = 0.05f / 0.1f; /* between two cameras, seen straight ahead */
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(3, 3, 0.01);
    struct lumi_pose pose = look(0.05, 0, 0, 0, 0, 1);
    struct lumi_disk disk = {0.1f, 0.1f, 0.1f, 0.1f};

    (void)state;
    lumi_disk_settings_default(&settings);
    settings.stretch = 0;
    for (int kernel = 0; kernel < 3; kernel++)
        for (int wide = 0; wide < 2; wide++) {
            struct lumi_picture picture;
            double expected = 0;
            settings.kernel = kernel;
            settings.disk_scale = wide ? 1.6f : 1;
            for (int i = 0; i < 9; i++)
                expected +=
                    (double)lumi_disk_weight(&disk, LUMI_DISK_OVAL, (enum lumi_disk_kernel)kernel, settings.disk_scale,
                                             0.05f - (float)wall.views[i].pose.t.x, (float)wall.views[i].pose.t.y);
            render(&wall, &lens, &pose, &settings, &picture);
            assert_true(fabs((double)lumi_row_f32(&picture.weight, 1)[1] - expected) < 1e-3);
            assert_true(wide || fabs(expected - 2 * (double)lumi_disk_weight(&disk, LUMI_DISK_OVAL,
                                                                             (enum lumi_disk_kernel)kernel, 1,
                                                                             at * 0.1f, 0)) < 1e-4);
            lumi_picture_finish(&picture);
        }
}

static void rectangular_disks_cover_their_corners(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(3, 3, 0.01);
    struct lumi_pose pose = look(0.08, 0.08, 0, 0, 0, 1);
    struct lumi_viewset *sets[2];
    float weights[2];

    (void)state;
    lumi_disk_settings_default(&settings);
    for (int i = 0; i < 2; i++) {
        struct lumi_picture picture;
        struct lumi_error error = {0};
        /* The middle view alone: (8, 8) cm lies outside the oval of 10 cm and inside the rectangle. */
        assert_int_equal(lumi_viewset_create(1, &wall.views[4], &wall.images[4], (enum lumi_disk_shape)i,
                                             LUMI_KERNEL_LINEAR, &sets[i], &error),
                         LUMI_OK);
        assert_int_equal(lumi_render_disks(sets[i], &lens, &pose, &settings, &picture, &error), LUMI_OK);
        weights[i] = lumi_row_f32(&picture.weight, 1)[1];
        assert_int_equal(picture.covered, i ? 9 : 0);
        lumi_picture_finish(&picture);
        lumi_viewset_destroy(sets[i]);
    }
    assert_true(weights[0] == 0);
    assert_true(fabsf(weights[1] - 0.2f * 0.2f) < 1e-3f);
}

static void the_same_direction_has_the_same_colour_in_every_projection(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_pose pose = look(0.1, 0.05, -0.02, 0.6, 0.8, 0.1);
    struct lumi_lens lenses[3] = {perspective(160, 120, 1.4)};
    struct lumi_picture pictures[3];
    int compared = 0, sum = 0;

    (void)state;
    lumi_disk_settings_default(&settings);
    lenses[1] = (struct lumi_lens){
        .model = LUMI_LENS_FISHEYE, .width = 220, .height = 220, .fx = 70, .fy = 70, .cx = 110, .cy = 110};
    lenses[2] = (struct lumi_lens){.model = LUMI_LENS_EQUIRECTANGULAR,
                                   .width = 440,
                                   .height = 220,
                                   .fx = 220 / LUMI_PI,
                                   .fy = 220 / LUMI_PI,
                                   .cx = 220,
                                   .cy = 110};
    for (int i = 0; i < 3; i++)
        render(&room, &lenses[i], &pose, &settings, &pictures[i]);
    /* All round, wrap-around and nadir included, the equirectangular picture is the truth where views look. */
    double off, db = psnr(&pictures[2], SCENE_ROOM, &lenses[2], &pose, &off);
    print_message("equirectangular: %.2f dB, %ld of %ld covered\n", db, pictures[2].covered, pictures[2].imaged);
    assert_true(db > 48 && off == 0);
    for (int x = 0; x < 440; x += 439)
        for (int y = 90; y < 130; y++)
            assert_true(lumi_row_f32(&pictures[2].weight, y)[x] > 0);
    for (int y = 10; y < 110; y += 7)
        for (int x = 10; x < 150; x += 7) {
            struct lumi_vec3 d;
            assert_true(lumi_lens_unproject(&lenses[0], x + 0.5, y + 0.5, &d));
            for (int i = 1; i < 3; i++) {
                double px, py;
                assert_true(lumi_lens_project(&lenses[i], d, &px, &py));
                for (int c = 0; c < 3; c++) {
                    int a = lumi_row_u8(&pictures[0].color, y)[3 * x + c];
                    int b = lumi_row_u8(&pictures[i].color, (int)py)[3 * (int)px + c];
                    sum += abs(a - b); /* up to half a pixel apart */
                    compared++;
                }
            }
        }
    assert_true(compared > 1000);
    print_message("mean difference between projections: %.2f levels\n", (double)sum / compared);
    assert_true(sum < 3 * compared);
    for (int i = 0; i < 3; i++)
        lumi_picture_finish(&pictures[i]);
}

static void the_bytes_do_not_depend_on_the_number_of_threads(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(150, 110, 1.1);
    struct lumi_pose pose = look(0.1, 0.05, 0.1, 0.2, 1, 0);
    const enum lumi_depth_test tests[] = {LUMI_DEPTH_INTRA, LUMI_DEPTH_INTER};

    (void)state;
    lumi_disk_settings_default(&settings);
    settings.sample = LUMI_F32;
    for (int i = 0; i < 2; i++) {
        struct lumi_picture one, eight;
        settings.depth_test = tests[i];
        settings.threads = 1;
        render(&room, &lens, &pose, &settings, &one);
        settings.threads = 8;
        render(&room, &lens, &pose, &settings, &eight);
        for (int y = 0; y < lens.height; y++) {
            assert_memory_equal(lumi_row_f32(&one.color, y), lumi_row_f32(&eight.color, y),
                                (size_t)lens.width * 3 * sizeof(float));
            assert_memory_equal(lumi_row_f32(&one.weight, y), lumi_row_f32(&eight.weight, y),
                                (size_t)lens.width * sizeof(float));
        }
        lumi_picture_finish(&one);
        lumi_picture_finish(&eight);
    }
}

/* Seen from the place it was taken, a mesh covers every pixel exactly once: no cracks between triangles or tiles. */
static void neighbouring_triangles_leave_no_gap_and_do_not_overlap(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(333, 251, 0.6);
    struct lumi_pose pose = look(0.013, 0.021, 0.05, 0.01, 0.02, 1);
    struct lumi_viewset *set;
    struct lumi_picture picture;

    (void)state;
    lumi_disk_settings_default(&settings);
    settings.stretch = 0;
    settings.depth_test = LUMI_DEPTH_NONE; /* every triangle that takes a pixel adds its weight */
    settings.kernel = LUMI_KERNEL_LINEAR;
    struct lumi_view view = room.views[30];
    assert_int_equal(lumi_viewset_create(1, &view, &room.images[30], LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &set, NULL),
                     LUMI_OK);
    pose = view.pose;
    assert_int_equal(lumi_render_disks(set, &lens, &pose, &settings, &picture, NULL), LUMI_OK);
    assert_int_equal(picture.covered, picture.imaged);
    for (int y = 0; y < lens.height; y++)
        for (int x = 0; x < lens.width; x++)
            assert_true(fabsf(lumi_row_f32(&picture.weight, y)[x] - 1) < 1e-3f);
    lumi_picture_finish(&picture);
    lumi_viewset_destroy(set);
}

static void views_that_make_no_sense_are_refused_by_number(void **state)
{
    struct lumi_view views[2] = {wall.views[0], wall.views[1]};
    struct lumi_viewset *set;
    struct lumi_error error = {0};

    (void)state;
    views[1].pose.r[0] = NAN;
    assert_int_equal(lumi_viewset_create(2, views, wall.images, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &set, &error),
                     LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "view 1"));
    views[1] = wall.views[1];
    views[1].disk.u_neg = 0;
    assert_int_equal(lumi_viewset_create(2, views, wall.images, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &set, &error),
                     LUMI_ERR_ARG);
    views[1] = wall.views[1];
    views[1].mesh = NULL;
    views[1].inverse_depth = NULL;
    assert_int_equal(lumi_viewset_create(2, views, wall.images, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &set, &error),
                     LUMI_ERR_ARG);
}

static void memory_that_runs_out_is_an_error_and_leaks_nothing(void **state)
{
    struct lumi_disk_settings settings;
    struct lumi_lens lens = perspective(64, 48, 1);
    struct lumi_pose pose = look(0, 0, 0, 1, 0, 0);
    int failures = 0;

    (void)state;
    lumi_disk_settings_default(&settings);
    settings.threads = 1;
    for (long after = 0; after < 2000; after++) {
        struct lumi_picture picture = {0};
        struct lumi_error error = {0};
        lumi_alloc_fail_after(after);
        int code = lumi_render_disks(room.set, &lens, &pose, &settings, &picture, &error);
        lumi_alloc_fail_after(-1);
        lumi_picture_finish(&picture);
        if (code == LUMI_OK)
            break;
        assert_int_equal(code, LUMI_ERR_NOMEM);
        assert_true(error.text[0] != '\0');
        failures++;
    }
    assert_true(failures > 20 && failures < 2000);
}

/* With all surfaces on one plane, blending over that plane is exact too. */
static void the_plane_method_is_right_for_a_plane(void **state)
{
    const int triangles[] = {0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4, 3, 4, 6, 4, 7, 6, 4, 5, 7, 5, 8, 7};
    const struct lumi_camera_mesh mesh = {triangles, 8};
    struct lumi_plane_settings settings = {
        .axis = {0, 0, 1}, .inverse_depth = 1 / 3.0, .filter = LUMI_FILTER_CUBIC, .sample = LUMI_U8};
    struct lumi_lens lens = perspective(150, 110, 0.7);
    struct lumi_pose pose = look(0.03, 0.04, 0, 0, 0, 1);
    double db[2], off;

    (void)state;
    for (int i = 0; i < 2; i++) {
        struct lumi_picture picture;
        settings.inverse_depth = i ? 1 / 1.2 : 1 / 3.0;
        assert_int_equal(lumi_render_plane(wall.set, &mesh, &lens, &pose, &settings, &picture, NULL), LUMI_OK);
        assert_int_equal(picture.covered, picture.imaged);
        /* Beside the panel, which lies on another plane. */
        double sum = 0;
        for (int y = 0; y < 110; y++)
            for (int x = 0; x < 30; x++) {
                struct lumi_vec3 d;
                uint8_t truth[3];
                assert_true(lumi_lens_unproject(&lens, x + 0.5, y + 0.5, &d));
                scene_pixel(SCENE_WALL, pose.t, lumi_rotate(pose.r, d), truth);
                for (int c = 0; c < 3; c++)
                    sum += pow((double)lumi_row_u8(&picture.color, y)[3 * x + c] - truth[c], 2);
            }
        db[i] = 10 * log10(255.0 * 255.0 * 110 * 30 * 3 / sum);
        psnr(&picture, SCENE_WALL, &lens, &pose, &off);
        lumi_picture_finish(&picture);
    }
    print_message("plane at the wall %.2f dB, before it %.2f dB\n", db[0], db[1]);
    assert_true(db[0] > 45);
    assert_true(db[0] > db[1] + 3);
}

static int open_scenes(void **state)
{
    (void)state;
    return scene_open(&wall, SCENE_WALL, true) | scene_open(&wall_dense, SCENE_WALL, false) |
           scene_open(&room, SCENE_ROOM, true) | scene_open(&ball, SCENE_BALL, true);
}

static int close_scenes(void **state)
{
    (void)state;
    scene_close(&wall);
    scene_close(&wall_dense);
    scene_close(&room);
    scene_close(&ball);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(before_a_plane_the_picture_is_the_truth),
        cmocka_unit_test(inside_a_sphere_the_picture_is_the_truth),
        cmocka_unit_test(outside_a_sphere_the_picture_is_the_truth),
        cmocka_unit_test(nearer_surfaces_hide_farther_ones_of_the_same_view),
        cmocka_unit_test(a_ray_through_a_view_s_centre_shows_that_view_alone),
        cmocka_unit_test(weights_follow_the_kernel_and_the_disk_s_scale),
        cmocka_unit_test(rectangular_disks_cover_their_corners),
        cmocka_unit_test(the_same_direction_has_the_same_colour_in_every_projection),
        cmocka_unit_test(the_bytes_do_not_depend_on_the_number_of_threads),
        cmocka_unit_test(neighbouring_triangles_leave_no_gap_and_do_not_overlap),
        cmocka_unit_test(views_that_make_no_sense_are_refused_by_number),
        cmocka_unit_test(memory_that_runs_out_is_an_error_and_leaks_nothing),
        cmocka_unit_test(the_plane_method_is_right_for_a_plane),
    };

    return cmocka_run_group_tests(tests, open_scenes, close_scenes);
}
