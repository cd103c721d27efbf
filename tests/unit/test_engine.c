/* The capture engine on its bench: whole captures, and what goes wrong in them one thing at a time. */
#include "engine_bench.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
/* after those */
#include <cmocka.h>

static void start(struct bench *b)
{
    struct lumi_error error = {0};

    assert_int_equal(bench_start(b, false, &error), LUMI_OK);
}

static void assert_complete(struct bench *b, double seconds)
{
    assert_true(bench_until(b, LUMI_ENGINE_DONE, seconds));
    assert_true(bench_status(b)->complete);
    assert_int_equal(b->frames_out, 0);
}

static void end_whole(struct bench *b)
{
    struct lumi_verify_result result;
    struct lumi_error error = {0};

    assert_int_equal(lumi_capture_verify(b->status.capture, NULL, NULL, NULL, &result, &error), LUMI_OK);
    assert_true(result.sealed);
    assert_int_equal(result.problems, 0);
    bench_end(b);
}

static unsigned bit(enum lumi_engine_state state)
{
    return 1u << state;
}

static void a_sweep_ends_as_a_sealed_capture_with_every_frame(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    assert_complete(&b, 200);
    assert_int_equal(b.status.accepted, 8);
    assert_int_equal(b.status.missing, 0);
    assert_int_equal(b.starts, 1);
    assert_int_equal(b.homes, 1);
    /* Every change tells the state it led to, however short that lasted. */
    assert_int_equal(b.states_told, bit(LUMI_ENGINE_PREFLIGHT) | bit(LUMI_ENGINE_HOMING) | bit(LUMI_ENGINE_ARMING) |
                                        bit(LUMI_ENGINE_SWEEPING) | bit(LUMI_ENGINE_DRAINING) |
                                        bit(LUMI_ENGINE_SEALING) | bit(LUMI_ENGINE_DONE));
    assert_string_equal(b.handed, b.status.capture);
    assert_int_equal(b.stored, b.event_number); /* every event of the board was acknowledged */
    end_whole(&b);
}

static void a_frame_that_never_comes_is_taken_again(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    b.flaws[2][1] = BENCH_NO_FRAME;
    start(&b);
    assert_complete(&b, 200);
    assert_int_equal(b.status.round, 1);
    assert_int_equal(b.starts, 2);
    assert_int_equal(b.status.cameras[0].surplus, 1); /* its frame of that shot was good */
    end_whole(&b);
}

static void late_doubled_damaged_and_wrongly_exposed_frames_are_found(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    b.flaws[0][0] = BENCH_TWICE;
    b.flaws[1][1] = BENCH_LATE;
    b.flaws[2][0] = BENCH_DAMAGED;
    b.flaws[3][1] = BENCH_EXPOSURE;
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DRAINING, 200));
    assert_int_equal(bench_status(&b)->cameras[0].doubled, 1);
    assert_int_equal(b.status.cameras[1].late, 1);
    assert_complete(&b, 200);
    assert_int_equal(b.status.round, 1);
    end_whole(&b);
}

static void a_frame_that_is_judged_bad_is_taken_again(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_START_STOP, 1);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    b.verdict_rejects = 1;
    assert_complete(&b, 200);
    assert_int_equal(b.status.accepted, 8);
    assert_int_equal(b.status.round, 1);
    end_whole(&b);
}

/* One frame of a sweep is found smeared, and so is what is taken of it again. */
static void take_smeared(struct bench *b, const double smears[2], int rounds)
{
    bench_begin(b, LUMI_PLAN_START_STOP, 1);
    start(b);
    assert_true(bench_until(b, LUMI_ENGINE_SWEEPING, 100));
    b->smears[0] = smears[0];
    assert_true(bench_until(b, LUMI_ENGINE_ARMING, 200));
    b->smears[0] = smears[1];
    assert_complete(b, 400);
    assert_int_equal(b->status.accepted, 8);
    assert_int_equal(b->status.round, rounds);
    end_whole(b);
}

static void a_smear_that_is_there_again_is_the_place_s(void **state)
{
    static struct bench b;

    (void)state;
    take_smeared(&b, (const double[2]){4.4, 4.3}, 1);
}

static void a_smear_of_another_length_is_taken_once_more(void **state)
{
    static struct bench b;

    (void)state;
    take_smeared(&b, (const double[2]){4.4, 9}, 2);
}

