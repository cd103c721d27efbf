/* daemon/store: jobs in, rows and files out, in either mode. */
#include "tests/unit/capture_fixture.h"

#include "daemon/store/store.h"
#include "proto/base/memory.h"

#include <math.h>
#include <sched.h>

#define SIDE 8

static struct lumi_rig rig;
static struct lumi_plan plan;

/* Two cameras, two positions, a bracket of two: eight frames. */
static struct lumi_capture *planned(void **state, const char *name)
{
    struct lumi_capture *capture;

    OK(lumi_rig_arc(&rig, 2, 72, 1, 0.35, SIDE, SIDE, 1.9, 1.5, error));
    lumi_plan_init(&plan, &rig);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.positions = 2;
    plan.turns = 1;
    plan.position_time = 6;
    plan.bracket = 2;
    plan.exposures[0] = 0.01;
    plan.exposures[1] = 0.04;
    OK(lumi_plan_check(&plan, &rig, error));
    OK(lumi_capture_create_live(in_scratch(state, name), &capture, error));
    OK(lumi_store_plan(capture, &rig, &plan, error));
    return capture;
}

static struct lumi_store *opened(struct lumi_capture *capture, bool synchronous)
{
    struct lumi_store_options options;
    struct lumi_store *store;

    lumi_store_options_init(&options);
    options.synchronous = synchronous;
    options.memory = 100000;
    OK(lumi_store_open(capture, &options, &store, error));
    return store;
}

/* Gives a job and waits until it is done. */
static struct lumi_store_done done_of(struct lumi_store *store, const struct lumi_store_job *job)
{
    struct lumi_store_done done;

    OK(lumi_store_give(store, job, error));
    lumi_store_work(store, 0);
    while (!lumi_store_done(store, &done))
        sched_yield();
    assert_int_equal(done.id, job->id);
    return done;
}

static struct lumi_store_job frame_job(int64_t frame, unsigned char *bytes, size_t size)
{
    struct lumi_store_job job = {.kind = LUMI_STORE_FRAME, .id = 100 + (uint64_t)frame, .frame = frame};

    job.file =
        (struct lumi_capture_file){.extension = ".raw", .width = SIDE, .height = SIDE, .camera_time_us = LUMI_NO_TIME};
    job.pieces[0] = (struct iovec){bytes, size / 3};
    job.pieces[1] = (struct iovec){bytes + size / 3, size - size / 3};
    job.piece_count = 2;
    return job;
}

static void a_plan_becomes_rows_with_prior_poses(void **state)
{
    struct lumi_capture *capture = planned(state, "plan");
    struct lumi_capture_frame *frames;
    char *text;
    int count;

    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 8);
    assert_string_equal(frames[0].name, "c00-t00-p000-b0");
    assert_string_equal(frames[7].name, "c01-t00-p001-b1");
    for (int i = 0; i < count; i++) {
        assert_int_equal(frames[i].plan_shot, i / 2);
        assert_int_equal(frames[i].state, LUMI_FRAME_PLANNED);
        assert_true(frames[i].has_pose && frames[i].pose_source == LUMI_POSE_PRIOR);
        assert_true(fabs(frames[i].exposure_offset - (i / 2 % 2 ? 2 : 0)) < 1e-9);
        assert_string_equal(frames[i].camera_name, rig.cameras[i % 2].name);
    }
    lumi_free(frames);
    struct lumi_rig read;
    struct lumi_plan again;
    OK(lumi_capture_get_profile(capture, &text, error));
    OK(lumi_rig_parse(text, strlen(text), "profile", &read, error));
    lumi_free(text);
    OK(lumi_capture_get_plan(capture, &text, error));
    OK(lumi_plan_parse(text, strlen(text), "plan", &read, &again, error));
    assert_memory_equal(&again, &plan, sizeof plan);
    lumi_free(text);
    lumi_capture_close(capture);
}

