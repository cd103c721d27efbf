/* The board's main loop, its start, and what runs in its interrupts. */
#include "firmware/core/core_state.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <string.h>

#define IDLE_TICKS (BOARD_TICK_HZ / 50) /* a main loop comes round at least every 20 ms: inputs are looked at */

size_t core_size(void)
{
    return sizeof(struct core);
}

double core_pitch(const struct core *core, double step)
{
    return core->has_profile ? lumi_rig_drop(&core->rig, step / core->steps_per_turn) : 0;
}

struct motion_limits core_limits(const struct core *core, double speed)
{
    const struct lumi_rig_motion *m = &core->rig.control.motion;
    const double steps = core->steps_per_turn / (2 * LUMI_PI);

    return (struct motion_limits){fmin(speed, m->speed_max) * steps, m->acceleration_max * steps, m->jerk_max * steps};
}

bool core_move(struct core *core, int64_t target, const struct motion_limits *limits, uint64_t at)
{
    uint32_t standing = core->safety.standing;

    if (core->sweep.active && core->sweep.intent == SWEEP_TO_ROW_END)
        standing &= ~(1u << LUMI_RIG_FAULT_HOST_LOST); /* its reaction is to go on */
    if (standing != 0 || motion_halted(&core->motion))
        return false;
    core->safety.marked.active = false; /* it may turn the other way */
    if (motion_start(&core->motion, target, limits, at))
        return true;
    safety_raise(core, LUMI_RIG_FAULT_INTERNAL, "a move could not begin");
    return false;
}

bool core_external(const struct core *core)
{
    return core->has_profile && core->rig.control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL;
}

void core_state_event(struct core *core, enum state_event event)
{
    const lumi_wire_State from = core->state;
    const unsigned next = state_next(from, event);

    if (next == STATE_STAY)
        return;
    if (next >= STATES || next == STATE_MISSING) {
        safety_raise(core, LUMI_RIG_FAULT_INTERNAL, "an event that its state cannot have");
        return;
    }
    core->state = (lumi_wire_State)next;
    if (core->state != from)
        core_report_state(core, from, core->state);
}

void core_rest(struct core *core)
{
    /* Marks or turns that did not come as they should, a motor that may have been without current: wherever the
     * platform is, it is not where its steps say. */
    if (core->safety.standing &
        (1u << LUMI_RIG_FAULT_INDEX_MISSED | 1u << LUMI_RIG_FAULT_INDEX_EARLY | 1u << LUMI_RIG_FAULT_OVERSPEED |
         1u << LUMI_RIG_FAULT_DRIVER | 1u << LUMI_RIG_FAULT_SUPPLY))
        motion_forget(&core->motion);
    const bool known = motion_known(&core->motion);

    firing_poll(&core->firing); /* what was broken off is told first */
    core->begun = false;
    if (core->homing_asked) {
        core->homing_asked = false;
        core_report_homed(core, false, "stopped before the mark was found");
    }
    if (core->sweep.active) {
        core->sweep.active = false;
        lamp_off(&core->lamp);
        core_report_ended(core, core->sweep.how);
    }
    if (core->safety.standing != 0)
        core_state_event(core, known ? EVENT_FAULT_KNOWN : EVENT_FAULT_LOST);
    else
        core_state_event(core, known ? EVENT_REST_KNOWN : EVENT_REST_LOST);
    if (core->safety.standing == 0 && !core->safety.estop_seen)
        sweep_unrecord(core); /* the pulse that was owed may have been dropped by a stop */
}

void core_stop_soon(struct core *core, bool finish)
{
    if (core->sweep.active) {
        lumi_wire_SweepEnded_How how = core->safety.standing & 1u << LUMI_RIG_FAULT_HOST_LOST
                                           ? lumi_wire_SweepEnded_How_HOST_LOST
                                           : lumi_wire_SweepEnded_How_FAULTED;
        if (finish)
            sweep_finish(core, how);
        else
            sweep_break(core, how);
        return;
    }
    if (homing_active(&core->homing))
        homing_cancel(&core->homing);
    motion_stop(&core->motion);
    firing_stop(&core->firing, finish);
}

/* What home, jog and tests come to, and the end of whatever was stopped. */
static void poll_activity(struct core *core)
{
    const char *reason = "";

    if (core_external(core) && motion_known(&core->motion) && core->safety.standing == 0)
        drop_string_ready(core); /* the host may move the drive whenever it likes */
    switch (core->state) {
    case lumi_wire_State_HOMING:
        if (!core->begun) {
            if (drop_string_ready(core)) {
                core->begun = true;
                homing_start(&core->homing, &core->motion, &core->rig, core->home_goal, core->home_turn);
            }
            return;
        }
        switch (homing_poll(&core->homing, &reason)) {
        case HOMING_RUNNING:
            return;
        case HOMING_DONE:
        case HOMING_FAILED:
            core->homing_asked = false;
            core_report_homed(core, motion_known(&core->motion), motion_known(&core->motion) ? "" : reason);
            core_rest(core);
        }
        return;
    case lumi_wire_State_JOGGING:
        if (!core->begun && drop_string_ready(core))
            core->begun = core_move(core, core->jog_target, &core->jog_limits, core->now + CORE_START_TICKS);
        else if (core->begun && !motion_moving(&core->motion))
            core_rest(core);
        return;
    case lumi_wire_State_TESTING:
        if (!firing_busy_now(&core->firing))
            core_rest(core);
        return;
    case lumi_wire_State_STOPPING:
        if (homing_active(&core->homing))
            homing_poll(&core->homing, &reason);
        if (!core->sweep.active && !motion_moving(&core->motion) && !homing_active(&core->homing) &&
            !firing_busy_now(&core->firing))
            core_rest(core);
        return;
    default:
        return;
    }
}

