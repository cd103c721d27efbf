/* The operator of a rig on a bad day. */
#include "rig_operator.h"

static bool wrong(struct rig_operator *o, const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool wrong(struct rig_operator *o, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    if (!o->why[0])
        vsnprintf(o->why, sizeof o->why, format, arguments);
    va_end(arguments);
    return false;
}

static void read_events(struct rig_operator *o)
{
    int count;
    const struct sim_machine_event *events = sim_machine_events(o->f.machine, &count);

    for (; o->events_read < count; o->events_read++) {
        const lumi_wire_Event *event = &events[o->events_read].event;
        if (event->which_kind == lumi_wire_Event_shot_tag && event->kind.shot.number < OPERATOR_SHOTS &&
            !event->kind.shot.lost)
            o->fired[event->kind.shot.number] = true;
    }
}

static int first_missing(const struct rig_operator *o)
{
    for (int i = 0; i < o->shots; i++)
        if (!o->fired[i])
            return i;
    return o->shots;
}

static bool active(lumi_wire_State state)
{
    return state == lumi_wire_State_HOMING || state == lumi_wire_State_JOGGING || state == lumi_wire_State_WINDING ||
           state == lumi_wire_State_SWEEPING || state == lumi_wire_State_PAUSING || state == lumi_wire_State_STOPPING ||
           state == lumi_wire_State_TESTING;
}

/* One thing at a time, by what the board says of itself. */
static void act(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    lumi_wire_Status s;
    struct lumi_error error = {0};

    if (sim_machine_status(m, &s, &error) != LUMI_OK) {
        sim_machine_run(m, 1);
    } else if (s.state == lumi_wire_State_NO_PROFILE) {
        if (sim_machine_configure(m, &o->f.rig, &error) != LUMI_OK)
            sim_machine_run(m, 1);
    } else if (s.state == lumi_wire_State_SWEEPING || s.state == lumi_wire_State_WINDING) {
        sim_machine_wait_sweep(m, 20, &error);
    } else if (active(s.state)) {
        sim_machine_run(m, 0.5);
    } else if (s.faults) {
        sim_machine_run(m, 0.5); /* somebody walks up and looks */
        if (sim_machine_clear(m, &error) != LUMI_OK)
            snprintf(o->refused, sizeof o->refused, "%s", error.text), sim_machine_run(m, 1);
        else if (o->clear_count < OPERATOR_CLEARS)
            o->clears[o->clear_count++] = sim_machine_now(m);
    } else if (!s.position_known) {
        if (sim_machine_home(m, !o->f.rig.string.held, 0, &error) != LUMI_OK)
            sim_machine_run(m, 1);
    } else if (s.plan_crc != lumi_wire_plan_crc(&o->f.plan)) {
        if (sim_machine_load_plan(m, &o->f.plan, &error) != LUMI_OK)
            sim_machine_run(m, 1);
    } else {
        int from;
        sim_machine_events(m, &from);
        if (o->shots > 0 && first_missing(o) == o->shots) {
            o->complete = true; /* its end was told while nobody listened */
            return;
        }
        int code = sim_machine_start(m, first_missing(o), true, &error);
        if (code == LUMI_ERR_BUSY && !o->f.rig.string.held) {
            sim_machine_home(m, true, 0, &error); /* a string that hangs loose is wound up first */
        } else if (code != LUMI_OK) {
            sim_machine_run(m, 1);
        } else if (sim_machine_wait_sweep(m, 120, &error) == LUMI_OK) {
            const lumi_wire_Event *end = sim_machine_find(m, from, lumi_wire_Event_sweep_ended_tag);
            read_events(o);
            o->complete =
                end->kind.sweep_ended.how == lumi_wire_SweepEnded_How_COMPLETE && first_missing(o) == o->shots;
        }
    }
    read_events(o);
}

bool rig_operator_run(struct rig_operator *o, double patience)
{
    struct sim_machine *m = o->f.machine;
    double until = sim_machine_seconds(m) + patience;

    o->shots = lumi_plan_shots(&o->f.plan);
    while (!o->complete && sim_machine_seconds(m) < until)
        act(o);
    if (!o->complete) {
        struct lumi_error error = {0};
        lumi_wire_Status s = {0};
        sim_machine_status(m, &s, &error);
        return wrong(o, "not complete after %g s: shot %d of %d is missing, state %d, faults 0x%x, %s; clear: %s",
                     patience, first_missing(o), o->shots, (int)s.state, (unsigned)s.faults, error.text, o->refused);
    }
    return true;
}

/* ---- judging ---- */

static int boot_of(const struct sim_machine *m, uint64_t ticks)
{
    int count, boot = 0;
    const uint64_t *starts = sim_machine_start_ticks(m, &count);

    for (int i = 1; i < count && starts[i] <= ticks; i++)
        boot = i;
    return boot;
}

static uint64_t ticks_of(uint64_t ns)
{
    return ns / 1000 * 84 + (ns % 1000 * 84 + 999) / 1000;
}

/* A shot is told of when its last line has fallen. */
#define TOLD_LATER (BOARD_TICK_HZ / 4)

/* When the last event of each boot that was told happened: what came after it is known to nobody. */
static uint64_t told_until(const struct sim_machine *m, int boot)
{
    int count, starts;
    const struct sim_machine_event *events = sim_machine_events(m, &count);
    uint64_t until = 0;

    sim_machine_start_ticks(m, &starts);
    if (boot == starts - 1)
        return UINT64_MAX;
    for (int i = 0; i < count; i++) {
        uint64_t at = ticks_of(events[i].event.time_ns);
        if (boot_of(m, at) == boot && at > until)
            until = at;
    }
    return until;
}

static int camera_of_channel(const struct lumi_rig *rig, int channel)
{
    for (int i = 0; i < rig->camera_count; i++)
        if (rig->control.triggers[i].channel == channel)
            return i;
    return -1;
}

/* Whether something in the script may rightly put a shot where it does not belong: steps that are lost are found at the
 * next mark only, a switch that lies may mislead homing, a camera that lags is late. */
static bool angles_are_sure(const struct rig_operator *o)
{
    for (int i = 0; i < o->script.count; i++) {
        const struct sim_fault *fault = &o->script.faults[i];
        bool input = fault->kind == SIM_FAULT_INPUT || fault->kind == SIM_FAULT_PULSE;
        if (fault->kind == SIM_FAULT_SLIP || fault->kind == SIM_FAULT_CAMERA_LAG ||
            (input && (fault->index == BOARD_IN_INDEX || fault->index == BOARD_IN_WOUND)))
            return false;
    }
    return true;
}

/* Within half a degree, at 36 degrees/s and with what is left of a start's swing: the position was what it was said to
 * be, and on a string the turn too. */
static bool judge_angle(struct rig_operator *o, uint32_t shot, const struct sim_exposure *e)
{
    double position = (double)(shot / (uint32_t)o->f.plan.bracket) / o->f.plan.positions;
    double want = lumi_rig_turn_angle(&o->f.rig, o->f.plan.first_turn + position);

    double error = o->f.rig.string.held ? remainder(e->angle - want, 2 * LUMI_PI) : e->angle - want;

    if (e->lost || !e->done || fabs(error) < 0.5 * DEGREE)
        return true;
    return wrong(o, "shot %u: camera %d is off by %.3f degrees", (unsigned)shot, e->camera, error / DEGREE);
}

/* Finds the record of a trigger edge, and marks it; −1: there is none. */
static int claim(const struct sim_exposure *records, bool *claimed, int count, int camera, uint64_t tick)
{
    for (int i = 0; i < count; i++)
        if (!claimed[i] && records[i].camera == camera && records[i].trigger + 84 >= tick &&
            records[i].trigger <= tick + 84) {
            claimed[i] = true;
            return i;
        }
    return -1;
}

/* Every edge that the board tells of was seen by its camera once; a shot that is told as fired has all its edges; none
 * is told twice as fired by one boot. */
static bool judge_shot(struct rig_operator *o, const lumi_wire_Shot *shot, const struct sim_exposure *records,
                       bool *claimed, int count)
{
    int k = 0;
    uint32_t cameras = 0;

    for (int channel = 0; channel < LUMI_RIG_CHANNELS; channel++) {
        if (!(shot->channels >> channel & 1))
            continue;
        int camera = camera_of_channel(&o->f.rig, channel);
        uint64_t tick = ticks_of(shot->middle_ns + (uint64_t)(int64_t)shot->edge_ns[k++]);
        int record = camera < 0 ? -1 : claim(records, claimed, count, camera, tick);
        if (record < 0)
            return wrong(o, "shot %u: camera %d saw no trigger at %.6f s", (unsigned)shot->number, camera,
                         (double)tick / BOARD_TICK_HZ);
        if (!shot->lost && angles_are_sure(o) && !judge_angle(o, shot->number, &records[record]))
            return false;
        cameras |= 1u << camera;
    }
    if (!shot->lost && cameras != lumi_plan_cameras(&o->f.plan, &o->f.rig))
        return wrong(o, "shot %u is told as fired, but only cameras 0x%x were", (unsigned)shot->number,
                     (unsigned)cameras);
    return true;
}

static bool judge_shots(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    int count, event_count, starts;
    const struct sim_exposure *records = sim_mechanics_exposures(sim_machine_mechanics(m), &count);
    const struct sim_machine_event *events = sim_machine_events(m, &event_count);
    bool *claimed = calloc((size_t)count + 1, sizeof *claimed), good = true;

    sim_machine_start_ticks(m, &starts);
    uint8_t *fired = calloc((size_t)starts * OPERATOR_SHOTS, 1);
    for (int i = 0; i < event_count && good; i++) {
        const lumi_wire_Event *event = &events[i].event;
        if (event->which_kind != lumi_wire_Event_shot_tag)
            continue;
        const lumi_wire_Shot *shot = &event->kind.shot;
        uint8_t *state = &fired[boot_of(m, ticks_of(event->time_ns)) * OPERATOR_SHOTS + (int)shot->number];
        if (!shot->lost && (*state)++)
            good = wrong(o, "shot %u is fired twice", (unsigned)shot->number);
        else
            good = judge_shot(o, shot, records, claimed, count);
    }
    for (int i = 0; i < count && good; i++)
        if (!claimed[i] && records[i].trigger + TOLD_LATER <= told_until(m, boot_of(m, records[i].trigger)))
            good = wrong(o, "camera %d was triggered at %.6f s and nobody tells of it", records[i].camera,
                         (double)records[i].trigger / BOARD_TICK_HZ);
    free(claimed);
    free(fired);
    return good;
}

/* What the board keeps of every shot is what it told in this boot. */
static bool judge_map(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    uint8_t map[OPERATOR_SHOTS] = {0}, told[OPERATOR_SHOTS] = {0};
    struct lumi_error error = {0};
    int count, starts;
    const struct sim_machine_event *events = sim_machine_events(m, &count);

    sim_machine_start_ticks(m, &starts);
    int before = starts;
    bool read = sim_machine_shots(m, map, o->shots, &error) == LUMI_OK;
    sim_machine_start_ticks(m, &starts);
    if (starts != before)
        return true; /* the script's last fault fell just here: the map went with the board's RAM */
    if (!read)
        return wrong(o, "the shots cannot be read: %s", error.text);
    for (int i = 0; i < count; i++) {
        const lumi_wire_Event *event = &events[i].event;
        if (event->which_kind == lumi_wire_Event_shot_tag && boot_of(m, ticks_of(event->time_ns)) == starts - 1)
            told[event->kind.shot.number] = event->kind.shot.lost ? 2 : 1;
    }
    for (int i = 0; i < o->shots; i++)
        if (map[i] != told[i])
            return wrong(o, "shot %d: the board keeps state %d, its events told %d", i, map[i], told[i]);
    return true;
}

static bool judge_estop(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    int edges, steps, starts;
    const uint64_t *edge = sim_machine_estop_ticks(m, &edges), *step = sim_machine_step_ticks(m, &steps);
    const uint64_t *start = sim_machine_start_ticks(m, &starts);

    for (int i = 0; i < edges; i += 2) {
        uint64_t from = edge[i], released = i + 1 < edges ? edge[i + 1] : UINT64_MAX, until = UINT64_MAX;
        for (int k = 0; k < o->clear_count; k++)
            if (o->clears[k] > from && o->clears[k] < until)
                until = o->clears[k];
        /* A restart forgets the fault, but not the switch; nothing moves before it is told to home. */
        for (int k = 0; k < starts; k++)
            if (start[k] > from && start[k] < until)
                until = start[k];
        if (released != UINT64_MAX && released > until)
            until = released;
        for (int k = 0; k < steps; k++)
            if (step[k] > from && step[k] < until)
                return wrong(o, "a step at %.6f s, after the emergency stop at %.6f s", (double)step[k] / BOARD_TICK_HZ,
                             (double)from / BOARD_TICK_HZ);
    }
    return true;
}

/* States in which nothing turns. */
static bool still(lumi_wire_State state)
{
    return state == lumi_wire_State_BOOT || state == lumi_wire_State_NO_PROFILE || state == lumi_wire_State_LOST ||
           state == lumi_wire_State_IDLE || state == lumi_wire_State_PAUSED || state == lumi_wire_State_STOPPED ||
           state == lumi_wire_State_STOPPED_LOST;
}

static bool no_step_between(struct rig_operator *o, uint64_t from, uint64_t to, lumi_wire_State state)
{
    int steps;
    const uint64_t *step = sim_machine_step_ticks(o->f.machine, &steps);
    int low = 0, high = steps;

    while (low < high) {
        int middle = (low + high) / 2;
        if (step[middle] <= from + BOARD_TICK_HZ / 1000000) /* events tell nanoseconds */
            low = middle + 1;
        else
            high = middle;
    }
    if (low < steps && step[low] < to)
        return wrong(o, "a step at %.6f s in state %d, since %.6f s", (double)step[low] / BOARD_TICK_HZ, (int)state,
                     (double)from / BOARD_TICK_HZ);
    return true;
}

/* From one change of state to the next that was told, nothing turns where nothing should: at rest, and above all where
 * the position is lost. */
static bool judge_states(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    int count;
    const struct sim_machine_event *events = sim_machine_events(m, &count);
    uint64_t since = 0;
    lumi_wire_State state = lumi_wire_State_BOOT;
    int boot = 0;

    for (int i = 0; i < count; i++) {
        const lumi_wire_Event *event = &events[i].event;
        uint64_t at = ticks_of(event->time_ns);
        if (event->which_kind != lumi_wire_Event_state_changed_tag)
            continue;
        if (boot_of(m, at) == boot && still(state) && !no_step_between(o, since, at, state))
            return false;
        boot = boot_of(m, at);
        state = event->kind.state_changed.to;
        since = at;
    }
    return true;
}

/* After a video no camera records: one that did not hear its stop would until its card is full. Those whose board
 * forgot, whose lines are dead or that are told wrong are excused. */
static bool judge_recording(struct rig_operator *o)
{
    struct sim_machine *m = o->f.machine;
    int starts, before, after;

    sim_machine_start_ticks(m, &starts);
    for (int i = 0; i < o->script.count; i++)
        if (o->script.faults[i].kind == SIM_FAULT_CAMERA_DEAD)
            return true;
    if (!o->f.options.mechanics.video || starts > 1)
        return true;
    sim_mechanics_video(sim_machine_mechanics(m), &before);
    sim_machine_run(m, 1);
    sim_mechanics_video(sim_machine_mechanics(m), &after);
    return before == after || wrong(o, "%d frames after the video's end", after - before);
}

/* A video that was told complete was filmed: every camera whose line lives has, all around, frames of every turn. */
static bool judge_filmed(struct rig_operator *o)
{
    enum { BINS = 72 };
    static int frames[LUMI_RIG_CAMERAS][BINS];
    int count, starts;
    const struct sim_video_frame *video = sim_mechanics_video(sim_machine_mechanics(o->f.machine), &count);

    sim_machine_start_ticks(o->f.machine, &starts);
    if (!o->f.options.mechanics.video || starts > 1) /* a restart forgets that cameras record: rig.md warns of it */
        return true;
    for (int i = 0; i < o->script.count; i++)
        if (o->script.faults[i].kind == SIM_FAULT_CAMERA_DEAD)
            return true;
    memset(frames, 0, sizeof frames);
    for (int i = 0; i < count; i++) {
        double turns = video[i].angle / (2 * LUMI_PI);
        int bin = (int)((turns - floor(turns)) * BINS);
        frames[video[i].camera][bin < BINS ? bin : BINS - 1]++;
    }
    /* 30 a second and 10 s a turn: four in each twelfth of 60 degrees. */
    for (int camera = 0; camera < o->f.rig.camera_count; camera++)
        for (int bin = 0; bin < BINS; bin++)
            if (frames[camera][bin] < 2 * o->f.plan.turns)
                return wrong(o, "camera %d has %d frames about %d degrees, in %d turns", camera, frames[camera][bin],
                             bin * 360 / BINS, o->f.plan.turns);
    return true;
}

bool rig_operator_judge(struct rig_operator *o)
{
    struct sim_mechanics *m = sim_machine_mechanics(o->f.machine);

    if (sim_mechanics_fallen(m) > 0)
        return wrong(o, "the arm fell by %g degrees", sim_mechanics_fallen(m) / DEGREE);
    if (sim_machine_events_lost(o->f.machine) == 0 && (!judge_shots(o) || !judge_map(o) || !judge_states(o)))
        return false;
    return judge_estop(o) && judge_recording(o) && judge_filmed(o);
}
