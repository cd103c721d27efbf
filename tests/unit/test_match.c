/* Frames matched to exposures: clocks that drift, frames that are lost, late, doubled, out of order. */
#include "daemon/engine/match.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
/* after those */
#include <cmocka.h>

#define NS 1000000000LL
#define MS 1000000LL

struct rig {
    struct lumi_match *match;
    int shot_of[512]; /* by the frame's tag; −1 surplus, −2 doubled, −3 nothing yet */
    int dropped[512], drops, exposed, unseen, late, out_of_order;
    double residual;
};
static char tags[512];

static void open_match(struct rig *rig, bool device_clock, double spacing, bool edges)
{
    struct lumi_match_options options;
    struct lumi_error error;

    memset(rig, 0, sizeof *rig);
    for (int i = 0; i < 512; i++)
        rig->shot_of[i] = -3;
    lumi_match_options_init(&options);
    options.device_clock = device_clock;
    options.spacing = spacing;
    options.edges = edges;
    assert_int_equal(lumi_match_create(&options, &rig->match, &error), LUMI_OK);
}

static void collect(struct rig *rig, int64_t now)
{
    struct lumi_match_result result;

    while (lumi_match_next(rig->match, now, &result)) {
        int tag = result.frame ? (int)((char *)result.frame - tags) : -1;
        switch (result.kind) {
        case LUMI_MATCH_HIT:
            rig->shot_of[tag] = result.shot;
            rig->late += result.late;
            rig->out_of_order += result.out_of_order;
            rig->residual = fmax(rig->residual, fabs(result.residual));
            break;
        case LUMI_MATCH_DOUBLED:
            rig->shot_of[tag] = -2;
            break;
        case LUMI_MATCH_SURPLUS:
            rig->shot_of[tag] = -1;
            break;
        case LUMI_MATCH_DROPPED:
            rig->dropped[rig->drops++] = result.shot;
            break;
        case LUMI_MATCH_EXPOSED:
            rig->exposed++;
            break;
        case LUMI_MATCH_UNSEEN:
            rig->unseen++;
            break;
        }
    }
}

static int64_t exposure(int shot)
{
    return 1000 * NS + shot * 2 * NS / 5;
}

static void frame(struct rig *rig, int tag, int64_t device, int64_t arrival, uint64_t sequence)
{
    lumi_match_frame(rig->match, &(struct lumi_match_frame){
                                     .device_ns = device, .host_ns = arrival, .sequence = sequence, .tag = tags + tag});
    collect(rig, arrival);
}

static void expect(struct rig *rig, int shot)
{
    assert_true(lumi_match_expect(rig->match, exposure(shot), 0.004, shot));
    collect(rig, exposure(shot) + 30 * MS);
}

/* A clock that is 80 ppm fast and began 12 days ago. */
static int64_t device(int64_t host)
{
    return host + 1036800LL * NS + host / 12500;
}

static void a_drifting_clock_is_fitted_to_microseconds(void **state)
{
    struct rig rig;
    struct lumi_match_clock clock;

    (void)state;
    open_match(&rig, true, 0.4, false);
    for (int i = 0; i < 200; i++) {
        expect(&rig, i);
        frame(&rig, i, device(exposure(i)), exposure(i) + 70 * MS + i % 7 * 20 * MS, (uint64_t)i);
    }
    collect(&rig, exposure(200) + NS);
    for (int i = 0; i < 200; i++)
        assert_int_equal(rig.shot_of[i], i);
    lumi_match_clock(rig.match, &clock);
    assert_int_equal(clock.matched, 200);
    assert_true(fabs(clock.drift_ppm + 80) < 0.1);
    assert_true(clock.residual_s < 1e-4);
    lumi_match_destroy(rig.match);
}

static void frames_that_come_before_their_exposure_is_known_wait_for_it(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, false);
    for (int i = 0; i < 20; i++) {
        frame(&rig, i, device(exposure(i)), exposure(i) + 10 * MS, (uint64_t)i);
        expect(&rig, i);
    }
    collect(&rig, exposure(20) + NS);
    for (int i = 0; i < 20; i++)
        assert_int_equal(rig.shot_of[i], i);
    lumi_match_destroy(rig.match);
}

