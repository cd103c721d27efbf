/* Every fault: what it does to motor, brake and triggers, what is left, and that the sweep goes on to its end. */
#include "tests/unit/core_bench.h"

static struct bench *sweeping(const char *name, const struct lumi_rig_safety *fitted, uint32_t *crc)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    assert_int_equal(lumi_rig_builtin(name, &rig, NULL), LUMI_OK);
    rig.control.safety.brake_fitted = fitted->brake_fitted;
    rig.control.safety.slack_fitted = fitted->slack_fitted;
    rig.control.safety.string_end_fitted = fitted->string_end_fitted;
    rig.control.safety.driver_fault_fitted = fitted->driver_fault_fitted;
    rig.control.safety.supply_minimum = fitted->supply_minimum;
    struct bench *b = bench_create(&rig);
    bench_home(b);
    lumi_plan_init(&plan, &rig);
    plan.turns = rig.string.held ? 1 : 2;
    *crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = *crc)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    bench_run(b, 11.0 + 0.06);
    return b;
}

/* Clears the fault, homes if need be, and runs the rest: every shot is fired once, or was lost and then fired. */
static void goes_on_to_the_end(struct bench *b, uint32_t faults, uint32_t crc, int shots)
{
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = faults ^ 0x400)), lumi_wire_Result_REFUSED);
    lumi_wire_Result cleared = bench_ask(b, BENCH_REQUEST(clear, .faults = faults));
    if (cleared != lumi_wire_Result_DONE)
        print_message("%s\n", b->reply.text);
    assert_int_equal(cleared, lumi_wire_Result_DONE);
    if (b->core->state == lumi_wire_State_LOST) {
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                         lumi_wire_Result_REFUSED);
        bench_home(b);
    }
    assert_int_equal(b->core->state, lumi_wire_State_IDLE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 120);
    for (int i = 0; i < shots; i++)
        assert_int_equal(b->shot_fired[i], 1);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    bench_destroy(b);
}

static void an_emergency_stop_stops_within_a_step(void **state)
{
    const struct lumi_rig_safety fitted = {.brake_fitted = true};
    uint32_t crc;

    (void)state;
    for (int k = 0; k < 5; k++) {
        struct bench *b = sweeping("bar2", &fitted, &crc);
        bench_run(b, 0.037 * k);
        assert_true(b->outputs[BOARD_OUT_BRAKE]);
        uint64_t pressed = host_board_now(b->board);
        uint64_t steps = host_board_counts(b->board)->steps;
        bench_set_input(b, BOARD_IN_ESTOP, true);
        assert_int_equal(b->lines, 0);
        bench_run(b, 3);
        assert_true(host_board_counts(b->board)->steps <= steps);
        assert_true(b->last_step <= pressed);
        assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
        assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_FAULTED);
        assert_int_equal(b->ended.fired + b->ended.lost, b->fired + b->lost);
        assert_false(b->outputs[BOARD_OUT_BRAKE]);
        assert_true(b->outputs[BOARD_OUT_ENABLE]);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_REFUSED);
        assert_string_equal(b->reply.text, "the emergency stop is still pressed");
        assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_REFUSED);
        bench_set_input(b, BOARD_IN_ESTOP, false);
        bench_run(b, 1);
        assert_int_equal(host_board_counts(b->board)->steps, steps);
        goes_on_to_the_end(b, 1, crc, 144);
    }
}

static void a_motor_goes_off_only_when_the_brake_holds(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    rig.control.safety.brake_fitted = true;
    rig.control.safety.reactions[LUMI_RIG_FAULT_ESTOP].motor = LUMI_RIG_MOTOR_OFF;
    struct bench *b = bench_create(&rig);
    bench_home(b);
    bench_run(b, 2);
    assert_false(b->outputs[BOARD_OUT_BRAKE]); /* at rest it holds */
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.3)), lumi_wire_Result_DONE);
    bench_run(b, 2);
    assert_true(b->outputs[BOARD_OUT_BRAKE]);
    bench_set_input(b, BOARD_IN_ESTOP, true);
    bench_run(b, 0.1);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    assert_false(b->outputs[BOARD_OUT_BRAKE]);
    bench_run(b, 0.3);
    assert_false(b->outputs[BOARD_OUT_ENABLE]);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    bench_home(b);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    /* Neither a loader, which drives no pin … */
    assert_int_equal(bench_ask(b, BENCH_REQUEST(enter_loader, 0)), lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "loader: the brake is closing; ask again in a second");
    bench_run(b, 1);
    /* … nor the bench's direct hand can drop the arm. */
    assert_int_equal(bench_ask(b, BENCH_REQUEST(set_output, lumi_wire_SetOutput_Output_BRAKE_OPEN, true)),
                     lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(set_output, lumi_wire_SetOutput_Output_ENABLE, false)),
                     lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(set_output, lumi_wire_SetOutput_Output_BRAKE_OPEN, false)),
                     lumi_wire_Result_DONE);
    bench_run(b, 0.5);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(set_output, lumi_wire_SetOutput_Output_ENABLE, false)),
                     lumi_wire_Result_DONE);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    bench_destroy(b);
}

