/* firmware/core: motion: what ends a move early: a stop, a halt, a main loop that is late. */
#include "motion_rig.h"

/* How far a ramp down from the curve's state takes. */
static double stop_distance(double v, double a, const struct motion_limits *l)
{
    double up = fmax(a, 0) / l->jerk; /* until it stops getting faster */
    double top = v + fmax(a, 0) * up / 2;

    return (v + top) * up + lumi_ramp_distance(top, l->acceleration, l->jerk);
}

static void a_stop_in_any_phase_keeps_the_limits_and_the_position(void **state)
{
    (void)state;
    seed = 15;
    for (int i = 0; i < 250; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        uint64_t period = MS + (uint64_t)(uniform() * MS);
        assert_true(motion_start(&rig->motion, distance, &l, 0));
        double end = ramp_end_time(&rig->motion.ramp);
        uint64_t when = rig->motion.origin + (uint64_t)(end * uniform() * BOARD_TICK_HZ);
        step_board_run(&rig->board, when, period);
        struct ramp_phase at;
        ramp_at(&rig->motion.ramp, motion_moving(&rig->motion) ? rig->motion.at_last.curve.t : end, &at);
        double bound = fmin(at.x + stop_distance(at.v, at.a, &l) + 1, (double)distance);
        motion_stop(&rig->motion);
        motion_stop(&rig->motion);
        double given_up = ramp_end_place(&rig->motion.ramp) + 0.01;
        if (given_up < (double)distance)
            assert_int_equal(motion_time_of(&rig->motion, given_up), BOARD_NEVER);
        step_board_run(&rig->board, when + (uint64_t)(uniform() * 0.1 * end * BOARD_TICK_HZ), period);
        motion_stop(&rig->motion);
        assert_in_range(rig->motion.ramp.count, 0, RAMP_PHASES);
        uint64_t last = motion_end(&rig->motion);
        step_board_run(&rig->board, BOARD_NEVER, period);
        assert_false(motion_starved(&rig->motion));
        assert_true(motion_known(&rig->motion));
        assert_int_equal(motion_position(&rig->motion), rig->board.steps);
        assert_int_equal(rig->board.steps, rig->board.count);
        assert_true((double)rig->board.count <= bound);
        assert_true(fabs((double)rig->board.steps - ramp_end_place(&rig->motion.ramp)) < 0.5001);
        if (rig->board.count > 0) {
            assert_true(llabs((long long)(last - rig->board.pulses[rig->board.count - 1])) <= MOTION_RAMP_TICKS);
            assert_within_limits(rig, &l);
        }
        /* And on it goes, not before the last curve is at rest. */
        uint64_t rest = rig->motion.rest_at;
        move(rig, distance + 1, &l, period);
        assert_true(rig->motion.origin >= rest);
        rig_free(rig);
    }
}

static void a_stop_comes_within_thirty_milliseconds(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    assert_true(motion_start(&rig->motion, 200000, &bar2, 0));
    step_board_run(&rig->board, motion_time_of(&rig->motion, 100000), 2 * MS);
    uint64_t now = rig->board.now;
    double most = 4800 * 0.03 + lumi_ramp_distance(bar2.speed, bar2.acceleration, bar2.jerk);
    motion_stop(&rig->motion);
    assert_true(ramp_end_place(&rig->motion.ramp) - 100000 < most);
    assert_true(motion_end(&rig->motion) > now);
    rig_free(rig);
}

static void a_stop_before_the_first_step_calls_the_move_off(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    motion_stop(&rig->motion); /* at rest: nothing */
    move(rig, 50, &bar2, MS);
    rig->board.count = 0;
    assert_true(motion_start(&rig->motion, 28800, &bar2, rig->board.now + 10 * (uint64_t)BOARD_TICK_HZ));
    step_board_run(&rig->board, rig->board.now + 9 * (uint64_t)BOARD_TICK_HZ, MS);
    assert_true(motion_moving(&rig->motion));
    motion_stop(&rig->motion);
    assert_false(motion_moving(&rig->motion));
    assert_false(rig->board.stepping);
    assert_int_equal(motion_end(&rig->motion), rig->board.now);
    assert_int_equal(motion_time_of(&rig->motion, 1000), BOARD_NEVER);
    assert_true(motion_speed(&rig->motion, rig->board.now) == 0);
    step_board_run(&rig->board, rig->board.now + 9 * (uint64_t)BOARD_TICK_HZ, MS);
    assert_int_equal(rig->board.count, 0);
    assert_true(motion_known(&rig->motion));
    move(rig, 0, &bar2, MS);
    rig_free(rig);
}

