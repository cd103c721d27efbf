/* pipeline/color: light brought down to the display's. */
#include "pipeline/color/tone.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static struct lumi_light light_of(double least, double most, int count)
{
    struct lumi_light light = {.count = 0};

    for (int i = 0; i < count; i++)
        lumi_light_add(&light, (float)(least * pow(most / least, (i + 0.5) / count)));
    return light;
}

static void the_statistics_are_those_of_the_light(void **state)
{
    struct lumi_light light = light_of(0.01, 100, 10000);

    (void)state;
    lumi_light_add(&light, 0);
    lumi_light_add(&light, -1);
    lumi_light_add(&light, NAN);
    assert_int_equal(light.count, 10000);
    assert_true(fabs(log2(lumi_light_average(&light))) < 0.02);
    assert_true(fabs(log2(lumi_light_most(&light, 0.001) / 100)) < 0.05);
    assert_true(fabs(log2(lumi_light_most(&light, 0.5))) < 0.05);
}

static void every_operator_rises_and_ends_at_white(void **state)
{
    const struct lumi_light light = light_of(0.001, 50, 10000);

    (void)state;
    for (int tone = LUMI_TONE_REINHARD; tone <= LUMI_TONE_HABLE; tone++) {
        struct lumi_tone_map map;
        float last = -1;
        lumi_tone_choose(&light, (enum lumi_tone)tone, 0, &map);
        for (int i = 0; i <= 1000; i++) {
            float rgb[3], v = (float)(exp2(-12 + 18.0 * i / 1000));
            rgb[0] = rgb[1] = rgb[2] = v;
            lumi_tone_apply(&map, rgb);
            assert_true(rgb[0] >= last - 1e-6f && fabsf(rgb[0] - rgb[1]) < 1e-5f);
            last = rgb[0];
        }
        float white[3], grey[3];
        for (int c = 0; c < 3; c++) {
            white[c] = (float)(map.white / map.scale);
            grey[c] = (float)lumi_light_average(&light);
        }
        lumi_tone_apply(&map, white);
        assert_true(fabsf(white[0] - 1) < 1e-3f);
        /* What is average stays near 18 % grey. */
        lumi_tone_apply(&map, grey);
        assert_true(grey[0] > 0.1f && grey[0] < 0.22f);
    }
}

static void strong_colours_keep_their_hue_and_their_light(void **state)
{
    const struct lumi_light light = light_of(0.001, 50, 10000);
    struct lumi_tone_map map;

    (void)state;
    lumi_tone_choose(&light, LUMI_TONE_REINHARD, 0, &map);
    float rgb[3] = {20, 2, 1};
    lumi_tone_apply(&map, rgb);
    assert_true(rgb[0] <= 1 + 1e-5f && rgb[0] > rgb[1] && rgb[1] > rgb[2] && rgb[2] >= 0);
    float grey[3], l = 0.2126f * 20 + 0.7152f * 2 + 0.0722f * 1;
    grey[0] = grey[1] = grey[2] = l;
    lumi_tone_apply(&map, grey);
    assert_true(fabsf(lumi_luminance(rgb) - grey[0]) < 1e-4f);
    /* Ratios stay where no channel is full. */
    float dim[3] = {0.02f, 0.01f, 0.005f};
    lumi_tone_apply(&map, dim);
    assert_true(fabsf(dim[0] / dim[1] - 2) < 1e-3f && fabsf(dim[1] / dim[2] - 2) < 1e-3f);
    float black[3] = {-0.1f, 0, 0};
    lumi_tone_apply(&map, black);
    assert_true(black[0] == 0 && black[1] == 0 && black[2] == 0);
}

static void without_an_operator_only_the_exposure_counts(void **state)
{
    const struct lumi_light none = {.count = 0};
    struct lumi_tone_map map;
    float rgb[3] = {0.25f, 3, -0.125f};

    (void)state;
    lumi_tone_choose(&none, LUMI_TONE_NONE, 1, &map);
    lumi_tone_apply(&map, rgb);
    assert_true(rgb[0] == 0.5f && rgb[1] == 6 && rgb[2] == -0.25f);
    /* A capture that is black all over stays so. */
    lumi_tone_choose(&none, LUMI_TONE_REINHARD, 0, &map);
    assert_true(map.scale == 1 && map.white == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_statistics_are_those_of_the_light),
        cmocka_unit_test(every_operator_rises_and_ends_at_white),
        cmocka_unit_test(strong_colours_keep_their_hue_and_their_light),
        cmocka_unit_test(without_an_operator_only_the_exposure_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
