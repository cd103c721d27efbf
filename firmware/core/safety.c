/* The fault table at work. */
#include "firmware/core/core_state.h"

#include <math.h>

#define SUPPLY_PERIOD (BOARD_TICK_HZ / 100)
#define SUPPLY_READINGS 5              /* 50 ms below the minimum */
#define LOOP_LATE (BOARD_TICK_HZ / 50) /* between two polls: the main loop hangs */
#define SUPPLY_HYSTERESIS 1.03         /* cleared from so much above it */
#define WATCH_PERIOD (BOARD_TICK_HZ / 200)
#define SPEED_TOLERANCE 1.02

#define BIT(fault) (1u << (fault))
static const char *const estop_text = "emergency stop";

/* How long an input must say the same, in ms. */
static const uint8_t debounce_ms[BOARD_INPUTS] = {
    [BOARD_IN_ESTOP] = 0, [BOARD_IN_INDEX] = 1,        [BOARD_IN_SLACK] = 20,   [BOARD_IN_STRING_END] = 5,
    [BOARD_IN_WOUND] = 5, [BOARD_IN_DRIVER_FAULT] = 2, [BOARD_IN_REACHED] = 10,
};

static uint64_t debounce_ticks(int input)
{
    return (uint64_t)debounce_ms[input] * (BOARD_TICK_HZ / 1000);
}

void safety_init(struct core *core)
{
    struct safety *s = &core->safety;
    const struct board *board = core->board;
    const uint64_t now = board->now(board->port);

    *s = (struct safety){.heard = now, .supply_due = now, .supply_mv = board->supply_mv(board->port)};
    for (int i = 0; i < BOARD_INPUTS; i++) {
        s->inputs[i] = s->raw[i] = board->input(board->port, (enum board_input)i);
        s->changed[i] = now;
    }
    debounce_init(&s->index, s->raw[BOARD_IN_INDEX]);
}

void safety_watch_index(struct core *core)
{
    index_watch_begin(&core->safety.watch, &core->rig, motion_position(&core->motion),
                      core->board->input(core->board->port, BOARD_IN_INDEX));
}

/* What a fault does. Without a profile, or where it says what cannot be for an emergency stop: halted, lines down. */
static struct lumi_rig_reaction reaction(const struct core *core, enum lumi_rig_fault fault)
{
    struct lumi_rig_reaction r = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF};

    if (core->has_profile)
        r = core->rig.control.safety.reactions[fault];
    if (fault == LUMI_RIG_FAULT_ESTOP && r.motor < LUMI_RIG_MOTOR_HALT)
        r.motor = LUMI_RIG_MOTOR_HALT;
    return r;
}

/* Everything that must not wait for the main loop. */
static void stop_now(struct core *core)
{
    motion_halt(&core->motion);
    if (core_external(core))
        core->board->output(core->board->port, BOARD_OUT_ENABLE, false);
    if (reaction(core, LUMI_RIG_FAULT_ESTOP).triggers == LUMI_RIG_TRIGGERS_OFF)
        firing_stop(&core->firing, false);
}

void safety_on_input(struct core *core, enum board_input input, bool active, uint64_t at)
{
    struct safety *s = &core->safety;

    if (input == BOARD_IN_ESTOP && active) {
        s->estop_seen = true;
        stop_now(core);
    } else if (input == BOARD_IN_DRIVER_FAULT && active && core->has_profile && at > core->now + LOOP_LATE &&
               core->rig.control.safety.driver_fault_fitted) {
        /* The motor may have let go of the arm, and the main loop that would close the brake does not come round. */
        s->driver_seen = true;
        motion_halt(&core->motion);
        core->board->output(core->board->port, BOARD_OUT_BRAKE, false);
    } else if (input == BOARD_IN_INDEX) {
        const int64_t position = motion_position(&core->motion);
        debounce_input(&s->index, active, position, at);
        index_watch_on_input(&s->watch, active, position, at);
    }
}

void safety_heartbeat(struct core *core)
{
    core->safety.heard = core->board->now(core->board->port);
}

/* Halts: the position stays known only if it stood. */
static void halt(struct core *core, bool off)
{
    homing_cancel(&core->homing);
    motion_halt(&core->motion);
    if (core_external(core)) {
        drop_string_cut(core);
    } else if (off) {
        drop_string_release(core);
        motion_forget(&core->motion);
    }
}

static void react(struct core *core, enum lumi_rig_fault fault)
{
    const struct lumi_rig_reaction r = reaction(core, fault);
    const bool finish = r.triggers == LUMI_RIG_TRIGGERS_FINISH;
    const bool knew = motion_known(&core->motion);

    if (!finish)
        firing_stop(&core->firing, false);
    if (r.motor == LUMI_RIG_MOTOR_ROW_END && sweep_end_with_row(core))
        return; /* still sweeping, to the row's end */
    if (r.motor >= LUMI_RIG_MOTOR_HALT)
        halt(core, r.motor == LUMI_RIG_MOTOR_OFF);
    /* The motor may have been without current for as long as it took to notice: steps then moved nothing. */
    if ((fault == LUMI_RIG_FAULT_DRIVER || fault == LUMI_RIG_FAULT_SUPPLY) && !motion_moving(&core->motion))
        motion_forget(&core->motion);
    if (knew && !motion_known(&core->motion))
        firing_spoil(&core->firing);
    index_watch_end(&core->safety.watch);
    if (r.brake && !motion_moving(&core->motion))
        drop_string_close(core);
    if (state_at_rest(core->state)) {
        core_rest(core);
        return;
    }
    core_stop_soon(core, finish);
    core_state_event(core, EVENT_FAULT_LATER);
}

