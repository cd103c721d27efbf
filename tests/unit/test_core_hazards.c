/* What goes wrong at an awkward moment: interrupts inside a poll, stops while lines are queued, switches and hands that
 * say otherwise than the board believes. */
#include "tests/unit/core_bench.h"

static struct bench *create(const char *name, void (*change)(struct lumi_rig *rig))
{
    struct lumi_rig rig;

    assert_int_equal(lumi_rig_builtin(name, &rig, NULL), LUMI_OK);
    if (change)
        change(&rig);
    return bench_create(&rig);
}

static uint32_t start(struct bench *b, const struct lumi_plan *plan)
{
    uint32_t crc = bench_load(b, plan);

    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    return crc;
}

static void press(struct bench *b)
{
    bench_set_input(b, BOARD_IN_ESTOP, true);
}

/* Released, cleared, homed; the rest is taken, and nothing twice. */
static void recover(struct bench *b, uint32_t faults, uint32_t crc, int shots)
{
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = faults)), lumi_wire_Result_DONE);
    bench_home(b);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 200);
    for (int i = 0; i < shots; i++)
        assert_int_equal(b->shot_fired[i], 1);
}

static void an_emergency_stop_in_mid_poll_leaves_what_has_not_begun_planned(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("arc16", NULL);
    bench_home(b);
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    bench_run(b, 10);
    b->core->safety.supply_due = b->core->sweep.feed_at; /* the poll that queues the next shot looks at the supply */
    b->inside = press;
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_true(b->lost <= 1);
    assert_true(b->fired > 20 && b->fired < 40);
    recover(b, 1, crc, 72);
    bench_destroy(b);
}

static void focus_lines(struct lumi_rig *rig)
{
    rig->camera_count = 2;
    for (int i = 0; i < 2; i++) {
        rig->control.triggers[i].focus_channel = 8 + i;
        rig->control.triggers[i].focus_lead = 0.8;
    }
}

/* A focus line is up while the platform is still on its way. */
static void a_stop_on_the_way_never_takes_a_shot_short_of_its_position(void **state)
{
    struct lumi_plan plan;

    (void)state;
    for (int k = 0; k < 40; k++) {
        struct bench *b = create("arc16", focus_lines);
        bench_home(b);
        lumi_plan_init(&plan, &b->rig);
        plan.mode = LUMI_PLAN_START_STOP;
        plan.positions = 8;
        plan.position_time = 4;
        plan.settle = 0.2;
        int64_t off = b->position - motion_position(&b->core->motion);
        b->step_count = b->edge_count = 0;
        uint32_t crc = start(b, &plan);
        bench_until(b, lumi_wire_State_SWEEPING, 30);
        bench_run(b, 6 + 0.1 * k);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(pause, 0)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_PAUSED, 10);
        assert_int_equal(b->lost, 0);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                         lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_IDLE, 60);
        int shot = 0;
        for (int i = 0; i < b->edge_count; i++) {
            if (!(b->edges[i].rise & 1))
                continue;
            int n = 0;
            while (n < b->step_count && b->step_at[n] <= b->edges[i].at)
                n++;
            assert_true(n > 0);
            assert_int_equal(b->step_position[n - 1] - off, lumi_plan_position_step(&plan, &b->rig, shot));
            shot++;
        }
        assert_int_equal(shot, 8);
        bench_destroy(b);
    }
}

static void brake_of_a_held_arm(struct lumi_rig *rig)
{
    rig->control.safety.brake_fitted = true;
}

static void a_held_arms_brake_that_was_opened_by_hand_closes_before_it_moves(void **state)
{
    (void)state;
    struct bench *b = create("arc16", brake_of_a_held_arm);
    bench_home(b);
    assert_int_equal(
        bench_ask(b, BENCH_REQUEST(set_output, .output = lumi_wire_SetOutput_Output_BRAKE_OPEN, .active = true)),
        lumi_wire_Result_DONE);
    assert_true(b->outputs[BOARD_OUT_BRAKE]);
    b->step_count = 0;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 30);
    assert_true(b->step_count > 0);
    assert_false(b->outputs[BOARD_OUT_BRAKE]);
    assert_true(b->step_at[0] >= b->brake_at + DROP_STRING_BRAKE_TICKS);
    bench_destroy(b);
}

