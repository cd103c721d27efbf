/* The check of a plan against the board that runs it: the tightest plan that is let through is made in its time, every
 * shot fired once, none late. */
#include "tests/unit/core_bench.h"

static uint32_t seed;

static double random_in(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * ((seed >> 8) / 16777216.0);
}

static struct lumi_rig random_rig(void)
{
    struct lumi_rig rig;
    struct lumi_rig_motion *m = &rig.control.motion;

    assert_int_equal(lumi_rig_builtin(random_in(0, 1) < 0.5 ? "bar2" : "arc16", &rig, NULL), LUMI_OK);
    for (int i = 0; i < rig.camera_count; i++) {
        rig.control.triggers[i].shutter_lag = random_in(0, 0.06);
        rig.control.triggers[i].busy = random_in(0, 0.2);
        rig.control.triggers[i].pulse = random_in(0.01, 0.15);
    }
    if (rig.camera_count == 2 && random_in(0, 1) < 0.5) {
        rig.control.triggers[1].focus_channel = 9;
        rig.control.triggers[1].focus_lead = random_in(0.05, 1.2);
    }
    m->speed_max *= random_in(0.5, 2);
    m->acceleration_max *= random_in(0.3, 2);
    m->jerk_max *= random_in(0.2, 2);
    m->wind_speed = m->speed_max;
    m->home_speed *= 2;
    m->settle = random_in(0.05, 0.6);
    m->backlash *= random_in(0, 3);
    rig.control.safety.overspeed = 0;
    return rig;
}

static struct lumi_plan random_plan(const struct lumi_rig *rig, enum lumi_plan_mode mode)
{
    struct lumi_plan plan;

    lumi_plan_init(&plan, rig);
    plan.mode = mode;
    plan.positions = (int)random_in(9, 60);
    plan.turns = 1;
    plan.bracket = mode == LUMI_PLAN_START_STOP ? (int)random_in(1, 5) : 1;
    for (int k = 0; k < plan.bracket; k++)
        plan.exposures[k] = mode == LUMI_PLAN_START_STOP ? random_in(0.0005, 0.2) : 0.0005;
    plan.bracket_gap = random_in(0, 1) < 0.3 ? random_in(0, 0.2) : 0;
    return plan;
}

/* Sets *time, which is a number of the plan's, to the least that passes the check. */
static void tighten(struct lumi_plan *plan, double *time, const struct lumi_rig *rig)
{
    double low = 0.11, high = 600;

    for (int i = 0; i < 60; i++) {
        *time = (low + high) / 2;
        *(lumi_plan_check(plan, rig, NULL) == LUMI_OK ? &high : &low) = *time;
    }
    *time = high;
}

/* At every trigger the camera's focus line has been up for its lead. */
static void focus_was_held(const struct bench *b, const struct lumi_rig_trigger *t)
{
    uint64_t since = 0;
    bool held = false;

    for (int i = 0; i < b->edge_count && t->focus_channel >= 0; i++) {
        if (b->edges[i].fall >> t->focus_channel & 1)
            held = false;
        if (b->edges[i].rise >> t->focus_channel & 1) {
            held = true;
            since = b->edges[i].at;
        }
        if (b->edges[i].rise >> t->channel & 1)
            assert_true(held && (double)(b->edges[i].at - since) >= t->focus_lead * BOARD_TICK_HZ - 2);
    }
}

/* Runs the sweep; returns its seconds, as far as the platform moved and lines went up. */
static double run(struct bench *b, const struct lumi_plan *plan)
{
    uint32_t crc = bench_load(b, plan);

    if (bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)) != lumi_wire_Result_DONE)
        fail_msg("%s", b->reply.text);
    for (int i = 0; i < 60000 && b->core->state != lumi_wire_State_SWEEPING; i++)
        bench_beat(b);
    b->step_count = b->edge_count = 0;
    bench_until(b, lumi_wire_State_IDLE, 600);
    assert_int_equal(b->ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    for (int i = 0; i < lumi_plan_shots(plan); i++)
        if (b->shot_fired[i] != 1 || b->shot_lost[i] != 0)
            fail_msg("shot %d of %d: fired %d times, lost %d times", i, lumi_plan_shots(plan), b->shot_fired[i],
                     b->shot_lost[i]);
    assert_true(b->step_count > 0 && b->step_count < BENCH_STEPS && b->edge_count < BENCH_EDGES);
    for (int i = 0; i < b->rig.camera_count; i++)
        focus_was_held(b, &b->rig.control.triggers[i]);
    uint64_t first = b->step_at[0], last = b->step_at[b->step_count - 1], exposed = 0;
    for (int i = 0; i < b->edge_count; i++) {
        first = b->edges[i].at < first ? b->edges[i].at : first;
        last = b->edges[i].at > last ? b->edges[i].at : last;
        if (b->edges[i].rise & 1) /* what camera 0 exposes */
            exposed = b->edges[i].at +
                      (uint64_t)((b->rig.control.triggers[0].shutter_lag + plan->exposures[plan->bracket - 1]) *
                                 BOARD_TICK_HZ);
    }
    last = exposed > last ? exposed : last;
    return (double)(last - first) / BOARD_TICK_HZ;
}

static void the_tightest_start_stop_sweep_keeps_its_time(void **state)
{
    (void)state;
    for (seed = 1; seed < 4000; seed += 97) {
        uint32_t begun = seed;
        struct lumi_rig rig = random_rig();
        struct lumi_plan plan = random_plan(&rig, LUMI_PLAN_START_STOP);
        struct bench *b = bench_create(&rig);
        uint64_t rise[LUMI_RIG_POSITIONS_MAX];
        int rises = 0;

        tighten(&plan, &plan.position_time, &rig);
        bench_home(b);
        double seconds = run(b, &plan), said = lumi_plan_seconds(&plan, &rig);
        if (fabs(seconds - said) > 0.2)
            fail_msg("seed %u: %g s, %g s were said", begun, seconds, said);
        for (int i = 0; i < b->edge_count; i++) /* the first trigger of camera 0 at each position */
            if (b->edges[i].rise & 1 && rises++ % plan.bracket == 0)
                rise[(rises - 1) / plan.bracket] = b->edges[i].at;
        assert_int_equal(rises, plan.positions * plan.bracket);
        for (int p = 2; p < plan.positions; p++) { /* the first move is the backlash's */
            double after = (double)(rise[p] - rise[1]) / BOARD_TICK_HZ, wanted = (p - 1) * plan.position_time;
            if (fabs(after - wanted) > 0.01)
                fail_msg("seed %u: position %d came %g s after position 1, not %g", begun, p, after, wanted);
        }
        bench_destroy(b);
        seed = begun;
    }
}

static void the_tightest_continuous_sweep_fires_every_shot(void **state)
{
    (void)state;
    for (seed = 2; seed < 4000; seed += 97) {
        uint32_t begun = seed;
        struct lumi_rig rig = random_rig();
        struct lumi_plan plan = random_plan(&rig, LUMI_PLAN_CONTINUOUS);
        struct bench *b = bench_create(&rig);

        tighten(&plan, &plan.turn_time, &rig);
        bench_home(b);
        double seconds = run(b, &plan), said = lumi_plan_seconds(&plan, &rig);
        if (fabs(seconds - said) > 0.2 + rig.control.triggers[1].focus_lead)
            fail_msg("seed %u: %g s, %g s were said", begun, seconds, said);
        bench_destroy(b);
        seed = begun;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_tightest_start_stop_sweep_keeps_its_time),
        cmocka_unit_test(the_tightest_continuous_sweep_fires_every_shot),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
