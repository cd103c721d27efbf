/* Single things that go wrong in the paper's sweeps, each by a fault script, and what the board makes of them. */
#include "rig_fixture.h"

static struct sim_fault_script script;

static void goes_wrong(struct rig_fixture *f, const char *text)
{
    OK(sim_fault_script_parse(text, strlen(text), "script", &script, error));
    sim_machine_set_faults(f->machine, &script);
}

/* Starts the sweep from `first` and waits for its end, however it comes. */
static lumi_wire_SweepEnded go(struct rig_fixture *f, int first, bool only_missing)
{
    int from;

    sim_machine_events(f->machine, &from);
    OK(sim_machine_start(f->machine, first, only_missing, error));
    OK(sim_machine_wait_sweep(f->machine, 4000, error));
    return sim_machine_find(f->machine, from, lumi_wire_Event_sweep_ended_tag)->kind.sweep_ended;
}

static lumi_wire_Status status_of(struct rig_fixture *f)
{
    lumi_wire_Status status;

    OK(sim_machine_status(f->machine, &status, error));
    return status;
}

static void expect_fault(struct rig_fixture *f, enum lumi_rig_fault fault)
{
    assert_int_equal(status_of(f).faults, 1u << fault);
}

static void clear_and_home(struct rig_fixture *f)
{
    OK(sim_machine_clear(f->machine, error));
    if (!status_of(f).position_known)
        OK(sim_machine_home(f->machine, !f->rig.string.held, 0, error));
}

/* What is missing is taken; then every camera has every shot exactly once. */
static void finish(struct rig_fixture *f)
{
    lumi_wire_SweepEnded end = go(f, 0, true);

    assert_int_equal(end.how, lumi_wire_SweepEnded_How_COMPLETE);
    assert_int_equal(end.fired, lumi_plan_shots(&f->plan));
    assert_int_equal(end.lost, 0);
}

static void begin(struct rig_fixture *f, const char *rig, double turn_time)
{
    rig_fixture_init(f, rig);
    f->plan.turn_time = turn_time;
    rig_fixture_start(f);
    OK(sim_machine_load_plan(f->machine, &f->plan, error));
}

static int exposures_of(struct rig_fixture *f, int camera)
{
    int count, own = 0;
    const struct sim_exposure *e = sim_mechanics_exposures(sim_machine_mechanics(f->machine), &count);

    for (int i = 0; i < count; i++)
        own += e[i].camera == camera && !e[i].lost;
    return own;
}

static void an_emergency_stop_ends_the_steps_and_is_released_only_by_a_clear(void **state)
{
    struct rig_fixture f;
    int edges, steps, after = 0;

    (void)state;
    begin(&f, "arc16", 30);
    /* A main loop of 3 ms, three steps long: the stop cannot wait for it. */
    host_board_set_loop(sim_machine_board(f.machine), 3 * BOARD_TICK_HZ / 1000, BOARD_TICK_HZ / 20);
    goes_wrong(&f, "at shot 30 estop press for 4s\n");
    lumi_wire_SweepEnded end = go(&f, 0, false);
    assert_int_equal(end.how, lumi_wire_SweepEnded_How_FAULTED);
    expect_fault(&f, LUMI_RIG_FAULT_ESTOP);
    assert_false(status_of(&f).position_known); /* it moved */
    const uint64_t *edge = sim_machine_estop_ticks(f.machine, &edges);
    const uint64_t *step = sim_machine_step_ticks(f.machine, &steps);
    for (int i = 0; i < steps; i++)
        after += step[i] > edge[0];
    assert_int_equal(after, 0);
    assert_int_equal(sim_machine_clear(f.machine, &expected_error), LUMI_ERR_BUSY); /* still pressed */
    sim_machine_run(f.machine, 5);
    assert_int_equal(sim_machine_start(f.machine, 0, true, &expected_error),
                     LUMI_ERR_BUSY); /* let go, but not cleared */
    clear_and_home(&f);
    finish(&f);
    rig_fixture_finish(&f);
}

static void a_lost_host_ends_the_sweep_with_its_row(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "arc16x2", 30);
    goes_wrong(&f, "at shot 20 host gone for 60s\n");
    lumi_wire_SweepEnded end = go(&f, 0, false);
    assert_int_equal(end.how, lumi_wire_SweepEnded_How_HOST_LOST);
    assert_int_equal(end.fired, 72);
    assert_int_equal(end.next_shot, 72);
    expect_fault(&f, LUMI_RIG_FAULT_HOST_LOST);
    assert_true(status_of(&f).position_known);
    clear_and_home(&f);
    finish(&f);
    for (int camera = 0; camera < 16; camera++)
        assert_int_equal(exposures_of(&f, camera), 144);
    judge_events(&f);
    rig_fixture_finish(&f);
}