static void filming(struct bench *b, struct lumi_plan *plan)
{
    bench_home(b);
    lumi_plan_init(plan, &b->rig);
    plan->mode = LUMI_PLAN_VIDEO;
    plan->turns = 2;
    b->edge_count = 0;
}

/* Sends the bench's own profile once more; `commit` would take it. */
static void upload(struct bench *b, lumi_wire_Request *commit)
{
    static lumi_wire_Profile scratch;
    static uint8_t data[LUMI_WIRE_PROFILE_MAX];
    size_t size = lumi_wire_encode_profile(&b->rig, &scratch, data, sizeof data), sent = 0;
    while (sent < size) {
        lumi_wire_Request request = {.which_command = lumi_wire_Request_write_profile_tag};
        lumi_wire_WriteProfile *write = &request.command.write_profile;
        write->offset = (uint32_t)sent;
        write->data.size = (pb_size_t)(size - sent < sizeof write->data.bytes ? size - sent : sizeof write->data.bytes);
        memcpy(write->data.bytes, data + sent, write->data.size);
        sent += write->data.size;
        assert_int_equal(bench_ask(b, &request), lumi_wire_Result_DONE);
    }
    *commit = (lumi_wire_Request){.which_command = lumi_wire_Request_commit_profile_tag};
    commit->command.commit_profile.size = (uint32_t)size;
    commit->command.commit_profile.crc = lumi_crc32c(0, data, size);
}

static void no_profile_is_taken_while_a_record_pulse_is_up(void **state)
{
    struct lumi_plan plan;
    lumi_wire_Request commit;

    (void)state;
    struct bench *b = create("bar2", NULL);
    filming(b, &plan);
    start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 20);
    bench_run(b, 5);
    upload(b, &commit);
    press(b);
    bench_run(b, 1);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, &commit), lumi_wire_Result_REFUSED);
    bench_run(b, 1);
    assert_int_equal(b->edge_count, 4);
    assert_int_equal(bench_ask(b, &commit), lumi_wire_Result_DONE);
    bench_destroy(b);
}

static void driver_without_brake(struct lumi_rig *rig)
{
    rig->control.safety.brake_fitted = true;
    rig->control.safety.driver_fault_fitted = true;
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        rig->control.safety.reactions[i].brake = false;
}

static void a_brake_that_an_interrupt_closed_is_known_to_be_closed(void **state)
{
    (void)state;
    struct bench *b = create("bar2", driver_without_brake);
    bench_home(b);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.5)), lumi_wire_Result_DONE);
    bench_run(b, 2);
    assert_true(b->outputs[BOARD_OUT_BRAKE]);
    uint64_t now = host_board_now(b->board);
    host_board_hang(b->board, now + BENCH_SECOND / 10);
    host_board_run(b->board, now + BENCH_SECOND / 15);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, true);
    assert_false(b->outputs[BOARD_OUT_BRAKE]);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, false);
    host_board_run(b->board, now + BENCH_SECOND / 9);
    bench_beat(b);
    assert_int_equal(b->core->string.open, b->outputs[BOARD_OUT_BRAKE]);
    bench_destroy(b);
}

static void upper_switch(struct lumi_rig *rig)
{
    rig->control.safety.wound_fitted = true;
    rig->control.motion.wind_speed = rig->control.motion.speed_max;
}

static void a_turn_that_was_told_wrong_does_not_tear_the_string(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("bar2", upper_switch);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .turn = 6)), lumi_wire_Result_DONE); /* it is 0 */
    bench_until(b, lumi_wire_State_IDLE, 120);
    lumi_plan_init(&plan, &b->rig);
    start(b, &plan);
    bench_until(b, lumi_wire_State_STOPPED_LOST, 120);
    assert_true(b->position > -1.0 * b->steps_per_turn);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_STRING_END);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = b->faults_set)), lumi_wire_Result_DONE);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    bench_destroy(b);
}

static void no_jog_goes_beyond_the_string(void **state)
{
    (void)state;
    struct bench *b = create("bar2", NULL);
    bench_home(b);
    const double turns = b->rig.string.length / b->rig.string.per_turn;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = turns + 0.5)), lumi_wire_Result_BAD);
    assert_int_equal(b->core->state, lumi_wire_State_IDLE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.2)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    bench_destroy(b);
}

