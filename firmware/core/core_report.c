/* What the board tells: events, and its status. */
#include "firmware/core/core_state.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <string.h>

/* 84 ticks are 1000 ns. */
uint64_t core_ns(uint64_t ticks)
{
    return ticks / 21 * 250 + ticks % 21 * 250 / 21;
}

static int64_t signed_ns(int64_t ticks)
{
    return ticks * 250 / 21;
}

static void copy_text(char *to, size_t size, const char *text)
{
    strncpy(to, text, size - 1);
    to[size - 1] = 0;
}

/* The event to fill in, at tick `at`. */
static lumi_wire_Event *make(struct core *core, pb_size_t kind, uint64_t at)
{
    memset(&core->event, 0, sizeof core->event);
    core->event.time_ns = core_ns(at);
    core->event.which_kind = kind;
    return &core->event;
}

static uint64_t now_of(const struct core *core)
{
    return core->board->now(core->board->port);
}

static void tell(struct core *core)
{
    lumi_wire_server_event(&core->server, &core->event);
}

void core_report_started(struct core *core)
{
    static const lumi_wire_Started_Cause causes[] = {
        [BOARD_RESET_POWER] = lumi_wire_Started_Cause_POWER,
        [BOARD_RESET_PIN] = lumi_wire_Started_Cause_PIN,
        [BOARD_RESET_SOFTWARE] = lumi_wire_Started_Cause_SOFTWARE,
        [BOARD_RESET_WATCHDOG] = lumi_wire_Started_Cause_WATCHDOG,
    };
    make(core, lumi_wire_Event_started_tag, now_of(core))->kind.started.cause =
        causes[core->board->reset_cause(core->board->port)];
    tell(core);
}

void core_report_state(struct core *core, lumi_wire_State from, lumi_wire_State to)
{
    lumi_wire_Event *event = make(core, lumi_wire_Event_state_changed_tag, now_of(core));

    event->kind.state_changed.from = from;
    event->kind.state_changed.to = to;
    tell(core);
}

void core_report_shot(void *context, const struct shot_record *record)
{
    struct core *core = context;
    lumi_wire_Shot *shot = &make(core, lumi_wire_Event_shot_tag, now_of(core))->kind.shot;

    shot->number = record->number;
    shot->lost = record->state == SHOT_LOST;
    shot->channels = record->lines;
    shot->step = record->position;
    shot->turn = record->position > 0 ? (uint32_t)(record->position / core->steps_per_turn + 1e-9) : 0;
    shot->pitch = core_pitch(core, record->position);
    shot->middle_ns = core_ns(record->middle);
    shot->bracket = (uint32_t)record->exposure;
    for (int line = 0; line < LUMI_RIG_CHANNELS; line++)
        if (record->lines >> line & 1)
            shot->edge_ns[shot->edge_ns_count++] = signed_ns(record->edge[line]);
    tell(core);
}

void core_report_feedback(void *context, int input, bool active, uint64_t at, uint32_t shot)
{
    struct core *core = context;
    lumi_wire_Feedback *feedback = &make(core, lumi_wire_Event_feedback_tag, at)->kind.feedback;

    feedback->input = (uint32_t)input;
    feedback->rising = active;
    feedback->shot = shot;
    feedback->edge_ns = core_ns(at);
    tell(core);
}

void core_report_turn(struct core *core, int turn, int64_t step, uint64_t at)
{
    lumi_wire_TurnMark *mark = &make(core, lumi_wire_Event_turn_mark_tag, at)->kind.turn_mark;

    mark->turn = (uint32_t)turn;
    mark->step = step;
    mark->pitch = core_pitch(core, (double)step);
    tell(core);
}

void core_report_fault(struct core *core, int fault, bool set, const char *text)
{
    lumi_wire_Fault *f = &make(core, lumi_wire_Event_fault_tag, now_of(core))->kind.fault;

    f->fault = (uint32_t)fault;
    f->set = set;
    f->step = motion_position(&core->motion);
    f->position_known = motion_known(&core->motion);
    copy_text(f->text, sizeof f->text, text);
    tell(core);
}

void core_report_homed(struct core *core, bool found, const char *text)
{
    lumi_wire_Homed *homed = &make(core, lumi_wire_Event_homed_tag, now_of(core))->kind.homed;

    homed->found = found;
    homed->step = motion_position(&core->motion);
    homed->turn_known = found;
    copy_text(homed->text, sizeof homed->text, text);
    tell(core);
}

void core_report_ended(struct core *core, lumi_wire_SweepEnded_How how)
{
    lumi_wire_SweepEnded *ended = &make(core, lumi_wire_Event_sweep_ended_tag, now_of(core))->kind.sweep_ended;

    ended->how = how;
    ended->next_shot = sweep_next_shot(core);
    firing_count(&core->firing, &ended->fired, &ended->lost);
    tell(core);
}

void core_report_note(struct core *core, const char *text)
{
    lumi_wire_Note *note = &make(core, lumi_wire_Event_note_tag, now_of(core))->kind.note;

    copy_text(note->text, sizeof note->text, text);
    tell(core);
}

void core_status(void *context, lumi_wire_Status *status)
{
    struct core *core = context;
    const double speed = motion_speed(&core->motion, core->now);

    status->state = core->state;
    status->faults = core->safety.standing;
    status->position_known = motion_known(&core->motion);
    status->turn_known = status->position_known;
    status->step = motion_position(&core->motion);
    for (int i = 0; i < BOARD_INPUTS; i++)
        status->inputs |= (uint32_t)core->safety.inputs[i] << i;
    status->supply_mv = core->safety.supply_mv > 0 ? (uint32_t)core->safety.supply_mv : 0;
    status->brake_open = core->string.open;
    status->enabled = core->string.enabled;
    firing_count(&core->firing, &status->shots_fired, &status->shots_lost);
    if (core->has_profile) {
        status->profile_crc = core->profile.crc;
        status->pitch = core_pitch(core, (double)status->step);
        status->speed = speed / core->steps_per_turn * (2 * LUMI_PI);
    }
    if (core->has_plan) {
        status->plan_crc = core->plan_crc;
        status->next_shot = sweep_next_shot(core);
    }
}
