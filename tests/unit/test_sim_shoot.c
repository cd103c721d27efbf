/* Captures and truth folders of a simulated place. */
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"
#include "sim/camera.h"
#include "sim/exposure.h"
#include "sim/place.h"
#include "sim/shoot.h"

#include <glib.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
    char *dir;
    struct sim_scene *scene;
};

static int set_up(void **state)
{
    static struct fixture f;

    f.dir = g_dir_make_tmp("lumi-sim-XXXXXX", NULL);
    if (!f.dir || sim_place_open("object", &f.scene, NULL) != LUMI_OK)
        return 1;
    *state = &f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    const char *argv[] = {"rm", "-rf", f->dir, NULL};

    sim_scene_destroy(f->scene);
    g_spawn_sync(NULL, (char **)(void *)argv, NULL, G_SPAWN_SEARCH_PATH, NULL, NULL, NULL, NULL, NULL, NULL);
    g_free(f->dir);
    return 0;
}

static void make_rig(struct sim_rig *rig, const char *text)
{
    struct sim_rig_options options;

    sim_rig_options_init(&options);
    options.width = 32;
    options.height = 24;
    options.scale = strncmp(text, "bar", 3) ? 1 : 0.1;
    assert_int_equal(sim_rig_init(rig, text, &options, NULL), LUMI_OK);
}

static void a_capture_holds_every_frame_with_its_true_pose(void **state)
{
    struct fixture *f = *state;
    const char *const rigs[] = {"planar:2x3:0.05", "bar2"};

    for (int k = 0; k < 2; k++) {
        g_autofree char *path = g_strdup_printf("%s/capture%d", f->dir, k);
        g_autofree char *depth = g_strdup_printf("%s/depth%d", f->dir, k);
        struct sim_rig rig;
        struct sim_output output;
        struct lumi_capture *capture;
        struct lumi_capture_frame *frames;
        struct lumi_error error = {0};
        int count;
        char meta[64];
        make_rig(&rig, rigs[k]);
        sim_output_init(&output);
        output.depth_dir = depth;
        output.threads = 2;
        assert_int_equal(sim_shoot(f->scene, "object", &rig, &output, NULL, NULL, path, &error), LUMI_OK);
        assert_int_equal(sim_shoot(f->scene, "object", &rig, &output, NULL, NULL, path, &error), LUMI_ERR_EXISTS);
        assert_int_equal(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &error), LUMI_OK);
        assert_int_equal(lumi_capture_get_meta(capture, "surface", meta, sizeof meta, &error), LUMI_OK);
        assert_string_equal(meta, k ? "sphere" : "plane");
        assert_int_equal(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, &error), LUMI_OK);
        assert_int_equal(count, rig.count);
        for (int i = 0; i < count; i++) {
            const struct sim_view *view = &rig.views[i];
            assert_true(frames[i].has_pose && frames[i].pose_source == LUMI_POSE_TRUE);
            for (int d = 0; d < 9; d++)
                assert_true(fabs(frames[i].pose.r[d] - view->pose.r[d]) < 1e-12);
            assert_true(lumi_length(lumi_sub(frames[i].pose.t, view->pose.t)) < 1e-12);
            assert_int_equal(frames[i].row, view->row);
            assert_int_equal(frames[i].column, view->column);
            assert_true(frames[i].lens.fx == view->lens.fx && frames[i].lens.model == view->lens.model);
            g_autofree char *exr = g_strdup_printf("%s/%s.exr", depth, frames[i].name);
            struct lumi_raster z;
            assert_int_equal(lumi_image_read_channel(exr, "Z", &z, &error), LUMI_OK);
            assert_int_equal(z.width, 32);
            lumi_raster_finish(&z);
        }
        lumi_free(frames);
        lumi_capture_close(capture);
        /* The capture as a rig: the same views, and what they lie on. */
        struct sim_rig again;
        assert_int_equal(sim_rig_from_capture(&again, path, &error), LUMI_OK);
        assert_int_equal(again.count, rig.count);
        assert_int_equal(again.plane, rig.plane);
        assert_true(fabs(again.radius - rig.radius) < 1e-9);
        assert_int_equal(again.views[1].column, rig.views[1].column);
        sim_rig_finish(&again);
        sim_rig_finish(&rig);
    }
}

/* Sum of the squared differences between neighbours in rows. */
static double detail(const struct lumi_raster *picture)
{
    double sum = 0;

    for (int y = 0; y < picture->height; y++) {
        const float *row = lumi_row_f32(picture, y);
        for (int i = 3; i < 3 * picture->width; i++)
            sum += (double)((row[i] - row[i - 3]) * (row[i] - row[i - 3]));
    }
    return sum;
}

