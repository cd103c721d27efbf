/* firmware/core: motion: steps come when the curve says, all of them, within the limits. */
#include "motion_rig.h"

static void every_pulse_of_a_move_lies_on_the_curve(void **state)
{
    static const int64_t distances[] = {1, 2, 3, 4, 5, 10, 33, 100, 399, 400, 401, 1000, 5000, 28800};
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        struct rig *rig = rig_new();
        move(rig, distances[i], &bar2, MS);
        assert_int_equal(rig->board.count, distances[i]);
        assert_true(worst_error(rig, &bar2) <= MOTION_RAMP_TICKS);
        move(rig, 0, &bar2, 2 * MS);
        assert_int_equal(rig->board.count, distances[i]);
        assert_int_equal(rig->board.steps, 0);
        assert_true(worst_error(rig, &bar2) <= MOTION_RAMP_TICKS);
        rig_free(rig);
    }
}

static void a_hundred_thousand_steps_a_second_come_with_a_poll_every_two_milliseconds(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    move(rig, 300000, &fast, 2 * MS);
    assert_int_equal(rig->board.count, 300000);
    assert_int_equal(rig->board.pulses[150001] - rig->board.pulses[150000], 840);
    assert_true(worst_error(rig, &fast) <= MOTION_RAMP_TICKS);
    rig_free(rig);
}

static void random_moves_keep_the_limits_and_lie_on_the_curve(void **state)
{
    long double worst = 0;

    (void)state;
    seed = 11;
    for (int i = 0; i < 150; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        move(rig, uniform() < 0.5 ? distance : -distance, &l, (1 + (uint64_t)(uniform() * 2)) * MS);
        assert_int_equal(rig->board.count, distance);
        worst = fmaxl(worst, worst_error(rig, &l));
        assert_within_limits(rig, &l);
        rig_free(rig);
    }
    print_message("worst pulse %.2Lf ticks from its curve\n", worst);
    assert_true(worst <= MOTION_RAMP_TICKS);
}

static void a_move_takes_the_time_the_plan_reckons_with(void **state)
{
    (void)state;
    seed = 12;
    for (int i = 0; i < 50; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l);
        assert_true(motion_start(&rig->motion, distance, &l, 0));
        double seconds = lumi_move_time((double)distance, l.speed, l.acceleration, l.jerk);
        assert_true(fabs(ramp_end_time(&rig->motion.ramp) / seconds - 1) < 1e-9);
        rig_free(rig);
    }
}

/* A whole sweep of 18 turns at 30 s a turn: every pulse of the cruise within a tick of its time, the last like the
 * first. */
static void a_sweep_of_18_turns_does_not_drift(void **state)
{
    static const double turn_times[] = {30, 31.4159, 120};
    (void)state;
    for (size_t i = 0; i < sizeof turn_times / sizeof *turn_times; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = bar2;
        l.speed = 28800 / turn_times[i];
        int64_t run_up = motion_run_up_steps(&l), last = 18 * 28800;
        motion_set_position(&rig->motion, -run_up);
        assert_true(motion_start(&rig->motion, last + run_up, &l, 0));
        uint64_t begin = motion_time_of(&rig->motion, 0);
        step_board_run(&rig->board, BOARD_NEVER, 2 * MS);
        assert_int_equal(motion_position(&rig->motion), last + run_up);
        long double interval = HZ * turn_times[i] / 28800;
        for (int64_t p = 1; p <= last; p++) {
            uint64_t pulse = rig->board.pulses[run_up + p - 1];
            long double wanted = (p - 0.5L) * interval;
            if (fabsl((long double)(pulse - begin) - wanted) > 1.01L)
                fail_msg("pulse %lld: %Lf ticks off", (long long)p, (long double)(pulse - begin) - wanted);
        }
        assert_true(fabsl((long double)(motion_time_of(&rig->motion, (double)last) - begin) -
                          18 * HZ * turn_times[i]) <= 1.01L);
        rig_free(rig);
    }
}

static void places_are_passed_when_it_was_said(void **state)
{
    (void)state;
    seed = 13;
    for (int i = 0; i < 40; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t distance = random_distance(&l), start = (int64_t)(uniform() * 1000);
        int sign = uniform() < 0.5 ? 1 : -1;
        motion_set_position(&rig->motion, start);
        assert_true(motion_start(&rig->motion, start + sign * distance, &l, 5000 * MS));
        assert_int_equal(motion_time_of(&rig->motion, (double)start), 5000 * MS);
        assert_int_equal(motion_time_of(&rig->motion, (double)(start - sign)), BOARD_NEVER);
        assert_int_equal(motion_time_of(&rig->motion, (double)(start + sign * (distance + 1))), BOARD_NEVER);
        uint64_t *said = calloc((size_t)distance, sizeof *said), end = motion_end(&rig->motion);
        assert_non_null(said);
        /* All is said before the first step, and stays true while it runs. */
        for (int64_t k = 0; k < distance; k++)
            said[k] = motion_time_of(&rig->motion, (double)start + sign * ((double)k + 0.5));
        uint64_t middle = motion_time_of(&rig->motion, (double)start + sign * (double)distance / 2);
        step_board_run(&rig->board, middle, MS);
        for (int64_t k = 0; k < distance; k += 1 + distance / 17)
            assert_int_equal(motion_time_of(&rig->motion, (double)start + sign * ((double)k + 0.5)), said[k]);
        step_board_run(&rig->board, BOARD_NEVER, MS);
        for (int64_t k = 0; k < distance; k++)
            assert_true(llabs((long long)(said[k] - rig->board.pulses[k])) <= MOTION_RAMP_TICKS);
        assert_int_equal(end, said[distance - 1]);
        free(said);
        rig_free(rig);
    }
}

