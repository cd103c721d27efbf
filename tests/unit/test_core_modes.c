/* Start-stop to its limits, ways of winding, an external drive: what single modes promise. */
#include "tests/unit/core_bench.h"

static void start_stop_plan(const struct lumi_rig *rig, struct lumi_plan *plan)
{
    lumi_plan_init(plan, rig);
    plan->mode = LUMI_PLAN_START_STOP;
    plan->positions = 24;
    plan->bracket = 3;
    plan->exposures[0] = 0.02;
    plan->exposures[1] = 0.1;
    plan->exposures[2] = 0.4;
    plan->position_time = 6;
}

static void a_position_takes_as_long_as_the_plan_says_to_the_limit(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;
    double low = 0.1, high = 6;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    for (int focus = 0; focus < 2; focus++) {
        rig.camera_count = 4;
        for (int i = 0; focus && i < 4; i++) {
            rig.control.triggers[i].focus_channel = 8 + i;
            rig.control.triggers[i].focus_lead = 0.5 + 0.1 * i;
        }
        start_stop_plan(&rig, &plan);
        for (low = 0.1, high = 6; high - low > 1e-4;) {
            plan.position_time = (low + high) / 2;
            *(lumi_plan_check(&plan, &rig, NULL) == LUMI_OK ? &high : &low) = plan.position_time;
        }
        plan.position_time = high;
        struct bench *b = bench_create(&rig);
        bench_home(b);
        b->edge_count = 0;
        uint32_t crc = bench_load(b, &plan);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_SWEEPING, 30);
        bench_until(b, lumi_wire_State_IDLE, 200);
        assert_int_equal(b->fired, 72);
        assert_int_equal(b->lost, 0);
        /* The first trigger of every position, one after another. */
        uint64_t last = 0;
        int count = 0, triggers = 0;
        for (int i = 0; i < b->edge_count; i++) {
            if (!(b->edges[i].rise & 1) || triggers++ % 3 != 0)
                continue;
            if (count >= 2) { /* the first move is longer or shorter than the others */
                double beat = (double)(b->edges[i].at - last) / BOARD_TICK_HZ;
                if (fabs(beat - plan.position_time) >= 20e-6)
                    print_message("position %d after %.6f s, %.6f wanted\n", count, beat, plan.position_time);
                assert_true(fabs(beat - plan.position_time) < 20e-6);
            }
            last = b->edges[i].at;
            count++;
        }
        assert_int_equal(count, 24);
        print_message("start-stop, focus %d: %.4f s a position, held\n", focus, plan.position_time);
        bench_destroy(b);
    }
}

static void a_bracket_that_has_begun_is_finished_before_a_pause(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    start_stop_plan(&rig, &plan);
    for (int k = 0; k < 12; k++) {
        struct bench *b = bench_create(&rig);
        bench_home(b);
        uint32_t crc = bench_load(b, &plan);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_SWEEPING, 30);
        bench_run(b, 11.5 + 0.53 * k);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(pause, 0)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_PAUSED, 10);
        assert_int_equal(b->fired % 3, 0);
        assert_int_equal(b->lost, 0);
        uint32_t first = b->fired;
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = first)),
                         lumi_wire_Result_DONE);
        bench_run(b, 20);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(stop, .at_once = k % 2)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_IDLE, 10);
        assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_STOPPED_BY_HOST);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .only_missing = true)),
                         lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_IDLE, 200);
        for (int i = 0; i < 72; i++)
            assert_int_equal(b->shot_fired[i], 1);
        bench_destroy(b);
    }
}