void safety_raise(struct core *core, enum lumi_rig_fault fault, const char *text)
{
    struct safety *s = &core->safety;

    if (s->standing & BIT(fault))
        return;
    s->standing |= BIT(fault);
    react(core, fault);
    core_report_fault(core, fault, true, text);
}

/* NULL where nothing keeps the fault standing. */
static const char *cause(const struct core *core, int fault)
{
    const struct safety *s = &core->safety;

    switch (fault) {
    case LUMI_RIG_FAULT_ESTOP:
        return s->inputs[BOARD_IN_ESTOP] || s->raw[BOARD_IN_ESTOP] ? "the emergency stop is still pressed" : NULL;
    case LUMI_RIG_FAULT_DRIVER:
        return s->inputs[BOARD_IN_DRIVER_FAULT] ? "the driver still reports a fault" : NULL;
    case LUMI_RIG_FAULT_SUPPLY:
        return s->supply_mv < core->rig.control.safety.supply_minimum * 1000 * SUPPLY_HYSTERESIS
                   ? "the supply is still low"
                   : NULL;
    case LUMI_RIG_FAULT_HOST_LOST:
        return core->now > s->heard + CORE_SECONDS(core->rig.control.safety.host_timeout) ? "no heartbeat has come yet"
                                                                                          : NULL;
    default:
        return NULL;
    }
}

const char *safety_clear(struct core *core, uint32_t faults)
{
    struct safety *s = &core->safety;

    if (faults != s->standing)
        return s->standing == 0 ? "no fault stands" : "name the faults that stand, all of them";
    if (faults == 0)
        return NULL;
    if (!state_at_rest(core->state))
        return "the rig has not come to rest yet";
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        if ((faults & BIT(i)) && cause(core, i))
            return cause(core, i);
    s->standing = 0;
    s->marked.active = false;
    /* A stop pressed meanwhile raises itself again: its interrupt sets estop_seen. */
    motion_release(&core->motion);
    if (s->estop_seen)
        motion_halt(&core->motion);
    if (core->has_profile && !s->estop_seen)
        sweep_unrecord(core);
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        if (faults & BIT(i))
            core_report_fault(core, i, false, "");
    if (!core->has_profile)
        core_state_event(core, EVENT_NO_PROFILE);
    else
        core_state_event(core, motion_known(&core->motion) ? EVENT_CLEAR_KNOWN : EVENT_CLEAR_LOST);
    return NULL;
}

static void poll_inputs(struct core *core)
{
    struct safety *s = &core->safety;

    for (int i = 0; i < BOARD_INPUTS; i++) {
        bool raw = core->board->input(core->board->port, (enum board_input)i);
        if (raw != s->raw[i]) {
            s->raw[i] = raw;
            s->changed[i] = core->now;
        }
        if (raw != s->inputs[i] && core->now >= s->changed[i] + debounce_ticks(i))
            s->inputs[i] = raw;
    }
}

static void watch_switches(struct core *core)
{
    struct safety *s = &core->safety;
    const struct lumi_rig_safety *fitted = &core->rig.control.safety;
    const bool driver = s->driver_seen;

    s->driver_seen = false;
    if (driver)
        drop_string_close(core); /* the interrupt has done so: it must be known, too */
    if ((s->inputs[BOARD_IN_DRIVER_FAULT] && fitted->driver_fault_fitted) || driver)
        safety_raise(core, LUMI_RIG_FAULT_DRIVER, "the motor driver reports a fault");
    if (!motion_moving(&core->motion) ||
        !(s->inputs[BOARD_IN_STRING_END] || s->inputs[BOARD_IN_SLACK] || s->inputs[BOARD_IN_WOUND]))
        return;
    const double speed = motion_speed(&core->motion, core->now);
    if (s->inputs[BOARD_IN_STRING_END] && fitted->string_end_fitted && speed > 0)
        safety_raise(core, LUMI_RIG_FAULT_STRING_END, "the string is paid out");
    if (s->inputs[BOARD_IN_SLACK] && fitted->slack_fitted && speed > 0)
        safety_raise(core, LUMI_RIG_FAULT_SLACK, "the string hangs loose");
    if (!s->inputs[BOARD_IN_WOUND] || !fitted->wound_fitted || speed >= 0 || homing_active(&core->homing))
        return;
    const double position = (double)motion_position(&core->motion);
    if (position > core->steps_per_turn && !(s->standing & BIT(LUMI_RIG_FAULT_STRING_END))) {
        motion_forget(&core->motion);
        safety_raise(core, LUMI_RIG_FAULT_STRING_END, "the arm is all the way up, turns too early");
    } else if (position < 0) {
        safety_raise(core, LUMI_RIG_FAULT_STRING_END, "the string is wound up, and was to be wound further");
    }
}