static void a_link_that_goes_and_comes_back_disturbs_nothing(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "bar2", 30);
    goes_wrong(&f, "at shot 100 usb unplug for 3s\n"
                   "at shot 400 link cut for 4s\n"
                   "at shot 700 link noise 0.2 for 60s\n");
    lumi_wire_SweepEnded end = go(&f, 0, false);
    assert_int_equal(end.how, lumi_wire_SweepEnded_How_COMPLETE);
    struct rig_figures figures = judge_exposures(&f);
    assert_int_equal(figures.exposures, 2592);
    assert_true(figures.angle_worst < 0.01);
    judge_events(&f);
    rig_fixture_finish(&f);
}

static void an_index_mark_that_does_not_come_is_missed(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "arc16x2", 30);
    goes_wrong(&f, "at shot 36 input index stuck-off for 60s\n");
    assert_int_equal(go(&f, 0, false).how, lumi_wire_SweepEnded_How_FAULTED);
    expect_fault(&f, LUMI_RIG_FAULT_INDEX_MISSED);
    sim_machine_run(f.machine, 60);
    clear_and_home(&f);
    finish(&f);
    rig_fixture_finish(&f);
}

static void lost_steps_are_found_at_the_next_mark(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "arc16x2", 30);
    goes_wrong(&f, "at shot 36 slip 12\n"); /* 2.4 degrees */
    assert_int_equal(go(&f, 0, false).how, lumi_wire_SweepEnded_How_FAULTED);
    lumi_wire_Status status = status_of(&f);
    assert_true(status.faults & (1u << LUMI_RIG_FAULT_INDEX_MISSED | 1u << LUMI_RIG_FAULT_INDEX_EARLY));
    assert_false(status.position_known);
    clear_and_home(&f);
    finish(&f);
    rig_fixture_finish(&f);
}

static void a_string_that_is_out_or_loose_stops_the_sweep(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "bar2", 30);
    goes_wrong(&f, "at shot 40 input string-end stuck-on for 20s\n");
    assert_int_equal(go(&f, 0, false).how, lumi_wire_SweepEnded_How_FAULTED);
    expect_fault(&f, LUMI_RIG_FAULT_STRING_END);
    sim_machine_run(f.machine, 20);
    clear_and_home(&f);
    goes_wrong(&f, "at shot 200 string snag for 20s\n"); /* it is the arm that stays up until the switch tells */
    assert_int_equal(go(&f, 0, true).how, lumi_wire_SweepEnded_How_FAULTED);
    expect_fault(&f, LUMI_RIG_FAULT_SLACK);
    assert_true(sim_mechanics_fallen(sim_machine_mechanics(f.machine)) == 0);
    sim_machine_run(f.machine, 20);
    clear_and_home(&f);
    finish(&f);
    assert_true(sim_mechanics_fallen(sim_machine_mechanics(f.machine)) == 0);
    rig_fixture_finish(&f);
}

static void a_board_that_hangs_is_started_anew_and_only_homes(void **state)
{
    struct rig_fixture f;

    (void)state;
    begin(&f, "arc16", 60);
    goes_wrong(&f, "at shot 20 hang 10s\n");
    OK(sim_machine_start(f.machine, 0, false, error));
    assert_int_equal(sim_machine_wait_sweep(f.machine, 100, &expected_error), LUMI_ERR_IO); /* it restarted */
    assert_int_equal(sim_machine_restarts(f.machine), 1);
    lumi_wire_Status status = status_of(&f);
    assert_false(status.position_known);
    OK(sim_machine_clear(f.machine, error)); /* the watchdog's reset is a fault of its own */
    OK(sim_machine_load_plan(f.machine, &f.plan, error));
    assert_int_equal(sim_machine_start(f.machine, 20, true, &expected_error), LUMI_ERR_BUSY);
    OK(sim_machine_home(f.machine, false, 0, error));
    assert_int_equal(go(&f, 20, true).how, lumi_wire_SweepEnded_How_COMPLETE);
    rig_fixture_finish(&f);
}

static bool fired_some(struct sim_machine *m, void *context)
{
    return sim_machine_last_status(m).shots_fired >= *(const uint32_t *)context;
}

static void a_paused_sweep_goes_on_where_it_was(void **state)
{
    struct rig_fixture f;
    uint32_t some = 50;

    (void)state;
    begin(&f, "bar2", 30);
    OK(sim_machine_start(f.machine, 0, false, error));
    assert_true(sim_machine_run_until(f.machine, fired_some, &some, 200));
    OK(sim_machine_pause(f.machine, error));
    OK(sim_machine_wait_sweep(f.machine, 100, error));
    lumi_wire_Status status = status_of(&f);
    assert_int_equal(status.state, lumi_wire_State_PAUSED);
    assert_true(status.position_known && status.next_shot >= 50 && status.next_shot < 60);
    sim_machine_run(f.machine, 120);
    finish(&f);
    struct rig_figures figures = judge_exposures(&f);
    assert_int_equal(figures.exposures, 2592);
    assert_true(figures.angle_worst < 0.01);
    judge_events(&f);
    rig_fixture_finish(&f);
}