static void winding_goes_where_the_plan_says(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    bench_home(b);
    lumi_plan_init(&plan, &rig);
    plan.turns = 1;
    plan.first_turn = 2;
    plan.wind = LUMI_PLAN_WIND_NONE;
    uint32_t crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_REFUSED);
    plan.wind = LUMI_PLAN_WIND_PLAN;
    crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 100);
    assert_int_equal(b->fired, 72);
    assert_true(fabs(b->last_shot.step / b->steps_per_turn - (2 + 71.0 / 72)) < 1e-9);
    assert_int_equal(b->last_shot.turn, 2);
    assert_true(fabs(b->last_shot.pitch - lumi_rig_drop(&rig, 2 + 71.0 / 72)) < 1e-12);
    plan.wind = LUMI_PLAN_WIND_FULL;
    plan.first_turn = 1;
    crc = bench_load(b, &plan);
    b->step_count = 0;
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 100);
    assert_int_equal(b->fired, 144);
    int64_t highest = b->step_position[0];
    for (int i = 0; i < b->step_count; i++)
        highest = b->step_position[i] < highest ? b->step_position[i] : highest;
    assert_true(highest < 0 && highest > -b->steps_per_turn / 4);
    bench_destroy(b);
}

static struct bench *with_external_drive(struct lumi_plan *plan, uint32_t *crc)
{
    struct lumi_rig rig;

    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    struct bench *b = bench_create(&rig);
    start_stop_plan(&rig, plan);
    *crc = bench_load(b, plan);
    return b;
}

static void an_external_drive_fires_where_it_stands(void **state)
{
    struct lumi_plan plan;
    uint32_t crc;

    (void)state;
    struct bench *b = with_external_drive(&plan, &crc);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 5)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    bench_run(b, 0.1);
    assert_true(b->homed.found);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_UNSUPPORTED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .first_shot = 1)), lumi_wire_Result_BAD);
    for (uint32_t position = 0; position < 24; position++) {
        bench_set_input(b, BOARD_IN_REACHED, false);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .first_shot = 3 * position, .timeout = 5)),
                         lumi_wire_Result_DONE);
        bench_run(b, 1);
        assert_int_equal(b->fired, 3 * position);
        bench_set_input(b, BOARD_IN_REACHED, true);
        bench_until(b, lumi_wire_State_IDLE, 10);
        assert_int_equal(b->fired, 3 * (position + 1));
    }
    for (int i = 0; i < 72; i++)
        assert_int_equal(b->shot_fired[i], 1);
    assert_int_equal(host_board_counts(b->board)->steps, 0);
    bench_destroy(b);
}

static void an_external_drive_that_does_not_come_or_leaves_is_told(void **state)
{
    struct lumi_plan plan;
    uint32_t crc;

    (void)state;
    struct bench *b = with_external_drive(&plan, &crc);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    bench_run(b, 1);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 2)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 3);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_FAULTED);
    assert_int_equal(b->notes, 1);
    assert_int_equal(b->fired + b->lost, 0);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(fire_here, .timeout = 2)), lumi_wire_Result_DONE);
    bench_set_input(b, BOARD_IN_REACHED, true);
    bench_run(b, 0.3); /* settled, and the first trigger is out */
    bench_set_input(b, BOARD_IN_REACHED, false);
    bench_until(b, lumi_wire_State_IDLE, 5);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_FAULTED);
    assert_int_equal(b->lost, 1);
    assert_int_equal(b->fired, 0);
    bench_set_input(b, BOARD_IN_ESTOP, true);
    assert_false(b->outputs[BOARD_OUT_ENABLE]); /* at once: the drive stops itself */
    bench_run(b, 0.1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED_LOST);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
    assert_false(b->outputs[BOARD_OUT_ENABLE]);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_DONE);
    bench_run(b, 0.5);
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    bench_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_position_takes_as_long_as_the_plan_says_to_the_limit),
        cmocka_unit_test(a_bracket_that_has_begun_is_finished_before_a_pause),
        cmocka_unit_test(winding_goes_where_the_plan_says),
        cmocka_unit_test(an_external_drive_fires_where_it_stands),
        cmocka_unit_test(an_external_drive_that_does_not_come_or_leaves_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