static void poll_links(struct core *core)
{
    const struct board *board = core->board;
    uint8_t data[64];

    for (int link = 0; link < BOARD_LINKS; link++) {
        size_t size, left = 1024; /* a flood must not keep the rest waiting */
        while (left > 0 && (size = board->link_read(board->port, (enum board_link)link, data, sizeof data)) > 0) {
            lumi_wire_server_receive(&core->server, link, data, size, core_ns(core->now));
            left = size < left ? left - size : 0;
        }
    }
    lumi_wire_server_poll(&core->server, core_ns(core->now));
}

static bool send_frame(void *context, int link, const uint8_t *frame, size_t size)
{
    struct core *core = context;

    return core->board->link_write(core->board->port, (enum board_link)link, frame, size) == size;
}

static void emergency_stop(void *context)
{
    struct core *core = context;

    core->safety.estop_seen = true;
    motion_halt(&core->motion);
    safety_poll(core);
}

static void heartbeat(void *context)
{
    safety_heartbeat(context);
}

void core_load_profile(struct core *core)
{
    core->uploaded = 0;
    core->has_plan = false;
    core->plan_crc = 0;
    core->has_profile =
        profile_store_load(core->board, &core->store, &core->rig, &core->profile, &core->error) == LUMI_OK;
    if (!core->has_profile) {
        core->profile = (struct profile_store_copy){.slot = -1};
        if (core->error.code != LUMI_ERR_NOTFOUND)
            core_report_note(core, core->error.text);
    } else {
        const struct lumi_rig_motion *m = &core->rig.control.motion;
        core->steps_per_turn = lumi_rig_steps_per_turn(&core->rig);
        motion_set_driver(&core->motion, m->step_pulse, m->direction_setup);
        drop_string_configure(core);
    }
    motion_forget(&core->motion);
    core_state_event(core, core->has_profile ? EVENT_PROFILE : EVENT_NO_PROFILE);
}

void core_init(struct core *core, const struct board *board)
{
    static const struct lumi_wire_server_ops ops = {.execute = core_execute,
                                                    .status = core_status,
                                                    .emergency_stop = emergency_stop,
                                                    .heartbeat = heartbeat,
                                                    .send = send_frame};
    lumi_wire_Welcome identity = lumi_wire_Welcome_init_zero;

    memset(core, 0, sizeof *core);
    core->board = board;
    core->now = board->now(board->port);
    core->state = lumi_wire_State_BOOT;
    strncpy(identity.board, board->name, sizeof identity.board - 1);
    strncpy(identity.firmware, LUMI_VERSION, sizeof identity.firmware - 1);
    identity.boot = board->boot_number(board->port);
    identity.unique_id.size = BOARD_UNIQUE_ID;
    board->unique_id(board->port, identity.unique_id.bytes);
    motion_init(&core->motion, board);
    homing_init(&core->homing, board);
    drop_string_init(core);
    firing_init(&core->firing, board, core->edges, core_report_shot, core_report_feedback, core);
    lamp_init(&core->lamp, board);
    lamp_off(&core->lamp);
    lumi_wire_server_init(&core->server, &ops, core, &identity);
    core_report_started(core);
    core_load_profile(core);
    safety_init(core);
    if (board->reset_cause(board->port) == BOARD_RESET_WATCHDOG)
        safety_raise(core, LUMI_RIG_FAULT_WATCHDOG, "the watchdog started the board anew");
}

void core_poll(struct core *core)
{
    core->now = core->board->now(core->board->port);
    core->board->watchdog_kick(core->board->port);
    poll_links(core);
    safety_poll(core);
    motion_poll(&core->motion);
    firing_poll(&core->firing);
    sweep_poll(core);
    poll_activity(core);
    lamp_poll(&core->lamp);
    drop_string_poll(core);
    motion_poll(&core->motion);
    bool well = core->has_profile && core->safety.standing == 0;
    if (well != core->lit) {
        core->lit = well;
        core->board->output(core->board->port, BOARD_OUT_STATUS, well);
    }
}

static uint64_t sooner(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

uint64_t core_next_poll(const struct core *core)
{
    uint64_t next = core->now + IDLE_TICKS;
    uint64_t wire = lumi_wire_server_next_poll(&core->server, core_ns(core->now));

    if (wire <= core_ns(core->now))
        next = core->now + BOARD_TICK_HZ / 1000; /* something waits for room on a link */
    else if (wire != UINT64_MAX)
        next = sooner(next, wire / 250 * 21 + 21);
    next = sooner(next, motion_next_poll(&core->motion));
    next = sooner(next, firing_next_poll(&core->firing));
    next = sooner(next, lamp_next_poll(&core->lamp));
    next = sooner(next, safety_next_poll(core));
    next = sooner(next, sweep_next_poll(core));
    next = sooner(next, drop_string_next_poll(core));
    return sooner(next, homing_next_poll(&core->homing));
}

uint32_t core_on_step(struct core *core, uint64_t at)
{
    return motion_on_step(&core->motion, at);
}

void core_on_trigger(struct core *core, uint64_t at)
{
    firing_on_trigger(&core->firing, at);
}

void core_on_input(struct core *core, enum board_input input, bool active, uint64_t at)
{
    safety_on_input(core, input, active, at);
    homing_on_input(&core->homing, input, active, at);
}

void core_on_feedback(struct core *core, int input, bool active, uint64_t at)
{
    firing_on_feedback(&core->firing, input, active, at);
}