static void a_start_that_is_refused_forgets_no_shot(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("bar2", NULL);
    bench_home(b);
    lumi_plan_init(&plan, &b->rig);
    plan.turns = 1;
    plan.wind = LUMI_PLAN_WIND_NONE;
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_IDLE, 90);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 2)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 90);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(get_status, 0)), lumi_wire_Result_DONE);
    assert_int_equal(b->reply.payload.status.shots_fired, 72);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                     lumi_wire_Result_REFUSED);
    bench_destroy(b);
}

static void a_stop_that_is_pressed_at_the_start_stands(void **state)
{
    (void)state;
    struct bench *b = create("bar2", NULL);
    b->inputs[BOARD_IN_ESTOP] = true; /* no edge that anybody saw */
    host_board_reset(b->board, BOARD_RESET_PIN);
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_REFUSED);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    bench_home(b);
    bench_destroy(b);
}

static void ramping_under_a_driver_that_failed(struct lumi_rig *rig)
{
    rig->control.safety.driver_fault_fitted = true;
    rig->control.safety.reactions[LUMI_RIG_FAULT_DRIVER].motor = LUMI_RIG_MOTOR_RAMP;
}

static void a_driver_that_failed_leaves_the_position_unknown(void **state)
{
    (void)state;
    for (int moving = 0; moving < 2; moving++) {
        struct bench *b = create("arc16", ramping_under_a_driver_that_failed);
        bench_home(b);
        if (moving) {
            assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 1)), lumi_wire_Result_DONE);
            bench_run(b, 2);
        }
        bench_set_input(b, BOARD_IN_DRIVER_FAULT, true);
        bench_until(b, lumi_wire_State_STOPPED_LOST, 5);
        bench_destroy(b);
    }
}

static void driven_from_outside(struct lumi_rig *rig)
{
    rig->control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
}

static void an_external_drive_stands_while_flash_is_written(void **state)
{
    lumi_wire_Request commit;

    (void)state;
    struct bench *b = create("arc16", driven_from_outside);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    bench_run(b, 0.5);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    upload(b, &commit);
    b->enable_falls = 0;
    assert_int_equal(bench_ask(b, &commit), lumi_wire_Result_DONE);
    assert_int_equal(b->enable_falls, 1);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    bench_destroy(b);
}

static void an_external_drives_position_is_finished_and_nothing_taken_twice(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("arc16", driven_from_outside);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    lumi_plan_init(&plan, &b->rig);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.positions = 24;
    plan.position_time = 6;
    plan.bracket = 3;
    plan.exposures[0] = 0.02;
    plan.exposures[1] = plan.exposures[2] = 0.2;
    bench_load(b, &plan);
    bench_set_input(b, BOARD_IN_REACHED, true);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 5)), lumi_wire_Result_DONE);
    for (int i = 0; i < 5000 && b->fired == 0; i++)
        bench_beat(b);
    assert_int_equal(b->fired, 1);
    bench_set_input(b, BOARD_IN_REACHED, false); /* it leaves */
    bench_until(b, lumi_wire_State_IDLE, 5);
    assert_true(b->fired < 3);
    bench_set_input(b, BOARD_IN_REACHED, true);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 5)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 10);
    for (int i = 0; i < 3; i++)
        assert_int_equal(b->shot_fired[i], 1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 5)), lumi_wire_Result_BAD);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(mark_shots, .count = 3)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 5)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 10);
    assert_int_equal(b->shot_fired[2], 2);
    bench_destroy(b);
}

static void an_external_drive_on_a_string_wants_a_brake(void **state)
{
    struct lumi_rig rig;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    rig.control.safety.brake_fitted = false;
    assert_int_equal(lumi_rig_check(&rig, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "no brake fitted the arm falls"));
    rig.control.safety.brake_fitted = true;
    assert_int_equal(lumi_rig_check(&rig, &error), LUMI_OK);
}

