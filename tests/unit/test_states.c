/* The table of states: complete, and true to what it promises. */
#include "firmware/core/states.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define S(name) lumi_wire_State_##name

static bool lost(unsigned state)
{
    return state == S(BOOT) || state == S(NO_PROFILE) || state == S(LOST) || state == S(STOPPED_LOST);
}

static void every_state_answers_every_event(void **state)
{
    (void)state;
    for (unsigned s = 0; s < STATES; s++) {
        for (unsigned e = 0; e < STATE_EVENTS; e++) {
            unsigned next = state_next((lumi_wire_State)s, (enum state_event)e);
            assert_int_not_equal(next, STATE_MISSING);
            assert_true(next < STATES || (next >= STATE_REFUSE && next <= STATE_STAY));
        }
        assert_string_not_equal(state_name((lumi_wire_State)s), "unknown");
    }
    assert_int_equal(state_next((lumi_wire_State)STATES, EVENT_STOP), STATE_IMPOSSIBLE);
    assert_int_equal(state_next(S(IDLE), STATE_EVENTS), STATE_IMPOSSIBLE);
}

static void with_the_position_lost_nothing_begins_but_homing_and_tests(void **state)
{
    (void)state;
    for (unsigned s = 0; s < STATES; s++) {
        if (!lost(s))
            continue;
        for (unsigned e = EVENT_HOME; e <= EVENT_PAUSE; e++) {
            unsigned next = state_next((lumi_wire_State)s, (enum state_event)e);
            if (s == S(LOST) && (e == EVENT_HOME || e == EVENT_TEST))
                assert_int_equal(next, e == EVENT_HOME ? S(HOMING) : S(TESTING));
            else
                assert_int_equal(next, STATE_REFUSE);
        }
    }
}

static void a_fault_can_come_in_every_state_and_only_clearing_leaves_it(void **state)
{
    (void)state;
    for (unsigned s = S(NO_PROFILE); s < STATES; s++) {
        unsigned next = state_next((lumi_wire_State)s, EVENT_FAULT_LOST);
        assert_true(next == S(STOPPED_LOST) || (s == S(STOPPED_LOST) && next == STATE_STAY));
        next = state_next((lumi_wire_State)s, EVENT_FAULT_KNOWN);
        if (!lost(s))
            assert_true(next == S(STOPPED) || (s == S(STOPPED) && next == STATE_STAY));
    }
    for (unsigned e = 0; e < STATE_EVENTS; e++) {
        unsigned next = state_next(S(STOPPED), (enum state_event)e);
        if (e != EVENT_CLEAR_KNOWN && e != EVENT_CLEAR_LOST)
            assert_true(next >= STATE_REFUSE || next == S(STOPPED_LOST));
        next = state_next(S(STOPPED_LOST), (enum state_event)e);
        if (e != EVENT_CLEAR_LOST && e != EVENT_NO_PROFILE)
            assert_true(next >= STATE_REFUSE);
    }
}

static void what_moves_comes_to_rest_with_what_is_known_then(void **state)
{
    (void)state;
    for (unsigned s = 0; s < STATES; s++) {
        if (state_at_rest((lumi_wire_State)s))
            continue;
        unsigned known = state_next((lumi_wire_State)s, EVENT_REST_KNOWN);
        assert_true(known == S(IDLE) || known == S(PAUSED));
        assert_int_equal(state_next((lumi_wire_State)s, EVENT_REST_LOST), S(LOST));
        unsigned later = state_next((lumi_wire_State)s, EVENT_FAULT_LATER);
        assert_true(later == S(STOPPING) || later == STATE_STAY);
        assert_int_equal(state_next((lumi_wire_State)s, EVENT_PROFILE), STATE_REFUSE);
        unsigned stop = state_next((lumi_wire_State)s, EVENT_STOP);
        assert_true(stop == S(STOPPING) || stop == STATE_STAY);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_state_answers_every_event),
        cmocka_unit_test(with_the_position_lost_nothing_begins_but_homing_and_tests),
        cmocka_unit_test(a_fault_can_come_in_every_state_and_only_clearing_leaves_it),
        cmocka_unit_test(what_moves_comes_to_rest_with_what_is_known_then),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
