/* pipeline/hdr: what cameras make of light. */
#include "pipeline/hdr/response.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void a_response_written_is_read_again_for_its_camera(void **state)
{
    struct lumi_response srgb, linear, read;
    struct lumi_error error;
    char *one, *two;

    (void)state;
    lumi_response_srgb(&srgb);
    lumi_response_linear(&linear);
    assert_int_equal(lumi_response_format(&srgb, "c00", &one, &error), LUMI_OK);
    assert_int_equal(lumi_response_format(&linear, "c01", &two, &error), LUMI_OK);
    size_t room = strlen(one) + strlen(two) + 64;
    char *text = malloc(room);
    snprintf(text, room, LUMI_RESPONSE_HEAD "# two cameras\n%s%s", one, two);
    assert_int_equal(lumi_response_parse(text, strlen(text), "file", "c01", &read, &error), LUMI_OK);
    assert_memory_equal(&read, &linear, sizeof read);
    assert_int_equal(lumi_response_parse(text, strlen(text), "file", "c00", &read, &error), LUMI_OK);
    assert_memory_equal(&read, &srgb, sizeof read);
    assert_int_equal(lumi_response_parse(text, strlen(text), "file", "c02", &read, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "c02"));
    /* Without a name it is everybody's. */
    snprintf(text, room, LUMI_RESPONSE_HEAD "%s", strchr(one, '\n') + 1);
    assert_int_equal(lumi_response_parse(text, strlen(text), "file", "any", &read, &error), LUMI_OK);
    assert_memory_equal(&read, &srgb, sizeof read);
    free(text);
    lumi_free(one);
    lumi_free(two);
}

static void what_is_no_response_is_refused_with_its_line(void **state)
{
    static const struct {
        const char *text, *part;
    } bad[] = {
        {"", "ends after 0"},
        {"lumisphere-response 2\n", "line 1"},
        {LUMI_RESPONSE_HEAD "0 0 0\n0.1 0.1\n", "line 3"},
        {LUMI_RESPONSE_HEAD "0 0 0\n0.2 0.2 0.2\n0.1 0.3 0.3\n", "line 4: less light"},
        {LUMI_RESPONSE_HEAD "0 0 0\n0.2 0.2 nan\n", "line 3"},
        {LUMI_RESPONSE_HEAD "0 0 0\n0.2 0.2 2\n", "line 3"},
        {LUMI_RESPONSE_HEAD "0 0 0\ncamera x\n", "line 3"},
        {LUMI_RESPONSE_HEAD "0 0 0\n", "ends after 1"},
    };
    struct lumi_response response;
    struct lumi_error error;

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(lumi_response_parse(bad[i].text, strlen(bad[i].text), "file", "c", &response, &error),
                         LUMI_ERR_FORMAT);
        assert_non_null(strstr(error.text, bad[i].part));
    }
}

/* A film-like curve: light to code. */
static double film(double light)
{
    double v = pow(light, 1 / 1.8);

    return 0.75 * v + 0.25 * v * v * (3 - 2 * v);
}

static void the_response_is_found_from_brackets(void **state)
{
    enum { PLACES = 400, SHOTS = 3 };
    static struct lumi_response_sample samples[PLACES * SHOTS];
    struct lumi_response response;
    struct lumi_error error = {0};
    unsigned seed = 12345;

    (void)state;
    for (int p = 0; p < PLACES; p++) {
        double light = exp2(-8.5 + 9.5 * p / PLACES);
        for (int k = 0; k < SHOTS; k++)
            for (int c = 0; c < 3; c++) {
                seed = seed * 1664525 + 1013904223;
                double code = 255 * film(fmin(light * exp2(2 * (k - 1)) * (1 - 0.2 * c), 1));
                code += 2.0 * ((double)(seed >> 8) / 16777216 - 0.5);
                samples[p * SHOTS + k].place = p;
                samples[p * SHOTS + k].log_exposure = (float)(2 * (k - 1) * log(2));
                samples[p * SHOTS + k].code[c] = (uint8_t)fmin(fmax(code + 0.5, 0), 255);
            }
    }
    assert_int_equal(lumi_response_estimate(samples, PLACES * SHOTS, &response, &error), LUMI_OK);
    for (int c = 0; c < 3; c++) {
        /* Where the top ends is a guess of its own (every code there may be clipped): compared by the middle. */
        double by = (double)response.light[c][180];
        double truth = 0;
        for (double l = 0; l < 1; l += 1e-5)
            if (255 * film(l) <= 180)
                truth = l;
        for (int z = 20; z <= 235; z += 5) {
            double light = 0;
            for (double l = 0; l < 1; l += 1e-4)
                if (255 * film(l) <= z)
                    light = l;
            assert_true(fabs((double)response.light[c][z] / by / (light / truth) - 1) < 0.06);
        }
        for (int z = 1; z < 256; z++)
            assert_true(response.light[c][z] >= response.light[c][z - 1]);
        assert_true(response.light[c][255] == 1 && response.light[c][0] == 0);
    }
    assert_int_equal(lumi_response_estimate(samples, 30, &response, &error), LUMI_ERR_FORMAT);
    for (int i = 0; i < PLACES * SHOTS; i++)
        samples[i].log_exposure = 0;
    assert_int_equal(lumi_response_estimate(samples, PLACES * SHOTS, &response, &error), LUMI_ERR_FORMAT);
}

static void sixteen_bits_pass_between_the_codes(void **state)
{
    struct lumi_raster picture, linear;
    struct lumi_response response;
    struct lumi_error error;

    (void)state;
    lumi_response_linear(&response);
    assert_int_equal(lumi_raster_create(&picture, 2, 1, 3, LUMI_U16), LUMI_OK);
    lumi_row_u16(&picture, 0)[0] = 12345;
    lumi_row_u16(&picture, 0)[5] = 65535;
    assert_int_equal(lumi_response_apply(&response, &picture, &linear, &error), LUMI_OK);
    assert_true(fabsf(lumi_row_f32(&linear, 0)[0] - 12345.0f / 65535) < 1e-6f);
    assert_true(lumi_row_f32(&linear, 0)[5] == 1);
    lumi_raster_finish(&picture);
    lumi_raster_finish(&linear);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_response_written_is_read_again_for_its_camera),
        cmocka_unit_test(what_is_no_response_is_refused_with_its_line),
        cmocka_unit_test(the_response_is_found_from_brackets),
        cmocka_unit_test(sixteen_bits_pass_between_the_codes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
