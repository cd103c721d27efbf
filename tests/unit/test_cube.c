/* pipeline/color: look-up tables from .cube files. */
#include "pipeline/color/cube.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void read_text(const char *text, struct lumi_cube *cube)
{
    struct lumi_error error = {0};

    if (lumi_cube_parse(text, strlen(text), "file", cube, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

/* A lattice of size³ points with values of a linear function of red, green and blue, over a domain. */
static char *linear_lattice(int size, const char *head)
{
    size_t room = 256 + (size_t)(size * size * size) * 64, used;
    char *text = malloc(room);

    used = (size_t)snprintf(text, room, "TITLE \"linear\"\n# by a test\r\n\nLUT_3D_SIZE %d\n%s", size, head);
    for (int b = 0; b < size; b++)
        for (int g = 0; g < size; g++)
            for (int r = 0; r < size; r++) {
                double x = r / (size - 1.0), y = g / (size - 1.0), z = b / (size - 1.0);
                used += (size_t)snprintf(text + used, room - used, "%.9f %.9f %.9f\n", 0.5 * x + 0.2 * y + 0.1 * z,
                                         0.1 + 0.7 * y, z - 0.3 * x);
            }
    return text;
}

static void a_lattice_is_exact_for_what_is_linear(void **state)
{
    struct lumi_cube cube;
    char *text = linear_lattice(5, "DOMAIN_MIN -1 0 0\nDOMAIN_MAX 1 1 2\n");

    (void)state;
    read_text(text, &cube);
    assert_int_equal(cube.dimensions, 3);
    for (int i = 0; i < 1000; i++) {
        const float in[3] = {(float)(i % 10) / 4.5f - 1, (float)(i / 10 % 10) / 9, (float)(i / 100) / 4.5f};
        const float x = (in[0] + 1) / 2, y = in[1], z = in[2] / 2;
        float out[3];
        lumi_cube_apply(&cube, in, out);
        assert_true(fabsf(out[0] - (0.5f * x + 0.2f * y + 0.1f * z)) < 1e-5f);
        assert_true(fabsf(out[1] - (0.1f + 0.7f * y)) < 1e-5f);
        assert_true(fabsf(out[2] - (z - 0.3f * x)) < 1e-5f);
    }
    lumi_cube_finish(&cube);
    free(text);
}

static void red_runs_fastest_and_cells_are_cut_into_tetrahedra(void **state)
{
    /* A cube of two points a side that is 1 where all three are 1: along the diagonal the least of the three. */
    static const char text[] = "LUT_3D_SIZE 2\n0 0 0\n1 0 0\n0 1 0\n0 0 0\n0 0 1\n0 0 0\n0 0 0\n1 1 1\n";
    struct lumi_cube cube;
    float out[3];

    (void)state;
    read_text(text, &cube);
    lumi_cube_apply(&cube, (const float[3]){1, 0, 0}, out);
    assert_true(out[0] == 1 && out[1] == 0 && out[2] == 0);
    lumi_cube_apply(&cube, (const float[3]){0, 1, 0}, out);
    assert_true(out[0] == 0 && out[1] == 1 && out[2] == 0);
    /* 0.6 ≥ 0.5 ≥ 0.2: 0.4 of the origin, 0.1 of red, 0.3 of red and green, 0.2 of white. */
    lumi_cube_apply(&cube, (const float[3]){0.6f, 0.5f, 0.2f}, out);
    assert_true(fabsf(out[0] - 0.3f) < 1e-6f && fabsf(out[1] - 0.2f) < 1e-6f && fabsf(out[2] - 0.2f) < 1e-6f);
    /* Outside it is held to the edge, and no number is black. */
    lumi_cube_apply(&cube, (const float[3]){7, -3, NAN}, out);
    assert_true(out[0] == 1 && out[1] == 0 && out[2] == 0);
    lumi_cube_finish(&cube);
}

static void curves_have_one_table_a_channel(void **state)
{
    struct lumi_cube cube;
    float out[3];

    (void)state;
    read_text("LUT_1D_SIZE 3\nLUT_1D_INPUT_RANGE 0 2\n0 1 0\n0.5 0.5 0.1\n1 0 0.4\n", &cube);
    lumi_cube_apply(&cube, (const float[3]){1, 0.5f, 1.5f}, out);
    assert_true(fabsf(out[0] - 0.5f) < 1e-6f && fabsf(out[1] - 0.75f) < 1e-6f && fabsf(out[2] - 0.25f) < 1e-6f);
    lumi_cube_finish(&cube);
}

static void faults_are_named_with_their_line(void **state)
{
    static const struct {
        const char *text;
        int code;
        const char *part;
    } bad[] = {
        {"", LUMI_ERR_FORMAT, "ends after 0 of 0"},
        {"0 0 0\n", LUMI_ERR_FORMAT, "line 1: a point before"},
        {"LUT_3D_SIZE 1\n", LUMI_ERR_FORMAT, "line 1"},
        {"LUT_3D_SIZE 2.5\n", LUMI_ERR_FORMAT, "line 1"},
        {"LUT_3D_SIZE 2 2\n", LUMI_ERR_FORMAT, "line 1"},
        {"LUT_3D_SIZE 1000\n", LUMI_ERR_LIMIT, "more points"},
        {"LUT_1D_SIZE 2\nLUT_3D_SIZE 2\n", LUMI_ERR_UNSUPPORTED, "line 2: a second table"},
        {"LUT_1D_SIZE 2\n0 0 0\n1 1\n", LUMI_ERR_FORMAT, "line 3: three numbers"},
        {"LUT_1D_SIZE 2\n0 0 0\n1,5 1 1\n", LUMI_ERR_FORMAT, "line 3"},
        {"LUT_1D_SIZE 2\n0 0 nan\n", LUMI_ERR_FORMAT, "line 2"},
        {"LUT_1D_SIZE 2\n0 0 0\n", LUMI_ERR_FORMAT, "ends after 1 of 2"},
        {"LUT_1D_SIZE 2\n0 0 0\n1 1 1\n1 1 1\n", LUMI_ERR_FORMAT, "line 4: more points"},
        {"LUT_1D_SIZE 2\n0 0 0\nTITLE x\n1 1 1\nDOMAIN_MIN 0 0 0\n", LUMI_ERR_FORMAT, "line 5: a keyword among"},
        {"LUT_1D_SIZE 2\nDOMAIN_MAX 0 1 1\n0 0 0\n1 1 1\n", LUMI_ERR_FORMAT, "domain is empty"},
        {"LUT_IN_VIDEO_RANGE\n", LUMI_ERR_UNSUPPORTED, "'LUT_IN_VIDEO_RANGE'"},
        {"\x89PNG\x01", LUMI_ERR_FORMAT, "no text"},
    };
    struct lumi_cube cube;
    struct lumi_error error;

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(lumi_cube_parse(bad[i].text, strlen(bad[i].text), "file", &cube, &error), bad[i].code);
        if (!strstr(error.text, bad[i].part))
            fail_msg("'%s' does not say '%s'", error.text, bad[i].part);
        assert_null(cube.values);
    }
}

static void a_table_of_a_real_program_is_read(void **state)
{
    static const char path[] = LUMI_SHARED_DATA "/lut/17p_cmp.cube";
    struct lumi_cube cube;
    struct lumi_error error = {0};
    float last = -1;

    (void)state;
    if (access(path, R_OK)) {
        print_message("%s is not there: skipped\n", path);
        skip();
    }
    if (lumi_cube_read(path, &cube, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(cube.size, 17);
    /* A lattice point gives what its line says, and grey rises. */
    float out[3];
    lumi_cube_apply(&cube, (const float[3]){1.0f / 16, 0, 0}, out);
    assert_true(fabsf(out[0] - 0.0631723f) < 1e-6f && out[1] == 0 && fabsf(out[2] - 0.00183108f) < 1e-6f);
    for (int i = 0; i <= 100; i++) {
        lumi_cube_apply(&cube, (const float[3]){(float)i / 100, (float)i / 100, (float)i / 100}, out);
        assert_true(out[1] >= last);
        last = out[1];
    }
    lumi_cube_finish(&cube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lattice_is_exact_for_what_is_linear),
        cmocka_unit_test(red_runs_fastest_and_cells_are_cut_into_tetrahedra),
        cmocka_unit_test(curves_have_one_table_a_channel),
        cmocka_unit_test(faults_are_named_with_their_line),
        cmocka_unit_test(a_table_of_a_real_program_is_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
