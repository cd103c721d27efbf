/* render/cpu: the disk renderer against scenes whose every ray is known. */
#include "render/cpu/disk_renderer.h"

#include "tests/unit/analytic_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

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
    };

    return cmocka_run_group_tests(tests, open_scenes, close_scenes);
}