static void exchanged_trigger_wires_are_red_and_start_nothing(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    b.exchanged = true;
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_RED, 100));
    assert_non_null(bench_check(&b, "trigger c00"));
    assert_int_equal(bench_check(&b, "trigger c00")->verdict, LUMI_RED);
    assert_non_null(strstr(bench_check(&b, "trigger c00")->reason, "c01"));
    assert_int_equal(b.starts, 0);
    bench_end(&b);
}

static void a_test_frame_that_comes_once_more_is_not_the_next_trigger_s(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    b.tests_twice = true;
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_int_equal(bench_check(&b, "trigger c01")->verdict, LUMI_GREEN);
    assert_true(bench_status(&b)->complete);
    bench_end(&b);
}

static void one_lost_test_frame_is_no_broken_trigger_two_are(void **state)
{
    struct bench b;

    (void)state;
    for (int lost = 1; lost <= 2; lost++) {
        bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
        b.tests_lost = lost;
        start(&b);
        assert_true(bench_until(&b, lost == 1 ? LUMI_ENGINE_DONE : LUMI_ENGINE_RED, 200));
        assert_int_equal(bench_check(&b, "trigger c00")->verdict, lost == 1 ? LUMI_YELLOW : LUMI_RED);
        assert_int_equal(bench_check(&b, "trigger c01")->verdict, LUMI_GREEN);
        bench_end(&b);
    }
}

static void batteries_and_cards_are_looked_at_where_a_camera_tells(void **state)
{
    static const struct {
        double battery;
        int64_t card;
        enum lumi_verdict battery_is, card_is;
        const char *battery_says, *card_says;
    } cases[] = {
        {0.9, 64000000000, LUMI_GREEN, LUMI_GREEN, "90 %", "64.0 GB free"},
        {0.05, 64000000000, LUMI_RED, LUMI_GREEN, "5 %", "64.0 GB free"},
        {0.9, 1000, LUMI_GREEN, LUMI_RED, "90 %", "0.0 GB free"},
    };
    struct bench b;

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
        lumi_engine_destroy(b.engine);
        b.battery = cases[i].battery;
        b.card = cases[i].card;
        bench_engine(&b);
        start(&b);
        bool red = cases[i].battery_is == LUMI_RED || cases[i].card_is == LUMI_RED;
        assert_true(bench_until(&b, red ? LUMI_ENGINE_RED : LUMI_ENGINE_DONE, 200));
        assert_int_equal(bench_check(&b, "battery c01")->verdict, cases[i].battery_is);
        assert_string_equal(bench_check(&b, "battery c01")->reason, cases[i].battery_says);
        assert_int_equal(bench_check(&b, "card c01")->verdict, cases[i].card_is);
        assert_string_equal(bench_check(&b, "card c01")->reason, cases[i].card_says);
        bench_end(&b);
    }
}

static void what_is_no_plan_is_refused_without_a_board(void **state)
{
    static const char text[] = "[sweep]\nmode = continuous\nspeed = 7\n";
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    assert_int_equal(lumi_engine_start(b.engine, b.now, text, strlen(text), NULL, &error), LUMI_ERR_FORMAT);
    assert_string_equal(error.text, "the plan:3: a plan has no key 'speed'");
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_IDLE);
    bench_end(&b);
}

static void a_mistyped_override_is_named(void **state)
{
    const char *const names[] = {"nonsense", NULL};
    const struct lumi_engine_start wanted = {.override = names, .preflight_only = true};
    struct lumi_error error = {0};
    char text[LUMI_PLAN_TEXT_MAX];
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    lumi_plan_print(&b.plan, &b.rig, text, sizeof text);
    assert_int_equal(lumi_engine_start(b.engine, b.now, text, strlen(text), &wanted, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_IDLE, 200));
    assert_int_equal(bench_check(&b, "override")->verdict, LUMI_YELLOW);
    assert_string_equal(bench_check(&b, "override")->reason, "no check is called 'nonsense'");
    bench_end(&b);
}