static void a_stop_while_the_string_is_wound_delays_nothing_afterwards(void **state)
{
    struct rig_fixture f;
    struct sim_machine_options options;

    (void)state;
    rig_fixture_init(&f, "bar2");
    options = f.options;
    options.mechanics.start_turns = 12.4;
    f.machine = sim_machine_create(&f.rig, &options);
    OK(sim_machine_configure(f.machine, &f.rig, error));
    goes_wrong(&f, "at 10s estop press for 1s\n");
    assert_int_equal(sim_machine_home(f.machine, true, 0, &expected_error), LUMI_ERR_NOTFOUND);
    assert_true(sim_machine_seconds(f.machine) < 15);
    sim_machine_run(f.machine, 2);
    OK(sim_machine_clear(f.machine, error));
    OK(sim_machine_home(f.machine, true, 0, error));
    assert_true(sim_machine_seconds(f.machine) < 150); /* 12 turns at 8 s, and the search for the mark */
    assert_int_equal(status_of(&f).turn_known, true);
    rig_fixture_finish(&f);
}

static void whoever_reaches_the_board_can_stop_it(void **state)
{
    struct rig_fixture f;
    uint32_t some = 5;
    int before, after;

    (void)state;
    begin(&f, "arc16", 30);
    OK(sim_machine_start(f.machine, 0, false, error));
    assert_true(sim_machine_run_until(f.machine, fired_some, &some, 200));
    sim_machine_emergency_stop(f.machine);
    sim_machine_run(f.machine, 0.1);
    sim_machine_step_ticks(f.machine, &before);
    sim_machine_run(f.machine, 10);
    sim_machine_step_ticks(f.machine, &after);
    assert_int_equal(before, after);
    expect_fault(&f, LUMI_RIG_FAULT_ESTOP);
    clear_and_home(&f);
    finish(&f);
    rig_fixture_finish(&f);
}

/* The power goes after every so many bytes of a new profile: the board has the old one or the new one, never none. */
static void power_that_goes_while_a_profile_is_written_leaves_the_old_or_the_new(void **state)
{
    struct rig_fixture f;
    int old = 0, new = 0;

    (void)state;
    for (uint64_t bytes = 0; bytes < 24000; bytes += 613) {
        rig_fixture_init(&f, "arc16");
        f.machine = sim_machine_create(&f.rig, &f.options);
        OK(sim_machine_configure(f.machine, &f.rig, error));
        uint32_t first = status_of(&f).profile_crc;
        struct lumi_rig other = f.rig;
        other.control.motion.settle = 0.7;
        host_board_cut_in_flash(sim_machine_board(f.machine), bytes);
        int code = sim_machine_configure(f.machine, &other, &expected_error);
        bool cut = !host_board_powered(sim_machine_board(f.machine));
        assert_true(cut || code == LUMI_OK);
        if (cut) {
            sim_machine_power(f.machine, false);
            sim_machine_run(f.machine, 1);
            sim_machine_power(f.machine, true);
        }
        host_board_cut_in_flash(sim_machine_board(f.machine), UINT64_MAX);
        sim_machine_run(f.machine, 1);
        lumi_wire_Status status = status_of(&f);
        assert_int_not_equal(status.state, lumi_wire_State_NO_PROFILE);
        assert_true(cut || status.profile_crc != first);
        *(status.profile_crc == first ? &old : &new) += 1;
        OK(sim_machine_configure(f.machine, &other, error));
        assert_int_not_equal(status_of(&f).profile_crc, first);
        rig_fixture_finish(&f);
    }
    assert_true(old > 5 && new > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_emergency_stop_ends_the_steps_and_is_released_only_by_a_clear),
        cmocka_unit_test(a_lost_host_ends_the_sweep_with_its_row),
        cmocka_unit_test(a_link_that_goes_and_comes_back_disturbs_nothing),
        cmocka_unit_test(an_index_mark_that_does_not_come_is_missed),
        cmocka_unit_test(lost_steps_are_found_at_the_next_mark),
        cmocka_unit_test(a_string_that_is_out_or_loose_stops_the_sweep),
        cmocka_unit_test(a_board_that_hangs_is_started_anew_and_only_homes),
        cmocka_unit_test(a_paused_sweep_goes_on_where_it_was),
        cmocka_unit_test(a_stop_while_the_string_is_wound_delays_nothing_afterwards),
        cmocka_unit_test(whoever_reaches_the_board_can_stop_it),
        cmocka_unit_test(power_that_goes_while_a_profile_is_written_leaves_the_old_or_the_new),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