static void a_rig_that_turns_smears_its_pictures_and_one_that_stands_does_not(void **state)
{
    struct fixture *f = *state;
    struct sim_rig rig;
    struct lumi_raster truth, still, there, back;

    make_rig(&rig, "arc:3x6:0.2");
    const struct sim_view *view = &rig.views[4];
    struct sim_moment moment = {.angle = view->turn_angle, .drop = view->drop};
    assert_int_equal(sim_camera_render(f->scene, &view->lens, &view->pose, 1, &truth, NULL, NULL), LUMI_OK);
    assert_int_equal(sim_exposure_render(f->scene, &rig.profile, view->camera, &moment, 1, &still, NULL), LUMI_OK);
    moment.moved = 0.3;
    assert_int_equal(sim_exposure_render(f->scene, &rig.profile, view->camera, &moment, 1, &there, NULL), LUMI_OK);
    moment.moved = -0.3;
    assert_int_equal(sim_exposure_render(f->scene, &rig.profile, view->camera, &moment, 1, &back, NULL), LUMI_OK);
    for (int y = 0; y < still.height; y++)
        for (int i = 0; i < 3 * still.width; i++) {
            assert_float_equal(lumi_row_f32(&still, y)[i], lumi_row_f32(&truth, y)[i], 1e-6);
            assert_float_equal(lumi_row_f32(&there, y)[i], lumi_row_f32(&back, y)[i], 1e-4);
        }
    assert_true(detail(&there) < 0.9 * detail(&still));
    lumi_raster_finish(&truth);
    lumi_raster_finish(&still);
    lumi_raster_finish(&there);
    lumi_raster_finish(&back);
    sim_rig_finish(&rig);
}

static void a_camera_that_was_run_into_looks_to_its_right(void **state)
{
    struct fixture *f = *state;
    const double askew = 0.2, c = cos(askew), s = sin(askew);
    struct lumi_raster seen, truth, straight;
    struct sim_rig rig;

    make_rig(&rig, "arc:3x6:0.2");
    const struct sim_view *view = &rig.views[4];
    struct sim_moment moment = {.angle = view->turn_angle, .drop = view->drop, .askew = askew};
    struct lumi_pose pose = view->pose;
    for (int row = 0; row < 3; row++) { /* columns: right, down, forward; the eye stays where it is */
        pose.r[3 * row] = c * view->pose.r[3 * row] - s * view->pose.r[3 * row + 2];
        pose.r[3 * row + 2] = s * view->pose.r[3 * row] + c * view->pose.r[3 * row + 2];
    }
    assert_int_equal(sim_camera_render(f->scene, &view->lens, &pose, 1, &truth, NULL, NULL), LUMI_OK);
    assert_int_equal(sim_camera_render(f->scene, &view->lens, &view->pose, 1, &straight, NULL, NULL), LUMI_OK);
    assert_int_equal(sim_exposure_render(f->scene, &rig.profile, view->camera, &moment, 1, &seen, NULL), LUMI_OK);
    double aside = 0;
    for (int y = 0; y < seen.height; y++)
        for (int i = 0; i < 3 * seen.width; i++) {
            assert_float_equal(lumi_row_f32(&seen, y)[i], lumi_row_f32(&truth, y)[i], 1e-5);
            aside += fabs((double)(lumi_row_f32(&seen, y)[i] - lumi_row_f32(&straight, y)[i]));
        }
    assert_true(aside / (3.0 * seen.width * seen.height) > 0.01); /* there is something to tell them apart by */
    lumi_raster_finish(&seen);
    lumi_raster_finish(&truth);
    lumi_raster_finish(&straight);
    sim_rig_finish(&rig);
}