/* The last capture, and after a restart the youngest in the folder. */
static void a_retake_needs_no_name(void **state)
{
    struct lumi_error error = {0};
    struct bench b;
    char path[1024], partial[1040];

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "--capture NAME"));
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    snprintf(path, sizeof path, "%s", bench_status(&b)->capture);
    bench_kill(&b);
    bench_engine(&b);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "nothing is missing"));
    assert_memory_equal(error.text, path, strlen(path));
    /* What is being taken in beside it is none yet. */
    snprintf(partial, sizeof partial, "%s.partial", path);
    assert_int_equal(rename(path, partial), 0);
    bench_kill(&b);
    bench_engine(&b);
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "--capture NAME"));
    bench_end(&b);
}

static void a_lamp_is_on_while_the_rig_may_move(void **state)
{
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    assert_false(b.lit);
    assert_true(bench_until(&b, LUMI_ENGINE_HOMING, 100));
    assert_true(b.lit);
    assert_true(bench_until(&b, LUMI_ENGINE_ARMING, 100));
    assert_false(b.lit);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_int_equal(lumi_engine_pause(b.engine, b.now, &error), LUMI_OK);
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_PAUSING);
    assert_true(b.lit);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_false(b.lit);
    bench_end(&b);
}

static void the_rig_is_homed_beside_a_capture(void **state)
{
    struct lumi_error error = {0};
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_home(b.engine, b.now, 0, false, &error), LUMI_OK);
    bench_run(&b, 20);
    assert_int_equal(b.homes, 1);
    start(&b);
    assert_int_equal(lumi_engine_home(b.engine, b.now, 0, false, &error), LUMI_ERR_BUSY);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_int_equal(b.homes, 1); /* it is known where it is */
    bench_end(&b);
}

/* An arm on a string, whose turn nobody knows after the board has started again. */
static void an_arm_on_a_string_is_homed_by_who_knows_its_turn(void **state)
{
    struct lumi_error error = {0};
    struct lumi_rig stringed;
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    assert_int_equal(lumi_rig_builtin("arc16x2", &stringed, NULL), LUMI_OK);
    b.rig.string = stringed.string;
    b.rig.turns = 3;
    b.config.home_turn = 0;
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    assert_int_equal(lumi_engine_home(b.engine, b.now, 2, false, &error), LUMI_ERR_BUSY);
    while (bench_status(&b)->fired < 2)
        bench_run(&b, 0.01);
    bench_restart_board(&b);
    bench_run(&b, 100);
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_INTERRUPTED);
    assert_non_null(strstr(b.status.text, "lumi capture home --turn N"));
    assert_int_equal(b.homes, 1);
    assert_int_equal(lumi_engine_home(b.engine, b.now, 2, false, &error), LUMI_OK);
    bench_run(&b, 20);
    assert_int_equal(b.homes, 2);
    assert_int_equal(b.home_turn, 2);
    assert_int_equal(lumi_engine_resume(b.engine, b.now, &error), LUMI_OK);
    assert_complete(&b, 300);
    assert_int_equal(b.homes, 2);
    end_whole(&b);
}

static void a_drive_is_asked_before_it_is_believed_in(void **state)
{
    static const struct {
        const char *says;
        int code;
        bool can_override;
    } cases[] = {{NULL, 0, false},
                 {"D1 answers: ready", LUMI_OK, false},
                 {"no answer", LUMI_ERR_IO, false},
                 {"an alarm, fault 42", LUMI_ERR_BUSY, true}};
    const char *const names[] = {"drive", NULL};
    const struct lumi_engine_start wanted = {.override = names, .preflight_only = true};
    char text[LUMI_PLAN_TEXT_MAX];
    struct lumi_error error;
    struct bench b;

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        bench_begin(&b, LUMI_PLAN_START_STOP, 1);
        lumi_engine_destroy(b.engine);
        b.rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
        b.drive_says = cases[i].says;
        b.drive_code = cases[i].code;
        bench_engine(&b);
        lumi_plan_print(&b.plan, &b.rig, text, sizeof text);
        assert_int_equal(lumi_engine_start(b.engine, b.now, text, strlen(text), &wanted, &error), LUMI_OK);
        const bool good = cases[i].says && cases[i].code == LUMI_OK;
        assert_true(bench_until(&b, good || cases[i].can_override ? LUMI_ENGINE_IDLE : LUMI_ENGINE_RED, 200));
        assert_int_equal(bench_check(&b, "drive")->verdict, good ? LUMI_GREEN : LUMI_RED);
        assert_int_equal(bench_check(&b, "drive")->overridden, cases[i].can_override);
        assert_string_equal(bench_check(&b, "drive")->reason,
                            cases[i].says ? cases[i].says : "the rig has an external drive, and none is configured");
        bench_end(&b);
    }
}

