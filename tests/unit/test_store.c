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

/* ---- Many frames ---- */

#define BIG 32

/* One position after another: `frames` frames of one camera. */
static struct lumi_capture *many(void **state, const char *name, int frames)
{
    struct lumi_capture *capture;

    OK(lumi_capture_create_live(in_scratch(state, name), &capture, error));
    const int64_t camera = add_camera(capture, "c");
    OK(lumi_capture_begin(capture, error));
    for (int i = 0; i < frames; i++) {
        char frame[16];
        snprintf(frame, sizeof frame, "f%04d", i);
        assert_int_equal(add_frame(capture, camera, frame), i + 1);
    }
    OK(lumi_capture_commit(capture, error));
    return capture;
}

static struct lumi_store_job small_job(int64_t frame, unsigned char *bytes, size_t size)
{
    struct lumi_store_job job = frame_job(frame, bytes, size);

    job.file = small_file();
    return job;
}

static int disk_left;
static int simulated_disk(void *context, size_t bytes, struct lumi_error *error)
{
    (void)context;
    (void)bytes;
    return disk_left-- > 0 ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOSPACE, "the disk is full");
}

static void what_does_not_fit_is_told_and_leaves_the_frame_as_it_was(void **state)
{
    struct lumi_store_options options;
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    unsigned char bytes[5000];
    struct lumi_store *store;
    int count;

    memset(bytes, 7, sizeof bytes);
    lumi_store_options_init(&options);
    options.synchronous = true;
    options.disk = simulated_disk;
    disk_left = 1;
    OK(lumi_store_open(many(state, "full", 2), &options, &store, error));
    struct lumi_store_job job = small_job(1, bytes, sizeof bytes);
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    job = small_job(2, bytes, sizeof bytes);
    struct lumi_store_done done = done_of(store, &job);
    assert_int_equal(done.code, LUMI_ERR_NOSPACE);
    assert_non_null(strstr(done.text, "the disk is full"));
    disk_left = 1; /* somebody made room */
    assert_int_equal(done_of(store, &job).code, LUMI_OK);
    assert_int_equal(done_of(store, &job).code, LUMI_ERR_NOSPACE);
    disk_left = 1;
    done = done_of(store, &job);
    assert_int_equal(done.code, LUMI_ERR_ARG); /* it is there already, and stays */
    OK(lumi_store_close(store, error));
    assert_int_equal(problems_of(in_scratch(state, "full")), 0);
    OK(lumi_capture_open(in_scratch(state, "full"), LUMI_CAPTURE_READ, &capture, error));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    assert_int_equal(count, 2);
    lumi_free(frames);
    lumi_capture_close(capture);
}

static void memory_is_bounded_and_one_frame_always_fits(void **state)
{
    struct lumi_store_options options;
    struct lumi_store_figures figures;
    unsigned char bytes[5000] = {1};
    struct lumi_store *store;

    lumi_store_options_init(&options);
    options.synchronous = true;
    options.memory = 4000;
    OK(lumi_store_open(many(state, "a", 3), &options, &store, error));
    struct lumi_store_job job = small_job(1, bytes, sizeof bytes);
    OK(lumi_store_give(store, &job, error)); /* larger than all of it, and alone */
    assert_int_equal(lumi_store_room(store), 0);
    job = small_job(2, bytes, 10);
    FAILS(lumi_store_give(store, &job, error), LUMI_ERR_LIMIT, "5000 bytes wait for the disk");
    job.kind = LUMI_STORE_EXPOSED; /* rows have room */
    job.piece_count = 0;
    OK(lumi_store_give(store, &job, error));
    lumi_store_figures(store, &figures);
    assert_true(figures.waiting == 5000 && figures.jobs == 2 && figures.room == 0);
    lumi_store_work(store, 1);
    lumi_store_figures(store, &figures);
    assert_true(figures.waiting == 0 && figures.jobs == 1 && figures.stored_bytes == 5000);
    OK(lumi_store_close(store, error));
}

