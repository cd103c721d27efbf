/* Sweeps at constant angular velocity: cameras fire as positions pass, or record by themselves. */
#include "firmware/core/core_state.h"

#include <math.h>

#define RECORD_AHEAD (BOARD_TICK_HZ / 50) /* a record pulse is queued 20 ms ahead */
#define RETRY_TICKS (BOARD_TICK_HZ / 1000)

static bool video(const struct core *core)
{
    return core->plan.mode == LUMI_PLAN_VIDEO;
}

/* The last shot that is wanted; all after it are done. */
static uint32_t last_shot(const struct core *core)
{
    uint32_t last = core->sweep.end - 1;

    while (last > core->sweep.shot && !sweep_wanted(core, last))
        last--;
    return last;
}

/* From where: far enough before the first exposure to be at speed, to have swung out and taken up the backlash. */
void sweep_plan_continuous(struct core *core)
{
    struct sweep *s = &core->sweep;
    const double run_up = lumi_plan_run_up(&core->plan, &core->rig);
    double first;

    if (video(core)) {
        s->mark = core->plan.first_turn + s->turns_done;
        s->marks_end = core->plan.first_turn + core->plan.turns + 1;
        first = s->mark * core->steps_per_turn;
    } else {
        first = sweep_position(core, s->shot);
        s->mark = (int)ceil(first / core->steps_per_turn - 1e-9);
        s->marks_end = core->plan.first_turn + core->plan.turns;
    }
    s->start = (int64_t)floor(first - run_up * core->steps_per_turn) - 1;
}

/* The first shots' lines may have to go up before the first step. */
static bool set_off(struct core *core)
{
    struct sweep *s = &core->sweep;
    const struct motion_limits limits = sweep_limits(core);
    const double last = video(core) ? (s->marks_end - 1) * core->steps_per_turn : sweep_position(core, last_shot(core));
    const double end = last + lumi_plan_run_down(&core->plan, &core->rig) * core->steps_per_turn;
    const uint64_t lead = video(core) ? 0 : firing_lead(&core->firing, 0);

    if (!core_move(core, (int64_t)ceil(end), &limits, core->now + CORE_START_TICKS + lead))
        return false;
    s->until = BOARD_NEVER; /* under way */
    return true;
}

/* Queues the shots whose time has come near. */
static void feed(struct core *core)
{
    struct sweep *s = &core->sweep;
    const uint64_t lead = firing_lead(&core->firing, 0) + SWEEP_AHEAD;

    if (core->now < s->feed_at) {
        sweep_wake(core, s->feed_at);
        return;
    }
    for (sweep_skip(core); s->shot < s->end; s->shot++, sweep_skip(core)) {
        const double position = sweep_position(core, s->shot);
        uint64_t middle = motion_time_of(&core->motion, position);
        if (middle == BOARD_NEVER) {
            if (motion_halted(&core->motion))
                return; /* an interrupt came since the faults were looked at: what has not begun stays planned */
            firing_lose(&core->firing, s->shot, 0, core->now, position);
            continue;
        }
        if (middle > core->now + lead) {
            s->feed_at = middle - lead;
            break;
        }
        if (!firing_shoot(&core->firing, s->shot, 0, middle, position)) {
            s->feed_at = core->now + RETRY_TICKS;
            break;
        }
    }
    if (s->shot < s->end)
        sweep_wake(core, s->feed_at);
}

/* Turn marks as they are passed: a poll late at most. */
static void pass_marks(struct core *core)
{
    struct sweep *s = &core->sweep;

    while (s->mark < s->marks_end) {
        if (s->mark_at == 0)
            s->mark_at = motion_time_of(&core->motion, s->mark * core->steps_per_turn);
        if (s->mark_at > core->now) {
            sweep_wake(core, s->mark_at);
            return;
        }
        if (video(core)) {
            lamp_send(&core->lamp, (unsigned)s->mark, core->now, core->rig.control.video.lamp_bit);
            s->turns_done = s->mark - core->plan.first_turn;
        }
        sweep_mark(core, s->mark_at);
        s->mark_at = 0;
    }
}

static bool all_passed(const struct core *core)
{
    const struct sweep *s = &core->sweep;

    return video(core) ? s->mark == s->marks_end : s->shot == s->end && !firing_busy_now(&core->firing);
}

static void poll_run(struct core *core)
{
    struct sweep *s = &core->sweep;

    if (motion_moving(&core->motion))
        pass_marks(core);
    if (s->intent != SWEEP_TO_REST && !video(core))
        feed(core);
    if (s->intent == SWEEP_TO_ROW_END && all_passed(core))
        s->intent = SWEEP_TO_REST;
    if (s->intent == SWEEP_TO_REST && !s->stopping && !firing_busy_now(&core->firing)) {
        motion_stop(&core->motion);
        s->stopping = true;
        s->mark_at = 0; /* may not be passed any more */
    }
    if (motion_moving(&core->motion)) {
        sweep_wake(core, motion_end(&core->motion));
        return;
    }
    if (firing_busy_now(&core->firing) || (s->intent != SWEEP_TO_REST && s->shot < s->end))
        return; /* firing_poll wakes us, or the feed does */
    if (video(core)) {
        s->phase = SWEEP_UNRECORD;
        s->until = 0;
        sweep_wake(core, core->now);
        return;
    }
    sweep_done(core);
}

/* Cameras that must hear a pulse to stop get it once the rig is at rest and the lamp's last code is out. */
static void poll_unrecord(struct core *core)
{
    struct sweep *s = &core->sweep;

    if (core->lamp.next != 0 && s->intent == SWEEP_GO) {
        sweep_wake(core, lamp_next_poll(&core->lamp));
        return;
    }
    lamp_off(&core->lamp);
    if (firing_busy_now(&core->firing)) {
        sweep_wake(core, core->now + RETRY_TICKS);
        return;
    }
    if (core->safety.standing == 0)
        firing_release(&core->firing); /* stopped at once by the host, and nothing to clear that would do it */
    if (firing_recording(&core->firing) && core->firing.gate != GATE_OFF &&
        firing_record(&core->firing, &core->rig, core->plan.cameras, false, core->now + RECORD_AHEAD))
        sweep_wake(core, core->now + RETRY_TICKS);
    else
        sweep_done(core);
}

static void poll_record(struct core *core)
{
    struct sweep *s = &core->sweep;

    if (s->intent != SWEEP_GO) {
        s->phase = SWEEP_UNRECORD;
        sweep_wake(core, core->now);
        return;
    }
    if (s->until == 0) {
        s->until = core->now + CORE_SECONDS(core->rig.control.video.record_lead) + RECORD_AHEAD;
        if (!firing_recording(&core->firing))
            firing_record(&core->firing, &core->rig, core->plan.cameras, true, core->now + RECORD_AHEAD);
    }
    if (core->now < s->until) {
        sweep_wake(core, s->until);
        return;
    }
    s->phase = SWEEP_RUN;
    sweep_wake(core, core->now);
}

void sweep_poll_continuous(struct core *core)
{
    struct sweep *s = &core->sweep;

    switch (s->phase) {
    case SWEEP_RECORD:
        poll_record(core);
        break;
    case SWEEP_UNRECORD:
        poll_unrecord(core);
        break;
    default:
        if (s->until != BOARD_NEVER && s->intent == SWEEP_GO && !set_off(core))
            return;
        poll_run(core);
    }
}
