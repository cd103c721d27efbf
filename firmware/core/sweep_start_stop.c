/* Sweeps that stand at every position: move, settle, bracket, next. And a bracket where an external drive stands. */
#include "firmware/core/core_state.h"

#include <math.h>

#define RETRY_TICKS (BOARD_TICK_HZ / 1000)

static int64_t stand(const struct core *core, uint32_t shot)
{
    return lumi_plan_position_step(&core->plan, &core->rig, (int)(shot / (uint32_t)core->plan.bracket));
}

static uint64_t settle_ticks(const struct core *core)
{
    return CORE_SECONDS(lumi_plan_settle(&core->plan, &core->rig));
}

/* The first position is approached in the sweep's direction, from as far as the backlash takes. */
void sweep_plan_start_stop(struct core *core)
{
    struct sweep *s = &core->sweep;
    const struct lumi_plan *plan = &core->plan;
    const double backlash = core->rig.control.motion.backlash * core->steps_per_turn / (2 * LUMI_PI);

    s->start = stand(core, s->shot) - (int64_t)ceil(backlash) - 1;
    s->period = CORE_SECONDS(lumi_plan_position_seconds(plan));
    s->mark = (int)ceil(sweep_position(core, s->shot) / core->steps_per_turn - 1e-9);
    s->marks_end = plan->first_turn + plan->turns;
}

/* The shots of the position that `shot` is one of: group_first .. group_end − 1. */
static void take_group(struct core *core)
{
    struct sweep *s = &core->sweep;
    const uint32_t bracket = (uint32_t)core->plan.bracket;
    const uint32_t end = (s->shot / bracket + 1) * bracket;

    s->group_first = s->shot;
    s->group_end = end < s->end ? end : s->end;
    s->phase = SWEEP_SHOOT;
    sweep_wake(core, core->now);
}

/* The earliest middle of exposure `to`: settled, and every camera ready after the exposure before. */
static uint64_t next_middle(const struct core *core, int to)
{
    const struct sweep *s = &core->sweep;
    uint64_t middle = s->ready_at + firing_half(&core->firing, to);

    if (s->exposure >= 0) {
        uint64_t spaced =
            s->middle + firing_spacing(&core->firing, s->exposure, to, CORE_SECONDS(core->plan.bracket_gap));
        middle = spaced > middle ? spaced : middle;
    }
    return middle;
}

/* Queues what is left of this position's bracket; true when all of it is queued. */
static bool shoot(struct core *core)
{
    struct sweep *s = &core->sweep;

    while (s->shot < s->group_end) {
        if (!sweep_wanted(core, s->shot)) {
            s->shot++;
            continue;
        }
        int exposure = (int)(s->shot % (uint32_t)core->plan.bracket);
        uint64_t middle = next_middle(core, exposure);
        uint64_t soonest = core->now + firing_lead(&core->firing, exposure);
        middle = middle > soonest ? middle : soonest;
        if (middle > soonest + SWEEP_AHEAD) {
            sweep_wake(core, middle - (soonest - core->now) - SWEEP_AHEAD);
            return false;
        }
        if (!firing_shoot(&core->firing, s->shot, exposure, middle, sweep_position(core, s->shot))) {
            sweep_wake(core, core->now + RETRY_TICKS);
            return false;
        }
        s->middle = middle;
        s->exposure = exposure;
        s->shot++;
    }
    return true;
}

/* When the last exposure that was queued is over. */
static uint64_t exposed(const struct core *core)
{
    const struct sweep *s = &core->sweep;

    return s->exposure < 0 ? 0 : s->middle + firing_half(&core->firing, s->exposure) + 1;
}

/* Sets off to the next position that wants a shot. */
static void move(struct core *core)
{
    struct sweep *s = &core->sweep;

    sweep_skip(core);
    if (s->shot >= s->end || s->intent == SWEEP_TO_REST) {
        if (!firing_busy_now(&core->firing)) /* firing_poll wakes us */
            sweep_done(core);
        return;
    }
    /* Not before the last exposure's end, and not before its time; what is late becomes the new beat. */
    const int64_t target = stand(core, s->shot);
    const uint64_t soonest = core->now + CORE_START_TICKS, over = exposed(core);
    uint64_t at = over > soonest ? over : soonest;
    if (s->cycle < at)
        s->cycle = at;
    at = s->cycle;
    if (at > soonest + CORE_START_TICKS) {
        sweep_wake(core, at - CORE_START_TICKS);
        return;
    }
    const struct motion_limits limits = sweep_limits(core);
    if (motion_position(&core->motion) != target) {
        if (!core_move(core, target, &limits, at))
            return;
        s->ready_at = motion_end(&core->motion);
        if (s->ready_at == BOARD_NEVER)
            return; /* halted by an interrupt just now */
        s->ready_at += settle_ticks(core);
    } else {
        s->ready_at = at + settle_ticks(core);
    }
    s->cycle += s->period;
    take_group(core);
    if (s->mark < s->marks_end && target >= llround(s->mark * core->steps_per_turn))
        sweep_mark(core, core->now);
}