static void jobs_of_one_frame_keep_their_order_and_a_failing_one_stands_alone(void **state)
{
    static unsigned char bytes[400000];
    struct lumi_store *store;
    struct lumi_store_options options;
    struct lumi_store_done done;
    int seen = 0;

    lumi_store_options_init(&options);
    options.writers = 2;
    OK(lumi_store_open(many(state, "a", BIG), &options, &store, error));
    for (int i = 1; i <= BIG; i++) {
        struct lumi_store_job job = small_job(i, bytes, sizeof bytes);
        job.id = (uint64_t)(10 * i);
        OK(lumi_store_give(store, &job, error));
        job = (struct lumi_store_job){.kind = LUMI_STORE_JUDGED, .id = (uint64_t)(10 * i + 1), .frame = i};
        job.accepted = true;
        OK(lumi_store_give(store, &job, error));
        job.id++;
        job.frame = 1000 + i; /* there is none */
        OK(lumi_store_give(store, &job, error));
    }
    uint64_t last[BIG + 1] = {0};
    while (seen < 3 * BIG) {
        if (!lumi_store_done(store, &done)) {
            sched_yield();
            continue;
        }
        seen++;
        if (done.id % 10 == 2) {
            assert_int_equal(done.code, LUMI_ERR_ARG);
            continue;
        }
        if (done.code != LUMI_OK)
            fail_msg("job %d: %s", (int)done.id, done.text);
        assert_true(done.id > last[done.id / 10]);
        last[done.id / 10] = done.id;
    }
    OK(lumi_store_close(store, error));
    assert_int_equal(problems_of(in_scratch(state, "a")), 0);
}

/* ---- The second copy ---- */

static void store_all(struct lumi_store *store, int frames)
{
    static unsigned char bytes[70000];

    for (int i = 1; i <= frames; i++) {
        for (size_t k = 0; k < sizeof bytes; k++)
            bytes[k] = (unsigned char)(k * (size_t)i >> 4);
        struct lumi_store_job job = small_job(i, bytes, sizeof bytes - 100 * (size_t)i);
        assert_int_equal(done_of(store, &job).code, LUMI_OK);
    }
}

static struct lumi_store_done seal_of(struct lumi_store *store)
{
    const struct lumi_store_job job = {.kind = LUMI_STORE_SEAL, .id = 9, .verify = true};

    return done_of(store, &job);
}

static struct lumi_store_options with_copy(void **state, bool synchronous)
{
    struct lumi_store_options options;

    lumi_store_options_init(&options);
    options.synchronous = synchronous;
    options.second_copy = in_scratch(state, "disk2");
    return options;
}

static void copied(void **state, const char *name, bool synchronous)
{
    struct lumi_store_options options = with_copy(state, synchronous);
    struct lumi_store *store;

    shell("mkdir -p '%s'", options.second_copy);
    OK(lumi_store_open(many(state, name, 5), &options, &store, error));
    store_all(store, 5);
    struct lumi_store_done done = seal_of(store);
    assert_int_equal(done.code, LUMI_OK);
    assert_non_null(strstr(done.text, "second copy: "));
    OK(lumi_store_close(store, error));
    shell("diff -r '%s' '%s/%s'", in_scratch(state, name), options.second_copy, name);
    assert_int_equal(problems_of(in_scratch(state, name)), 0);
}

static void a_second_copy_is_the_same_and_verified(void **state)
{
    copied(state, "a", false);
    copied(state, "b", true);
}