static void a_platform_that_runs_away_is_too_fast(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    rig.control.safety.overspeed = rig.control.motion.speed_max * 1.05;
    struct bench *b = bench_create(&rig);
    bench_home(b);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 3, .speed = rig.control.motion.speed_max)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 40);
    b->slip = 2;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = -3, .speed = rig.control.motion.speed_max)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_STOPPED_LOST, 20);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_OVERSPEED);
    bench_destroy(b);
}

static void cameras_left_recording_are_stopped_once_the_fault_is_cleared(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    bench_home(b);
    lumi_plan_init(&plan, &rig);
    plan.mode = LUMI_PLAN_VIDEO;
    plan.turns = 2;
    uint32_t crc = bench_load(b, &plan);
    b->edge_count = 0;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_SWEEPING, 20);
    bench_run(b, 40);
    assert_int_equal(b->edge_count, 2);
    bench_set_input(b, BOARD_IN_ESTOP, true);
    bench_run(b, 1);
    assert_int_equal(b->edge_count, 2);
    assert_false(b->outputs[BOARD_OUT_LAMP]);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    bench_run(b, 1);
    assert_int_equal(b->edge_count, 4);
    /* Going on, the turn that was not recorded whole is recorded again. */
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .turn = 1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    b->turn_marks = 0;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 100);
    assert_int_equal(b->turn_marks, 2);
    assert_int_equal(b->edge_count, 8);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    bench_destroy(b);
}

static void winding_into_the_upper_end_stops(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    rig.control.safety.wound_fitted = true;
    struct bench *b = bench_create(&rig);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .wind_up = true)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 200);
    assert_true(b->homed.found);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = -2)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_STOPPED, 60);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_STRING_END);
    assert_true(b->position > -0.8 * b->steps_per_turn);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = b->faults_set)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    bench_destroy(b);
}

static void the_hosts_emergency_stop_is_the_same(void **state)
{
    const struct lumi_rig_safety fitted = {0};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("arc16", &fitted, &crc);
    assert_true(lumi_wire_client_emergency_stop(&b->client, core_ns(host_board_now(b->board))));
    bench_beat(b);
    uint64_t steps = host_board_counts(b->board)->steps;
    bench_run(b, 2);
    assert_int_equal(host_board_counts(b->board)->steps, steps);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_int_equal(b->client.stops_left, 0);
    goes_on_to_the_end(b, 1, crc, 72);
}

static void the_strings_end_ramps_down_and_only_lets_wind_up(void **state)
{
    const struct lumi_rig_safety fitted = {.brake_fitted = true, .string_end_fitted = true};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("bar2", &fitted, &crc);
    bench_set_input(b, BOARD_IN_STRING_END, true);
    bench_run(b, 3);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_STRING_END);
    assert_false(b->outputs[BOARD_OUT_BRAKE]);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1u << LUMI_RIG_FAULT_STRING_END)),
                     lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = -0.1)), lumi_wire_Result_DONE);
    bench_run(b, 0.7);
    bench_set_input(b, BOARD_IN_STRING_END, false);
    bench_until(b, lumi_wire_State_IDLE, 20);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 120);
    for (int i = 0; i < 144; i++)
        assert_int_equal(b->shot_fired[i], 1);
    assert_int_equal(b->lost, 0);
    bench_destroy(b);
}

static void a_slack_string_halts_and_holds(void **state)
{
    const struct lumi_rig_safety fitted = {.brake_fitted = true, .slack_fitted = true};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("bar2", &fitted, &crc);
    bench_set_input(b, BOARD_IN_SLACK, true);
    bench_run(b, 0.1);
    uint64_t steps = host_board_counts(b->board)->steps;
    bench_run(b, 2);
    assert_int_equal(host_board_counts(b->board)->steps, steps);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    bench_set_input(b, BOARD_IN_SLACK, false);
    bench_run(b, 0.1);
    goes_on_to_the_end(b, 1u << LUMI_RIG_FAULT_SLACK, crc, 144);
}

static void a_drivers_fault_and_a_low_supply_halt_until_they_are_gone(void **state)
{
    const struct lumi_rig_safety fitted = {.driver_fault_fitted = true, .supply_minimum = 20};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("arc16", &fitted, &crc);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, true);
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1u << LUMI_RIG_FAULT_DRIVER)),
                     lumi_wire_Result_REFUSED);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, false);
    bench_run(b, 0.1);
    goes_on_to_the_end(b, 1u << LUMI_RIG_FAULT_DRIVER, crc, 72);

    b = sweeping("arc16", &fitted, &crc);
    b->supply_mv = 19000;
    bench_run(b, 0.02);
    b->supply_mv = 24000; /* a dip is nothing */
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_SWEEPING);
    b->supply_mv = 19000;
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    b->supply_mv = 20100; /* not yet well */
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1u << LUMI_RIG_FAULT_SUPPLY)),
                     lumi_wire_Result_REFUSED);
    b->supply_mv = 24000;
    bench_run(b, 0.1);
    goes_on_to_the_end(b, 1u << LUMI_RIG_FAULT_SUPPLY, crc, 72);
}