static void sensor_values_are_a_file_that_develops_to_the_picture(void **state)
{
    struct fixture *f = *state;
    struct sim_rig rig;
    struct sim_output output;
    struct lumi_raster picture, developed, light = {0};
    uint8_t *data;
    size_t size;
    double sum = 0, sum_developed = 0;

    make_rig(&rig, "planar:2x3:0.05");
    sim_output_init(&output);
    output.format = SIM_FORMAT_DNG;
    assert_string_equal(sim_format_extension(output.format), ".dng");
    assert_int_equal(sim_view_render(f->scene, &rig.views[0], &output, NULL, &picture, NULL), LUMI_OK);
    assert_int_equal(sim_view_encode(&picture, 0, 0, &output, &data, &size, NULL), LUMI_OK);
    lumi_raster_finish(&picture);
    g_autofree char *path = g_strdup_printf("%s/view.dng", f->dir);
    assert_true(g_file_set_contents(path, (const char *)data, (gssize)size, NULL));
    lumi_free(data);
    assert_int_equal(lumi_image_read(path, 3, &developed, NULL, NULL), LUMI_OK);
    assert_int_equal(sim_camera_render(f->scene, &rig.views[0].lens, &rig.views[0].pose, 1, &picture, NULL, NULL),
                     LUMI_OK);
    lumi_raster_convert(&developed, LUMI_F32, &light);
    assert_int_equal(developed.width, picture.width);
    assert_int_equal(developed.height, picture.height);
    for (int y = 4; y < picture.height - 4; y++)
        for (int i = 12; i < 3 * picture.width - 12; i++) {
            sum += (double)lumi_row_f32(&picture, y)[i];
            sum_developed += (double)lumi_row_f32(&light, y)[i];
        }
    assert_true(fabs(sum_developed / sum - 1) < 0.03);
    lumi_raster_finish(&picture);
    lumi_raster_finish(&developed);
    lumi_raster_finish(&light);
    sim_rig_finish(&rig);
}

static void views_can_be_given_one_by_one(void **state)
{
    struct sim_rig from, rig = {0};
    struct lumi_lens wrong = {0};

    (void)state;
    make_rig(&from, "planar:2x3:0.05");
    for (int i = 0; i < from.count; i++)
        assert_int_equal(sim_rig_add(&rig, &from.views[i].lens, &from.views[i].pose, NULL), LUMI_OK);
    assert_int_equal(sim_rig_add(&rig, &wrong, &from.views[0].pose, NULL), LUMI_ERR_FORMAT);
    assert_int_equal(rig.count, 6);
    assert_memory_equal(&rig.views[4].pose, &from.views[4].pose, sizeof rig.views[4].pose);
    sim_rig_finish(&rig);
    sim_rig_finish(&from);
    assert_int_equal(sim_rig_from_capture(&rig, "/there/is/none", NULL), LUMI_ERR_NOTFOUND);
}

static void truth_writes_the_bytes_again_for_any_number_of_threads(void **state)
{
    struct fixture *f = *state;
    char *json[2], *png[2];
    gsize json_size[2], png_size[2];

    for (int k = 0; k < 2; k++) {
        g_autofree char *dir = g_strdup_printf("%s/truth%d", f->dir, k);
        g_autofree char *poses = g_strdup_printf("%s/transforms.json", dir);
        g_autofree char *image = g_strdup_printf("%s/images/r01c02.png", dir);
        struct sim_rig rig;
        struct sim_output output;
        struct lumi_error error = {0};
        make_rig(&rig, "planar:2x3:0.05");
        sim_output_init(&output);
        output.depth = true;
        output.threads = 1 + 3 * k;
        output.sensor.full_well = 3000;
        output.sensor.bits = 12;
        assert_int_equal(sim_truth_write(f->scene, &rig, &output, dir, &error), LUMI_OK);
        assert_int_equal(sim_truth_write(f->scene, &rig, &output, dir, &error), LUMI_ERR_EXISTS);
        assert_true(g_file_get_contents(poses, &json[k], &json_size[k], NULL));
        assert_true(g_file_get_contents(image, &png[k], &png_size[k], NULL));
        sim_rig_finish(&rig);
    }
    assert_string_equal(json[0], json[1]);
    assert_int_equal(png_size[0], png_size[1]);
    assert_memory_equal(png[0], png[1], png_size[0]);
    struct lumi_image_info info;
    assert_int_equal(lumi_image_info_memory(png[0], png_size[0], "r01c02.png", &info, NULL), LUMI_OK);
    assert_int_equal(info.sample, LUMI_U16);
    /* The first camera: left and above the middle, its y up and z backward in the file. */
    assert_non_null(strstr(json[0], "[[1, 0, 0, -0.05"));
    assert_non_null(strstr(json[0], "[0, 0, -1, 0], [0, 1, 0, 0.025"));
    for (int k = 0; k < 2; k++) {
        g_free(json[k]);
        g_free(png[k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_capture_holds_every_frame_with_its_true_pose),
        cmocka_unit_test(a_rig_that_turns_smears_its_pictures_and_one_that_stands_does_not),
        cmocka_unit_test(a_camera_that_was_run_into_looks_to_its_right),
        cmocka_unit_test(sensor_values_are_a_file_that_develops_to_the_picture),
        cmocka_unit_test(views_can_be_given_one_by_one),
        cmocka_unit_test(truth_writes_the_bytes_again_for_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
