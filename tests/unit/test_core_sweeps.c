/* Whole sweeps on the bench: every shot once, at its angle; what pausing, resuming and a lost host leave behind. */
#include "tests/unit/core_bench.h"

static struct bench *homed(const char *name, double hurry)
{
    struct lumi_rig rig;

    assert_int_equal(lumi_rig_builtin(name, &rig, NULL), LUMI_OK);
    for (int i = 0; i < rig.camera_count; i++) {
        rig.control.triggers[i].shutter_lag = 0.02 + 0.003 * i;
        rig.control.triggers[i].busy = 0.1;
    }
    rig.control.motion.wind_speed = rig.control.motion.speed_max;
    (void)hurry;
    struct bench *b = bench_create(&rig);
    bench_home(b);
    return b;
}

static uint32_t start(struct bench *b, const struct lumi_plan *plan)
{
    uint32_t crc = bench_load(b, plan);
    lumi_wire_Result result = bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc));

    if (result != lumi_wire_Result_DONE)
        print_message("%s\n", b->reply.text);
    assert_int_equal(result, lumi_wire_Result_DONE);
    return crc;
}

static void each_shot_was_fired_once(const struct bench *b, int shots)
{
    for (int i = 0; i < shots; i++) {
        if (b->shot_fired[i] != 1)
            print_message("shot %d fired %d times, lost %d times\n", i, b->shot_fired[i], b->shot_lost[i]);
        assert_int_equal(b->shot_fired[i], 1);
    }
    assert_int_equal(b->fired, shots);
}

/* The largest distance in degrees from an exposure's middle, as the edges and lags make it, to its position. */
static double worst_angle(const struct bench *b, const struct lumi_plan *plan, int *exposures)
{
    const double per_position = b->steps_per_turn / plan->positions;
    double worst = 0;

    *exposures = 0;
    for (int i = 0; i < b->edge_count; i++)
        for (int c = 0; c < b->rig.camera_count; c++) {
            const struct lumi_rig_trigger *t = &b->rig.control.triggers[c];
            if (!(b->edges[i].rise >> t->channel & 1))
                continue;
            uint64_t middle = b->edges[i].at + (uint64_t)((t->shutter_lag + plan->exposures[0] / 2) * BOARD_TICK_HZ);
            double place = bench_position_at(b, middle) / per_position;
            worst = fmax(worst, fabs(place - round(place)) * 360 / plan->positions);
            ++*exposures;
        }
    return worst;
}

static void a_continuous_sweep_fires_every_shot_at_its_angle(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;
    int exposures;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    plan.turn_time = 30;
    b->step_count = b->edge_count = 0;
    int64_t off = b->position - motion_position(&b->core->motion);
    start(b, &plan);
    bench_until(b, lumi_wire_State_IDLE, 60);
    each_shot_was_fired_once(b, 72);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    assert_int_equal(b->ended.fired, 72);
    for (int i = 0; i < b->step_count; i++)
        b->step_position[i] -= off;
    double worst = worst_angle(b, &plan, &exposures);
    print_message("continuous, 30 s a turn: worst exposure middle %.6f degrees off\n", worst);
    assert_int_equal(exposures, 16 * 72);
    assert_true(worst < 0.01);
    assert_int_equal(b->turn_marks, 1);
    assert_int_equal(b->edge_count > 0, 1);
    assert_int_equal(b->lines, 0);
    bench_destroy(b);
}

static void positions_between_steps_are_met_too(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;
    int exposures;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    plan.positions = 71;
    plan.turn_time = 60;
    b->step_count = b->edge_count = 0;
    int64_t off = b->position - motion_position(&b->core->motion);
    start(b, &plan);
    bench_until(b, lumi_wire_State_IDLE, 90);
    each_shot_was_fired_once(b, 71);
    for (int i = 0; i < b->step_count; i++)
        b->step_position[i] -= off;
    double worst = worst_angle(b, &plan, &exposures);
    print_message("71 positions, 60 s a turn: worst exposure middle %.6f degrees off\n", worst);
    assert_int_equal(exposures, 16 * 71);
    assert_true(worst < 0.001);
    bench_destroy(b);
}

static void a_start_stop_sweep_takes_brackets_standing_still(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.positions = 12;
    plan.position_time = 3;
    plan.bracket = 3;
    plan.exposures[0] = 0.01;
    plan.exposures[1] = 0.04;
    plan.exposures[2] = 0.16;
    b->step_count = b->edge_count = 0;
    start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    uint64_t begun = host_board_now(b->board);
    bench_until(b, lumi_wire_State_IDLE, 60);
    each_shot_was_fired_once(b, 36);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    double seconds = (double)(host_board_now(b->board) - begun) / BOARD_TICK_HZ;
    assert_true(seconds > 33 && seconds < 35.5);
    /* No step from half a settling time before a trigger until its exposure is over. */
    for (int i = 0, k = 0; i < b->edge_count; i++) {
        if (b->edges[i].rise == 0)
            continue;
        while (k < b->step_count && b->step_at[k] <= b->edges[i].at)
            k++;
        assert_true(k > 0);
        assert_true(b->edges[i].at - b->step_at[k - 1] > 0.15 * BOARD_TICK_HZ);
        if (k < b->step_count)
            assert_true(b->step_at[k] - b->edges[i].at > 0.02 * BOARD_TICK_HZ);
    }
    bench_destroy(b);
}

