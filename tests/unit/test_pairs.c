/* Pairs: who is matched with whom, what is matched, and that a prior which is wrong is noticed. */
#include "pipeline/calibrate/pair_match.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { POINTS = 400 };
#define DEGREE (LUMI_PI / 180)

static uint64_t state = 1;

static double random_between(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) / 9007199254740992.0;
}

/* A camera on a ring that looks outwards, turned and shifted a little. */
static struct lumi_pose on_ring(double degrees, double wrong_degrees, double wrong_m)
{
    const double a = degrees * DEGREE, b = a + wrong_degrees * DEGREE;
    struct lumi_pose pose;

    lumi_pose_look(lumi_vec3(0.35 * cos(a), 0.35 * sin(a), wrong_m), lumi_vec3(cos(b), sin(b), wrong_degrees * DEGREE),
                   lumi_vec3(0, 0, 1), &pose);
    return pose;
}

static const struct lumi_lens fisheye = {LUMI_LENS_FISHEYE, 640, 512, 333, 333, 320, 256, 0, 0, 0, 0, 0, 0};

/* The same points as both cameras see them; the descriptors a little different, in another order. */
static void see(const struct lumi_pose *pose, bool backwards, struct lumi_sighted *sighted)
{
    struct lumi_features features = {.width = 640, .height = 512};

    state = 7;
    features.items = lumi_calloc(POINTS, sizeof *features.items);
    for (int i = 0; i < POINTS; i++) {
        struct lumi_feature *item = &features.items[backwards ? POINTS - 1 - i : i];
        const double a = random_between(-1, 1), distance = random_between(1, 8);
        const struct lumi_vec3 point =
            lumi_vec3(distance * cos(a), distance * sin(a), distance * random_between(-0.7, 0.7));
        double x, y;
        for (int k = 0; k < LUMI_DESCRIPTOR_SIZE; k++)
            item->descriptor[k] = (uint8_t)(random_between(20, 60) + (backwards ? k % 5 : 0));
        assert_true(lumi_lens_project(&fisheye, lumi_to_camera(pose, point), &x, &y));
        item->x = (float)x;
        item->y = (float)y;
        item->scale = 2;
    }
    features.count = POINTS;
    assert_int_equal(lumi_sighted_init(sighted, &fisheye, &features, NULL), LUMI_OK);
}

static int right_ones(const struct lumi_matches *matches)
{
    int right = 0;

    for (int i = 0; i < matches->count; i++)
        right += matches->items[i].a + matches->items[i].b == POINTS - 1;
    return right;
}

static void a_prior_that_is_a_little_wrong_finds_what_belongs_together(void **unused)
{
    const struct lumi_pose first = on_ring(0, 0, 0), second = on_ring(5, 0, 0), wrong = on_ring(5, 0.7, 0.007);
    const struct lumi_band band = {2 * DEGREE, 0.4, 0.35};
    struct lumi_motion_between truth, motion;
    struct lumi_sighted a, b;
    struct lumi_matches matches;
    double baseline;

    (void)unused;
    see(&first, false, &a);
    see(&second, true, &b);
    lumi_motion_of(&first, &second, &truth, &baseline);
    lumi_motion_of(&first, &wrong, &motion, &baseline);
    assert_int_equal(lumi_match_features(&a, &b, &motion, &band, 0.85, LUMI_FEATURES_MAX, &matches), LUMI_OK);
    assert_true(matches.count > POINTS * 9 / 10);
    assert_true(right_ones(&matches) > matches.count * 98 / 100);
    assert_true(fabs(lumi_motion_error(&motion, &matches.sights[0])) > 0); /* the prior fits badly … */
    assert_true(lumi_motion_refine(&motion, matches.sights, matches.count, 0.02, 0.001));
    for (int i = 0; i < matches.count; i++)
        if (matches.items[i].a + matches.items[i].b == POINTS - 1)
            assert_true(fabs(lumi_motion_error(&motion, &matches.sights[i])) < 2e-4); /* … and what is found, well */
    for (int i = 0; i < 9; i++)
        assert_true(fabs(motion.rotation[i] - truth.rotation[i]) < 2e-3);
    lumi_matches_finish(&matches);
    lumi_sighted_finish(&a);
    lumi_sighted_finish(&b);
}

