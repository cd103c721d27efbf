/* The table of states. A row a state, a column an event; tests hold it to be complete and to its invariants. */
#include "firmware/core/states.h"

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#define TO(name) lumi_wire_State_##name
#define NO STATE_REFUSE
#define BUG STATE_IMPOSSIBLE
#define STAY STATE_STAY

static_assert(STATES == 14, "a state more wants a row more");
static_assert(STATE_EVENTS == 17, "an event more wants a column more");

/* clang-format off */
static const uint8_t table[STATES][STATE_EVENTS] = {
    [TO(BOOT)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = NO, [EVENT_PROFILE] = TO(LOST), [EVENT_NO_PROFILE] = TO(NO_PROFILE),
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = BUG,
        [EVENT_FAULT_LATER] = BUG, [EVENT_FAULT_KNOWN] = BUG, [EVENT_FAULT_LOST] = BUG,
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(NO_PROFILE)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = STAY, [EVENT_PROFILE] = TO(LOST), [EVENT_NO_PROFILE] = STAY,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = BUG,
        [EVENT_FAULT_LATER] = BUG, [EVENT_FAULT_KNOWN] = BUG, [EVENT_FAULT_LOST] = TO(STOPPED_LOST),
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(LOST)] = {
        [EVENT_HOME] = TO(HOMING), [EVENT_JOG] = NO, [EVENT_TEST] = TO(TESTING), [EVENT_START] = NO,
        [EVENT_FIRE] = NO, [EVENT_PAUSE] = NO, [EVENT_STOP] = STAY, [EVENT_PROFILE] = STAY,
        [EVENT_NO_PROFILE] = TO(NO_PROFILE), [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = BUG,
        [EVENT_REST_LOST] = BUG, [EVENT_FAULT_LATER] = BUG, [EVENT_FAULT_KNOWN] = BUG,
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(IDLE)] = {
        [EVENT_HOME] = TO(HOMING), [EVENT_JOG] = TO(JOGGING), [EVENT_TEST] = TO(TESTING),
        [EVENT_START] = TO(WINDING), [EVENT_FIRE] = TO(SWEEPING), [EVENT_PAUSE] = NO, [EVENT_STOP] = STAY,
        [EVENT_PROFILE] = TO(LOST), [EVENT_NO_PROFILE] = TO(NO_PROFILE), [EVENT_AT_START] = BUG,
        [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = TO(LOST), [EVENT_FAULT_LATER] = BUG,
        [EVENT_FAULT_KNOWN] = TO(STOPPED), [EVENT_FAULT_LOST] = TO(STOPPED_LOST),
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(HOMING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(IDLE), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(JOGGING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(IDLE), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(WINDING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = TO(PAUSING), [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = TO(SWEEPING), [EVENT_REST_KNOWN] = TO(PAUSED), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(SWEEPING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = TO(PAUSING), [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(IDLE), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(PAUSING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = STAY, [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(PAUSED), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(PAUSED)] = {
        [EVENT_HOME] = TO(HOMING), [EVENT_JOG] = TO(JOGGING), [EVENT_TEST] = TO(TESTING),
        [EVENT_START] = TO(WINDING), [EVENT_FIRE] = TO(SWEEPING), [EVENT_PAUSE] = STAY, [EVENT_STOP] = TO(IDLE),
        [EVENT_PROFILE] = TO(LOST), [EVENT_NO_PROFILE] = TO(NO_PROFILE), [EVENT_AT_START] = BUG,
        [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = TO(LOST), [EVENT_FAULT_LATER] = BUG,
        [EVENT_FAULT_KNOWN] = TO(STOPPED), [EVENT_FAULT_LOST] = TO(STOPPED_LOST),
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(STOPPING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = STAY, [EVENT_STOP] = STAY, [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(IDLE), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = STAY, [EVENT_FAULT_KNOWN] = TO(STOPPED), [EVENT_FAULT_LOST] = TO(STOPPED_LOST),
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
    [TO(STOPPED)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = STAY, [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = TO(STOPPED_LOST),
        [EVENT_FAULT_LATER] = BUG, [EVENT_FAULT_KNOWN] = STAY, [EVENT_FAULT_LOST] = TO(STOPPED_LOST),
        [EVENT_CLEAR_KNOWN] = TO(IDLE), [EVENT_CLEAR_LOST] = TO(LOST)},
    [TO(STOPPED_LOST)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = STAY, [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = TO(NO_PROFILE),
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = BUG, [EVENT_REST_LOST] = BUG,
        [EVENT_FAULT_LATER] = BUG, [EVENT_FAULT_KNOWN] = BUG, [EVENT_FAULT_LOST] = STAY,
        [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = TO(LOST)},
    [TO(TESTING)] = {
        [EVENT_HOME] = NO, [EVENT_JOG] = NO, [EVENT_TEST] = NO, [EVENT_START] = NO, [EVENT_FIRE] = NO,
        [EVENT_PAUSE] = NO, [EVENT_STOP] = TO(STOPPING), [EVENT_PROFILE] = NO, [EVENT_NO_PROFILE] = NO,
        [EVENT_AT_START] = BUG, [EVENT_REST_KNOWN] = TO(IDLE), [EVENT_REST_LOST] = TO(LOST),
        [EVENT_FAULT_LATER] = TO(STOPPING), [EVENT_FAULT_KNOWN] = TO(STOPPED),
        [EVENT_FAULT_LOST] = TO(STOPPED_LOST), [EVENT_CLEAR_KNOWN] = BUG, [EVENT_CLEAR_LOST] = BUG},
};
/* clang-format on */

unsigned state_next(lumi_wire_State state, enum state_event event)
{
    if ((unsigned)state >= STATES || (unsigned)event >= STATE_EVENTS)
        return STATE_IMPOSSIBLE;
    return table[state][event];
}

bool state_at_rest(lumi_wire_State state)
{
    switch (state) {
    case TO(BOOT):
    case TO(NO_PROFILE):
    case TO(LOST):
    case TO(IDLE):
    case TO(PAUSED):
    case TO(STOPPED):
    case TO(STOPPED_LOST):
        return true;
    default:
        return false;
    }
}

bool state_sweeping(lumi_wire_State state)
{
    return state == TO(WINDING) || state == TO(SWEEPING) || state == TO(PAUSING);
}

const char *state_name(lumi_wire_State state)
{
    static const char *const names[STATES] = {"starting",
                                              "without a profile",
                                              "lost",
                                              "idle",
                                              "homing",
                                              "jogging",
                                              "winding",
                                              "sweeping",
                                              "pausing",
                                              "paused",
                                              "stopping",
                                              "stopped by a fault",
                                              "stopped by a fault, position lost",
                                              "testing triggers"};
    return (unsigned)state < STATES ? names[state] : "unknown";
}
