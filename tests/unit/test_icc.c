/* pipeline/color: ICC profiles. The profiles are made here, with Little CMS. */
#include "pipeline/color/icc.h"
#include "proto/base/raster.h"

#include <lcms2.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void *saved(cmsHPROFILE profile, size_t *size)
{
    cmsUInt32Number bytes = 0;

    assert_true(cmsSaveProfileToMem(profile, NULL, &bytes));
    void *data = malloc(bytes);
    assert_true(cmsSaveProfileToMem(profile, data, &bytes));
    cmsCloseProfile(profile);
    *size = bytes;
    return data;
}

/* Adobe RGB (1998): sRGB's white, a greener green, gamma 2.2. */
static cmsHPROFILE adobe(void)
{
    cmsCIExyY white = {0.3127, 0.3290, 1};
    cmsCIExyYTRIPLE primaries = {{0.64, 0.33, 1}, {0.21, 0.71, 1}, {0.15, 0.06, 1}};
    cmsToneCurve *curve = cmsBuildGamma(NULL, 563.0 / 256), *curves[3] = {curve, curve, curve};
    cmsHPROFILE profile = cmsCreateRGBProfile(&white, &primaries, curves);

    cmsFreeToneCurve(curve);
    return profile;
}

static struct lumi_icc *open_icc(cmsHPROFILE profile, bool linear)
{
    struct lumi_error error = {0};
    struct lumi_icc *icc;
    size_t size;
    void *data = saved(profile, &size);

    if (lumi_icc_create(data, size, "profile", linear, &icc, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    free(data);
    return icc;
}

static void srgb_changes_nothing(void **state)
{
    (void)state;
    for (int linear = 0; linear < 2; linear++) {
        struct lumi_icc *icc = open_icc(cmsCreate_sRGBProfile(), linear);
        for (int i = 0; i < 1000; i++) {
            const float in[3] = {(float)(i % 10) / 9, (float)(i / 10 % 10) / 9, (float)(i / 100) / 9};
            float out[3] = {in[0], in[1], in[2]};
            lumi_icc_apply(icc, out, 1);
            for (int c = 0; c < 3; c++)
                assert_true(fabsf(out[c] - in[c]) < 1.5e-3f);
        }
        lumi_icc_destroy(icc);
    }
}

static void colours_of_wider_primaries_come_out_stronger(void **state)
{
    /* What Adobe RGB's linear colours are in sRGB's, by the two sets of primaries. */
    static const double to_srgb[9] = {1.39835574, -0.39835574, 0, 0, 1, 0, 0, -0.04293898, 1.04293898};
    struct lumi_icc *curves = open_icc(adobe(), false), *matrix = open_icc(adobe(), true);

    (void)state;
    for (int i = 0; i < 27; i++) {
        const double light[3] = {0.2 + 0.2 * (i % 3), 0.2 + 0.2 * (i / 3 % 3), 0.2 + 0.2 * (i / 9)};
        float one[3], other[3];
        for (int c = 0; c < 3; c++) {
            /* The pipeline decoded the file's codes by sRGB's curve, whatever they were made by. */
            one[c] = lumi_srgb_decode(powf((float)light[c], 256.0f / 563));
            other[c] = (float)(7 * light[c]);
        }
        lumi_icc_apply(curves, one, 1);
        lumi_icc_apply(matrix, other, 1);
        for (int row = 0; row < 3; row++) {
            double wanted = 0;
            for (int c = 0; c < 3; c++)
                wanted += to_srgb[3 * row + c] * light[c];
            assert_true(fabs((double)one[row] - wanted) < 3e-3);
            assert_true(fabs((double)other[row] - 7 * wanted) < 2e-2);
        }
    }
    lumi_icc_destroy(curves);
    lumi_icc_destroy(matrix);
}

static void what_is_no_profile_of_rgb_is_refused(void **state)
{
    struct lumi_error error;
    struct lumi_icc *icc;
    size_t size;
    void *lab = saved(cmsCreateLab4Profile(NULL), &size);

    (void)state;
    assert_int_equal(lumi_icc_create("no profile", 10, "file", false, &icc, &error), LUMI_ERR_FORMAT);
    assert_null(icc);
    assert_int_equal(lumi_icc_create(lab, size, "file", false, &icc, &error), LUMI_ERR_UNSUPPORTED);
    assert_non_null(strstr(error.text, "file: "));
    free(lab);
    void *whole = saved(adobe(), &size);
    assert_int_equal(lumi_icc_create(whole, size / 2, "file", true, &icc, &error) < 0, 1);
    free(whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(srgb_changes_nothing),
        cmocka_unit_test(colours_of_wider_primaries_come_out_stronger),
        cmocka_unit_test(what_is_no_profile_of_rgb_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