static void what_is_dropped_doubled_late_or_out_of_order_is_named(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, false);
    for (int i = 0; i < 40; i++) {
        expect(&rig, i);
        if (i == 10) /* never comes */
            continue;
        if (i == 20) { /* behind the next */
            expect(&rig, 21);
            frame(&rig, 21, device(exposure(21)), exposure(21) + 60 * MS, 21);
            frame(&rig, 20, device(exposure(20)), exposure(21) + 70 * MS, 20);
            i++;
            continue;
        }
        if (i == 30) {
            frame(&rig, i, device(exposure(i)), exposure(i) + 2 * NS, (uint64_t)i);
            continue;
        }
        frame(&rig, i, device(exposure(i)), exposure(i) + 60 * MS, (uint64_t)i);
        if (i == 15)
            frame(&rig, 100, device(exposure(i)), exposure(i) + 80 * MS, (uint64_t)i);
        if (i == 16)
            frame(&rig, 101, device(exposure(i) + 200 * MS + 50 * MS), exposure(i) + 300 * MS, (uint64_t)i + 1);
    }
    collect(&rig, exposure(60));
    assert_int_equal(rig.drops, 1);
    assert_int_equal(rig.dropped[0], 10);
    assert_int_equal(rig.shot_of[20], 20);
    assert_int_equal(rig.shot_of[21], 21);
    assert_int_equal(rig.shot_of[30], 30);
    assert_int_equal(rig.shot_of[100], -2);
    assert_int_equal(rig.late, 2); /* the one that was overtaken, too */
    assert_true(rig.out_of_order >= 1);
    lumi_match_destroy(rig.match);
}

static void a_first_frame_that_is_lost_shifts_nothing(void **state)
{
    for (int clock = 0; clock < 2; clock++) {
        struct rig rig;
        (void)state;
        open_match(&rig, clock, 0.4, false);
        for (int i = 0; i < 20; i++) {
            expect(&rig, i);
            if (i > 0)
                frame(&rig, i, clock ? device(exposure(i)) : LUMI_MATCH_NO_TIME, exposure(i) + 60 * MS, (uint64_t)i);
        }
        collect(&rig, exposure(60));
        assert_int_equal(rig.drops, 1);
        assert_int_equal(rig.dropped[0], 0);
        for (int i = 1; i < 20; i++)
            assert_int_equal(rig.shot_of[i], i);
        lumi_match_destroy(rig.match);
    }
}

static void without_a_clock_number_and_order_tell_late_from_missing(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, false, 0.4, false);
    uint64_t sequence = 1;
    for (int i = 0; i < 40; i++) {
        expect(&rig, i);
        if (i == 10) { /* the camera missed its trigger: it counts on */
            continue;
        }
        if (i == 20) { /* held up: it comes with the next */
            expect(&rig, 21);
            frame(&rig, 20, LUMI_MATCH_NO_TIME, exposure(21) + 50 * MS, sequence++);
            frame(&rig, 21, LUMI_MATCH_NO_TIME, exposure(21) + 62 * MS, sequence++);
            i++;
            continue;
        }
        frame(&rig, i, LUMI_MATCH_NO_TIME, exposure(i) + 60 * MS + i % 3 * 5 * MS, sequence++);
    }
    collect(&rig, exposure(60));
    for (int i = 0; i < 40; i++)
        if (i != 10)
            assert_int_equal(rig.shot_of[i], i);
    assert_int_equal(rig.drops, 1);
    assert_int_equal(rig.dropped[0], 10);
    lumi_match_destroy(rig.match);
}

static void a_camera_whose_clock_is_set_is_followed(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, false);
    for (int i = 0; i < 40; i++) {
        int64_t step = i >= 20 ? 3600 * NS : 0;
        expect(&rig, i);
        frame(&rig, i, device(exposure(i)) + step, exposure(i) + 60 * MS, (uint64_t)i);
    }
    collect(&rig, exposure(60));
    for (int i = 0; i < 40; i++)
        assert_int_equal(rig.shot_of[i], i);
    assert_int_equal(rig.drops, 0);
    lumi_match_destroy(rig.match);
}

