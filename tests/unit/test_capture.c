/* proto/capture: what goes in comes out, in order and whole; frames move through their states and no other way. */
#include "tests/unit/capture_fixture.h"

#include "proto/base/memory.h"
#include "proto/mechanism/rig.h"

#include <math.h>
#include <sys/stat.h>

static void a_published_capture_gives_back_what_was_stored(void **state)
{
    const char *path = in_scratch(state, "a.capture");
    struct lumi_capture_lens lens = small_lens(), back;
    struct lumi_capture_file file = small_file();
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    struct lumi_pose pose;
    int64_t lens_id, camera, id;
    char text[64];
    int count;

    lens.lens.fx = 0.1 + 0.2;
    lens.parameters[0] = 1.0 / 3;
    lumi_pose_look(lumi_vec3(1.0 / 3, 0.1, -2), lumi_vec3(1, 2, 3), lumi_vec3(0, 0, 1), &pose);
    file.exif = "MM\0*";
    file.exif_size = 4;
    file.exposure_s = 1.0 / 250;
    file.iso = 400;
    file.camera_time_us = 12345678901;
    OK(lumi_capture_create(path, &capture, error));
    assert_int_not_equal(access(path, F_OK), 0);
    OK(lumi_capture_set_meta(capture, "surface", "sphere", error));
    OK(lumi_capture_add_lens(capture, &lens, &lens_id, error));
    OK(lumi_capture_add_camera(capture, "c00", lens_id, &camera, error));
    const struct lumi_capture_new_frame frame = {"one", "images/one.jpg", camera, 0, 0, 3, 4};
    OK(lumi_capture_add_frame(capture, &frame, &id, error));
    OK(lumi_capture_trigger_frame(capture, id, 77, error));
    OK(lumi_capture_store_bytes(capture, id, "abc", 3, &file, error));
    OK(lumi_capture_set_pose(capture, id, &pose, LUMI_POSE_TRUE, "a test", error));
    add_frame(capture, camera, "two");
    OK(lumi_capture_publish(capture, "2026-11-23", error));
    lumi_capture_close(capture);
    assert_int_not_equal(access(in_scratch(state, "a.capture.partial"), F_OK), 0);

    OK(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    assert_true(lumi_capture_sealed(capture));
    OK(lumi_capture_get_meta(capture, "surface", text, sizeof text, error));
    assert_string_equal(text, "sphere");
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 2);
    assert_string_equal(frames[0].name, "one");
    assert_string_equal(frames[0].original, "images/one.jpg");
    assert_string_equal(frames[0].file, "data/frames/one.jpg");
    assert_string_equal(frames[0].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_int_equal(frames[0].bytes, 3);
    assert_int_equal(frames[0].state, LUMI_FRAME_RECEIVED);
    assert_int_equal(frames[0].row, 3);
    assert_int_equal(frames[0].column, 4);
    assert_true(frames[0].lens.fx == 0.1 + 0.2 && frames[0].lens.k1 == -0.1);
    assert_string_equal(frames[0].lens_model, "SIMPLE_RADIAL");
    assert_true(frames[0].has_pose && frames[0].pose_source == LUMI_POSE_TRUE);
    assert_memory_equal(&frames[0].pose, &pose, sizeof pose);
    assert_true(frames[0].exposure_s == 1.0 / 250 && frames[0].iso == 400);
    assert_true(frames[0].trigger_time_us == 77 && frames[0].camera_time_us == 12345678901);
    assert_int_equal(frames[1].state, LUMI_FRAME_PLANNED);
    assert_false(frames[1].has_pose);
    assert_true(frames[1].trigger_time_us == LUMI_NO_TIME);
    OK(lumi_capture_lens(capture, frames[0].lens_id, &back, error));
    assert_memory_equal(back.parameters, lens.parameters, sizeof back.parameters);
    void *exif;
    size_t exif_size;
    OK(lumi_capture_exif(capture, frames[0].id, &exif, &exif_size, error));
    assert_int_equal(exif_size, 4);
    assert_memory_equal(exif, "MM\0*", 4);
    lumi_free(exif);
    lumi_free(frames);
    OK(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    assert_int_equal(count, 1);
    lumi_free(frames);
    lumi_capture_close(capture);
    assert_int_equal(problems_of(path), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_published_capture_gives_back_what_was_stored, scratch_setup,
                                        scratch_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
