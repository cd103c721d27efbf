/* Poses that were found against the true ones: what is said of them. */
#include "pipeline/calibrate/rotation.h"
#include "pipeline/evaluate/pose_error.h"
#include "pipeline/run/places.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <string.h>

enum { COUNT = 24, FAR = 7, TURNED = 13 };

/* Cameras on a sphere that look outwards, more or less; their set owns nothing but its arrays. */
static void make_set(struct lumi_pose_set *set)
{
    *set = (struct lumi_pose_set){COUNT, g_new0(char *, COUNT), g_new0(struct lumi_pose, COUNT)};
    for (int i = 0; i < COUNT; i++) {
        const double w[3] = {0.3 * i, sin(i), 0.1 * i};
        set->names[i] = g_strdup_printf("r%02dc%02d", i / 6, i % 6);
        lumi_rotation_exp(w, set->poses[i].r);
        set->poses[i].t = lumi_scale(lumi_normalize(lumi_vec3(cos(1.3 * i), sin(2.1 * i), cos(0.7 * i + 1))), 0.35);
    }
}

/* Another world's: larger, turned, elsewhere. */
static void bring_away(struct lumi_pose_set *set, struct lumi_similarity *away)
{
    const double w[3] = {0.2, -1.1, 0.4};

    away->scale = 1.25;
    away->shift = lumi_vec3(3, -2, 1);
    lumi_rotation_exp(w, away->rotation);
    for (int i = 0; i < set->count; i++)
        lumi_similarity_apply(away, &set->poses[i], &set->poses[i]);
}

static void turn(struct lumi_pose *pose, double angle)
{
    const double w[3] = {0, angle, 0};
    double by[9], turned[9];

    lumi_rotation_exp(w, by);
    lumi_rotation_multiply(pose->r, by, turned);
    memcpy(pose->r, turned, sizeof turned);
}

static void the_worst_are_listed_first_by_name(void **state)
{
    struct lumi_pose_set found, truth;
    struct lumi_pose_error result;
    struct lumi_similarity away;
    struct lumi_error error = {0};

    (void)state;
    make_set(&found);
    make_set(&truth);
    bring_away(&truth, &away);
    truth.poses[FAR].t.x += 0.004;
    turn(&truth.poses[TURNED], 0.01);
    g_free(found.names[3]);
    found.names[3] = g_strdup("another");
    assert_int_equal(lumi_pose_error(&found, &truth, &result, &error), LUMI_OK);
    assert_int_equal(result.truths, COUNT);
    assert_int_equal(result.distance.count, COUNT - 1);
    assert_true(fabs(result.scale - 1.25) < 0.01);
    assert_string_equal(result.off[0].name, truth.names[FAR]);
    assert_true(fabs(result.off[0].position - 0.004) < 0.001);
    assert_string_equal(result.worst_turned, truth.names[TURNED]);
    for (int i = 1; i < result.distance.count; i++) {
        assert_true(result.off[i].position <= result.off[i - 1].position);
        assert_true(strcmp(result.off[i].name, truth.names[3]) != 0);
    }
    g_autofree char *text = lumi_pose_error_text(&result, 2), *few = lumi_pose_error_text(&result, 0);
    g_autofree char *json = lumi_pose_error_json(&result, 1);
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    assert_int_equal(g_strv_length(lines), 7); /* heading, two lines, heading, two pictures, nothing */
    assert_non_null(strstr(lines[0], "23 of 24"));
    assert_non_null(strstr(lines[4], truth.names[FAR]));
    assert_null(strstr(few, "furthest"));
    assert_non_null(strstr(json, "\"furthest\":[{\"name\":\"r01c01\",\"position_mm\":"));
    lumi_pose_error_finish(&result);
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&truth);
}

static void poses_that_share_too_few_names_are_refused(void **state)
{
    struct lumi_pose_set found, truth;
    struct lumi_pose_error result;
    struct lumi_error error = {0};

    (void)state;
    make_set(&found);
    make_set(&truth);
    found.count = 2;
    assert_int_equal(lumi_pose_error(&found, &truth, &result, &error), LUMI_ERR_FORMAT);
    lumi_pose_error_finish(&result);
    found.count = COUNT;
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&truth);
}

static void what_is_true_is_brought_over_to_what_was_found(void **state)
{
    struct lumi_pose_set found, truth;
    struct lumi_similarity away;
    struct lumi_error error = {0};
    struct {
        double before;
        struct lumi_pose pose;
    } views[2] = {{1, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.1, 0.05, 0}}}, {2, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}}};

    (void)state;
    make_set(&found);
    make_set(&truth);
    bring_away(&found, &away);
    found.poses[FAR].t.x += 0.5; /* one that is lost does not draw the others along */
    assert_int_equal(
        lumi_pose_set_align(&truth, &found, &views[0].pose, (char *)&views[1] - (char *)&views[0], 2, &error), LUMI_OK);
    for (int i = 0; i < 2; i++) {
        struct lumi_pose expected = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {i == 0 ? 0.1 : 0, i == 0 ? 0.05 : 0, 0}};
        lumi_similarity_apply(&away, &expected, &expected);
        assert_true(lumi_length(lumi_sub(views[i].pose.t, expected.t)) < 1e-4);
        assert_true(lumi_rotation_angle(views[i].pose.r, expected.r) < 1e-4);
    }
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&truth);
}

static void only_pictures_that_are_used_count_as_found(void **state)
{
    g_autofree char *folder = g_dir_make_tmp("test_pose_error-XXXXXX", NULL);
    g_autofree char *path = g_build_filename(folder, "all.places", NULL);
    struct lumi_places places = {0};
    struct lumi_pose_set set, found;
    struct lumi_error error = {0};
    struct lumi_lens lens;

    (void)state;
    make_set(&set);
    lumi_lens_init_pinhole(&lens, 64, 48, 1);
    for (int i = 0; i < 6; i++) {
        struct lumi_place place = {.pose = set.poses[i], .used = i != 2, .kept = i != 2, .synthetic = i == 5};
        g_strlcpy(place.name, set.names[i], sizeof place.name);
        g_strlcpy(place.why, i == 2 ? "lost" : "", sizeof place.why);
        assert_int_equal(lumi_places_add_lens(&places, &lens, &place.lens, &error), LUMI_OK);
        assert_int_equal(lumi_places_add(&places, &place, &error), LUMI_OK);
    }
    assert_int_equal(lumi_places_write(path, &places, &error), LUMI_OK);
    assert_int_equal(lumi_pose_set_read(path, &found, &error), LUMI_OK);
    assert_int_equal(found.count, 4);
    assert_string_equal(found.names[2], set.names[3]);
    assert_true(fabs(found.poses[2].t.y - set.poses[3].t.y) < 1e-15);
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&set);
    lumi_places_finish(&places);
    g_remove(path);
    g_rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_worst_are_listed_first_by_name),
        cmocka_unit_test(poses_that_share_too_few_names_are_refused),
        cmocka_unit_test(what_is_true_is_brought_over_to_what_was_found),
        cmocka_unit_test(only_pictures_that_are_used_count_as_found),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
