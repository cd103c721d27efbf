/* The frames on the sphere, retakes that somebody asks for, the arm, and turning it by hand. */
#include "engine_bench.h"
#include "proto/mechanism/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
/* after those */
#include <cmocka.h>

static void begin(struct bench *b)
{
    bench_begin(b, LUMI_PLAN_START_STOP, 1);
}

static void start(struct bench *b)
{
    struct lumi_error error = {0};

    assert_int_equal(bench_start(b, false, &error), LUMI_OK);
}

static void assert_letters(struct bench *b, const char *wanted)
{
    struct lumi_engine_frames frames;
    struct lumi_engine_frame frame;
    char found[65] = "";

    assert_true(lumi_engine_frames(b->engine, &frames));
    for (int i = 0; i < frames.shots * frames.camera_count; i++) {
        lumi_engine_frame(b->engine, &frames, i, &frame);
        found[i] = frame.letter;
    }
    assert_string_equal(found, wanted);
}

static const char *name_of(struct bench *b, int number)
{
    struct lumi_engine_frames frames;
    struct lumi_engine_frame frame;

    assert_true(lumi_engine_frames(b->engine, &frames));
    lumi_engine_frame(b->engine, &frames, number, &frame);
    return frame.name;
}

static void before_a_capture_there_are_no_frames(void **state)
{
    struct lumi_engine_frames frames;
    struct bench b;

    (void)state;
    begin(&b);
    assert_false(lumi_engine_frames(b.engine, &frames));
    assert_int_equal(frames.shots, 0);
    bench_end(&b);
}

static void every_frame_has_its_place_and_says_how_it_stands(void **state)
{
    struct lumi_engine_frames frames;
    struct lumi_engine_frame frame;
    struct lumi_pose pose;
    struct bench b;

    (void)state;
    begin(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_letters(&b, "pppppppp");
    while (bench_status(&b)->accepted < 4)
        bench_run(&b, 0.01);
    assert_letters(&b, "aaaapppp");
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "aaaaaaaa");
    assert_memory_equal(b.letters, "aaaaaaaa", 8); /* the same was told by events */
    assert_true(lumi_engine_frames(b.engine, &frames));
    assert_string_equal(frames.capture, b.status.capture);
    assert_int_equal(frames.shots, 4);
    assert_int_equal(frames.camera_count, 2);
    for (int i = 0; i < 8; i++) {
        lumi_engine_frame(b.engine, &frames, i, &frame);
        lumi_rig_camera_pose(&b.rig, i % 2, i / 2 / 4.0, &pose);
        assert_float_equal(frame.direction[0], pose.t.x / 0.7, 1e-6);
        assert_float_equal(frame.direction[1], pose.t.y / 0.7, 1e-6);
        assert_float_equal(frame.direction[2], pose.t.z / 0.7, 1e-6);
    }
    assert_string_equal(name_of(&b, 3), "c01-t00-p001");
    bench_end(&b);
}

static void what_a_frame_was_rejected_for_is_a_letter(void **state)
{
    struct lumi_engine_missing missing[2];
    struct bench b;

    (void)state;
    begin(&b);
    b.config.retakes = 0;
    bench_kill(&b);
    bench_engine(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    b.verdict_rejects = 1;
    b.smears[1] = 5;
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "cfaaaaaa");
    assert_int_equal(lumi_engine_missing(b.engine, missing, 2), 2);
    assert_int_equal(missing[0].fault, LUMI_JUDGE_CLIPPED);
    assert_int_equal(missing[1].fault, LUMI_JUDGE_SOFT);
    bench_end(&b);
}

/* The row holds numbers: the same verdict is found again. */
static void a_capture_that_is_opened_again_has_the_same_letters(void **state)
{
    const char *frames[] = {"c01-t00-p003", NULL};
    struct lumi_error error;
    struct bench b;

    (void)state;
    begin(&b);
    b.config.retakes = 0;
    bench_kill(&b);
    bench_engine(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    b.verdict_rejects = 1;
    b.smears[1] = 5;
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    bench_kill(&b);
    bench_engine(&b);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    assert_letters(&b, "cfaaaaat");
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "cfaaaaan"); /* those that were not chosen stay as they are */
    bench_end(&b);
}