/* A shot of the position's bracket has begun or is done: the rest belongs to it, and so does the way that is left to
 * the position (a focus line may go up before it is reached). Not where the position is lost. */
static bool bracket_begun(const struct core *core)
{
    const struct sweep *s = &core->sweep;

    if (core->firing.gate != GATE_OPEN || s->shot <= s->group_first || !motion_known(&core->motion))
        return false;
    return firing_begun(&core->firing, s->group_first) ||
           (!motion_moving(&core->motion) && firing_state(&core->firing, s->group_first) != SHOT_PLANNED);
}

static void poll_shoot(struct core *core)
{
    struct sweep *s = &core->sweep;

    if (s->intent == SWEEP_TO_REST && !bracket_begun(core)) {
        if (core->firing.gate == GATE_OPEN)
            firing_stop(&core->firing, true);
        if (motion_moving(&core->motion)) {
            motion_stop(&core->motion);
            sweep_wake(core, motion_end(&core->motion));
        } else if (!firing_busy_now(&core->firing)) {
            sweep_done(core);
        }
        return;
    }
    if (!shoot(core))
        return;
    if (motion_moving(&core->motion)) {
        sweep_wake(core, motion_end(&core->motion));
        return;
    }
    /* The next move is planned just before the last exposure is over. */
    if (s->external || s->intent == SWEEP_TO_REST) {
        if (!firing_busy_now(&core->firing))
            sweep_done(core);
    } else if (core->now + CORE_START_TICKS < exposed(core)) {
        sweep_wake(core, exposed(core) - CORE_START_TICKS);
    } else {
        s->phase = SWEEP_MOVE;
        move(core);
    }
}

/* The drive says where it stands; should it leave while cameras expose, their shots are lost. */
static void poll_external(struct core *core)
{
    struct sweep *s = &core->sweep;
    const bool reached = core->safety.inputs[BOARD_IN_REACHED];

    if (s->phase == SWEEP_SHOOT) {
        if (!reached && s->intent == SWEEP_GO && firing_busy_now(&core->firing)) {
            core_report_note(core, "the drive left its position while cameras exposed");
            sweep_break(core, lumi_wire_SweepEnded_How_FAULTED);
        }
        poll_shoot(core);
    } else if (s->intent == SWEEP_TO_REST) {
        sweep_done(core);
    } else if (reached && core->safety.raw[BOARD_IN_REACHED]) {
        s->ready_at = core->now + settle_ticks(core);
        take_group(core);
    } else if (core->now >= s->until) {
        core_report_note(core, "the drive did not reach its position in time");
        s->how = lumi_wire_SweepEnded_How_FAULTED;
        sweep_done(core);
    } else {
        sweep_wake(core, s->until);
    }
}

const char *sweep_fire_here(struct core *core, uint32_t first_shot, double timeout)
{
    struct sweep *s = &core->sweep;
    const uint32_t shots = (uint32_t)lumi_plan_shots(&core->plan);

    if (first_shot >= shots || first_shot % (uint32_t)core->plan.bracket != 0)
        return "no position of the plan begins with this shot";
    if (!(timeout >= 0 && timeout <= 3600))
        return "the time to wait is out of range";
    const uint32_t end = first_shot + (uint32_t)core->plan.bracket;
    uint32_t shot = first_shot; /* what has been fired of it stays: MarkShots plans it again */
    while (shot < end && firing_state(&core->firing, shot) == SHOT_FIRED)
        shot++;
    if (shot == end)
        return "every shot of this position has been fired";
    firing_begin(&core->firing, &core->rig, &core->plan);
    for (uint32_t i = shot; i < end; i++)
        if (firing_state(&core->firing, i) == SHOT_LOST)
            firing_plan_again(&core->firing, i, 1);
    *s = (struct sweep){.active = true, .external = true, .phase = SWEEP_REACH, .exposure = -1, .shot = shot};
    s->end = end;
    s->how = lumi_wire_SweepEnded_How_COMPLETE;
    s->until = core->now + CORE_SECONDS(timeout);
    motion_set_position(&core->motion, stand(core, first_shot));
    return NULL;
}

void sweep_poll_start_stop(struct core *core)
{
    if (core->sweep.external)
        poll_external(core);
    else if (core->sweep.phase == SWEEP_SHOOT)
        poll_shoot(core);
    else
        move(core);
}