static void a_mark_that_does_not_come_loses_the_position(void **state)
{
    const struct lumi_rig_safety fitted = {0};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("bar2", &fitted, &crc);
    b->mark_hidden = true;
    bench_until(b, lumi_wire_State_STOPPED_LOST, 40);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_INDEX_MISSED);
    assert_true(b->fired > 60 && b->fired < 80);
    b->mark_hidden = false;
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1u << LUMI_RIG_FAULT_INDEX_MISSED)),
                     lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .turn = 1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 120);
    for (int i = 0; i < 144; i++)
        assert_int_equal(b->shot_fired[i], 1);
    bench_destroy(b);
}

static void a_mark_out_of_place_is_a_fault(void **state)
{
    const struct lumi_rig_safety fitted = {0};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("bar2", &fitted, &crc);
    b->position += (int64_t)(b->steps_per_turn * 0.05); /* the belt has jumped */
    bench_until(b, lumi_wire_State_STOPPED_LOST, 40);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_INDEX_EARLY);
    assert_true(b->fired > 60 && b->fired < 72);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = b->faults_set)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .turn = 1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 120);
    for (int i = 0; i < 144; i++)
        assert_int_equal(b->shot_fired[i], 1);
    bench_destroy(b);
}

static void a_watchdog_reset_is_told_and_stands(void **state)
{
    const struct lumi_rig_safety fitted = {0};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("arc16", &fitted, &crc);
    uint32_t fired = b->fired;
    host_board_hang(b->board, host_board_now(b->board) + 3 * BENCH_SECOND);
    bench_run(b, 6);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_true(b->faults_set & 1u << LUMI_RIG_FAULT_WATCHDOG);
    assert_int_equal(b->starts, 2);
    assert_true(b->fired >= fired);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1u << LUMI_RIG_FAULT_WATCHDOG)),
                     lumi_wire_Result_DONE);
    bench_home(b);
    bench_destroy(b);
}

static void a_main_loop_that_comes_too_late_is_an_internal_fault(void **state)
{
    const struct lumi_rig_safety fitted = {0};
    uint32_t crc;

    (void)state;
    struct bench *b = sweeping("arc16", &fitted, &crc);
    host_board_hang(b->board, host_board_now(b->board) + BENCH_SECOND / 2);
    bench_run(b, 2);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_INTERNAL);
    goes_on_to_the_end(b, 1u << LUMI_RIG_FAULT_INTERNAL, crc, 72);
}

static void a_fault_at_rest_keeps_the_position(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    bench_home(b);
    bench_set_input(b, BOARD_IN_ESTOP, true);
    bench_run(b, 0.1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    assert_int_equal(b->core->state, lumi_wire_State_IDLE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 20);
    bench_destroy(b);
}

static void a_stop_in_mid_homing_loses_the_position(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    bench_run(b, 1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(stop, .at_once = true)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_LOST, 10);
    assert_int_equal(b->homed_count, 1);
    assert_false(b->homed.found);
    bench_home(b);
    bench_destroy(b);
}

static void clearing_where_nothing_stands_changes_nothing(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, 0)), lumi_wire_Result_DONE);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    bench_home(b);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, 0)), lumi_wire_Result_DONE);
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_IDLE);
    assert_int_equal(b->faults_set, 0);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "no fault stands");
    bench_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_emergency_stop_stops_within_a_step),
        cmocka_unit_test(a_motor_goes_off_only_when_the_brake_holds),
        cmocka_unit_test(a_platform_that_runs_away_is_too_fast),
        cmocka_unit_test(cameras_left_recording_are_stopped_once_the_fault_is_cleared),
        cmocka_unit_test(winding_into_the_upper_end_stops),
        cmocka_unit_test(the_hosts_emergency_stop_is_the_same),
        cmocka_unit_test(the_strings_end_ramps_down_and_only_lets_wind_up),
        cmocka_unit_test(a_slack_string_halts_and_holds),
        cmocka_unit_test(a_drivers_fault_and_a_low_supply_halt_until_they_are_gone),
        cmocka_unit_test(a_mark_that_does_not_come_loses_the_position),
        cmocka_unit_test(a_mark_out_of_place_is_a_fault),
        cmocka_unit_test(a_watchdog_reset_is_told_and_stands),
        cmocka_unit_test(a_main_loop_that_comes_too_late_is_an_internal_fault),
        cmocka_unit_test(a_fault_at_rest_keeps_the_position),
        cmocka_unit_test(a_stop_in_mid_homing_loses_the_position),
        cmocka_unit_test(clearing_where_nothing_stands_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
