/* pipeline/equiangular: gains and vignetting in their file, and out of a picture. */
#include "pipeline/equiangular/gains.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void fill(struct lumi_gains *gains)
{
    struct lumi_error error;

    assert_int_equal(lumi_gains_create(gains, 1, 2, &error), LUMI_OK);
    gains->vignetting[0][0] = -0.2;
    gains->vignetting[0][2] = 1.0 / 3;
    strcpy(gains->items[0].name, "b");
    strcpy(gains->items[1].name, "a");
    for (int c = 0; c < 3; c++) {
        gains->items[0].gain[c] = 1.25 + 0.1 * c;
        gains->items[1].gain[c] = 1 / 3.0;
    }
    lumi_gains_sort(gains);
}

static void what_is_written_is_read_again_number_for_number(void **state)
{
    g_autofree char *path = g_build_filename(g_get_tmp_dir(), "lumi-gains-XXXXXX", NULL);
    struct lumi_gains gains, read;
    struct lumi_error error;

    (void)state;
    close(g_mkstemp(path));
    fill(&gains);
    assert_int_equal(lumi_gains_write(path, &gains, &error), LUMI_OK);
    assert_int_equal(lumi_gains_read(path, &read, &error), LUMI_OK);
    assert_int_equal(read.count, 2);
    assert_memory_equal(read.items, gains.items, 2 * sizeof *read.items);
    assert_memory_equal(read.vignetting, gains.vignetting, sizeof *read.vignetting);
    assert_null(lumi_gains_find(&read, "c"));
    assert_true(lumi_gains_find(&read, "b")->gain[0] == 1.25);
    g_unlink(path);
    lumi_gains_finish(&gains);
    lumi_gains_finish(&read);
}

static void files_that_are_none_are_refused(void **state)
{
    static const char *const bad[] = {
        "",
        "[]",
        "{\"format\": \"lumisphere gains\", \"version\": 2, \"lenses\": [], \"images\": []}",
        "{\"format\": \"lumisphere gains\", \"version\": 1, \"lenses\": []}",
        "{\"format\": \"lumisphere gains\", \"version\": 1, \"lenses\": [{\"vignetting\": [1, 2]}], \"images\": []}",
        "{\"format\": \"lumisphere gains\", \"version\": 1, \"lenses\": [], \"images\": [{\"name\": \"a\", \"lens\": "
        "0, "
        "\"gain\": [1, 1, 1]}]}",
        "{\"format\": \"lumisphere gains\", \"version\": 1, \"lenses\": [{\"vignetting\": [0, 0, 0]}], \"images\": "
        "[{\"name\": \"a\", \"lens\": 0, \"gain\": [1, 0, 1]}]}",
    };
    struct lumi_gains gains;
    struct lumi_error error;

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(lumi_gains_parse(bad[i], strlen(bad[i]), "file", &gains, &error), LUMI_ERR_FORMAT);
        assert_int_equal(strncmp(error.text, "file: ", 6), 0);
        assert_null(gains.items);
    }
}

static void a_picture_is_divided_by_what_its_lens_and_its_camera_did(void **state)
{
    struct lumi_gains gains;
    struct lumi_raster picture;
    struct lumi_lens lens;

    (void)state;
    fill(&gains);
    lumi_lens_init_pinhole(&lens, 64, 48, 1);
    const struct lumi_gain *gain = lumi_gains_find(&gains, "b");
    assert_int_equal(lumi_raster_create(&picture, 64, 48, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < 48; y++)
        for (int i = 0; i < 64 * 3; i++) {
            double r2 = lumi_vignetting_radius2(&lens, i / 3 + 0.5, y + 0.5);
            lumi_row_f32(&picture, y)[i] =
                (float)(0.4 * gain->gain[i % 3] * exp(lumi_vignetting_log(gains.vignetting[0], r2)));
        }
    lumi_gains_apply(&gains, gain, &lens, true, &picture);
    for (int y = 0; y < 48; y++)
        for (int i = 0; i < 64 * 3; i++)
            assert_true(fabsf(lumi_row_f32(&picture, y)[i] - 0.4f) < 1e-6f);
    /* A picture nobody knows stays. */
    lumi_gains_apply(&gains, lumi_gains_find(&gains, "z"), &lens, true, &picture);
    assert_true(fabsf(lumi_row_f32(&picture, 5)[5] - 0.4f) < 1e-6f);
    /* What may be clipped stays white, unless nothing clips. */
    for (int i = 0; i < 64 * 3; i++)
        lumi_row_f32(&picture, 24)[i] = 1;
    lumi_gains_apply(&gains, gain, &lens, true, &picture);
    for (int i = 90; i < 96; i++)
        assert_true(lumi_row_f32(&picture, 24)[i] >= 1 &&
                    lumi_row_f32(&picture, 24)[i] == lumi_row_f32(&picture, 24)[i - i % 3]);
    for (int i = 0; i < 64 * 3; i++)
        lumi_row_f32(&picture, 24)[i] = 1;
    lumi_gains_apply(&gains, gain, &lens, false, &picture);
    assert_true(lumi_row_f32(&picture, 24)[3 * 32] < 0.81f);
    lumi_raster_finish(&picture);
    lumi_gains_finish(&gains);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read_again_number_for_number),
        cmocka_unit_test(files_that_are_none_are_refused),
        cmocka_unit_test(a_picture_is_divided_by_what_its_lens_and_its_camera_did),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
