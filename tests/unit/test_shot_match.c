/* Pictures that cameras took by clocks of their own, with gaps and some too many, find their shots. */
#include "pipeline/exchange/card.h"
#include "pipeline/exchange/shot_match.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define ROOM 6000

/* A camera's list as it is made up, and which shot each item truly is of. */
struct made {
    struct lumi_shot_item items[ROOM];
    int truth[ROOM], shots[ROOM], count;
    double offset, drift, resolution;
    uint64_t noise;
};

static struct made cameras[4];
static struct lumi_shot_camera matched[4];
static struct lumi_error error;

static double noise(struct made *made)
{
    made->noise = made->noise * 6364136223846793005u + 1442695040888963407u;
    return (double)(made->noise >> 33) / 2147483648.0 - 0.5;
}

static void add(struct made *made, double time, double stops, int truth)
{
    double clock = made->offset + (1 + made->drift) * time + 0.002 * noise(made);

    if (made->resolution > 0)
        clock = floor(clock / made->resolution) * made->resolution;
    made->items[made->count] = (struct lumi_shot_item){clock, stops};
    made->truth[made->count++] = truth;
}

static void begin(int count, double offset, double drift)
{
    memset(cameras, 0, sizeof cameras);
    for (int c = 0; c < count; c++) {
        cameras[c].offset = offset * c;
        cameras[c].drift = drift * c;
        cameras[c].noise = (uint64_t)c + 1;
    }
}

static void match(int count, int shots, int bracket)
{
    static const double offsets[] = {-2, 0, 2};
    struct lumi_shot_plan plan = {.shots = shots, .bracket = bracket};

    for (int k = 0; bracket > 1 && k < bracket; k++)
        plan.offsets[k] = offsets[k];
    memset(matched, 0, sizeof matched);
    for (int c = 0; c < count; c++) {
        matched[c].items = cameras[c].items;
        matched[c].count = cameras[c].count;
        matched[c].shots = cameras[c].shots;
    }
    assert_int_equal(lumi_shot_match(&plan, matched, count, &error), LUMI_OK);
}

static void expect_truth(int count)
{
    for (int c = 0; c < count; c++)
        for (int i = 0; i < cameras[c].count; i++)
            if (cameras[c].shots[i] != cameras[c].truth[i])
                fail_msg("camera %d, item %d: shot %d, not %d", c, i, cameras[c].shots[i], cameras[c].truth[i]);
}

static void whole_sweeps_by_clocks_that_differ_and_drift_match_shot_by_shot(void **state)
{
    (void)state;
    begin(4, -86400.3, 80e-6);
    for (int c = 0; c < 4; c++)
        for (int s = 0; s < 1296; s++)
            add(&cameras[c], 0.4167 * s, NAN, s);
    match(4, 1296, 1);
    expect_truth(4);
    assert_float_equal(matched[2].offset, -2 * 86400.3, 0.01);
    assert_float_equal(matched[3].drift, 240e-6, 2e-6);
    assert_true(matched[1].worst < 0.01 && !matched[1].ambiguous && !matched[1].by_order);
}

static void gaps_doubled_shots_and_test_shots_are_found(void **state)
{
    (void)state;
    begin(3, 3600.7, 50e-6);
    for (int c = 0; c < 3; c++) {
        if (c == 1)
            add(&cameras[c], -300, NAN, -1); /* somebody tried its button */
        add(&cameras[c], -60, NAN, -1);      /* all of them, a test */
        add(&cameras[c], -31, NAN, -1);
        for (int s = 0; s < 72; s++) {
            if (!(c == 0 && s == 20) && !(c == 2 && s >= 40 && s < 44) && s != 50)
                add(&cameras[c], 0.5 * s, NAN, s);
            if (c == 1 && s == 30)
                add(&cameras[c], 0.5 * s + 0.2, NAN, -1); /* a contact that bounced */
        }
        if (c == 2)
            add(&cameras[c], 100, NAN, -1);
    }
    match(3, 72, 1);
    expect_truth(3);
    assert_int_equal(matched[0].matched, 70);
    assert_int_equal(matched[1].matched, 71);
    assert_int_equal(matched[2].matched, 67);
}

static void a_pause_is_no_gap(void **state)
{
    (void)state;
    begin(2, 17.3, 0);
    for (int c = 0; c < 2; c++)
        for (int s = 0; s < 60; s++)
            add(&cameras[c], 1.2 * s + (s >= 25 ? 95.1 : 0) + (s >= 40 ? 1.2 : 0), NAN, s);
    match(2, 60, 1);
    expect_truth(2);
}

static void a_camera_that_stopped_early_keeps_its_first_shots(void **state)
{
    (void)state;
    begin(3, 0.01, 0); /* clocks set together */
    for (int c = 0; c < 3; c++)
        for (int s = 0; s < 72; s++)
            if ((c != 2 || s < 31) && (c != 1 || s >= 3))
                add(&cameras[c], 0.5 * s, NAN, s);
    match(3, 72, 1);
    expect_truth(3);
    /* By a clock of its own it cannot be told which end is missing: it is said. */
    begin(3, 1234.56, 0);
    for (int c = 0; c < 3; c++)
        for (int s = 0; s < 72; s++)
            if (c != 2 || s < 31)
                add(&cameras[c], 0.5 * s, NAN, s);
    match(3, 72, 1);
    expect_truth(3);
    assert_true(matched[2].ambiguous && !matched[1].ambiguous);
}