static void without_a_prior_the_motion_is_found_and_what_is_outside_a_wrong_one_is_seen(void **unused)
{
    const struct lumi_pose first = on_ring(0, 0, 0), second = on_ring(5, 0, 0), wrong = on_ring(-5, 0, 0);
    const struct lumi_band band = {2 * DEGREE, 0.4, 0.35};
    struct lumi_motion_between truth, found, prior;
    struct lumi_sighted a, b;
    struct lumi_matches matches;
    double baseline;
    int outside = 0, inside = 0;

    (void)unused;
    see(&first, false, &a);
    see(&second, true, &b);
    lumi_motion_of(&first, &second, &truth, &baseline);
    lumi_motion_of(&first, &wrong, &prior, &baseline);
    assert_int_equal(lumi_match_features(&a, &b, NULL, NULL, 0.8, LUMI_FEATURES_MAX, &matches), LUMI_OK);
    assert_true(right_ones(&matches) > POINTS * 9 / 10);
    assert_true(lumi_motion_find(matches.sights, matches.count, 0.08, 0.004, &found) > POINTS * 8 / 10);
    for (int i = 0; i < 9; i++)
        assert_true(fabs(found.rotation[i] - truth.rotation[i]) < 3e-3);
    assert_true(lumi_dot(found.direction, truth.direction) > 0.98); /* not the other way either */
    for (int i = 0; i < matches.count; i++) {
        outside += !lumi_band_holds(&prior, &band, &matches.sights[i]);
        inside += lumi_band_holds(&truth, &band, &matches.sights[i]);
    }
    assert_true(outside > matches.count * 9 / 10);
    assert_true(inside > matches.count * 9 / 10);
    lumi_matches_finish(&matches);
    lumi_sighted_finish(&a);
    lumi_sighted_finish(&b);
}

static void neighbours_are_partners_across_the_seam_and_rows_and_either_way(void **unused)
{
    enum { COLUMNS = 24, ROWS = 3 };
    struct lumi_source *sources = calloc(COLUMNS * ROWS, sizeof *sources);
    struct lumi_run run = {.sources = sources, .count = COLUMNS * ROWS};

    (void)unused;
    for (int i = 0; i < run.count; i++) {
        sources[i].lens = fisheye;
        sources[i].prior = on_ring(360.0 * (i % COLUMNS) / COLUMNS, 0, 0.15 * (i / COLUMNS));
    }
    for (int i = 0; i < run.count; i++) {
        g_autofree int *partners = NULL;
        const int count = lumi_pairs_choose(&run, i, &partners), row = i / COLUMNS * COLUMNS;
        bool left = false, right = false, beside = false;
        assert_in_range(count, 8, 20);
        for (int k = 0; k < count; k++) {
            g_autofree int *back = NULL;
            const int others = lumi_pairs_choose(&run, partners[k], &back);
            bool mutual = false;
            for (int j = 0; j < others; j++)
                mutual = mutual || back[j] == i;
            assert_true(mutual && partners[k] != i && (k == 0 || partners[k] > partners[k - 1]));
            left = left || partners[k] == row + (i + COLUMNS - 1) % COLUMNS;
            right = right || partners[k] == row + (i + 1) % COLUMNS;
            beside = beside || partners[k] == i + COLUMNS || partners[k] == i - COLUMNS;
        }
        assert_true(left && right && beside);
    }
    free(sources);
}

static void a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged(void **unused)
{
    struct lumi_match matches[2] = {{1, 2, 3.5f}, {65535, 0, 0}};
    struct lumi_pair pairs[2] = {
        {.name = "r00c01", .match_count = 2, .matches = matches, .free_count = 9, .free_outside = 4},
        {.name = "b", .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .direction = {0, 0, 1}}};
    const struct lumi_pair_list list = {2, pairs};
    struct lumi_pair_list back;
    struct lumi_error error = {0};
    char path[] = "/tmp/test_pairsXXXXXX";

    (void)unused;
    close(mkstemp(path));
    assert_int_equal(lumi_pairs_write(path, &list, &error), LUMI_OK);
    assert_int_equal(lumi_pairs_read(path, &back, &error), LUMI_OK);
    assert_int_equal(back.count, 2);
    assert_string_equal(back.items[0].name, "r00c01");
    assert_true(back.items[0].free_count == 9 && back.items[0].free_outside == 4);
    assert_memory_equal(back.items[0].matches, matches, sizeof matches);
    assert_true(back.items[1].rotation[4] == 1 && back.items[1].direction.z == 1);
    lumi_pairs_finish(&back);
    char *data;
    gsize size;
    assert_true(g_file_get_contents(path, &data, &size, NULL));
    for (gsize i = 0; i < size; i += 3) {
        data[i] ^= 4;
        assert_true(lumi_pairs_decode(data, size, "damaged", &back, &error) < 0);
        data[i] ^= 4;
        assert_true(lumi_pairs_decode(data, i, "cut", &back, &error) < 0);
    }
    g_free(data);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_prior_that_is_a_little_wrong_finds_what_belongs_together),
        cmocka_unit_test(without_a_prior_the_motion_is_found_and_what_is_outside_a_wrong_one_is_seen),
        cmocka_unit_test(neighbours_are_partners_across_the_seam_and_rows_and_either_way),
        cmocka_unit_test(a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
