/* Tracks: what matches join, what they do not, which are chosen. */
#include "pipeline/calibrate/track_join.h"
#include "proto/base/memory.h"
#include "proto/base/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { IMAGES = 4, FEATURES = 64, SIDE = 80 };

static void begin(struct lumi_track_graph *graph)
{
    *graph = (struct lumi_track_graph){.image_count = IMAGES};
    graph->images = lumi_calloc(IMAGES, sizeof *graph->images);
    for (int i = 0; i < IMAGES; i++) {
        graph->images[i] = (struct lumi_track_image){SIDE, SIDE, FEATURES, NULL, 0};
        graph->images[i].places = lumi_calloc(FEATURES, sizeof(struct lumi_track_place));
        for (int k = 0; k < FEATURES; k++) /* an even grid */
            graph->images[i].places[k] = (struct lumi_track_place){5 + 10 * (float)(k % 8), 5 + 10 * (float)(k / 8), 2};
    }
    assert_int_equal(lumi_track_graph_begin(graph), LUMI_OK);
}

static void join(struct lumi_track_graph *graph, int i, uint32_t a, int k, uint32_t b)
{
    assert_int_equal(lumi_track_graph_join(graph, i, a, k, b), LUMI_OK);
}

static void triangle(struct lumi_track_graph *graph, uint32_t feature)
{
    join(graph, 0, feature, 1, feature);
    join(graph, 1, feature, 2, feature);
    join(graph, 0, feature, 2, feature);
}

static void choose(struct lumi_track_graph *graph, int per_image, struct lumi_tracks *tracks)
{
    const struct lumi_tracks_settings settings = {.per_image = per_image, .shortest = 3};

    assert_int_equal(lumi_track_graph_choose(graph, &settings, tracks), LUMI_OK);
}

static void three_pictures_that_agree_make_a_track(void **unused)
{
    struct lumi_track_graph graph;
    struct lumi_tracks tracks;

    (void)unused;
    begin(&graph);
    triangle(&graph, 7);
    choose(&graph, 0, &tracks);
    assert_int_equal(tracks.track_count, 1);
    assert_int_equal(tracks.observation_count, 3);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(tracks.observations[i].image, i);
        assert_int_equal(tracks.observations[i].feature, 7);
        assert_true(tracks.observations[i].sigma > 0.1f && tracks.observations[i].sigma < 0.3f);
    }
    lumi_tracks_finish(&tracks);
    lumi_track_graph_finish(&graph);
}

static void what_no_third_picture_says_is_not_joined(void **unused)
{
    struct lumi_track_graph graph;
    struct lumi_tracks tracks;

    (void)unused;
    begin(&graph);
    triangle(&graph, 3);
    join(&graph, 2, 3, 3, 20); /* would bring a wrong place into a good track */
    choose(&graph, 0, &tracks);
    assert_int_equal(tracks.track_count, 1);
    assert_int_equal(tracks.tracks[0].count, 3);
    lumi_tracks_finish(&tracks);
    lumi_track_graph_finish(&graph);
}

static void a_track_with_two_places_in_one_picture_is_left_out(void **unused)
{
    struct lumi_track_graph graph;
    struct lumi_tracks tracks;

    (void)unused;
    begin(&graph);
    triangle(&graph, 3);
    join(&graph, 0, 3, 3, 9);
    join(&graph, 1, 3, 3, 9);
    join(&graph, 0, 3, 3, 10);
    join(&graph, 1, 3, 3, 10);
    triangle(&graph, 5);
    choose(&graph, 0, &tracks);
    assert_int_equal(tracks.track_count, 1);
    assert_int_equal(tracks.observations[0].feature, 5);
    lumi_tracks_finish(&tracks);
    lumi_track_graph_finish(&graph);
}

static void a_point_with_two_directions_is_one(void **unused)
{
    struct lumi_track_graph graph;
    struct lumi_tracks tracks;

    (void)unused;
    begin(&graph);
    lumi_free(graph.parent);
    graph.images[0].places[4] = graph.images[0].places[3];
    assert_int_equal(lumi_track_graph_begin(&graph), LUMI_OK);
    join(&graph, 0, 3, 1, 3);
    join(&graph, 0, 4, 2, 3);
    join(&graph, 1, 3, 2, 3);
    choose(&graph, 0, &tracks);
    assert_int_equal(tracks.track_count, 1);
    assert_int_equal(tracks.tracks[0].count, 3);
    lumi_tracks_finish(&tracks);
    lumi_track_graph_finish(&graph);
}

static void few_are_spread_over_the_picture_and_long_ones_go_first(void **unused)
{
    struct lumi_track_graph graph;
    struct lumi_tracks tracks;
    int left = 0, longest = 0;

    (void)unused;
    begin(&graph);
    for (uint32_t i = 0; i < FEATURES; i++)
        triangle(&graph, i);
    for (uint32_t i = 0; i < FEATURES; i += 2) { /* these are seen by the fourth as well */
        join(&graph, 0, i, 3, i);
        join(&graph, 1, i, 3, i);
    }
    choose(&graph, 24, &tracks);
    assert_in_range(tracks.track_count, 16, 48);
    for (int i = 0; i < tracks.track_count; i++) {
        left += tracks.observations[tracks.tracks[i].first].x < SIDE / 2;
        longest += tracks.tracks[i].count == 4;
    }
    assert_in_range(left, tracks.track_count / 4, 3 * tracks.track_count / 4);
    assert_int_equal(tracks.tracks[0].count, 4);
    assert_true(longest >= 16);
    lumi_tracks_finish(&tracks);
    lumi_track_graph_finish(&graph);
}

static void a_match_of_features_that_are_not_there_is_refused(void **unused)
{
    struct lumi_track_graph graph;

    (void)unused;
    begin(&graph);
    assert_int_equal(lumi_track_graph_join(&graph, 0, FEATURES, 1, 0), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_track_graph_join(&graph, 0, 0, -1, 0), LUMI_ERR_FORMAT);
    lumi_track_graph_finish(&graph);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(three_pictures_that_agree_make_a_track),
        cmocka_unit_test(what_no_third_picture_says_is_not_joined),
        cmocka_unit_test(a_track_with_two_places_in_one_picture_is_left_out),
        cmocka_unit_test(a_point_with_two_directions_is_one),
        cmocka_unit_test(few_are_spread_over_the_picture_and_long_ones_go_first),
        cmocka_unit_test(a_match_of_features_that_are_not_there_is_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
