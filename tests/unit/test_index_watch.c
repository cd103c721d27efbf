/* firmware/core: the index switch: bounces are no edges, marks come where they should or it is said. */
#include "firmware/core/index_watch.h"
#include "step_board.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#define MS (BOARD_TICK_HZ / 1000)
#define STEP (BOARD_TICK_HZ / 960) /* between two steps at 30 s a turn */

static struct lumi_rig bar2(void)
{
    struct lumi_rig rig;
    struct lumi_error error;

    assert_int_equal(lumi_rig_builtin("bar2", &rig, &error), LUMI_OK);
    rig.control.motion.index_window = LUMI_PI / 180;
    return rig;
}

static void a_spike_is_no_edge_and_an_edge_is_dated_to_the_first_contact(void **state)
{
    struct debounce d;
    struct debounce_edge edge;

    (void)state;
    debounce_init(&d, false);
    debounce_input(&d, true, 10, 1000);
    debounce_input(&d, false, 10, 1000 + DEBOUNCE_TICKS / 2);
    assert_false(debounce_poll(&d, 1000 + 2 * DEBOUNCE_TICKS, &edge));
    assert_false(d.settled);
    debounce_input(&d, true, 20, 5 * DEBOUNCE_TICKS);
    debounce_input(&d, false, 21, 6 * DEBOUNCE_TICKS - 2);
    debounce_input(&d, true, 22, 6 * DEBOUNCE_TICKS);
    debounce_input(&d, true, 23, 7 * DEBOUNCE_TICKS - 1);
    assert_false(debounce_poll(&d, 7 * DEBOUNCE_TICKS - 1, &edge));
    assert_true(debounce_poll(&d, 7 * DEBOUNCE_TICKS, &edge));
    assert_true(edge.active && d.settled);
    assert_int_equal(edge.position, 20);
    assert_int_equal(edge.at, 5 * DEBOUNCE_TICKS);
    assert_false(debounce_poll(&d, 20 * DEBOUNCE_TICKS, &edge));
}

static void index_marks_are_right_early_or_missed(void **state)
{
    struct lumi_rig rig = bar2();
    struct index_watch watch;
    int64_t w = 80; /* 1° of 28,800 steps */

    (void)state;
    index_watch_begin(&watch, &rig, -700, false);
    assert_int_equal(index_watch_position(&watch, -100), INDEX_OK);
    assert_int_equal(index_watch_edge(&watch, 3), INDEX_OK);
    assert_int_equal(index_watch_position(&watch, 28800 + w), INDEX_OK);
    assert_int_equal(index_watch_edge(&watch, 28800 + w), INDEX_OK);
    assert_int_equal(index_watch_position(&watch, 28800 + w + 1), INDEX_OK);
    assert_int_equal(index_watch_edge(&watch, 2 * 28800 - w - 1), INDEX_EARLY);
    assert_int_equal(index_watch_edge(&watch, 2 * 28800 - w), INDEX_OK);
    assert_int_equal(index_watch_edge(&watch, 2 * 28800 + w + 1), INDEX_EARLY);
    assert_int_equal(index_watch_position(&watch, 3 * 28800 + w), INDEX_OK);
    assert_int_equal(index_watch_position(&watch, 3 * 28800 + w + 1), INDEX_MISSED);
    assert_int_equal(index_watch_position(&watch, 3 * 28800 + w + 2), INDEX_OK); /* said once */
    assert_int_equal(index_watch_position(&watch, 5 * 28800 + w + 1), INDEX_MISSED);
    assert_int_equal(index_watch_position(&watch, 5 * 28800 + w + 1), INDEX_MISSED);
    assert_int_equal(index_watch_position(&watch, 5 * 28800 + w + 1), INDEX_OK);
    /* Begun within a window: that mark may come or not. */
    index_watch_begin(&watch, &rig, -w + 1, false);
    assert_int_equal(index_watch_position(&watch, 2 * w), INDEX_OK);
    assert_int_equal(index_watch_position(&watch, 28800 + w + 1), INDEX_MISSED);
    index_watch_begin(&watch, &rig, w - 1, false);
    assert_int_equal(index_watch_edge(&watch, w), INDEX_OK);
    assert_int_equal(index_watch_edge(&watch, w + 1), INDEX_EARLY);
    assert_int_equal(index_watch_position(&watch, 28800 + w), INDEX_OK);
    /* No window: not watched. */
    rig.control.motion.index_window = 0;
    index_watch_begin(&watch, &rig, 0, false);
    assert_int_equal(index_watch_edge(&watch, 1234), INDEX_OK);
    assert_int_equal(index_watch_position(&watch, 100000), INDEX_OK);
}

/* A sweep of three turns, the switch closing at the steps told, for 100 steps each; counts the verdicts. */
static void sweep(const int64_t *marks, int count, int *missed, int *early)
{
    struct lumi_rig rig = bar2();
    struct motion motion;
    struct step_board board;
    struct index_watch watch = {0};

    *missed = *early = 0;
    step_board_init(&board, &motion);
    index_watch_begin(&watch, &rig, -500, false);
    for (int64_t position = -500; position < 2 * 28800 + 1000; position++) {
        board.now += STEP;
        bool closed = false;
        for (int i = 0; i < count; i++)
            closed |= position >= marks[i] && position < marks[i] + 100;
        if (closed != board.inputs[BOARD_IN_INDEX]) {
            board.inputs[BOARD_IN_INDEX] = closed;
            for (int i = 0; i < 5; i++) /* it bounces */
                index_watch_on_input(&watch, closed ^ (i & 1), position, board.now + (uint64_t)i * MS / 8);
        }
        enum index_verdict verdict = index_watch_poll(&watch, &board.board, position, board.now + MS);
        *missed += verdict == INDEX_MISSED;
        *early += verdict == INDEX_EARLY;
    }
    assert_int_equal(board.locks, 0);
}

static void a_sweep_is_watched_from_its_edges(void **state)
{
    static const int64_t right[] = {2, 28800, 2 * 28800 - 3}, rims[] = {-80, 28800 + 80, 2 * 28800 - 79};
    static const int64_t lost[] = {0, 2 * 28800}, jumped[] = {0, 28800, 2 * 28800 - 400}, late[] = {0, 28800 + 90};
    int missed, early;

    (void)state;
    sweep(right, 3, &missed, &early);
    assert_int_equal(missed, 0);
    assert_int_equal(early, 0);
    sweep(rims, 3, &missed, &early);
    assert_int_equal(missed, 0);
    assert_int_equal(early, 0);
    sweep(lost, 2, &missed, &early);
    assert_int_equal(missed, 1);
    assert_int_equal(early, 0);
    sweep(jumped, 3, &missed, &early);
    assert_int_equal(missed, 1);
    assert_int_equal(early, 1);
    sweep(late, 2, &missed, &early);
    assert_int_equal(missed, 2); /* that one and the third */
    assert_int_equal(early, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_spike_is_no_edge_and_an_edge_is_dated_to_the_first_contact),
        cmocka_unit_test(index_marks_are_right_early_or_missed),
        cmocka_unit_test(a_sweep_is_watched_from_its_edges),
    };

    return cmocka_run_group_tests_name("index_watch", tests, NULL, NULL);
}
