/* Sweeps: beginning, winding, ending. */
#include "firmware/core/core_state.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>

double sweep_position(const struct core *core, uint32_t shot)
{
    const struct lumi_plan *plan = &core->plan;
    const uint32_t group = shot / (uint32_t)plan->bracket;

    return core->steps_per_turn * ((double)plan->first_turn * plan->positions + group) / plan->positions;
}

bool sweep_wanted(const struct core *core, uint32_t shot)
{
    return firing_state(&core->firing, shot) == SHOT_PLANNED && !firing_pending(&core->firing, shot);
}

void sweep_skip(struct core *core)
{
    struct sweep *s = &core->sweep;

    while (s->shot < s->end && !sweep_wanted(core, s->shot))
        s->shot++;
}

uint32_t sweep_next_shot(struct core *core)
{
    const uint32_t shots = core->has_plan ? (uint32_t)lumi_plan_shots(&core->plan) : 0;
    const uint32_t next = firing_next_planned(&core->firing);

    return next < shots ? next : shots;
}

void sweep_wake(struct core *core, uint64_t at)
{
    if (at < core->sweep.wake)
        core->sweep.wake = at;
}

struct motion_limits sweep_limits(const struct core *core)
{
    const struct lumi_rig_motion *m = &core->rig.control.motion;
    struct motion_limits limits = core_limits(core, m->speed_max);

    if (core->plan.mode != LUMI_PLAN_START_STOP)
        limits.speed = core->steps_per_turn / core->plan.turn_time;
    return limits;
}

void sweep_done(struct core *core)
{
    core->sweep.phase = SWEEP_NONE;
    core_rest(core);
}

/* Where it winds to: video by turns, the others by the first shot. */
static void plan_way(struct core *core)
{
    struct sweep *s = &core->sweep;
    const struct lumi_plan *plan = &core->plan;

    s->per_position = core->steps_per_turn / plan->positions;
    if (plan->mode == LUMI_PLAN_START_STOP)
        sweep_plan_start_stop(core);
    else
        sweep_plan_continuous(core);
}

/* The shots of this sweep, by what the host asked for: which is the first. */
static const char *choose_shots(struct core *core, uint32_t first, bool only_missing)
{
    struct sweep *s = &core->sweep;
    const uint32_t shots = (uint32_t)lumi_plan_shots(&core->plan);

    s->only_missing = only_missing;
    s->shot = first;
    s->end = shots;
    if (core->plan.mode == LUMI_PLAN_VIDEO) {
        if (!only_missing)
            s->turns_done = 0;
        s->turns_done = s->turns_done < core->plan.turns ? s->turns_done : 0;
        return NULL;
    }
    if (first >= shots)
        return "there is no such shot in the plan";
    while (only_missing && s->shot < shots && firing_state(&core->firing, s->shot) == SHOT_FIRED)
        s->shot++;
    if (s->shot == shots)
        return "every shot has been fired";
    return NULL;
}

/* What is lost, or all of it, is planned again. Only once nothing refuses the sweep any more. */
static void plan_shots(struct core *core, uint32_t first)
{
    const struct sweep *s = &core->sweep;

    for (uint32_t i = first; i < s->end; i++)
        if (!s->only_missing || firing_state(&core->firing, i) == SHOT_LOST)
            firing_plan_again(&core->firing, i, 1);
}

static const char *check_wind(const struct core *core)
{
    const struct sweep *s = &core->sweep;
    const double away = (double)(motion_position(&core->motion) - s->start);

    if (core->plan.wind == LUMI_PLAN_WIND_NONE && fabs(away) > core->steps_per_turn)
        return "the plan does not wind, and the arm is in another turn than it begins with";
    if (core->safety.inputs[BOARD_IN_SLACK] && core->rig.control.safety.slack_fitted && away < 0)
        return "the string hangs loose";
    return NULL;
}

const char *sweep_begin(struct core *core, uint32_t first_shot, bool only_missing)
{
    struct sweep *s = &core->sweep;
    const int turns_done = s->turns_done;
    const char *why;

    *s = (struct sweep){.turns_done = turns_done, .wake = BOARD_NEVER, .exposure = -1};
    why = choose_shots(core, first_shot, only_missing);
    if (why)
        return why;
    plan_way(core);
    why = check_wind(core);
    if (why)
        return why;
    firing_begin(&core->firing, &core->rig, &core->plan);
    plan_shots(core, first_shot);
    s->phase = SWEEP_WIND;
    s->full_wound = core->plan.wind != LUMI_PLAN_WIND_FULL || first_shot > 0 || only_missing;
    s->how = lumi_wire_SweepEnded_How_COMPLETE;
    s->active = true;
    s->wake = 0;
    return NULL;
}

