/* Cameras that record by themselves: what they are told when a stop comes at an awkward moment. */
#include "tests/unit/core_bench.h"

static struct bench *create(void)
{
    struct lumi_rig rig;

    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
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

static void filming(struct bench *b, struct lumi_plan *plan)
{
    bench_home(b);
    lumi_plan_init(plan, &b->rig);
    plan->mode = LUMI_PLAN_VIDEO;
    plan->turns = 2;
    b->edge_count = 0;
}

static void recording_that_never_began_is_not_stopped(void **state)
{
    struct lumi_plan plan;

    (void)state;
    for (int how = 0; how < 3; how++) {
        struct bench *b = create();
        filming(b, &plan);
        uint32_t crc = start(b, &plan);
        while (b->core->state != lumi_wire_State_SWEEPING)
            bench_beat(b);
        assert_int_equal(b->edge_count, 0); /* queued, 20 ms ahead */
        if (how == 2) {
            press(b);
        } else {
            assert_int_equal(bench_ask(b, BENCH_REQUEST(stop, .at_once = how == 1)), lumi_wire_Result_DONE);
        }
        bench_run(b, 2);
        assert_true(state_at_rest(b->core->state));
        assert_int_equal(b->edge_count, 0);
        if (how == 2) {
            bench_set_input(b, BOARD_IN_ESTOP, false);
            bench_run(b, 0.1);
            assert_int_equal(bench_ask(b, BENCH_REQUEST(clear, .faults = 1)), lumi_wire_Result_DONE);
            bench_run(b, 1);
            assert_int_equal(b->edge_count, 0); /* a pulse would have started them */
        }
        if (b->core->state == lumi_wire_State_IDLE) {
            assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
            bench_until(b, lumi_wire_State_IDLE, 200);
            assert_int_equal(b->edge_count, 4);
        }
        bench_destroy(b);
    }
}

static void cameras_that_record_are_stopped_by_a_stop_at_once_too(void **state)
{
    struct lumi_plan plan;

    (void)state;
    struct bench *b = create();
    filming(b, &plan);
    uint32_t crc = start(b, &plan);
    bench_until(b, lumi_wire_State_SWEEPING, 20);
    bench_run(b, 20);
    assert_int_equal(b->edge_count, 2);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(stop, .at_once = true)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 10);
    assert_int_equal(b->edge_count, 4);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 200);
    assert_int_equal(b->edge_count, 8);
    bench_destroy(b);
}

/* Whether cameras that take every pulse's rise for start or stop record now. */
static bool films(const struct bench *b)
{
    int rises = 0;

    for (int i = 0; i < b->edge_count; i++)
        rises += (b->edges[i].rise & 1) != 0;
    return rises % 2 != 0;
}

/* A host that answers at once: a few requests within the 2 ms that a pulse is queued ahead. */
static void ask_quickly(struct bench *b, lumi_wire_Request *request)
{
    struct lumi_error error;
    uint8_t data[512];
    size_t size;

    b->replied = false;
    assert_int_equal(lumi_wire_client_request(&b->client, request, core_ns(host_board_now(b->board)), &error), 0);
    for (int i = 0; i < 1000 && !b->replied; i++) {
        host_board_run(b->board, host_board_now(b->board) + BENCH_SECOND / 20000);
        while ((size = host_board_link_pull(b->board, BOARD_LINK_USB, data, sizeof data)) > 0)
            lumi_wire_client_receive(&b->client, data, size, core_ns(host_board_now(b->board)));
        lumi_wire_client_poll(&b->client, core_ns(host_board_now(b->board)));
    }
    assert_true(b->replied);
    assert_int_equal(b->reply.result, lumi_wire_Result_DONE);
}

/* Stopped in the record lead, cleared: `later` (s) the stop pulse is queued, up or just down. */
static struct bench *cleared(double pressed, double later, uint32_t *crc)
{
    struct lumi_plan plan;
    struct bench *b = create();

    filming(b, &plan);
    *crc = start(b, &plan);
    while (b->core->state != lumi_wire_State_SWEEPING)
        bench_beat(b);
    bench_run(b, pressed);
    assert_true(films(b));
    press(b);
    bench_run(b, 0.1);
    assert_int_equal(b->core->state, lumi_wire_State_STOPPED);
    bench_set_input(b, BOARD_IN_ESTOP, false);
    bench_run(b, 0.1);
    ask_quickly(b, BENCH_REQUEST(clear, .faults = 1));
    if (later > 0)
        bench_run(b, later);
    return b;
}

static void a_video_that_is_resumed_at_once_waits_for_the_pulse_that_is_owed(void **state)
{
    static const double later[] = {0, 0.002, 0.004, 0.006, 0.02, 0.1, 0.15, 0.19, 0.21, 0.3};
    uint32_t crc;

    (void)state;
    for (int k = 0; k < 20; k++) {
        struct bench *b = cleared(k % 2 ? 0.05 : 0.4, later[k / 2], &crc); /* its start pulse cut short, or whole */
        ask_quickly(b, BENCH_REQUEST(start_sweep, .plan_crc = crc));
        bench_run(b, 2);
        assert_true(films(b));
        bench_until(b, lumi_wire_State_IDLE, 200);
        assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
        assert_int_equal(b->edge_count, 8); /* four pulses, each by itself */
        bench_destroy(b);
    }
}

static void a_stop_pulse_that_a_stop_dropped_is_given_at_rest(void **state)
{
    uint32_t crc;

    (void)state;
    for (int k = 0; k < 6; k++) {
        struct bench *b = cleared(0.4, 0, &crc);
        if (k % 3 == 0)
            ask_quickly(b, BENCH_REQUEST(start_sweep, .plan_crc = crc));
        else if (k % 3 == 1)
            ask_quickly(b, BENCH_REQUEST(home, 0));
        else
            ask_quickly(b, BENCH_REQUEST(jog, .turns = 0.1));
        ask_quickly(b, BENCH_REQUEST(stop, .at_once = k / 3 != 0));
        assert_int_equal(b->edge_count, 2); /* it was queued */
        bench_run(b, 2);
        assert_true(state_at_rest(b->core->state));
        assert_false(films(b));
        assert_int_equal(b->edge_count, 4);
        bench_destroy(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recording_that_never_began_is_not_stopped),
        cmocka_unit_test(cameras_that_record_are_stopped_by_a_stop_at_once_too),
        cmocka_unit_test(a_video_that_is_resumed_at_once_waits_for_the_pulse_that_is_owed),
        cmocka_unit_test(a_stop_pulse_that_a_stop_dropped_is_given_at_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