static void a_bracket_that_nobody_can_verify_is_told_before_it_is_taken(void **state)
{
    struct bench b;

    (void)state;
    for (int bracket = 1; bracket <= 3; bracket += 2)
        for (int silent = 0; silent <= 1; silent++) {
            bench_begin(&b, LUMI_PLAN_START_STOP, bracket);
            b.silent = silent;
            start(&b);
            assert_true(bench_until(&b, LUMI_ENGINE_DONE, 400));
            const struct lumi_engine_check *check = bench_check(&b, "bracket c01");
            if (bracket > 1 && silent) {
                assert_non_null(check);
                assert_int_equal(check->verdict, LUMI_YELLOW);
                assert_non_null(strstr(check->reason, "is not verified"));
            } else
                assert_null(check);
            bench_end(&b);
        }
}

static void exposures_of_a_bracket_are_told_to_the_cameras(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_START_STOP, 3);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 400));
    assert_true(b.told_exposures >= 22); /* between each two of twelve shots, both */
    assert_true(bench_status(&b)->complete);
    assert_int_equal(b.status.accepted, 24);
    assert_int_equal(b.status.round, 0);
    bench_end(&b);
}

static void a_killed_program_goes_on_where_it_was(void **state)
{
    struct bench b;
    struct lumi_error error = {0};
    bool found;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    while (bench_status(&b)->stored + b.status.accepted < 3)
        bench_run(&b, 0.01);
    bench_kill(&b);
    b.state = lumi_wire_State_IDLE;
    bench_engine(&b);
    assert_int_equal(lumi_engine_recover(b.engine, b.now, &found, &error), LUMI_OK);
    assert_true(found);
    assert_complete(&b, 300);
    end_whole(&b);
}

static void a_capture_of_another_rig_is_left_as_it_is(void **state)
{
    struct lumi_error error = {0};
    char name[LUMI_RIG_NAME];
    struct bench b;
    bool found;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    while (bench_status(&b)->stored + b.status.accepted < 3)
        bench_run(&b, 0.01);
    bench_kill(&b);
    b.state = lumi_wire_State_IDLE;
    memcpy(name, b.config.cameras[1].name, sizeof name);
    snprintf(b.config.cameras[1].name, sizeof name, "other");
    bench_engine(&b);
    assert_int_equal(lumi_engine_recover(b.engine, b.now, &found, &error), LUMI_ERR_NOTFOUND);
    assert_false(found);
    assert_non_null(strstr(error.text, "test.capture: camera"));
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_IDLE);
    assert_string_equal(b.status.capture, "");
    bench_kill(&b);
    memcpy(b.config.cameras[1].name, name, sizeof name); /* the rig that it is of */
    bench_engine(&b);
    assert_int_equal(lumi_engine_recover(b.engine, b.now, &found, &error), LUMI_OK);
    assert_true(found);
    assert_complete(&b, 300);
    end_whole(&b);
}

static void a_board_that_restarts_is_homed_and_told_what_is_done(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    while (bench_status(&b)->fired < 2)
        bench_run(&b, 0.01);
    bench_restart_board(&b);
    assert_complete(&b, 300);
    assert_int_equal(b.homes, 2);
    assert_int_equal(b.starts, 2);
    end_whole(&b);
}

static void nothing_goes_on_while_a_fault_stands(void **state)
{
    struct bench b;
    struct lumi_error error = {0};
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_sweep_ended_tag};

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    start(&b);
    while (bench_status(&b)->fired < 2)
        bench_run(&b, 0.01);
    bench_stand_still(&b);
    b.faults = 1u << LUMI_RIG_FAULT_SLACK;
    event.kind.sweep_ended.how = lumi_wire_SweepEnded_How_FAULTED;
    b.state = lumi_wire_State_IDLE;
    bench_event(&b, &event);
    assert_true(bench_until(&b, LUMI_ENGINE_INTERRUPTED, 100));
    bench_run(&b, 60);
    assert_int_equal(bench_status(&b)->state, LUMI_ENGINE_INTERRUPTED);
    assert_int_equal(lumi_engine_resume(b.engine, b.now, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "slack"));
    assert_int_equal(lumi_engine_clear(b.engine, b.now, &error), LUMI_OK);
    bench_run(&b, 2);
    assert_int_equal(lumi_engine_resume(b.engine, b.now, &error), LUMI_OK);
    assert_complete(&b, 300);
    bench_end(&b);
}