static void after_a_halt_no_step_comes_and_the_count_is_right(void **state)
{
    (void)state;
    seed = 16;
    for (int i = 0; i < 100; i++) {
        struct rig *rig = rig_new();
        assert_true(motion_start(&rig->motion, 5000, &bar2, 0));
        step_board_run(&rig->board, rig->motion.origin + (uint64_t)(1.2 * uniform() * BOARD_TICK_HZ), MS);
        bool begun = rig->board.count > 0, late = i % 2 && begun && motion_moving(&rig->motion);
        if (late) { /* a pulse has risen whose interrupt has to wait for the e-stop's */
            rig->board.steps += 1;
            rig->board.count++;
        }
        motion_halt(&rig->motion);
        assert_false(rig->board.stepping);
        if (late)
            assert_int_equal(motion_on_step(&rig->motion, rig->board.now), 0);
        size_t count = rig->board.count;
        step_board_run(&rig->board, rig->board.now + BOARD_TICK_HZ, MS);
        assert_int_equal(rig->board.count, count);
        assert_int_equal(motion_position(&rig->motion), rig->board.steps);
        assert_false(motion_moving(&rig->motion));
        assert_int_equal(motion_known(&rig->motion), !begun);
        assert_int_equal(motion_time_of(&rig->motion, 4999), BOARD_NEVER);
        assert_true(motion_speed(&rig->motion, rig->board.now) == 0);
        /* Latched. */
        assert_true(motion_halted(&rig->motion));
        motion_set_position(&rig->motion, 0);
        assert_false(motion_start(&rig->motion, 10, &bar2, 0));
        motion_release(&rig->motion);
        assert_int_equal(motion_time_of(&rig->motion, 1), BOARD_NEVER);
        rig->board.steps = 0;
        move(rig, 10, &bar2, MS);
        rig_free(rig);
    }
}

static void a_halt_at_rest_keeps_the_position(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    move(rig, 100, &bar2, MS);
    motion_halt(&rig->motion);
    assert_true(motion_known(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), 100);
    motion_release(&rig->motion);
    move(rig, 0, &bar2, MS);
    rig_free(rig);
}

static struct motion *halted_by_lock;
static int locks_before_halt;

static unsigned lock_and_halt(void *port)
{
    if (locks_before_halt-- == 0)
        motion_halt(halted_by_lock); /* the e-stop's interrupt, just before interrupts are held off */
    return step_board_lock(port);
}

static void a_halt_while_a_move_is_being_started_wins(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    int halted = 0;

    rig->board.board.lock = lock_and_halt;
    halted_by_lock = &rig->motion;
    for (int n = 0; n < 5; n++) {
        locks_before_halt = n;
        bool started = motion_start(&rig->motion, 100, &bar2, 0);
        if (locks_before_halt >= 0)
            break; /* it locks no more often */
        halted++;
        assert_false(started);
        assert_int_equal(rig->board.starts, 0);
        assert_true(motion_known(&rig->motion));
        motion_release(&rig->motion);
    }
    assert_in_range(halted, 1, 4);
    rig_free(rig);
}

static void a_halt_before_the_first_step_keeps_the_position(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    assert_true(motion_start(&rig->motion, 5000, &bar2, 0));
    motion_halt(&rig->motion);
    assert_false(rig->board.stepping);
    assert_true(motion_known(&rig->motion));
    motion_release(&rig->motion);
    move(rig, 10, &bar2, MS);
    rig_free(rig);
}

/* The main loop stops coming: the steps made are right, the rest is not made. */
static void a_main_loop_that_is_late_ends_the_steps_and_never_makes_a_wrong_one(void **state)
{
    int starved = 0;

    (void)state;
    seed = 17;
    for (int i = 0; i < 60; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = i % 2 ? fast : bar2;
        struct truth truth = truth_of(20000, &l);
        assert_true(motion_start(&rig->motion, 20000, &l, 0));
        step_board_run(&rig->board, rig->motion.origin + (uint64_t)(uniform() * truth_end(&truth) * HZ), MS);
        step_board_advance(&rig->board, rig->board.now + (uint64_t)(2 * uniform() * 30 * MS));
        step_board_run(&rig->board, BOARD_NEVER, MS);
        assert_false(rig->board.stepping);
        assert_int_equal(motion_position(&rig->motion), rig->board.count);
        for (size_t k = 0; k < rig->board.count; k++)
            assert_true(fabsl((long double)(rig->board.pulses[k] - rig->motion.origin) -
                              truth_time(&truth, k + 0.5L) * HZ) <= MOTION_RAMP_TICKS);
        if (rig->board.count < 20000) {
            starved++;
            assert_true(motion_starved(&rig->motion));
            assert_false(motion_known(&rig->motion));
            assert_false(motion_start(&rig->motion, 0, &l, 0));
            motion_release(&rig->motion);
            assert_false(motion_starved(&rig->motion));
            assert_false(motion_start(&rig->motion, 0, &l, 0)); /* nobody knows from where */
            assert_true(motion_seek(&rig->motion, 10, &l));
        }
        rig_free(rig);
    }
    assert_in_range(starved, 10, 50);
}