static void between_two_steps_places_are_even_in_the_cruise(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    struct motion_limits l = {1000, 5000, 50000};

    assert_true(motion_start(&rig->motion, 5000, &l, 0));
    uint64_t at = motion_time_of(&rig->motion, 2000);
    for (int i = 0; i <= 20; i++)
        assert_true(llabs((long long)(motion_time_of(&rig->motion, 2000 + i / 20.0) - at) - i * 84000 / 20) <= 1);
    assert_true(fabs(motion_speed(&rig->motion, at) - 1000) < 1e-9);
    assert_true(motion_speed(&rig->motion, rig->board.now) == 0);
    rig_free(rig);
}

static void the_run_up_reaches_the_speed(void **state)
{
    (void)state;
    seed = 14;
    for (int i = 0; i < 50; i++) {
        struct rig *rig = rig_new();
        struct motion_limits l = random_limits();
        int64_t run_up = motion_run_up_steps(&l);
        motion_set_position(&rig->motion, -run_up);
        assert_true(motion_start(&rig->motion, 10 * run_up, &l, 0));
        assert_true(fabs(motion_speed(&rig->motion, motion_time_of(&rig->motion, 0) + 1) / l.speed - 1) < 1e-9);
        double before = motion_speed(&rig->motion, motion_time_of(&rig->motion, -0.3 * (double)run_up));
        assert_true(before < l.speed || run_up < 10);
        rig_free(rig);
    }
}

static void slow_steps_may_be_seconds_apart(void **state)
{
    (void)state;
    struct rig *rig = rig_new();
    const struct motion_limits slow = {0.2, 0.5, 1};

    move(rig, 20, &slow, 10 * MS);
    assert_int_equal(rig->board.pulses[11] - rig->board.pulses[10], 5u * BOARD_TICK_HZ);
    assert_true(worst_error(rig, &slow) <= MOTION_RAMP_TICKS);
    const struct motion_limits bad[] = {{0.01, 1, 1}, {1, 1e-4, 1},        {1, 1, 1e-4},    {0, 1, 1},
                                        {1, 0, 1},    {1, 1, (double)NAN}, {1e6, 1e6, 1e6}, {-1, 1, 1}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(motion_start(&rig->motion, 0, &bad[i], 0));
    rig_free(rig);
}

static void moves_begin_when_they_are_told_and_the_driver_has_its_time(void **state)
{
    (void)state;
    struct rig *rig = rig_new();

    motion_set_driver(&rig->motion, 5e-6, 0.5);
    assert_int_equal(rig->board.pulse_width, 420);
    assert_true(motion_start(&rig->motion, 5, &bar2, 3 * (uint64_t)BOARD_TICK_HZ));
    assert_int_equal(motion_time_of(&rig->motion, 0), 3 * (uint64_t)BOARD_TICK_HZ);
    assert_false(motion_start(&rig->motion, 9, &bar2, 0)); /* not at rest */
    step_board_run(&rig->board, BOARD_NEVER, MS);
    uint64_t now = rig->board.now;
    assert_false(motion_start(&rig->motion, 5, &bar2, 0)); /* it is there */
    rig->board.count = 0;
    assert_true(motion_start(&rig->motion, 0, &bar2, 0));
    step_board_run(&rig->board, BOARD_NEVER, MS);
    assert_true(rig->board.pulses[0] >= now + BOARD_TICK_HZ / 2);
    motion_forget(&rig->motion);
    assert_false(motion_start(&rig->motion, 5, &bar2, 0));
    rig_free(rig);
}

static void every_stop_is_approached_with_rising_steps(void **state)
{
    static const int64_t targets[] = {500, 520, 900, 890, 890, 0, 10, 41, 42, -3000, -2999};
    (void)state;
    struct rig *rig = rig_new();
    int64_t rising = 0;

    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        int moves = 0;
        for (int64_t leg; (leg = motion_next_leg(&rig->motion, targets[i], 40)) != motion_position(&rig->motion);) {
            int64_t by = leg - motion_position(&rig->motion);
            rising = by > 0 ? rising + by : 0;
            move(rig, leg, &bar2, MS);
            assert_true(++moves <= 2);
        }
        assert_int_equal(motion_position(&rig->motion), targets[i]);
        assert_true(rising >= 40);
    }
    /* Without backlash the way is straight. */
    assert_int_equal(motion_next_leg(&rig->motion, -5000, 0), -5000);
    rig_free(rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pulse_of_a_move_lies_on_the_curve),
        cmocka_unit_test(a_hundred_thousand_steps_a_second_come_with_a_poll_every_two_milliseconds),
        cmocka_unit_test(random_moves_keep_the_limits_and_lie_on_the_curve),
        cmocka_unit_test(a_move_takes_the_time_the_plan_reckons_with),
        cmocka_unit_test(a_sweep_of_18_turns_does_not_drift),
        cmocka_unit_test(places_are_passed_when_it_was_said),
        cmocka_unit_test(between_two_steps_places_are_even_in_the_cruise),
        cmocka_unit_test(the_run_up_reaches_the_speed),
        cmocka_unit_test(slow_steps_may_be_seconds_apart),
        cmocka_unit_test(moves_begin_when_they_are_told_and_the_driver_has_its_time),
        cmocka_unit_test(every_stop_is_approached_with_rising_steps),
    };

    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}
