/* pipeline/hdr: the stages `response` and `merge` over a capture of brackets, whole and not. */
#include "pipeline/hdr/merge_stage.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 128, HEIGHT = 96, POSITIONS = 6 };

static char *folder, *capture_path;

static double light_at(int position, int x, int y)
{
    double wave = 0.5 + 0.3 * sin(x / 9.0 + position) + 0.2 * sin(y / 7.0);

    return 0.02 * exp2(6 * wave);
}

/* The codes of one shot; `curve`: a camera that is not sRGB. */
static void store_shot(struct lumi_capture *capture, int64_t frame, int position, double stops, bool curve, bool broken)
{
    struct lumi_raster picture;
    struct lumi_image_options options;
    struct lumi_error error = {0};
    uint8_t *data;
    size_t size;

    assert_int_equal(lumi_raster_create(&picture, WIDTH, HEIGHT, 3, LUMI_U8), LUMI_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int i = 0; i < 3 * WIDTH; i++) {
            float v = (float)fmin(light_at(position, i / 3, y) * exp2(stops), 1);
            lumi_row_u8(&picture, y)[i] = (uint8_t)((curve ? sqrtf(v) : lumi_srgb_encode(v)) * 255 + 0.5f);
        }
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_PNG;
    assert_int_equal(lumi_image_encode(&picture, &options, &data, &size, &error), LUMI_OK);
    const struct lumi_capture_file file = {.extension = ".png",
                                           .width = WIDTH,
                                           .height = HEIGHT,
                                           .exposure_s = position == 5 ? 0 : 0.004 * exp2(stops),
                                           .iso = 200,
                                           .camera_time_us = LUMI_NO_TIME};
    assert_int_equal(lumi_capture_store_bytes(capture, frame, data, broken ? size / 2 : size, &file, &error), LUMI_OK);
    lumi_free(data);
    lumi_raster_finish(&picture);
}

/* Six positions with three shots; of position 2 the middle one is missing, of 3 only the darkest is there, of 4 one is
 * damaged, and 5's camera says nothing of its exposures. `asked`: stops as the capture has them; what the camera does
 * is in the files. */
static void make_capture(bool curve)
{
    struct lumi_capture_lens lens = {.name = "lens"};
    struct lumi_error error = {0};
    struct lumi_capture *capture;
    int64_t lens_id, camera, place, shot, frame;

    lumi_lens_init_pinhole(&lens.lens, WIDTH, HEIGHT, 1);
    assert_int_equal(lumi_capture_create(capture_path, &capture, &error), LUMI_OK);
    assert_int_equal(lumi_capture_add_lens(capture, &lens, &lens_id, &error), LUMI_OK);
    assert_int_equal(lumi_capture_add_camera(capture, "camera", lens_id, &camera, &error), LUMI_OK);
    assert_int_equal(lumi_capture_begin(capture, &error), LUMI_OK);
    for (int p = 0; p < POSITIONS; p++) {
        const struct lumi_capture_position position = {.number = p};
        assert_int_equal(lumi_capture_add_position(capture, &position, &place, &error), LUMI_OK);
        for (int k = 0; k < 3; k++) {
            g_autofree char *name = g_strdup_printf("p%d-%d", p, k);
            struct lumi_capture_new_frame new_frame = {.name = name, .camera = camera, .row = 0, .column = p};
            struct lumi_pose pose;
            if ((p == 2 && k == 1) || (p == 3 && k > 0))
                continue;
            assert_int_equal(lumi_capture_add_shot(capture, place, k, 2 * (k - 1), &shot, &error), LUMI_OK);
            new_frame.shot = shot;
            assert_int_equal(lumi_capture_add_frame(capture, &new_frame, &frame, &error), LUMI_OK);
            store_shot(capture, frame, p, 2 * (k - 1), curve, p == 4 && k == 2);
            lumi_pose_look(lumi_vec3(p, 0, 0), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &pose);
            assert_int_equal(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "test", &error), LUMI_OK);
        }
    }
    assert_int_equal(lumi_capture_commit(capture, &error), LUMI_OK);
    assert_int_equal(lumi_capture_publish(capture, NULL, &error), LUMI_OK);
    lumi_capture_close(capture);
}