static void brackets_of_unequal_length_keep_their_places(void **state)
{
    static const double stops[] = {-2, 0, 2};

    (void)state;
    begin(3, 500.2, 30e-6);
    for (int c = 0; c < 3; c++)
        for (int p = 0; p < 40; p++)
            for (int k = 0; k < 3; k++) {
                bool missing =
                    (c == 0 && p == 7 && k == 2) || (c == 1 && p == 0 && k == 0) || (c == 2 && p == 22 && k > 0);
                if (!missing)
                    add(&cameras[c], 4.0 * p + 0.4 * k, -7 + c + stops[k], 3 * p + k);
            }
    match(3, 120, 3);
    expect_truth(3);
    for (int c = 0; c < 3; c++) {
        double offsets[LUMI_SHOT_BRACKET];
        assert_int_equal(lumi_shot_find_bracket(cameras[c].items, cameras[c].count, offsets), 3);
        assert_float_equal(offsets[0], -2, 1e-9);
        assert_float_equal(offsets[1], 0, 1e-9);
        assert_float_equal(offsets[2], 2, 1e-9);
    }
}

static void one_exposure_is_no_bracket(void **state)
{
    double offsets[LUMI_SHOT_BRACKET];

    (void)state;
    begin(1, 0, 0);
    for (int s = 0; s < 30; s++)
        add(&cameras[0], s, s == 12 ? 0.5 : 0, s);
    assert_int_equal(lumi_shot_find_bracket(cameras[0].items, 30, offsets), 1);
    for (int s = 0; s < 30; s++)
        cameras[0].items[s].stops = NAN;
    assert_int_equal(lumi_shot_find_bracket(cameras[0].items, 30, offsets), 1);
}

static void clocks_of_whole_seconds_match_at_the_pace_of_a_sweep(void **state)
{
    (void)state;
    begin(3, 77.7, 0);
    cameras[1].resolution = cameras[2].resolution = 1;
    for (int c = 0; c < 3; c++)
        for (int s = 0; s < 72; s++)
            add(&cameras[c], 0.4167 * s, NAN, s);
    match(3, 72, 1);
    expect_truth(3);
    /* All of them. */
    begin(3, 77.7, 0);
    for (int c = 0; c < 3; c++) {
        cameras[c].resolution = 1;
        for (int s = 0; s < 72; s++)
            add(&cameras[c], 0.4167 * s, NAN, s);
    }
    match(3, 72, 1);
    expect_truth(3);
}

static void pictures_without_times_match_by_their_order(void **state)
{
    (void)state;
    begin(2, 9, 0);
    for (int s = 0; s < 24; s++) {
        add(&cameras[0], 2.0 * s, NAN, s);
        add(&cameras[1], NAN, NAN, s);
    }
    cameras[0].items[7].time = NAN; /* one whose head is damaged stands between its neighbours */
    match(2, 24, 1);
    expect_truth(2);
    assert_true(matched[1].by_order && !matched[1].ambiguous && !matched[0].by_order);
}

static void no_list_breaks_the_matching(void **state)
{
    uint64_t seed = 7;

    (void)state;
    for (int round = 0; round < 300; round++) {
        begin(3, 0, 0);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < (int)((seed >> 40) % 40); i++) {
                seed = seed * 6364136223846793005u + 1442695040888963407u;
                double time = (seed >> 20) % 5 == 0 ? NAN : (double)(seed >> 33) / (double)(1u << (seed % 31));
                cameras[c].items[cameras[c].count++] = (struct lumi_shot_item){time, (double)((seed >> 50) % 7)};
            }
        match(3, 1 + round % 30, 1 + round % 3);
        for (int c = 0; c < 3; c++)
            for (int i = 0, last = -1; i < cameras[c].count; i++) {
                assert_true(cameras[c].shots[i] >= -1 && cameras[c].shots[i] < 1 + round % 30);
                if (cameras[c].shots[i] >= 0) {
                    assert_true(cameras[c].shots[i] > last);
                    last = cameras[c].shots[i];
                }
            }
    }
}

static void names_stand_in_the_order_of_the_camera(void **state)
{
    char *rolled[] = {"IMG_0001.JPG", "IMG_0002.JPG", "IMG_9997.JPG", "IMG_9998.JPG", "IMG_9999.JPG"};
    char *straight[] = {"IMG_0001.JPG", "IMG_0002.JPG", "IMG_0009.JPG"};
    char *plain[] = {"a1.jpg", "a9999.jpg"};

    (void)state;
    assert_int_equal(lumi_card_first(rolled, 5), 2);
    assert_int_equal(lumi_card_first(straight, 3), 0);
    assert_int_equal(lumi_card_first(plain, 2), 0);
    assert_true(lumi_card_compare("img_9.jpg", "IMG_10.JPG") < 0);
    assert_true(lumi_card_compare("100CANON", "101CANON") < 0);
    assert_true(lumi_card_compare("a007", "a7b") < 0);
    assert_int_equal(lumi_card_compare("a.jpg", "a.jpg"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_sweeps_by_clocks_that_differ_and_drift_match_shot_by_shot),
        cmocka_unit_test(gaps_doubled_shots_and_test_shots_are_found),
        cmocka_unit_test(a_pause_is_no_gap),
        cmocka_unit_test(a_camera_that_stopped_early_keeps_its_first_shots),
        cmocka_unit_test(brackets_of_unequal_length_keep_their_places),
        cmocka_unit_test(one_exposure_is_no_bracket),
        cmocka_unit_test(clocks_of_whole_seconds_match_at_the_pace_of_a_sweep),
        cmocka_unit_test(pictures_without_times_match_by_their_order),
        cmocka_unit_test(no_list_breaks_the_matching),
        cmocka_unit_test(names_stand_in_the_order_of_the_camera),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
