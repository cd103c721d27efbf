/* daemon/rig/clock_match: simulated clocks and delays. */
#include "daemon/rig/clock_match.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static uint64_t noise;

static double uniform(void)
{
    noise = noise * 6364136223846793005u + 1442695040888963407u;
    return (double)(noise >> 11) / 9007199254740992.0;
}

/* A board whose clock began at host time `started_ns` and goes (1 + drift) as fast. */
struct board {
    double started_ns, drift;
};

static uint64_t board_time(const struct board *board, double host_ns)
{
    return (uint64_t)((host_ns - board->started_ns) * (1 + board->drift));
}

static struct lumi_clock_sample trip(const struct board *board, double at, double out, double stay, double back)
{
    return (struct lumi_clock_sample){.host_sent_ns = (uint64_t)at,
                                      .board_received_ns = board_time(board, at + out),
                                      .board_sent_ns = board_time(board, at + out + stay),
                                      .host_received_ns = (uint64_t)(at + out + stay + back)};
}

static void run(struct lumi_clock_match *match, const struct board *board, double from, int count, double base,
                double jitter)
{
    for (int i = 0; i < count; i++) {
        struct lumi_clock_sample sample =
            trip(board, from + i * 5e8, base - jitter * log(1 - uniform()), 1e5, base - jitter * log(1 - uniform()));
        assert_true(lumi_clock_match_add(match, &sample));
    }
}

static double error_at(const struct lumi_clock_match *match, const struct board *board, double host)
{
    return (double)(int64_t)(lumi_clock_to_host(match, board_time(board, host)) - (uint64_t)host);
}

static void one_round_trip_is_good_to_half_of_it(void **state)
{
    struct board board = {.started_ns = 7e12, .drift = 0};
    struct lumi_clock_match match;

    (void)state;
    lumi_clock_match_init(&match);
    assert_false(lumi_clock_matched(&match));
    assert_int_equal(lumi_clock_to_host(&match, 5), 0);
    struct lumi_clock_sample sample = trip(&board, 7e12 + 1e9, 1e5, 1e6, 3e5);
    assert_true(lumi_clock_match_add(&match, &sample));
    assert_true(lumi_clock_matched(&match));
    assert_true(fabs(error_at(&match, &board, 7e12 + 1.2e9)) <= 2e5 + 2);
    assert_true(fabs(match.round_trip_ns - 4e5) < 2);
}

static void drift_is_found_through_jitter(void **state)
{
    static const double drifts[] = {-80e-6, -3e-6, 0, 20e-6, 150e-6};

    (void)state;
    for (int i = 0; i < 5; i++) {
        struct board board = {.started_ns = 1e12, .drift = drifts[i]};
        struct lumi_clock_match match;
        noise = 17 + (uint64_t)i;
        lumi_clock_match_init(&match);
        run(&match, &board, 1e12 + 3e9, 240, 200e3, 300e3);
        assert_true(fabs(match.drift - drifts[i]) < 2e-6);
        /* The quickest trips are symmetric here: the middle of the window is known far better than the jitter. */
        assert_true(fabs(error_at(&match, &board, 1e12 + 60e9)) < 60e3);
        assert_true(fabs(error_at(&match, &board, 1e12 + 123e9)) < 100e3);
        assert_true(match.residual_ns < 100e3);
        assert_int_equal(match.restarts, 0);
    }
}

static void delays_on_one_way_do_not_pull_the_clock(void **state)
{
    struct board board = {.started_ns = 2e12, .drift = 25e-6};
    struct lumi_clock_match match;

    (void)state;
    noise = 5;
    lumi_clock_match_init(&match);
    for (int i = 0; i < 200; i++) {
        /* Three of four answers wait up to 40 ms on the way back, as behind a busy serial line. */
        double back = 150e3 + (i % 4 ? 40e6 * uniform() : 20e3 * uniform());
        struct lumi_clock_sample sample = trip(&board, 2e12 + 1e9 + i * 5e8, 150e3 + 20e3 * uniform(), 5e4, back);
        assert_true(lumi_clock_match_add(&match, &sample));
        if (i > 8)
            assert_true(fabs(error_at(&match, &board, 2e12 + 1e9 + i * 5e8)) < 100e3);
    }
    assert_true(fabs(match.drift - 25e-6) < 1e-6);
}