static void a_full_disk_loses_nothing(void **state)
{
    struct bench b;

    (void)state;
    bench_begin(&b, LUMI_PLAN_START_STOP, 1);
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_SWEEPING, 100));
    b.disk_full = true;
    bench_run(&b, 30);
    assert_int_not_equal(bench_status(&b)->state, LUMI_ENGINE_DONE);
    assert_int_equal(b.status.accepted, 0);
    b.disk_full = false;
    assert_complete(&b, 300);
    end_whole(&b);
}

static void a_capture_that_was_stopped_says_what_is_missing(void **state)
{
    struct bench b;
    struct lumi_error error = {0};
    struct lumi_engine_missing missing[8];

    (void)state;
    bench_begin(&b, LUMI_PLAN_CONTINUOUS, 1);
    b.config.retakes = 0;
    lumi_engine_destroy(b.engine);
    bench_engine(&b);
    b.flaws[1][0] = BENCH_NO_FRAME;
    start(&b);
    assert_true(bench_until(&b, LUMI_ENGINE_DONE, 200));
    assert_false(bench_status(&b)->complete);
    assert_int_equal(lumi_engine_missing(b.engine, missing, 8), 1);
    assert_int_equal(missing[0].shot, 1);
    assert_string_equal(missing[0].camera, "c00");
    assert_non_null(strstr(missing[0].reason, "never came"));
    assert_string_equal(b.handed, "");
    /* And somebody takes it, though the capture is sealed. */
    assert_int_equal(lumi_engine_retake(b.engine, b.now, NULL, NULL, &error), LUMI_OK);
    assert_complete(&b, 200);
    assert_string_equal(b.handed, b.status.capture);
    end_whole(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sweep_ends_as_a_sealed_capture_with_every_frame),
        cmocka_unit_test(a_frame_that_never_comes_is_taken_again),
        cmocka_unit_test(late_doubled_damaged_and_wrongly_exposed_frames_are_found),
        cmocka_unit_test(a_frame_that_is_judged_bad_is_taken_again),
        cmocka_unit_test(a_smear_that_is_there_again_is_the_place_s),
        cmocka_unit_test(a_smear_of_another_length_is_taken_once_more),
        cmocka_unit_test(exchanged_trigger_wires_are_red_and_start_nothing),
        cmocka_unit_test(a_test_frame_that_comes_once_more_is_not_the_next_trigger_s),
        cmocka_unit_test(one_lost_test_frame_is_no_broken_trigger_two_are),
        cmocka_unit_test(batteries_and_cards_are_looked_at_where_a_camera_tells),
        cmocka_unit_test(what_is_no_plan_is_refused_without_a_board),
        cmocka_unit_test(a_mistyped_override_is_named),
        cmocka_unit_test(a_retake_needs_no_name),
        cmocka_unit_test(a_lamp_is_on_while_the_rig_may_move),
        cmocka_unit_test(the_rig_is_homed_beside_a_capture),
        cmocka_unit_test(an_arm_on_a_string_is_homed_by_who_knows_its_turn),
        cmocka_unit_test(a_drive_is_asked_before_it_is_believed_in),
        cmocka_unit_test(a_bracket_that_nobody_can_verify_is_told_before_it_is_taken),
        cmocka_unit_test(exposures_of_a_bracket_are_told_to_the_cameras),
        cmocka_unit_test(a_killed_program_goes_on_where_it_was),
        cmocka_unit_test(a_capture_of_another_rig_is_left_as_it_is),
        cmocka_unit_test(a_board_that_restarts_is_homed_and_told_what_is_done),
        cmocka_unit_test(nothing_goes_on_while_a_fault_stands),
        cmocka_unit_test(a_full_disk_loses_nothing),
        cmocka_unit_test(a_capture_that_was_stopped_says_what_is_missing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