static void watch_supply(struct core *core)
{
    struct safety *s = &core->safety;
    const double minimum = core->rig.control.safety.supply_minimum * 1000;

    if (core->now < s->supply_due)
        return;
    s->supply_due = core->now + SUPPLY_PERIOD;
    s->supply_mv = core->board->supply_mv(core->board->port);
    if (!(minimum > 0) || s->supply_mv >= minimum)
        s->supply_low = 0;
    else if (++s->supply_low >= SUPPLY_READINGS)
        safety_raise(core, LUMI_RIG_FAULT_SUPPLY, "the supply is low");
}

static void tell_verdict(struct core *core, enum index_verdict verdict)
{
    if (verdict == INDEX_MISSED)
        safety_raise(core, LUMI_RIG_FAULT_INDEX_MISSED, "the index mark did not come");
    else if (verdict == INDEX_EARLY)
        safety_raise(core, LUMI_RIG_FAULT_INDEX_EARLY, "the index mark came where it should not");
}

/* The platform's own speed, by the time between two marks that lie apart by the steps: a sweep that winds back a
 * little passes the same mark again. Homing counts steps from elsewhere, so it leaves no mark behind. */
static void watch_turn(struct core *core, const struct debounce_edge *edge)
{
    struct safety *s = &core->safety;
    const double limit = core->rig.control.safety.overspeed;
    const double apart = fabs((double)(edge->position - s->marked.position));

    if (s->marked.active && apart > core->steps_per_turn / 4 && limit > 0 &&
        (double)(edge->at - s->marked.at) * limit < 2 * LUMI_PI * BOARD_TICK_HZ)
        safety_raise(core, LUMI_RIG_FAULT_OVERSPEED, "a turn took less time than it may");
    s->marked = *edge;
    s->marked.active = !homing_active(&core->homing);
}

static void watch_index(struct core *core)
{
    struct safety *s = &core->safety;
    const struct board *board = core->board;
    struct debounce_edge edge;
    unsigned lock = board->lock(board->port);
    bool changed = debounce_poll(&s->index, core->now, &edge);

    board->unlock(board->port, lock);
    if (changed && edge.active)
        watch_turn(core, &edge);
    if (state_at_rest(core->state))
        index_watch_end(&s->watch);
    tell_verdict(core, index_watch_poll(&s->watch, board, motion_position(&core->motion), core->now));
}

/* No planner of ours goes faster than the profile allows; should it, that is seen. */
static void watch_speed(struct core *core)
{
    struct safety *s = &core->safety;
    const double most = core->rig.control.motion.speed_max * core->steps_per_turn / (2 * LUMI_PI);

    if (core->now < s->speed_due || !motion_moving(&core->motion))
        return;
    s->speed_due = core->now + SUPPLY_PERIOD;
    if (fabs(motion_speed(&core->motion, core->now)) > most * SPEED_TOLERANCE + 1)
        safety_raise(core, LUMI_RIG_FAULT_OVERSPEED, "planned faster than the profile allows");
}

static void watch_host(struct core *core)
{
    const double timeout = core->rig.control.safety.host_timeout;

    if (timeout > 0 && state_sweeping(core->state) && core->now > core->safety.heard + CORE_SECONDS(timeout))
        safety_raise(core, LUMI_RIG_FAULT_HOST_LOST, "no heartbeat from the host");
}

void safety_poll(struct core *core)
{
    struct safety *s = &core->safety;

    poll_inputs(core);
    if (s->estop_seen || s->inputs[BOARD_IN_ESTOP]) {
        s->estop_seen = false;
        stop_now(core);
        safety_raise(core, LUMI_RIG_FAULT_ESTOP, estop_text);
    }
    if (!core->has_profile)
        return;
    watch_switches(core);
    watch_supply(core);
    watch_index(core);
    watch_speed(core);
    watch_host(core);
    if (motion_starved(&core->motion) && !(s->standing & BIT(LUMI_RIG_FAULT_INTERNAL))) {
        firing_spoil(&core->firing); /* what was put out meanwhile was put out where the platform was not */
        safety_raise(core, LUMI_RIG_FAULT_INTERNAL, "the steps ran out: the main loop was late");
    }
}

uint64_t safety_next_poll(const struct core *core)
{
    const struct safety *s = &core->safety;
    uint64_t next = core->has_profile ? s->supply_due : BOARD_NEVER;

    if (s->estop_seen)
        return core->now;
    if (s->watch.active && core->now + WATCH_PERIOD < next)
        next = core->now + WATCH_PERIOD;
    if (s->index.bouncing && s->index.latest + DEBOUNCE_TICKS < next)
        next = s->index.latest + DEBOUNCE_TICKS;
    for (int i = 0; i < BOARD_INPUTS; i++)
        if (s->raw[i] != s->inputs[i] && s->changed[i] + debounce_ticks(i) < next)
            next = s->changed[i] + debounce_ticks(i);
    return next;
}