static void a_camera_that_came_back_is_matched_by_its_usual_delay(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, false);
    for (int i = 0; i < 40; i++) {
        expect(&rig, i);
        if (i == 20)
            lumi_match_restart(rig.match);
        if (i >= 20 && i < 24)
            continue; /* away */
        frame(&rig, i, i < 20 ? device(exposure(i)) : exposure(i) - 900 * NS, exposure(i) + 60 * MS,
              (uint64_t)(i < 20 ? i : i - 24));
    }
    collect(&rig, exposure(60));
    for (int i = 0; i < 40; i++)
        if (i < 20 || i >= 24)
            assert_int_equal(rig.shot_of[i], i);
    assert_int_equal(rig.drops, 4);
    lumi_match_destroy(rig.match);
}

static void edges_are_given_to_their_exposures_and_missing_ones_named(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, true);
    for (int i = 0; i < 10; i++) {
        if (i != 4)
            lumi_match_edge(rig.match, exposure(i) + MS);
        expect(&rig, i);
        frame(&rig, i, device(exposure(i)), exposure(i) + 60 * MS, (uint64_t)i);
    }
    collect(&rig, exposure(60));
    assert_int_equal(rig.exposed, 9);
    assert_int_equal(rig.unseen, 1);
    lumi_match_destroy(rig.match);
}

static void every_frame_and_exposure_gets_one_verdict_at_the_end(void **state)
{
    struct rig rig;

    (void)state;
    open_match(&rig, true, 0.4, false);
    expect(&rig, 0);
    expect(&rig, 1);
    frame(&rig, 0, device(exposure(0)), exposure(0) + 450 * MS, 0);
    frame(&rig, 1, device(exposure(50)), exposure(0) + 460 * MS, 1);
    lumi_match_finish(rig.match);
    collect(&rig, exposure(2));
    assert_int_not_equal(rig.shot_of[0], -3);
    assert_int_not_equal(rig.shot_of[1], -3);
    assert_int_equal(lumi_match_open(rig.match), 0);
    lumi_match_destroy(rig.match);
}

static void files_of_a_card_are_matched_by_order_and_time(void **state)
{
    int64_t exposures[20], files[24];
    int pairs[24], count = 0;
    double offset;

    (void)state;
    for (int i = 0; i < 20; i++) {
        exposures[i] = exposure(i * 8); /* 3.2 s apart */
        if (i == 7)
            continue; /* the camera missed it */
        /* The card's clock is 25 minutes off and counts in steps of two seconds. */
        files[count] = (exposures[i] - 1500 * NS) / (2 * NS) * 2 * NS;
        count++;
    }
    assert_int_equal(lumi_match_files(files, count, exposures, 20, 1.6, pairs, &offset), 19);
    for (int i = 0; i < count; i++)
        assert_int_equal(pairs[i], i < 7 ? i : i + 1);
    assert_true(fabs(offset - 1500) < 3);
    /* All there: by order, whatever the times say. */
    for (int i = 0; i < 20; i++)
        files[i] = 5;
    assert_int_equal(lumi_match_files(files, 20, exposures, 20, 1.6, pairs, NULL), 20);
    assert_int_equal(pairs[19], 19);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_drifting_clock_is_fitted_to_microseconds),
        cmocka_unit_test(frames_that_come_before_their_exposure_is_known_wait_for_it),
        cmocka_unit_test(what_is_dropped_doubled_late_or_out_of_order_is_named),
        cmocka_unit_test(a_first_frame_that_is_lost_shifts_nothing),
        cmocka_unit_test(without_a_clock_number_and_order_tell_late_from_missing),
        cmocka_unit_test(a_camera_whose_clock_is_set_is_followed),
        cmocka_unit_test(a_camera_that_came_back_is_matched_by_its_usual_delay),
        cmocka_unit_test(edges_are_given_to_their_exposures_and_missing_ones_named),
        cmocka_unit_test(every_frame_and_exposure_gets_one_verdict_at_the_end),
        cmocka_unit_test(files_of_a_card_are_matched_by_order_and_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