/* One leg after the other; all of them end at `start`. */
static void poll_wind(struct core *core)
{
    struct sweep *s = &core->sweep;
    const struct lumi_rig_motion *m = &core->rig.control.motion;

    if (motion_moving(&core->motion)) {
        sweep_wake(core, motion_end(&core->motion));
        return;
    }
    if (s->intent != SWEEP_GO) {
        sweep_done(core);
        return;
    }
    /* A record pulse that was owed is still up or to come: one that began meanwhile would be the same to cameras. */
    if (!drop_string_ready(core) || firing_busy_now(&core->firing)) {
        sweep_wake(core, core->now + BOARD_TICK_HZ / 100);
        return;
    }
    /* All the way up: where a sweep from turn 0 would begin. */
    const int64_t up = s->start - llround(core->plan.first_turn * core->steps_per_turn);
    const int64_t target = s->full_wound ? s->start : up;
    const int64_t position = motion_position(&core->motion);
    if (position == target || (!s->full_wound && position < target)) {
        if (s->full_wound) {
            s->phase = core->plan.mode == LUMI_PLAN_VIDEO        ? SWEEP_RECORD
                       : core->plan.mode == LUMI_PLAN_START_STOP ? SWEEP_MOVE
                                                                 : SWEEP_RUN;
            s->until = 0;
            safety_watch_index(core);
            core_state_event(core, EVENT_AT_START);
        }
        s->full_wound = true;
        sweep_wake(core, core->now);
        return;
    }
    struct motion_limits limits = core_limits(core, m->wind_speed);
    core_move(core, target, &limits, core->now + CORE_START_TICKS);
}

void sweep_poll(struct core *core)
{
    struct sweep *s = &core->sweep;

    if (!s->active)
        return;
    s->wake = BOARD_NEVER;
    if (s->phase == SWEEP_WIND)
        poll_wind(core);
    else if (core->plan.mode == LUMI_PLAN_START_STOP)
        sweep_poll_start_stop(core);
    else
        sweep_poll_continuous(core);
}

uint64_t sweep_next_poll(const struct core *core)
{
    return core->sweep.active ? core->sweep.wake : BOARD_NEVER;
}

void sweep_finish(struct core *core, lumi_wire_SweepEnded_How how)
{
    struct sweep *s = &core->sweep;

    s->intent = SWEEP_TO_REST;
    s->how = how;
    s->wake = 0;
    if (s->phase == SWEEP_WIND)
        motion_stop(&core->motion);
    else if (s->phase != SWEEP_SHOOT)
        firing_stop(&core->firing, true);
}

void sweep_break(struct core *core, lumi_wire_SweepEnded_How how)
{
    struct sweep *s = &core->sweep;

    firing_stop(&core->firing, false);
    motion_stop(&core->motion);
    s->intent = SWEEP_TO_REST;
    s->how = how;
    s->stopping = true;
    s->wake = 0;
}

bool sweep_end_with_row(struct core *core)
{
    struct sweep *s = &core->sweep;
    const uint32_t row = (uint32_t)core->plan.positions * (uint32_t)core->plan.bracket;
    uint32_t in = s->phase == SWEEP_SHOOT ? s->group_first : s->shot;

    if (!s->active || s->external || s->intent == SWEEP_TO_REST || core->state != lumi_wire_State_SWEEPING)
        return false;
    s->intent = SWEEP_TO_ROW_END;
    s->how = lumi_wire_SweepEnded_How_HOST_LOST;
    s->wake = 0;
    if (core->plan.mode == LUMI_PLAN_VIDEO) {
        s->marks_end = s->mark + 1 < s->marks_end ? s->mark + 1 : s->marks_end;
        return true;
    }
    /* Where the next row has not begun, this one is at its end. */
    uint32_t end = s->phase != SWEEP_SHOOT && in % row == 0 ? in : (in / row + 1) * row;
    s->end = end < s->end ? end : s->end;
    return true;
}

void sweep_unrecord(struct core *core)
{
    if (firing_busy_now(&core->firing) || !firing_recording(&core->firing))
        return; /* what is queued at rest is that pulse */
    firing_release(&core->firing);
    firing_record(&core->firing, &core->rig, core->plan.cameras, false,
                  core->board->now(core->board->port) + FIRING_MARGIN_TICKS);
}

void sweep_mark(struct core *core, uint64_t at)
{
    struct sweep *s = &core->sweep;

    core_report_turn(core, s->mark, llround(s->mark * core->steps_per_turn), at);
    s->mark++;
}