static void a_good_frame_is_taken_again_after_the_sweep_that_goes_on(void **state)
{
    const char *frames[] = {"c00-t00-p000", "c01-t00-p003", NULL};
    struct lumi_verify_result result;
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    begin(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    while (bench_status(&b)->accepted < 4)
        bench_run(&b, 0.01);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_SWEEPING);
    assert_letters(&b, "taaapppp"); /* what is planned is taken anyway, once */
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 300));
    assert_letters(&b, "naaaaaaa");
    assert_string_equal(name_of(&b, 0), "c00-t00-p000.2");
    assert_int_equal(b.status.round, 1);
    assert_true(b.status.complete);
    assert_int_equal(lumi_capture_verify(b.status.capture, NULL, NULL, NULL, &result, &error), LUMI_OK);
    assert_true(result.sealed);
    assert_int_equal(result.problems, 0);
    bench_end(&b);
}

static void what_is_on_its_way_is_taken_again_when_it_is_there(void **state)
{
    struct lumi_error error = {0};
    struct bench b;
    const char *frames[] = {"c00-t00-p001", NULL};

    (void)state;
    begin(&b);
    b.config.retakes = 0; /* none by itself: this one was asked for */
    bench_kill(&b);
    bench_engine(&b);
    b.flaws[1][0] = BENCH_LATE;
    start(&b);
    for (int i = 0; i < 100000 && b.letters[2] != 'w'; i++)
        bench_run(&b, 0.001);
    assert_int_equal(b.letters[2], 'w');
    assert_int_equal(lumi_engine_retake(b.engine, b.now, "test.capture", frames, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 300));
    assert_letters(&b, "aanaaaaa");
    assert_int_equal(b.status.round, 1);
    bench_end(&b);
}

static void what_was_asked_for_survives_a_crash(void **state)
{
    const char *frames[] = {"c01-t00-p000", NULL};
    struct lumi_error error = {0};
    struct bench b;
    bool found;

    (void)state;
    begin(&b);
    start(&b);
    while (bench_status(&b)->accepted < 4)
        bench_run(&b, 0.01);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    bench_run(&b, 0.5);
    bench_kill(&b);
    b.state = lumi_wire_State_IDLE;
    bench_engine(&b);
    assert_int_equal(lumi_engine_recover(b.engine, b.now, &found, &error), LUMI_OK);
    assert_true(found);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 300));
    assert_letters(&b, "anaaaaaa");
    bench_end(&b);
}

static void a_retake_in_mid_sweep_names_frames_of_that_capture(void **state)
{
    const char *unknown[] = {"c00-t00-p000", "nothing", NULL}, *one[] = {"c00-t00-p000", NULL};
    struct lumi_error error;
    struct bench b;

    (void)state;
    begin(&b);
    start(&b);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, one, &error), LUMI_ERR_BUSY); /* the preflight */
    while (bench_status(&b)->accepted < 2)
        bench_run(&b, 0.01);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, unknown, &error), LUMI_ERR_NOTFOUND);
    assert_letters(&b, "aapppppp"); /* all or nothing */
    assert_int_equal(lumi_engine_retake(b.engine, b.now, "other.capture", one, &error), LUMI_ERR_BUSY);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, NULL, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "test.capture, sweeping"));
    assert_true(bench_until(&b, LUMI_ENGINE_SEALING, 200));
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, one, &error), LUMI_ERR_BUSY);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    bench_end(&b);
}

static void a_good_frame_is_taken_again_from_a_sealed_capture(void **state)
{
    const char *frames[] = {"c00-t00-p002", NULL}, *again[] = {"c00-t00-p002.2", NULL};
    struct lumi_error error;
    struct bench b;

    (void)state;
    begin(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "aaaanaaa");
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, again, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "aaaanaaa");
    assert_string_equal(name_of(&b, 4), "c00-t00-p002.3");
    assert_true(b.status.complete);
    bench_end(&b);
}

/* Frames that wait to be judged from their files, and are not to be judged any more. */
static void a_frame_that_was_not_judged_yet_is_taken_again(void **state)
{
    const char *frames[] = {"c00-t00-p002", NULL};
    struct lumi_error error;
    struct bench b;

    (void)state;
    begin(&b);
    b.config.judging = false;
    bench_kill(&b);
    bench_engine(&b);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_letters(&b, "ssssssss");
    b.config.judging = true;
    bench_kill(&b);
    bench_engine(&b);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 300));
    assert_true(b.status.complete);
    assert_letters(&b, "aaaanaaa");
    bench_end(&b);
}

/* ---- two operators ---- */