static void a_second_copy_goes_on_after_an_interruption_and_is_mended(void **state)
{
    struct lumi_store_options options = with_copy(state, true);
    struct lumi_capture *capture;
    struct lumi_store *store;

    shell("mkdir -p '%s'", options.second_copy);
    OK(lumi_store_open(many(state, "a", 5), &options, &store, error));
    store_all(store, 3);
    OK(lumi_store_close(store, error)); /* the program ends here */
    shell("cd '%s/a.partial/data/frames' && test $(ls | wc -l) = 3 && rm f0001.jpg && "
          "printf x | dd of=f0002.jpg conv=notrunc bs=1 seek=5 2>/dev/null && echo torn > f0000.jpg.tmp",
          options.second_copy);
    OK(lumi_capture_open(in_scratch(state, "a"), LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_store_open(capture, &options, &store, error));
    struct lumi_store_done done = seal_of(store);
    assert_non_null(strstr(done.text, "second copy: "));
    OK(lumi_store_close(store, error));
    shell("diff -r '%s' '%s/a'", in_scratch(state, "a"), options.second_copy);
}

static void without_a_second_disk_the_first_goes_on(void **state)
{
    struct lumi_store_options options = with_copy(state, false);
    struct lumi_store_figures figures;
    struct lumi_store *store;

    OK(lumi_store_open(many(state, "a", 2), &options, &store, error));
    store_all(store, 2);
    lumi_store_figures(store, &figures);
    assert_int_equal(figures.copy_code, LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(figures.copy_text, "disk2"));
    struct lumi_store_done done = seal_of(store);
    assert_int_equal(done.code, LUMI_OK);
    assert_non_null(strstr(done.text, "no second copy: "));
    OK(lumi_store_close(store, error));
    assert_int_equal(problems_of(in_scratch(state, "a")), 0);
}

static void a_file_that_has_changed_is_found_before_the_seal(void **state)
{
    struct lumi_store_options options;
    struct lumi_store *store;

    lumi_store_options_init(&options);
    OK(lumi_store_open(many(state, "a", 2), &options, &store, error));
    store_all(store, 2);
    shell("printf x | dd of='%s' conv=notrunc bs=1 seek=9 2>/dev/null", in_scratch(state, "a/data/frames/f0001.jpg"));
    struct lumi_store_done done = seal_of(store);
    assert_int_equal(done.code, LUMI_ERR_CHECKSUM);
    assert_non_null(strstr(done.text, "data/frames/f0001.jpg"));
    OK(lumi_store_close(store, error));
}

static void a_disk_tells_its_room_and_its_speed(void **state)
{
    int64_t room = 0;
    double speed = 0;

    OK(lumi_store_disk((char *)*state, &room, error));
    assert_true(room > 0);
    OK(lumi_store_measure((char *)*state, 1 << 20, &speed, error));
    assert_true(speed > 0);
    shell("test -z \"$(ls -A '%s')\"", (char *)*state);
    FAILS(lumi_store_disk("/nowhere/at/all", &room, error), LUMI_ERR_NOTFOUND, "/nowhere/at/all");
    FAILS(lumi_store_measure("/nowhere/at/all", 1, &speed, error), LUMI_ERR_NOTFOUND, "/nowhere");
}

#define IN_SCRATCH(test) cmocka_unit_test_setup_teardown(test, scratch_setup, scratch_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        IN_SCRATCH(a_plan_becomes_rows_with_prior_poses),
        IN_SCRATCH(a_capture_is_stored_and_sealed_by_threads),
        IN_SCRATCH(a_capture_is_stored_and_sealed_in_virtual_time),
        IN_SCRATCH(what_does_not_fit_is_told_and_leaves_the_frame_as_it_was),
        IN_SCRATCH(memory_is_bounded_and_one_frame_always_fits),
        IN_SCRATCH(jobs_of_one_frame_keep_their_order_and_a_failing_one_stands_alone),
        IN_SCRATCH(a_second_copy_is_the_same_and_verified),
        IN_SCRATCH(a_second_copy_goes_on_after_an_interruption_and_is_mended),
        IN_SCRATCH(without_a_second_disk_the_first_goes_on),
        IN_SCRATCH(a_file_that_has_changed_is_found_before_the_seal),
        IN_SCRATCH(a_disk_tells_its_room_and_its_speed),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