static void a_main_loop_every_ten_milliseconds_is_enough(void **state)
{
    (void)state;
    seed = 18;
    for (int i = 0; i < 60; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        l.acceleration = l.speed / between(0.1, 3);
        l.jerk = l.acceleration / between(0.03, 1);
        move(rig, random_distance(&l), &l, 10 * MS);
        rig_free(rig);
    }
}

static void it_is_polled_as_often_as_it_asks(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    int polls = 0;

    assert_int_equal(motion_next_poll(&rig->motion), BOARD_NEVER);
    assert_true(motion_start(&rig->motion, 20000, &fast, 0));
    while (motion_moving(&rig->motion)) {
        uint64_t next = motion_next_poll(&rig->motion);
        if (next == BOARD_NEVER) {
            step_board_advance(&rig->board, rig->board.now + MS);
            continue;
        }
        assert_true(next >= rig->board.now);
        step_board_advance(&rig->board, next);
        motion_poll(&rig->motion);
        polls++;
    }
    assert_false(motion_starved(&rig->motion));
    assert_int_equal(motion_position(&rig->motion), 20000);
    assert_in_range(polls, 10, 1000);
    rig_free(rig);
}

/* Whatever is asked for in whatever order: every step is counted, none comes while halted, and what is known is true.
 */
static void any_order_of_moves_stops_and_halts_keeps_the_count(void **state)
{
    (void)state;
    seed = 19;
    for (int i = 0; i < 40; i++) {
        struct rig *rig = rig_new();
        int64_t offset = 0; /* of the position from the truth; changes when it is set */
        for (int n = 0; n < 100; n++) {
            struct motion_limits l = random_limits();
            int64_t by = random_distance(&l) % 5000 + 1;
            bool moving = motion_moving(&rig->motion), halted = motion_halted(&rig->motion), done;
            size_t count = rig->board.count;
            switch ((int)(uniform() * 8)) {
            case 0:
            case 1:
            case 2:
                if (uniform() < 0.5)
                    by = -by;
                done = motion_start(&rig->motion, motion_position(&rig->motion) + by, &l, 0);
                assert_int_equal(done, !moving && !halted && motion_known(&rig->motion));
                break;
            case 3:
                assert_int_equal(motion_seek(&rig->motion, -by, &l), !moving && !halted);
                break;
            case 4:
                motion_stop(&rig->motion);
                break;
            case 5:
                motion_halt(&rig->motion);
                assert_false(rig->board.stepping);
                break;
            case 6:
                motion_release(&rig->motion);
                break;
            default:
                motion_set_position(&rig->motion, by);
                if (!moving)
                    offset = by - rig->board.steps;
            }
            step_board_run(&rig->board, rig->board.now + (uint64_t)(between(1e-4, 2) * BOARD_TICK_HZ), 2 * MS);
            assert_false(motion_starved(&rig->motion));
            assert_int_equal(motion_position(&rig->motion), rig->board.steps + offset);
            assert_int_equal(motion_moving(&rig->motion), rig->board.stepping);
            if (motion_halted(&rig->motion))
                assert_int_equal(rig->board.count, count);
        }
        rig_free(rig);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_stop_in_any_phase_keeps_the_limits_and_the_position),
        cmocka_unit_test(a_stop_comes_within_thirty_milliseconds),
        cmocka_unit_test(a_stop_before_the_first_step_calls_the_move_off),
        cmocka_unit_test(after_a_halt_no_step_comes_and_the_count_is_right),
        cmocka_unit_test(a_halt_at_rest_keeps_the_position),
        cmocka_unit_test(a_halt_while_a_move_is_being_started_wins),
        cmocka_unit_test(a_halt_before_the_first_step_keeps_the_position),
        cmocka_unit_test(any_order_of_moves_stops_and_halts_keeps_the_count),
        cmocka_unit_test(a_main_loop_that_is_late_ends_the_steps_and_never_makes_a_wrong_one),
        cmocka_unit_test(a_main_loop_every_ten_milliseconds_is_enough),
        cmocka_unit_test(it_is_polled_as_often_as_it_asks),
    };

    return cmocka_run_group_tests_name("motion_stop", tests, NULL, NULL);
}