static void lines_fall_in_the_emergency_stops_interrupt(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("arc16", NULL);
    bench_home(b);
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    bench_run(b, 5);
    while (b->lines == 0)
        host_board_run(b->board, host_board_now(b->board) + BENCH_SECOND / 1000);
    press(b);
    assert_int_equal(b->lines, 0); /* no poll has come round yet */
    bench_run(b, 1);
    assert_int_equal(b->lost, 1);
    recover(b, 1, crc, 72);
    bench_destroy(b);
}

static void finishing_under_a_driver_that_failed(struct lumi_rig *rig)
{
    rig->control.safety.driver_fault_fitted = true;
    rig->control.safety.reactions[LUMI_RIG_FAULT_DRIVER].triggers = LUMI_RIG_TRIGGERS_FINISH;
}

static void a_shot_that_is_finished_while_the_motor_halted_under_it_is_lost(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create("arc16", finishing_under_a_driver_that_failed);
    bench_home(b);
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    bench_run(b, 5);
    while (b->lines == 0)
        host_board_run(b->board, host_board_now(b->board) + BENCH_SECOND / 1000);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, true);
    bench_run(b, 1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    assert_int_equal(b->lost, 1);
    bench_set_input(b, BOARD_IN_DRIVER_FAULT, false);
    recover(b, b->faults_set, crc, 72);
    bench_destroy(b);
}

/* From the step before the first trigger backwards: how many rise. */
static int risen_before_first_trigger(const struct bench *b)
{
    int edge = 0, last = 0, first;

    while (b->edges[edge].rise == 0)
        edge++;
    while (last + 1 < b->step_count && b->step_at[last + 1] < b->edges[edge].at)
        last++;
    for (first = last; first > 0 && b->step_position[first] > b->step_position[first - 1];)
        first--;
    return last - first;
}

static void every_beginning_takes_up_the_backlash(void **state)
{
    struct lumi_plan plan;

    (void)state;
    for (int mode = LUMI_PLAN_CONTINUOUS; mode <= LUMI_PLAN_START_STOP; mode++) {
        struct bench *b = create("arc16", NULL);
        const double backlash = b->rig.control.motion.backlash / (2 * LUMI_PI) * b->steps_per_turn;
        bench_home(b);
        lumi_plan_init(&plan, &b->rig);
        plan.mode = (enum lumi_plan_mode)mode;
        plan.turn_time = 60;
        b->edge_count = b->step_count = 0;
        uint32_t crc = start(b, &plan);
        bench_until(b, lumi_wire_State_SWEEPING, 30);
        bench_run(b, 20);
        assert_true(backlash > 1 && risen_before_first_trigger(b) >= backlash);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(pause, 0)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_PAUSED, 10);
        b->edge_count = b->step_count = 0;
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                         lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_IDLE, 90);
        assert_true(risen_before_first_trigger(b) >= backlash);
        bench_destroy(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_emergency_stop_in_mid_poll_leaves_what_has_not_begun_planned),
        cmocka_unit_test(a_stop_on_the_way_never_takes_a_shot_short_of_its_position),
        cmocka_unit_test(a_held_arms_brake_that_was_opened_by_hand_closes_before_it_moves),
        cmocka_unit_test(no_profile_is_taken_while_a_record_pulse_is_up),
        cmocka_unit_test(a_brake_that_an_interrupt_closed_is_known_to_be_closed),
        cmocka_unit_test(a_turn_that_was_told_wrong_does_not_tear_the_string),
        cmocka_unit_test(no_jog_goes_beyond_the_string),
        cmocka_unit_test(a_start_that_is_refused_forgets_no_shot),
        cmocka_unit_test(a_stop_that_is_pressed_at_the_start_stands),
        cmocka_unit_test(a_driver_that_failed_leaves_the_position_unknown),
        cmocka_unit_test(an_external_drive_stands_while_flash_is_written),
        cmocka_unit_test(an_external_drives_position_is_finished_and_nothing_taken_twice),
        cmocka_unit_test(an_external_drive_on_a_string_wants_a_brake),
        cmocka_unit_test(lines_fall_in_the_emergency_stops_interrupt),
        cmocka_unit_test(a_shot_that_is_finished_while_the_motor_halted_under_it_is_lost),
        cmocka_unit_test(every_beginning_takes_up_the_backlash),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
