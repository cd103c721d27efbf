/* Clusters of views, the views of the coarse level, what a quality means. */
#include "pipeline/compress/cluster.h"
#include "pipeline/compress/level.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 21, VIEWS = SIDE * SIDE };

static void make_grid(struct lumi_pose poses[VIEWS])
{
    memset(poses, 0, VIEWS * sizeof *poses);
    for (int i = 0; i < VIEWS; i++)
        poses[i].t = lumi_vec3(i % SIDE * 0.03, i / SIDE * 0.03, 0);
}

static void every_view_is_in_one_cluster_of_even_size(void **state)
{
    struct lumi_pose poses[VIEWS];
    struct lumi_clusters clusters;
    bool seen[VIEWS] = {false};

    (void)state;
    make_grid(poses);
    assert_int_equal(lumi_clusters_make(VIEWS, poses, 25, &clusters, NULL), LUMI_OK);
    assert_int_equal(clusters.count, 18);
    assert_int_equal(clusters.first[18], VIEWS);
    for (int i = 0; i < clusters.count; i++)
        assert_in_range(clusters.first[i + 1] - clusters.first[i], 24, 25);
    for (int i = 0; i < VIEWS; i++) {
        assert_false(seen[clusters.members[i]]);
        seen[clusters.members[i]] = true;
    }
    lumi_clusters_finish(&clusters);
}

static void the_reference_image_is_near_its_cluster(void **state)
{
    struct lumi_pose poses[VIEWS];
    struct lumi_clusters clusters;

    (void)state;
    make_grid(poses);
    assert_int_equal(lumi_clusters_make(VIEWS, poses, 25, &clusters, NULL), LUMI_OK);
    for (int i = 0; i < clusters.count; i++)
        for (int k = clusters.first[i] + 1; k < clusters.first[i + 1]; k++) {
            struct lumi_vec3 apart =
                lumi_sub(poses[clusters.members[k]].t, poses[clusters.members[clusters.first[i]]].t);
            assert_true(lumi_length(apart) < 0.03 * 5.5);
        }
    lumi_clusters_finish(&clusters);
}

static void the_coarse_level_has_one_view_of_nine(void **state)
{
    struct lumi_pose poses[VIEWS];
    int *views, count;

    (void)state;
    make_grid(poses);
    assert_int_equal(lumi_coarse_views(VIEWS, poses, &views, &count, NULL), LUMI_OK);
    assert_int_equal(count, 49);
    for (int i = 1; i < count; i++)
        assert_true(views[i] > views[i - 1]);
    lumi_free(views);
    /* Of few views all. */
    assert_int_equal(lumi_coarse_views(30, poses, &views, &count, NULL), LUMI_OK);
    assert_int_equal(count, 30);
    lumi_free(views);
}

static void views_in_one_place_and_single_views_do_no_harm(void **state)
{
    struct lumi_pose poses[VIEWS] = {0};
    struct lumi_clusters clusters;

    (void)state;
    assert_int_equal(lumi_clusters_make(VIEWS, poses, 25, &clusters, NULL), LUMI_OK);
    assert_int_equal(clusters.count, 18);
    lumi_clusters_finish(&clusters);
    assert_int_equal(lumi_clusters_make(1, poses, 25, &clusters, NULL), LUMI_OK);
    assert_int_equal(clusters.count, 1);
    lumi_clusters_finish(&clusters);
    assert_int_equal(lumi_clusters_make(0, poses, 25, &clusters, NULL), LUMI_ERR_ARG);
}

static void quality_is_a_scale_from_the_coarsest_to_the_finest_quantizer(void **state)
{
    struct compress_quality quality, before;

    (void)state;
    compress_quality_init(&before, 0);
    assert_int_equal(before.tile_quantizer, 63);
    for (int value = 1; value <= 100; value++) {
        compress_quality_init(&quality, value);
        assert_true(quality.tile_quantizer <= before.tile_quantizer);
        assert_true(quality.tile_quantizer >= before.tile_quantizer - 1); /* no step is left out */
        assert_true(quality.reference_quantizer <= quality.tile_quantizer);
        before = quality;
    }
    assert_int_equal(before.tile_quantizer, 0);
    compress_quality_init(&quality, 10);
    compress_quality_init(&before, 20);
    assert_true(quality.tile_quantizer > before.tile_quantizer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_view_is_in_one_cluster_of_even_size),
        cmocka_unit_test(the_reference_image_is_near_its_cluster),
        cmocka_unit_test(the_coarse_level_has_one_view_of_nine),
        cmocka_unit_test(views_in_one_place_and_single_views_do_no_harm),
        cmocka_unit_test(quality_is_a_scale_from_the_coarsest_to_the_finest_quantizer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