static void the_second_who_presses_start_is_told_what_is_under_way(void **state)
{
    struct lumi_engine_start second = {.name = "second.capture"};
    struct lumi_error error;
    char text[LUMI_PLAN_TEXT_MAX];
    struct bench b;

    (void)state;
    begin(&b);
    size_t size = lumi_plan_print(&b.plan, &b.rig, text, sizeof text);
    struct lumi_engine_start first = {.name = "first.capture", .title = "The hall"};
    assert_int_equal(lumi_engine_start(b.engine, b.now, text, size, &first, &error), LUMI_OK);
    assert_int_equal(lumi_engine_start(b.engine, b.now, text, size, &second, &error), LUMI_ERR_BUSY);
    assert_string_equal(error.text, "another capture is under way: first.capture, The hall, preflight");
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_int_equal(lumi_engine_start(b.engine, b.now, text, size, &second, &error), LUMI_ERR_BUSY);
    assert_string_equal(error.text, "another capture is under way: first.capture, The hall, sweeping");
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    bench_end(&b);
}

/* ---- the arm ---- */

static void where_the_arm_is_is_known_when_rig_and_position_are(void **state)
{
    const struct lumi_engine_arm *arm;
    struct lumi_rig rig;
    const char *source;
    struct bench b;

    (void)state;
    begin(&b);
    b.known = true;
    b.step = (int64_t)(lumi_rig_steps_per_turn(&b.rig) * 0.75);
    bench_run(&b, 2);
    arm = &bench_status(&b)->arm;
    assert_false(arm->known);
    assert_false(lumi_engine_profile(b.engine, &rig, &source));
    lumi_engine_rig_profile(b.engine, b.now, 0, LUMI_OK, "", &b.rig); /* nobody asked, and it is told */
    assert_true(bench_status(&b)->arm.known);
    assert_float_equal(arm->turn, 0.75, 1e-3);
    assert_float_equal(arm->yaw, -LUMI_PI / 2, 1e-2);
    assert_float_equal(arm->pitch, 0, 1e-9);
    assert_int_equal(arm->camera_count, 2);
    assert_float_equal(arm->cameras[0][0], 0, 1e-2);
    assert_true(arm->cameras[0][1] < -0.5);
    assert_true(lumi_engine_profile(b.engine, &rig, &source));
    assert_string_equal(source, "board");
    assert_int_equal(rig.camera_count, 2);
    b.connected = false;
    bench_run(&b, 2);
    assert_false(bench_status(&b)->arm.known);
    assert_true(lumi_engine_profile(b.engine, &rig, &source));
    assert_string_equal(source, "last");
    bench_end(&b);
}

static void the_rig_is_turned_by_hand_only_when_nothing_sweeps(void **state)
{
    struct lumi_error error;
    struct bench b;

    (void)state;
    begin(&b);
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 1, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "home first"));
    b.known = true;
    b.state = lumi_wire_State_IDLE;
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, LUMI_PI / 2, &error), LUMI_OK);
    bench_run(&b, 2);
    assert_float_equal(b.jogged, 0.25, 1e-9);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 7, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 0, &error), LUMI_ERR_ARG);
    b.faults = 1u << LUMI_RIG_FAULT_SLACK;
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 1, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "slack"));
    b.faults = 0;
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, -1, &error), LUMI_OK);
    b.state = lumi_wire_State_JOGGING;
    bench_run(&b, 4);
    assert_true(b.lit);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 1, &error), LUMI_ERR_BUSY);
    assert_int_equal(lumi_engine_stop(b.engine, b.now, false, true, &error), LUMI_OK); /* it can be stopped, too */
    b.state = lumi_wire_State_IDLE;
    bench_run(&b, 2);
    assert_false(b.lit);
    start(&b);
    assert_int_equal(lumi_engine_jog(b.engine, b.now, 1, &error), LUMI_ERR_BUSY);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    bench_end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(before_a_capture_there_are_no_frames),
        cmocka_unit_test(every_frame_has_its_place_and_says_how_it_stands),
        cmocka_unit_test(what_a_frame_was_rejected_for_is_a_letter),
        cmocka_unit_test(a_capture_that_is_opened_again_has_the_same_letters),
        cmocka_unit_test(a_good_frame_is_taken_again_after_the_sweep_that_goes_on),
        cmocka_unit_test(what_is_on_its_way_is_taken_again_when_it_is_there),
        cmocka_unit_test(what_was_asked_for_survives_a_crash),
        cmocka_unit_test(a_retake_in_mid_sweep_names_frames_of_that_capture),
        cmocka_unit_test(a_good_frame_is_taken_again_from_a_sealed_capture),
        cmocka_unit_test(a_frame_that_was_not_judged_yet_is_taken_again),
        cmocka_unit_test(the_second_who_presses_start_is_told_what_is_under_way),
        cmocka_unit_test(where_the_arm_is_is_known_when_rig_and_position_are),
        cmocka_unit_test(the_rig_is_turned_by_hand_only_when_nothing_sweeps),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
