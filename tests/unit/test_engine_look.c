/* Pictures of the cameras from the engine: frames as they come, and looks while nothing is under way, of which nothing
 * remains when something begins. */
#include "engine_bench.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
/* after those */
#include <cmocka.h>

static void begin(struct bench *b, bool by_software)
{
    bench_begin(b, LUMI_PLAN_CONTINUOUS, 1);
    bench_kill(b);
    b->by_software = by_software;
    bench_engine(b);
}

static void start(struct bench *b)
{
    struct lumi_error error = {0};

    assert_int_equal(bench_start(b, false, &error), LUMI_OK);
}

/* As lumid does while somebody watches, but far more often. */
static int look_for(struct bench *b, int camera, double seconds)
{
    const int64_t end = b->now + (int64_t)(seconds * 1e9);
    struct lumi_error error = {0};
    int code = LUMI_OK;

    while (b->now < end) {
        code = lumi_engine_look(b->engine, b->now, camera, &error);
        bench_run(b, 0.05);
    }
    return code;
}

static void assert_captures(struct bench *b)
{
    assert_true(bench_until(b, LUMI_ENGINE_DONE, 200));
    assert_true(bench_status(b)->complete);
    assert_int_equal(b->status.round, 0);
    assert_int_equal(b->status.accepted, 8);
    for (int c = 0; c < BENCH_CAMERAS; c++) {
        assert_int_equal(b->status.cameras[c].surplus, 0);
        assert_int_equal(b->status.cameras[c].matched, 4);
    }
    assert_int_equal(b->frames_out, 0);
}

static void frames_of_a_sweep_and_of_its_tests_are_shown(void **state)
{
    struct bench b;

    (void)state;
    begin(&b, false);
    start(&b);
    assert_captures(&b);
    assert_int_equal(b.shown, 8);
    assert_true(b.looked >= 2);
    bench_end(&b);
}

static void a_camera_with_a_software_trigger_is_fired_by_it_twice_a_second(void **state)
{
    struct bench b;

    (void)state;
    begin(&b, true);
    assert_int_equal(look_for(&b, 1, 10), LUMI_OK);
    assert_int_equal(b.trigger[1], LUMI_TRIGGER_SOFTWARE);
    assert_in_range(b.looked, 15, 23);
    assert_int_equal(b.fired[0], 0);
    assert_int_equal(b.tests_fired, 0);
    assert_int_equal(b.frames_out, 0);
    /* Nobody looks any more. */
    lumi_engine_look_end(b.engine, b.now, 1);
    bench_run(&b, 1);
    const int fired = b.fired[1];
    bench_run(&b, 5);
    assert_int_equal(b.fired[1], fired);
    assert_false(b.armed[1]);
    bench_end(&b);
}

static void what_begins_ends_it_and_the_cameras_are_as_the_capture_wants_them(void **state)
{
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    begin(&b, true);
    look_for(&b, 0, 3);
    look_for(&b, 1, 2.02); /* its last frame is still on its way */
    start(&b);
    const int fired = b.fired[0] + b.fired[1];
    assert_int_equal(look_for(&b, 0, 3), LUMI_ERR_BUSY);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_int_equal(b.trigger[0], LUMI_TRIGGER_HARDWARE);
    assert_int_equal(b.trigger[1], LUMI_TRIGGER_HARDWARE);
    assert_int_equal(lumi_engine_look(b.engine, b.now, 0, &error), LUMI_ERR_BUSY);
    lumi_engine_look_end(b.engine, b.now, 0); /* of no effect */
    assert_true(b.armed[0]);
    assert_captures(&b);
    assert_int_equal(b.fired[0] + b.fired[1], fired);
    bench_end(&b);
}

static void a_retake_after_it_sets_the_cameras_up_anew(void **state)
{
    static const char *const frames[] = {"c00-t00-p001", NULL};
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    begin(&b, true);
    start(&b);
    assert_captures(&b);
    assert_int_equal(look_for(&b, 0, 2), LUMI_OK);
    assert_int_equal(b.trigger[0], LUMI_TRIGGER_SOFTWARE);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, frames, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_int_equal(b.trigger[0], LUMI_TRIGGER_HARDWARE);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_true(bench_status(&b)->complete);
    bench_end(&b);
}

static void a_camera_that_the_board_alone_fires_is_looked_through_once_the_rig_is_known(void **state)
{
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    begin(&b, false);
    assert_int_equal(look_for(&b, 0, 3), LUMI_ERR_UNSUPPORTED);
    assert_int_equal(b.tests_fired, 0);
    assert_int_equal(lumi_engine_look_check(b.engine, 0, &error), LUMI_ERR_UNSUPPORTED);
    assert_int_equal(bench_start(&b, true, &error), LUMI_OK); /* the preflight alone */
    assert_true(bench_until(&b, LUMI_ENGINE_IDLE, 100));
    assert_int_equal(lumi_engine_look_check(b.engine, 0, &error), LUMI_OK);
    b.looked = b.tests_fired = 0;
    lumi_engine_look_end(b.engine, b.now, 0);
    look_for(&b, 0, 5);
    assert_in_range(b.looked, 6, 12);
    assert_int_equal(b.looked, b.tests_fired);
    assert_int_equal(b.trigger[0], LUMI_TRIGGER_HARDWARE);
    /* Not while a fault stands. */
    b.faults = 1u << LUMI_RIG_FAULT_DRIVER;
    bench_run(&b, 1);
    b.tests_fired = 0;
    look_for(&b, 0, 2);
    assert_int_equal(b.tests_fired, 0);
    b.faults = 0;
    bench_run(&b, 1);
    start(&b);
    assert_captures(&b);
    bench_end(&b);
}

static void a_camera_that_is_not_there_or_records_by_itself_is_not_looked_through(void **state)
{
    struct lumi_camera_notice gone = {.kind = LUMI_CAMERA_GONE}, came = {.kind = LUMI_CAMERA_CAME};
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    begin(&b, true);
    lumi_engine_camera_notice(b.engine, b.now, 0, &gone);
    assert_int_equal(look_for(&b, 0, 1), LUMI_ERR_NOTFOUND);
    came.identity.records_itself = true;
    lumi_engine_camera_notice(b.engine, b.now, 0, &came);
    assert_int_equal(look_for(&b, 0, 1), LUMI_ERR_UNSUPPORTED);
    assert_int_equal(lumi_engine_look(b.engine, b.now, BENCH_CAMERAS, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(lumi_engine_look(b.engine, b.now, -1, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(b.fired[0], 0);
    bench_end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_of_a_sweep_and_of_its_tests_are_shown),
        cmocka_unit_test(a_camera_with_a_software_trigger_is_fired_by_it_twice_a_second),
        cmocka_unit_test(what_begins_ends_it_and_the_cameras_are_as_the_capture_wants_them),
        cmocka_unit_test(a_retake_after_it_sets_the_cameras_up_anew),
        cmocka_unit_test(a_camera_that_the_board_alone_fires_is_looked_through_once_the_rig_is_known),
        cmocka_unit_test(a_camera_that_is_not_there_or_records_by_itself_is_not_looked_through),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
