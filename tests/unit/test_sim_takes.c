/* How pictures are taken, and what goes wrong. */
#include "sim/takes.h"

#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void make(struct sim_rig *rig)
{
    struct sim_rig_options options;

    sim_rig_options_init(&options);
    options.scale = 0.1;
    assert_int_equal(sim_rig_init(rig, "arc16", &options, NULL), LUMI_OK);
}

/* A picture of a few steps, darker to the left. */
static void make_picture(struct lumi_raster *picture, const struct sim_rig *rig)
{
    const struct lumi_lens *lens = &rig->views[0].lens;

    assert_int_equal(lumi_raster_create(picture, lens->width, lens->height, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < lens->height; y++)
        for (int x = 0; x < lens->width; x++)
            for (int c = 0; c < 3; c++)
                lumi_row_f32(picture, y)[3 * x + c] = x < lens->width / 2 ? 0.2f : 0.8f;
}

static void shots_are_exposed_nearly_as_asked_and_tell_what_they_were(void **state)
{
    const struct sim_takes takes = {.bracket_count = 3, .brackets = {-2, 0, 2}, .base_s = 0.004, .seed = 5};
    struct sim_rig rig;
    double worst = 0;

    (void)state;
    make(&rig);
    for (int i = 0; i < rig.count; i++)
        for (int k = 0; k < 3; k++) {
            struct sim_take take;
            sim_takes_shot(&takes, &rig, i, k, &take);
            double off = take.stops - takes.brackets[k];
            assert_false(take.lost);
            assert_true(fabs(take.exposure_s - 0.004 * exp2(take.stops)) < 1e-9);
            worst = fmax(worst, fabs(off));
        }
    assert_true(worst > 0.02 && worst < 0.25);
    sim_rig_finish(&rig);
}

static void a_cameras_gain_is_its_own_and_some_frames_drift(void **state)
{
    const struct sim_takes takes = {.gain = 0.4, .seed = 5};
    struct sim_rig rig;
    double usual[LUMI_RIG_CAMERAS];
    int drifted = 0;

    (void)state;
    make(&rig);
    for (int c = 0; c < rig.cameras; c++) { /* what most of its frames have */
        struct sim_take first, take;
        int best = 0;
        for (int i = c; i < rig.count; i += rig.cameras) {
            int same = 0;
            sim_takes_shot(&takes, &rig, i, 0, &first);
            for (int j = c; j < rig.count; j += rig.cameras) {
                sim_takes_shot(&takes, &rig, j, 0, &take);
                same += take.stops == first.stops;
            }
            if (same > best)
                usual[c] = first.stops;
            best = same > best ? same : best;
        }
        drifted += rig.count / rig.cameras - best;
        assert_true(fabs(usual[c]) > 1e-6 && fabs(usual[c]) < 2);
        assert_true(c == 0 || usual[c] != usual[0]);
    }
    assert_true(drifted > 0 && drifted < rig.count / 3);
    sim_rig_finish(&rig);
}

static void faults_touch_what_they_name_and_nothing_else(void **state)
{
    struct sim_takes takes = {.seed = 5};
    struct lumi_raster picture, plain;
    struct sim_rig rig;
    struct sim_take take;

    (void)state;
    make(&rig);
    assert_int_equal(sim_takes_add_fault(&takes, "black=r00c02", NULL), LUMI_OK);
    assert_int_equal(sim_takes_add_fault(&takes, "unfocused=c01", NULL), LUMI_OK);
    assert_int_equal(sim_takes_add_fault(&takes, "isolated=c02", NULL), LUMI_OK);
    assert_int_equal(sim_takes_add_fault(&takes, "missing-row=3", NULL), LUMI_OK);
    assert_int_equal(sim_takes_apply(&takes, &rig, NULL), LUMI_OK);
    make_picture(&plain, &rig);
    const int middle = plain.width / 2;
    for (int i = 0; i < rig.count; i++) {
        const struct sim_view *view = &rig.views[i];
        make_picture(&picture, &rig);
        sim_takes_disturb(&takes, &rig, i, &picture);
        const float *row = lumi_row_f32(&picture, 5);
        bool black = view->row == 0 && view->column == 2;
        if (black)
            assert_true(row[0] == 0 && row[3 * (picture.width - 1)] == 0);
        else if (view->camera == 1)
            assert_true(row[3 * middle] > 0.21f && row[3 * middle] < 0.79f);
        else if (view->camera == 2)
            assert_true(row[0] == 0.8f && row[3 * (picture.width - 1)] == 0.2f);
        else
            assert_memory_equal(picture.data, plain.data, picture.stride * (size_t)picture.height);
        sim_takes_shot(&takes, &rig, i, 0, &take);
        assert_int_equal(take.lost, view->row == 3);
        lumi_raster_finish(&picture);
    }
    lumi_raster_finish(&plain);
    sim_rig_finish(&rig);
}

static void swapped_cameras_have_each_others_pictures(void **state)
{
    struct sim_takes takes = {.seed = 5};
    struct sim_rig rig, plain;

    (void)state;
    make(&rig);
    make(&plain);
    assert_int_equal(sim_takes_add_fault(&takes, "swapped=c00:c03", NULL), LUMI_OK);
    assert_int_equal(sim_takes_apply(&takes, &rig, NULL), LUMI_OK);
    for (int i = 0; i < rig.count; i++) {
        int camera = rig.views[i].camera, other = camera == 0 ? 3 : camera == 3 ? 0 : camera;
        assert_memory_equal(&rig.views[i].pose, &plain.views[i - camera + other].pose, sizeof(struct lumi_pose));
    }
    sim_rig_finish(&rig);
    sim_rig_finish(&plain);
}

static void the_arm_covers_the_lower_edge_and_little_else(void **state)
{
    const struct sim_takes takes = {.arm = true};
    struct lumi_raster picture;
    struct sim_rig rig;
    int dark = 0, upper = 0;

    (void)state;
    make(&rig);
    make_picture(&picture, &rig);
    sim_takes_disturb(&takes, &rig, 0, &picture);
    for (int y = 0; y < picture.height; y++)
        for (int x = 0; x < picture.width; x++)
            if (lumi_row_f32(&picture, y)[3 * x] < 0.1f) {
                dark++;
                upper += y < picture.height * 3 / 4;
            }
    assert_int_equal(upper, 0);
    assert_true(dark > picture.width * picture.height / 300 && dark < picture.width * picture.height / 20);
    lumi_raster_finish(&picture);
    sim_rig_finish(&rig);
}

static void what_is_no_fault_of_the_rig_is_refused(void **state)
{
    static const char *const words[] = {"", "late", "black", "black=", "backwards=1", "swapped=c00", "missing-row"};
    static const char *const absent[] = {"black=r99c00", "unfocused=c16", "swapped=c00:top", "missing-row=90",
                                         "unequal-brackets"};
    struct lumi_error error = {0};
    struct sim_rig rig;

    (void)state;
    make(&rig);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        struct sim_takes takes = {0};
        assert_int_equal(sim_takes_add_fault(&takes, words[i], &error), LUMI_ERR_ARG);
    }
    for (size_t i = 0; i < sizeof absent / sizeof *absent; i++) {
        struct sim_takes takes = {0};
        assert_int_equal(sim_takes_add_fault(&takes, absent[i], &error), LUMI_OK);
        assert_int_equal(sim_takes_apply(&takes, &rig, &error), LUMI_ERR_ARG);
    }
    sim_rig_finish(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shots_are_exposed_nearly_as_asked_and_tell_what_they_were),
        cmocka_unit_test(a_cameras_gain_is_its_own_and_some_frames_drift),
        cmocka_unit_test(faults_touch_what_they_name_and_nothing_else),
        cmocka_unit_test(swapped_cameras_have_each_others_pictures),
        cmocka_unit_test(the_arm_covers_the_lower_edge_and_little_else),
        cmocka_unit_test(what_is_no_fault_of_the_rig_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