static void a_paused_sweep_goes_on_and_every_shot_is_fired_once(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 30);
    for (int i = 0; i < 3; i++) {
        bench_run(b, 4 + i);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(pause, 0)), lumi_wire_Result_DONE);
        bench_until(b, lumi_wire_State_PAUSED, 10);
        assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_PAUSED_BY_HOST);
        assert_int_equal(b->ended.fired, b->fired);
        assert_int_equal(b->lost, 0);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(get_status, 0)), lumi_wire_Result_DONE);
        uint32_t next = b->reply.payload.status.next_shot;
        assert_int_equal(next, b->fired);
        assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = next)),
                         lumi_wire_Result_DONE);
    }
    bench_until(b, lumi_wire_State_IDLE, 60);
    each_shot_was_fired_once(b, 72);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    bench_destroy(b);
}

static void marked_shots_are_taken_once_more_and_no_others(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_IDLE, 60);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(mark_shots, .first = 20, .count = 5)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(read_shots, 0)), lumi_wire_Result_DONE);
    assert_int_equal(b->reply.payload.shots.count, 72);
    assert_int_equal(b->reply.payload.shots.states.bytes[5], 0x00);
    assert_int_equal(b->reply.payload.shots.states.bytes[4], 0x55);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = 0, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    for (int i = 0; i < 72; i++)
        assert_int_equal(b->shot_fired[i], i >= 20 && i < 25 ? 2 : 1);
    bench_destroy(b);
}

static void shots_marked_as_fired_are_not_taken_again(void **state)
{
    struct bench *b = homed("arc16", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    uint32_t crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(mark_shots, .first = 0, .count = 30, .fired = true)),
                     lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(mark_shots, .first = 40, .count = 32, .fired = true)),
                     lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(mark_shots, .first = 40, .count = 33, .fired = true)),
                     lumi_wire_Result_BAD);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = 0, .only_missing = true)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 60);
    for (int i = 0; i < 72; i++)
        assert_int_equal(b->shot_fired[i], i >= 30 && i < 40);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(get_status, 0)), lumi_wire_Result_DONE);
    assert_int_equal(b->reply.payload.status.shots_fired, 72);
    bench_destroy(b);
}

static void a_lost_host_ends_the_row_and_the_sweep_goes_on_later(void **state)
{
    struct bench *b = homed("bar2", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    plan.turns = 3;
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 60);
    bench_run(b, 20);
    b->mute = true;
    bench_run(b, 40);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED);
    b->mute = false;
    bench_run(b, 2);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_HOST_LOST);
    assert_int_equal(b->ended.fired, 72);
    assert_int_equal(b->faults_set, 1u << LUMI_RIG_FAULT_HOST_LOST);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = 72)),
                     lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "start: not while the rig is stopped by a fault (host-lost)");
    assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 2)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = 72)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 100);
    each_shot_was_fired_once(b, 216);
    assert_int_equal(b->turn_marks, 3);
    assert_int_equal(b->turn_mark.turn, 2);
    assert_int_equal(b->turn_mark.step, llround(2 * b->steps_per_turn));
    assert_true(fabs(b->turn_mark.pitch - lumi_rig_drop(&b->rig, 2)) < 1e-6);
    bench_destroy(b);
}

static void a_video_records_and_flashes_every_turn(void **state)
{
    struct bench *b = homed("bar2", 1);
    struct lumi_plan plan;

    (void)state;
    lumi_plan_init(&plan, &b->rig);
    plan.mode = LUMI_PLAN_VIDEO;
    plan.turns = 2;
    plan.turn_time = 20;
    b->edge_count = b->lamp_count = 0;
    start(b, &plan);
    bench_until(b, lumi_wire_State_IDLE, 120);
    assert_int_equal(b->fired + b->lost, 0);
    assert_int_equal(b->turn_marks, 3);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    assert_int_equal(b->edge_count, 4); /* a pulse to record, a pulse to stop */
    double recorded = (double)(b->edges[2].at - b->edges[0].at) / BOARD_TICK_HZ;
    assert_true(recorded > 40 && recorded < 55);
    /* Every code begins with one lamp edge a turn after the last. */
    int codes = 0;
    uint64_t began[8] = {0};
    for (int i = 0; i < b->lamp_count; i++)
        if (i == 0 || b->lamp_at[i] - b->lamp_at[i - 1] > BENCH_SECOND)
            began[codes++ % 8] = b->lamp_at[i];
    assert_int_equal(codes, 3);
    for (int i = 1; i < 3; i++)
        assert_true(fabs((double)(began[i] - began[i - 1]) / BOARD_TICK_HZ - 20) < 0.001);
    bench_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_continuous_sweep_fires_every_shot_at_its_angle),
        cmocka_unit_test(positions_between_steps_are_met_too),
        cmocka_unit_test(a_start_stop_sweep_takes_brackets_standing_still),
        cmocka_unit_test(a_paused_sweep_goes_on_and_every_shot_is_fired_once),
        cmocka_unit_test(marked_shots_are_taken_once_more_and_no_others),
        cmocka_unit_test(shots_marked_as_fired_are_not_taken_again),
        cmocka_unit_test(a_lost_host_ends_the_row_and_the_sweep_goes_on_later),
        cmocka_unit_test(a_video_records_and_flashes_every_turn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
