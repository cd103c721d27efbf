/* daemon/engine: frames of a camera that nobody triggers; each shot gets the one about its time. */
#include "daemon/engine/match.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#define MS 1000000LL
#define PERIOD (40 * MS)
#define FRAMES 400

static int frames[FRAMES]; /* tags point into it: the frame's number */
static int dropped;        /* the last shot without one; −1 */

static struct lumi_match *begun(bool device_clock)
{
    struct lumi_match_options options;
    struct lumi_error error;
    struct lumi_match *match;

    lumi_match_options_init(&options);
    options.spacing = 1;
    options.period = 1.0 / 30; /* it is 25 a second really */
    options.settle = 0.3;
    options.device_clock = device_clock;
    assert_int_equal(lumi_match_create(&options, &match, &error), LUMI_OK);
    return match;
}

/* 16 s of frames, every one out 30 ms after it began; from 1 s on a shot every 1.09 s, known 100 ms after it was fired.
 * Every frame in `skip`..`skip`+2 is lost. Returns how many shots got a frame. */
static int sweep(struct lumi_match *match, bool device_clock, int skip, double *worst_ms)
{
    int shots = 0, hits = 0, waiting_most = 0, waiting = 0;

    *worst_ms = 0;
    dropped = -1;
    for (int i = 0; i < FRAMES; i++) {
        const int64_t begin = i * PERIOD, now = begin + 30 * MS;
        struct lumi_match_result result;
        frames[i] = i;
        if (i < skip || i > skip + 2) {
            struct lumi_match_frame frame = {.device_ns = device_clock ? begin : LUMI_MATCH_NO_TIME,
                                             .host_ns = now,
                                             .sequence = (uint64_t)i,
                                             .tag = &frames[i]};
            lumi_match_frame(match, &frame);
            waiting++;
        }
        while (shots < 13 && 1000 * MS + shots * 1090 * MS + 100 * MS <= now) {
            assert_true(lumi_match_expect(match, 1000 * MS + shots * 1090 * MS, 0.01, shots));
            shots++;
        }
        while (lumi_match_next(match, now, &result)) {
            assert_int_not_equal(result.kind, LUMI_MATCH_DOUBLED);
            waiting -= result.frame != NULL;
            if (result.kind == LUMI_MATCH_DROPPED)
                dropped = result.shot;
            if (result.kind != LUMI_MATCH_HIT)
                continue;
            hits++;
            double away = fabs((double)(*(int *)result.frame * PERIOD - (1000 * MS + result.shot * 1090 * MS))) * 1e-6;
            *worst_ms = away > *worst_ms ? away : *worst_ms;
        }
        waiting_most = waiting > waiting_most ? waiting : waiting_most;
    }
    assert_int_equal(shots, 13);
    assert_true(waiting_most <= 12); /* of the settle time, no more: a camera has few buffers */
    return hits;
}

static void every_shot_gets_a_frame_that_began_about_when_it_was_fired(void **state)
{
    struct lumi_match *match = begun(true);
    struct lumi_match_clock clock;
    double worst;

    (void)state;
    assert_int_equal(sweep(match, true, FRAMES, &worst), 13);
    assert_true(worst <= 30.1);
    lumi_match_clock(match, &clock);
    assert_int_equal(clock.matched, 13);
    assert_int_equal(clock.surplus, 0);
    assert_int_equal(clock.dropped, 0);
    lumi_match_destroy(match);
}

static void without_a_clock_the_time_of_arrival_stands_for_it(void **state)
{
    struct lumi_match *match = begun(false);
    double worst;

    (void)state;
    assert_int_equal(sweep(match, false, FRAMES, &worst), 13);
    assert_true(worst <= 45);
    lumi_match_destroy(match);
}

static void a_shot_in_a_hole_of_the_frames_is_dropped(void **state)
{
    struct lumi_match *match = begun(true);
    double worst;

    (void)state;
    /* Shot 3 is at 4.27 s: frames 106 to 108 began at 4.24 to 4.32 s. */
    assert_int_equal(sweep(match, true, 106, &worst), 12);
    assert_int_equal(dropped, 3);
    lumi_match_destroy(match);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_shot_gets_a_frame_that_began_about_when_it_was_fired),
        cmocka_unit_test(without_a_clock_the_time_of_arrival_stands_for_it),
        cmocka_unit_test(a_shot_in_a_hole_of_the_frames_is_dropped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
