/* pipeline/run: which view stands where, and the nearest of many. */
#include "pipeline/run/nearest.h"
#include "pipeline/run/recent.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static int put(struct lumi_recent *recent, int index)
{
    int slot;

    if (!lumi_recent_find(recent, index, &slot))
        lumi_recent_take(recent, slot, index);
    return slot;
}

static void what_was_used_longest_ago_goes_first(void **state)
{
    struct lumi_recent recent;
    int slot;

    (void)state;
    lumi_recent_init(&recent, 3);
    const int a = put(&recent, 10), b = put(&recent, 20), c = put(&recent, 30);
    assert_true(a != b && b != c && a != c);
    assert_true(lumi_recent_find(&recent, 10, &slot));
    assert_int_equal(slot, a);
    assert_int_equal(put(&recent, 40), b);
    assert_int_equal(put(&recent, 50), c);
    assert_int_equal(put(&recent, 60), a);
    assert_false(lumi_recent_find(&recent, 10, &slot));
}

static void a_place_that_could_not_be_filled_holds_nothing(void **state)
{
    struct lumi_recent recent;
    int slot, again;

    (void)state;
    lumi_recent_init(&recent, 2);
    put(&recent, 1);
    put(&recent, 2);
    assert_false(lumi_recent_find(&recent, 3, &slot)); /* 1 goes; 3 cannot be read */
    assert_false(lumi_recent_find(&recent, 1, &again));
    assert_int_equal(again, slot);
    assert_true(lumi_recent_find(&recent, 2, &again));
}

static void the_nearest_are_kept_in_order_each_once(void **state)
{
    static const struct lumi_near items[] = {{3, 7}, {1, 9}, {2, 4}, {1, 5}, {1, 9}, {0.5, -1}, {9, 1}, {0, 2}};
    static const int expected[] = {2, 5, 9, 4};
    struct lumi_near list[4];
    int count = 0;

    (void)state;
    for (int i = 0; i < 8; i++)
        count = lumi_nearest_insert(list, count, 4, items[i]);
    assert_int_equal(count, 4);
    for (int i = 0; i < 4; i++)
        assert_int_equal(list[i].index, expected[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_used_longest_ago_goes_first),
        cmocka_unit_test(a_place_that_could_not_be_filled_holds_nothing),
        cmocka_unit_test(the_nearest_are_kept_in_order_each_once),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