/* The life of a frame and what surrounds it. */
static void live(struct lumi_store *store)
{
    unsigned char bytes[9000];

    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (unsigned char)(i * 7 ^ i >> 3);
    struct lumi_store_job job = {.kind = LUMI_STORE_SWEEP, .id = 1, .time_us = 1000, .sweep = 0};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_DEVICE, .id = 2, .camera = 1, .device = {.serial = "0815"}};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_SHOT, .id = 3, .frames = {1, 2}, .trigger_us = {5, 6}};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_EXPOSED, .id = 4, .frame = 1, .exposed_us = 7};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = frame_job(1, bytes, sizeof bytes);
    struct lumi_store_done done = done_of(store, &job);
    assert_int_equal(done.code, LUMI_OK);
    assert_int_equal(done.bytes, sizeof bytes);
    job = (struct lumi_store_job){.kind = LUMI_STORE_JUDGED, .id = 5, .frame = 1, .sharpness = 0.5, .text = "smeared"};
    job.judgement.blur_pixels = 3;
    job.judgement.moved = NAN;
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_LOST, .id = 6, .frame = 2, .text = "it never came"};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_RETAKE, .id = 7, .frame = 1};
    done = done_of(store, &job);
    const int64_t shot = done.shot, again = done.frame;
    assert_int_equal(again, 9);
    job.frame = 2;
    done = done_of(store, &job);
    assert_int_equal(done.shot, shot); /* the retakes of a shot are one shot */
    job =
        (struct lumi_store_job){.kind = LUMI_STORE_SHOT, .id = 8, .frames = {9, 10}, .sweep = 1, .trigger_us = {8, 9}};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_CLOCK, .id = 9, .camera = 1, .clock = {.frames = 4}};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){
        .kind = LUMI_STORE_INCIDENT, .id = 10, .key = "late", .text = "by 3 s", .camera = 1, .frame = 2, .time_us = 5};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_SWEEP, .id = 11, .time_us = 2000, .ended = true, .text = "whole"};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = (struct lumi_store_job){.kind = LUMI_STORE_SEAL, .id = 12, .verify = true, .date = "2026-11-23"};
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    FAILS(lumi_store_give(store, &job, error), LUMI_ERR_ARG, "sealed");
    OK(lumi_store_close(store, error));
}

/* The capture is sound and sealed in the end. */
static void life(void **state, const char *name, bool synchronous)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    struct lumi_capture_sweep *sweeps;
    struct lumi_capture_incident *incidents;
    int count;

    live(opened(planned(state, name), synchronous));
    assert_int_equal(problems_of(in_scratch(state, name)), 0);
    OK(lumi_capture_open(in_scratch(state, name), LUMI_CAPTURE_READ, &capture, error));
    assert_true(lumi_capture_sealed(capture));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 10);
    assert_int_equal(frames[0].state, LUMI_FRAME_RETAKEN);
    assert_true(frames[0].exposed_time_us == 7 && frames[0].trigger_time_us == 5 && frames[0].sweep == 0);
    assert_true(frames[0].judgement.blur_pixels == 3 && isnan(frames[0].judgement.moved));
    assert_string_equal(frames[0].reason, "smeared");
    assert_string_equal(frames[0].file, "data/frames/c00-t00-p000-b0.raw");
    assert_int_equal(frames[0].bytes, 9000);
    assert_int_equal(frames[4].retake_of, 1);
    assert_int_equal(frames[4].plan_shot, 0);
    assert_int_equal(frames[4].sweep, 1);
    assert_int_equal(frames[5].state, LUMI_FRAME_TRIGGERED);
    lumi_free(frames);
    OK(lumi_capture_sweeps(capture, &sweeps, &count, error));
    assert_int_equal(count, 1);
    assert_true(sweeps[0].began_us == 1000 && sweeps[0].ended_us == 2000);
    lumi_free(sweeps);
    OK(lumi_capture_incidents(capture, &incidents, &count, error));
    assert_int_equal(count, 1);
    assert_string_equal(incidents[0].text, "by 3 s");
    lumi_free(incidents);
    struct lumi_capture_device device;
    OK(lumi_capture_get_device(capture, 2, &device, error));
    assert_string_equal(device.serial, "0815");
    lumi_capture_close(capture);
}

static void a_capture_is_stored_and_sealed_by_threads(void **state)
{
    life(state, "threads", false);
}

static void a_capture_is_stored_and_sealed_in_virtual_time(void **state)
{
    life(state, "virtual", true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_plan_becomes_rows_with_prior_poses, scratch_setup, scratch_teardown),
        cmocka_unit_test_setup_teardown(a_capture_is_stored_and_sealed_by_threads, scratch_setup, scratch_teardown),
        cmocka_unit_test_setup_teardown(a_capture_is_stored_and_sealed_in_virtual_time, scratch_setup,
                                        scratch_teardown),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