static void a_restart_of_the_board_is_seen_and_the_past_forgotten(void **state)
{
    struct board first = {.started_ns = 1e12, .drift = 10e-6}, second = {.started_ns = 1.1e12, .drift = 10e-6};
    struct lumi_clock_match match;

    (void)state;
    noise = 3;
    lumi_clock_match_init(&match);
    run(&match, &first, 1e12 + 1e9, 150, 100e3, 50e3);
    run(&match, &second, 1.1e12 + 1e9, 1, 100e3, 50e3);
    assert_int_equal(match.restarts, 1);
    assert_int_equal(match.count, 1);
    assert_true(fabs(error_at(&match, &second, 1.1e12 + 1e9)) < 300e3);
    run(&match, &second, 1.1e12 + 1.5e9, 100, 100e3, 50e3);
    assert_int_equal(match.restarts, 1);
    assert_true(fabs(error_at(&match, &second, 1.1e12 + 40e9)) < 50e3);
    lumi_clock_match_restart(&match);
    assert_false(lumi_clock_matched(&match));
    assert_int_equal(match.restarts, 2);
}

static void the_line_bends_with_a_crystal_that_warms_up(void **state)
{
    struct lumi_clock_match match;
    double host = 1e12, board = 5e9;

    (void)state;
    noise = 11;
    lumi_clock_match_init(&match);
    for (int i = 0; i < 1200; i++) { /* ten minutes, from 10 to 40 ppm */
        double drift = 10e-6 + 30e-6 * i / 1200;
        struct lumi_clock_sample sample = {(uint64_t)host, (uint64_t)(board + 1e5 * uniform()), (uint64_t)(board + 2e5),
                                           (uint64_t)(host + 3e5 + 1e5 * uniform())};
        assert_true(lumi_clock_match_add(&match, &sample));
        host += 5e8;
        board += 5e8 * (1 + drift);
    }
    assert_int_equal(match.restarts, 0);
    assert_true(fabs(match.drift - 38e-6) < 4e-6);
}

static void times_that_run_backwards_are_left_out(void **state)
{
    struct lumi_clock_match match;
    struct lumi_clock_sample host = {100, 5, 6, 99}, board = {100, 6, 5, 200};

    (void)state;
    lumi_clock_match_init(&match);
    assert_false(lumi_clock_match_add(&match, &host));
    assert_false(lumi_clock_match_add(&match, &board));
    assert_false(lumi_clock_matched(&match));
}

static void a_moment_before_the_clock_began_is_none(void **state)
{
    struct board board = {.started_ns = 1e9, .drift = 0};
    struct lumi_clock_match match;
    struct lumi_clock_sample sample = trip(&board, 3e9, 1e5, 0, 1e5);

    (void)state;
    lumi_clock_match_init(&match);
    lumi_clock_match_add(&match, &sample);
    assert_int_equal(lumi_clock_to_board(&match, 5), 0);
    assert_true(llabs((long long)lumi_clock_to_board(&match, 4000000000u) - 3000000000ll) <= 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_round_trip_is_good_to_half_of_it),
        cmocka_unit_test(drift_is_found_through_jitter),
        cmocka_unit_test(delays_on_one_way_do_not_pull_the_clock),
        cmocka_unit_test(a_restart_of_the_board_is_seen_and_the_past_forgotten),
        cmocka_unit_test(the_line_bends_with_a_crystal_that_warms_up),
        cmocka_unit_test(times_that_run_backwards_are_left_out),
        cmocka_unit_test(a_moment_before_the_clock_began_is_none),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
