/* The board's error texts, made without stdio, against the C library's. */
#include "proto/base/result.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

int board_fail(struct lumi_error *error, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#define SAME(...)                                                                                                      \
    do {                                                                                                               \
        struct lumi_error here, there;                                                                                 \
        assert_int_equal(board_fail(&here, LUMI_ERR_FORMAT, __VA_ARGS__), LUMI_ERR_FORMAT);                            \
        lumi_fail(&there, LUMI_ERR_FORMAT, __VA_ARGS__);                                                               \
        assert_int_equal(here.code, LUMI_ERR_FORMAT);                                                                  \
        assert_string_equal(here.text, there.text);                                                                    \
    } while (0)

static void whole_numbers_and_strings_read_as_with_printf(void **state)
{
    (void)state;
    SAME("plain");
    SAME("%s: %d of %u, 100 %%", "name", -17, 4000000000u);
    SAME("%ld %lld %lu %zu %c", -2147483647L, -9223372036854775807LL - 1, 7ul, (size_t)99, 'x');
    SAME("%d %d", 0, -2147483647 - 1);
}

static void numbers_with_a_fraction_read_as_with_printf(void **state)
{
    static const double values[] = {0,        1,         -1,        0.5,     0.0001,  0.00001234, 123456,
                                    999999.4, 999999.5,  1234567,   1e6,     1e-300,  1e300,      0.1,
                                    2.5e-5,   3.14159,   100,       1e5,     0.01,    1.0 / 3,    2e9,
                                    0.999999, 9.9999949, 9.9999951, DBL_MAX, 65536.5, 20.25};
    (void)state;
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        SAME("%g", values[i]);
    SAME("%g %g", (double)INFINITY, -(double)INFINITY);
}

/* Powers of ten are made by multiplying up, so the last of six digits may differ by one where the seventh is a half. */
static void any_number_is_right_to_six_digits(void **state)
{
    uint64_t seed = 1;
    (void)state;

    for (int i = 0; i < 100000; i++) {
        struct lumi_error error;
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        const double value = ldexp((double)(seed >> 11), (int)(seed % 200) - 150);
        board_fail(&error, -1, "%g", value);
        assert_true(fabs(strtod(error.text, NULL) - value) <= 5.0001e-6 * value);
    }
}

static void a_text_that_is_too_long_ends_in_place_and_lines_stay_one(void **state)
{
    struct lumi_error error;
    char big[3000];
    (void)state;

    memset(big, 'a', sizeof big - 1);
    big[sizeof big - 1] = 0;
    board_fail(&error, -1, "%s%s", big, big);
    assert_int_equal(strlen(error.text), sizeof error.text - 1);
    board_fail(&error, -1, "a%sb", "\n\t\x7f");
    assert_string_equal(error.text, "a???b");
    assert_int_equal(board_fail(NULL, -5, "x"), -5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_numbers_and_strings_read_as_with_printf),
        cmocka_unit_test(numbers_with_a_fraction_read_as_with_printf),
        cmocka_unit_test(any_number_is_right_to_six_digits),
        cmocka_unit_test(a_text_that_is_too_long_ends_in_place_and_lines_stay_one),
    };
    return cmocka_run_group_tests_name("board text", tests, NULL, NULL);
}
