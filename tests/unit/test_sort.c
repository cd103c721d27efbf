/* proto/base: plain numbers in order. */
#include "proto/base/sort.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <limits.h>

static void numbers_stand_in_ascending_order(void **state)
{
    double doubles[] = {3, -1, 2, -1, 1e300, -1e-300};
    float floats[] = {0.5F, -0.25F, 4, 0};
    int ints[] = {INT_MAX, INT_MIN, 0, -1, 1};

    (void)state;
    lumi_sort_doubles(doubles, 6);
    lumi_sort_floats(floats, 4);
    lumi_sort_ints(ints, 5);
    for (int i = 1; i < 6; i++)
        assert_true(doubles[i - 1] <= doubles[i]);
    for (int i = 1; i < 4; i++)
        assert_true(floats[i - 1] <= floats[i]);
    for (int i = 1; i < 5; i++)
        assert_true(ints[i - 1] < ints[i]);
    assert_true(doubles[5] == 1e300 && floats[0] == -0.25F && ints[0] == INT_MIN && ints[4] == INT_MAX);
}

static void a_median_is_the_middle_one_or_the_greater_of_two(void **state)
{
    double odd[] = {9, 1, 5}, even[] = {8, 2, 4, 6};

    (void)state;
    assert_true(lumi_sort_median(odd, 3) == 5);
    assert_true(lumi_sort_median(even, 4) == 6);
    assert_true(lumi_sort_median(even, 1) == 2);
}

static void of_no_numbers_there_is_nothing_to_sort(void **state)
{
    (void)state;
    lumi_sort_doubles(NULL, 0);
    lumi_sort_floats(NULL, 0);
    lumi_sort_ints(NULL, 0);
    assert_true(lumi_sort_median(NULL, 0) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_stand_in_ascending_order),
        cmocka_unit_test(a_median_is_the_middle_one_or_the_greater_of_two),
        cmocka_unit_test(of_no_numbers_there_is_nothing_to_sort),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