static int make_folder(void **state)
{
    (void)state;
    folder = g_dir_make_tmp("lumi-merge-XXXXXX", NULL);
    capture_path = g_build_filename(folder, "capture", NULL);
    return 0;
}

static int remove_folder(void **state)
{
    g_autofree char *command = g_strdup_printf("rm -rf '%s'", folder);

    (void)state;
    g_free(folder);
    g_free(capture_path);
    return g_spawn_command_line_sync(command, NULL, NULL, NULL, NULL) ? 0 : 1;
}

static struct lumi_run *open_run(const char *response)
{
    struct lumi_parameters parameters;
    struct lumi_run *run;
    struct lumi_error error = {0};

    lumi_run_defaults(&parameters);
    parameters.response = response;
    if (lumi_run_open(capture_path, NULL, &parameters, 2, true, &run, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return run;
}

static void run_stage(struct lumi_run *run, const struct lumi_stage *stage, int made)
{
    struct lumi_error error = {0};
    int skipped = 0;

    if (lumi_run_stage(run, stage, 0, -1, &skipped, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lumi_stage_count(run, stage) - skipped, made);
}

/* Mean of |ln(merged / light)|; `common`: less what is common to all pixels. */
static double error_of(const struct lumi_run *run, int index, bool common)
{
    g_autofree char *path = lumi_run_path(run, "merge", index, ".exr");
    struct lumi_raster merged;
    struct lumi_error error;
    double mean = 0, sum = 0;

    assert_int_equal(lumi_image_read(path, 3, &merged, NULL, &error), LUMI_OK);
    for (int round = 0; round < 2; round++) {
        sum = 0;
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                double away = log((double)lumi_row_f32(&merged, y)[3 * x + 1] / light_at(index, x, y));
                sum += round == 0 ? away : fabs(away - mean);
            }
        mean = common && round == 0 ? sum / (WIDTH * HEIGHT) : mean;
    }
    lumi_raster_finish(&merged);
    return sum / (WIDTH * HEIGHT);
}

static void brackets_become_one_picture_each_and_gaps_are_named(void **state)
{
    (void)state;
    make_capture(false);
    struct lumi_run *run = open_run(NULL);
    assert_int_equal(run->count, POSITIONS);
    assert_int_equal(lumi_stage_count(run, &lumi_stage_response), 0);
    run_stage(run, &lumi_stage_merge, POSITIONS);
    run_stage(run, &lumi_stage_merge, 0);
    for (int i = 0; i < POSITIONS; i++)
        assert_true(error_of(run, i, false) < (i == 3 ? 0.04 : 0.02)); /* of position 3 only the dark shot is there */
    g_autofree char *remarks = lumi_merge_remarks(run);
    assert_null(strstr(remarks, "p0-1:"));
    assert_non_null(strstr(remarks, "p2-0: the shot of +0 stops is missing"));
    assert_non_null(strstr(remarks, "p3-0: the shot of +0, +2 stops is missing"));
    assert_non_null(strstr(remarks, "p4-1: a shot is left out"));
    g_autofree char *path = lumi_run_path(run, "merge", 5, ".txt");
    g_autofree char *text = NULL;
    assert_true(g_file_get_contents(path, &text, NULL, NULL));
    assert_non_null(strstr(text, "the camera did not report them"));
    lumi_run_close(run);
}

static void a_response_of_its_own_is_estimated(void **state)
{
    (void)state;
    make_capture(true);
    struct lumi_run *run = open_run("estimate");
    run_stage(run, &lumi_stage_response, 1);
    run_stage(run, &lumi_stage_merge, POSITIONS);
    double estimated = error_of(run, 0, true);
    g_autofree char *file = g_strdup_printf("%s/response/all.txt", run->work);
    lumi_run_close(run);
    assert_true(estimated < 0.05);
    /* The same from the file; and worse where sRGB is believed. */
    run = open_run(file);
    run_stage(run, &lumi_stage_merge, POSITIONS);
    assert_true(error_of(run, 0, true) == estimated);
    lumi_run_close(run);
    run = open_run(NULL);
    run_stage(run, &lumi_stage_merge, POSITIONS);
    assert_true(error_of(run, 0, true) > 2 * estimated);
    lumi_run_close(run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(brackets_become_one_picture_each_and_gaps_are_named, make_folder,
                                        remove_folder),
        cmocka_unit_test_setup_teardown(a_response_of_its_own_is_estimated, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
