/* Running a sweep from the host.
 *
 * 1. Which shots are done is the board's to say (ReadShots); events only add when and where. After a restart of the
 *    board its memory of them is gone: then the log tells it (MarkShots).
 * 2. The end is an event, but also a state: where the event was lost, a board that rests has ended. */
#include "daemon/rig/sweep_run.h"
#include "daemon/rig/link_priv.h"

#include <glib.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define ANSWER_SECONDS 10.0
#define REST_NS 1500000000u /* at rest for so long without a word of the end: it has ended */
#define LATE_NS 3000000000u /* for the next of the events that are on their way when it has ended */

struct course {
    struct lumi_rig_sweep_run *run;
    uint32_t first_event; /* of this sweep */
    uint32_t next_event;  /* seen up to here */
    uint32_t boot, turn;
    bool begun; /* StartSweep was answered */
    bool kept;  /* the board held this plan, and its account of the shots, before it was given it */
    bool left;  /* the log holds every shot: the board was left alone */
    bool restarted;
    int obeyed; /* interrupts that were acted on */
    uint64_t begun_ns, heard_ns, rest_ns;
    char reason[256]; /* the last fault or note */
    struct lumi_error log_error;
    uint8_t states[LUMI_PLAN_SHOTS_MAX]; /* of the shots, when it begins and when it has ended */
};

void lumi_rig_sweep_run_init(struct lumi_rig_sweep_run *run)
{
    *run = (struct lumi_rig_sweep_run){.patience = 60};
}

/* ---- what is done ---- */

int lumi_rig_read_shots(struct lumi_rig_link *link, uint32_t count, uint8_t *states, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_read_shots_tag};
    lumi_wire_Reply reply;

    for (uint32_t first = 0; first < count;) {
        const lumi_wire_Shots *shots = &reply.payload.shots;
        request.command.read_shots.first = first;
        LUMI_TRY(lumi_rig_link_command(link, &request, ANSWER_SECONDS, &reply, error));
        if (reply.which_payload != lumi_wire_Reply_shots_tag || shots->first != first || !shots->count ||
            shots->count > count - first || shots->states.size < (shots->count + 3) / 4 ||
            (shots->count % 4 && first + shots->count < count))
            return lumi_fail(error, LUMI_ERR_FORMAT, "the board's map of shots makes no sense");
        for (uint32_t i = 0; i < shots->count; i++)
            states[first + i] = shots->states.bytes[i / 4] >> i % 4 * 2 & 3;
        first += shots->count;
    }
    return LUMI_OK;
}

void lumi_rig_missing_text(const uint8_t *states, uint32_t count, char *text, size_t size)
{
    size_t used = 0;

    text[0] = '\0';
    for (uint32_t first = 0; first < count; first++) {
        uint32_t last = first;
        if (states[first] == 1)
            continue;
        while (last + 1 < count && states[last + 1] != 1)
            last++;
        if (used + 40 > size) {
            snprintf(text + used, size - used, ", ...");
            return;
        }
        used += (size_t)snprintf(text + used, size - used, first == last ? "%s%" PRIu32 : "%s%" PRIu32 "-%" PRIu32,
                                 used ? ", " : "", first, last);
        first = last;
    }
}

static uint32_t first_missing(const uint8_t *states, uint32_t count)
{
    uint32_t first = 0;

    while (first < count && states[first] == 1)
        first++;
    return first;
}

/* ---- events ---- */

static uint64_t to_host(void *context, uint64_t board_ns)
{
    return lumi_rig_link_to_host(context, board_ns);
}

static void write_down(struct course *course, const struct lumi_rig_notice *notice)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_json_clock clock = {course->boot, run->utc_offset_ns, to_host, run->link};

    if (run->log && !course->log_error.code)
        lumi_rig_sweep_log_notice(run->log, notice, &clock, &course->log_error);
}

static void take_event(struct course *course, const lumi_wire_Event *event)
{
    struct lumi_rig_sweep_run *run = course->run;

    course->next_event = event->number + 1;
    if ((int32_t)(event->number - course->first_event) < 0)
        return;
    if (event->which_kind == lumi_wire_Event_sweep_ended_tag && course->begun) {
        run->ended = true;
        run->how = event->kind.sweep_ended.how;
    } else if (event->which_kind == lumi_wire_Event_turn_mark_tag) {
        course->turn = event->kind.turn_mark.turn;
    } else if (event->which_kind == lumi_wire_Event_note_tag) {
        g_strlcpy(course->reason, event->kind.note.text, sizeof course->reason);
    } else if (event->which_kind == lumi_wire_Event_fault_tag && event->kind.fault.set) {
        uint32_t fault = event->kind.fault.fault;
        snprintf(course->reason, sizeof course->reason, "%s%s%s",
                 fault < LUMI_RIG_FAULTS ? lumi_rig_fault_names[fault] : "unknown fault",
                 event->kind.fault.text[0] ? ": " : "", event->kind.fault.text);
    }
}

static void take(struct course *course, const struct lumi_rig_notice *notice)
{
    struct lumi_rig_link_snapshot snapshot;

    if (notice->kind == LUMI_RIG_NOTICE_CONNECTED) {
        lumi_rig_link_snapshot(course->run->link, &snapshot);
        course->restarted |= notice->restarted;
        course->boot = snapshot.welcome.boot;
    }
    /* On a sweep that was begun anew, what was before it is no part of it. */
    if (notice->kind != LUMI_RIG_NOTICE_EVENT || course->run->resume ||
        (int32_t)(notice->event.number - course->first_event) >= 0)
        write_down(course, notice);
    if (notice->kind != LUMI_RIG_NOTICE_EVENT)
        return;
    if (!course->log_error.code)
        lumi_rig_link_stored(course->run->link, &notice->event);
    take_event(course, &notice->event);
}

static void listen(struct course *course, double seconds)
{
    struct lumi_rig_notice notice;

    while (lumi_rig_link_notice(course->run->link, seconds, &notice)) {
        take(course, &notice);
        seconds = 0;
    }
}

/* ---- beginning ---- */

static int load(struct course *course, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_load_plan_tag};

    request.command.load_plan.has_plan = true;
    lumi_wire_from_plan(course->run->plan, &request.command.load_plan.plan);
    return lumi_rig_link_command(course->run->link, &request, ANSWER_SECONDS, NULL, error);
}

static int mark(struct course *course, uint32_t first, uint32_t count, bool fired, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_mark_shots_tag};

    request.command.mark_shots = (lumi_wire_MarkShots){.first = first, .count = count, .fired = fired};
    return lumi_rig_link_command(course->run->link, &request, ANSWER_SECONDS, NULL, error);
}

/* The board has started again since the log's last event, or had another plan meanwhile, and knows nothing of what was
 * fired before. */
static int remind(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;

    if (!run->log || !run->log->any || (course->kept && run->log->boot == course->boot))
        return LUMI_OK;
    for (uint32_t first = 0, count; first < run->shots; first += count + 1) {
        for (count = 0; first + count < run->shots && course->states[first + count] != 1 &&
                        lumi_rig_sweep_log_has(run->log, first + count);
             count++)
            course->states[first + count] = 1;
        if (count)
            LUMI_TRY(mark(course, first, count, true, error));
    }
    return LUMI_OK;
}

/* What is to be taken: everything, or what is missing. */
static int find_missing(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;

    if (!run->shots)
        return LUMI_OK;
    if (!run->resume)
        return mark(course, 0, run->shots, false, error);
    LUMI_TRY(lumi_rig_read_shots(run->link, run->shots, course->states, error));
    return remind(course, error);
}

static int start(struct course *course, uint32_t first, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_start_sweep_tag};

    request.command.start_sweep.first_shot = first;
    request.command.start_sweep.only_missing = course->run->resume;
    request.command.start_sweep.plan_crc = lumi_wire_plan_crc(course->run->plan);
    return lumi_rig_link_command(course->run->link, &request, ANSWER_SECONDS, NULL, error);
}

/* On a board that holds another plan: whether its sweep is unfinished, and its account would be lost. */
static int spare_another(struct course *course, const lumi_wire_Status *status, struct lumi_error *error)
{
    const lumi_wire_Request request = {.which_command = lumi_wire_Request_read_plan_tag};
    struct lumi_plan plan;
    lumi_wire_Reply reply;
    uint32_t shots;

    LUMI_TRY(lumi_rig_link_command(course->run->link, &request, ANSWER_SECONDS, &reply, error));
    if (reply.which_payload != lumi_wire_Reply_plan_tag)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the board's answer holds no plan");
    LUMI_TRY(lumi_wire_to_plan(&reply.payload.plan, &plan, error));
    shots = (uint32_t)lumi_plan_shots(&plan);
    if (status->shots_fired >= shots)
        return LUMI_OK;
    return lumi_fail(
        error, LUMI_ERR_EXISTS,
        "the board holds another sweep, %s, with %u of %u shots fired, and would forget which: finish that "
        "one first, or say --again too",
        plan.name, (unsigned)status->shots_fired, (unsigned)shots);
}

static bool whole_log(const struct lumi_rig_sweep_run *run)
{
    uint32_t shot = 0;

    while (run->log && shot < run->shots && lumi_rig_sweep_log_has(run->log, shot))
        shot++;
    return run->shots && shot == run->shots;
}

/* Whether this sweep may begin, and whether the board is at it already. */
static int may_begin(struct course *course, const lumi_wire_Status *status, bool *running, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;
    bool ours = status->plan_crc == lumi_wire_plan_crc(run->plan);

    *running = !lumi_rig_state_at_rest(status->state);
    if (*running && !(ours && run->resume))
        return lumi_fail(error, LUMI_ERR_BUSY, "the board is %s%s", lumi_wire_state_name(status->state),
                         ours ? " this plan: run --resume joins it" : "");
    if (!*running && ours && !run->resume && !run->again && status->shots_fired && status->shots_fired < run->shots)
        return lumi_fail(
            error, LUMI_ERR_EXISTS,
            "the board holds this sweep with %u of %u shots fired: --resume takes what is missing, --again "
            "everything anew",
            (unsigned)status->shots_fired, (unsigned)run->shots);
    course->kept = ours;
    if (!ours && run->resume && !run->again && status->plan_crc && status->shots_fired)
        return spare_another(course, status, error);
    return LUMI_OK;
}

static int begin(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_link_snapshot snapshot;
    lumi_wire_Status status;
    uint32_t first;
    bool running;

    LUMI_TRY(lumi_rig_bench_status(run->link, &status, error));
    lumi_rig_link_snapshot(run->link, &snapshot);
    course->boot = snapshot.welcome.boot;
    course->first_event = status.events_next;
    course->next_event = snapshot.welcome.events_first;
    course->left = run->resume && status.plan_crc != lumi_wire_plan_crc(run->plan) && whole_log(run);
    if (course->left) {
        run->fired = run->shots;
        run->ended = true;
        return LUMI_OK;
    }
    LUMI_TRY(may_begin(course, &status, &running, error));
    lumi_rig_link_take_charge(run->link, true); /* not before it is clear that its events are ours to take */
    if (running) {                              /* its end may be among what the board has kept */
        course->first_event = 0;
        course->begun = true;
        return LUMI_OK;
    }
    LUMI_TRY(load(course, error));
    LUMI_TRY(find_missing(course, error));
    first = first_missing(course->states, run->shots);
    if (run->shots && first == run->shots) {
        run->ended = true;
        return LUMI_OK;
    }
    course->begun = true;
    if (!run->drive)
        return start(course, first, error);
    /* Whole positions. */
    run->fired = first / (uint32_t)run->plan->bracket * (uint32_t)run->plan->bracket;
    return LUMI_OK;
}

/* ---- following ---- */

static void obey(struct course *course)
{
    struct lumi_rig_sweep_run *run = course->run;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_pause_tag};
    int interrupts = run->interrupts ? run->interrupts(run->context) : 0;
    struct lumi_error ignored;

    if (interrupts <= course->obeyed)
        return;
    course->obeyed = interrupts;
    if (interrupts == 2) {
        request.which_command = lumi_wire_Request_stop_tag;
        request.command.stop.at_once = true;
    }
    /* One that does not come through must not be the last word. */
    if (interrupts > 2 ||
        (lumi_rig_link_command(run->link, &request, ANSWER_SECONDS, NULL, &ignored) == LUMI_ERR_IO && interrupts > 1))
        lumi_rig_link_emergency_stop(run->link);
}

static void show(struct course *course, const struct lumi_rig_link_snapshot *snapshot)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_sweep_progress progress = {.state = snapshot->status.state,
                                               .connected = snapshot->state == LUMI_RIG_LINK_OPEN,
                                               .shots = run->shots,
                                               .fired = snapshot->status.shots_fired,
                                               .lost = snapshot->status.shots_lost,
                                               .turn = course->turn};

    if (run->progress && snapshot->status_known)
        run->progress(run->context, &progress);
}

/* Whether the board rests though nothing has told of an end. */
static bool rests(struct course *course, const struct lumi_rig_link_snapshot *snapshot)
{
    uint64_t now = lumi_rig_link_now();

    if (!snapshot->status_known || snapshot->status_ns <= course->begun_ns || snapshot->state != LUMI_RIG_LINK_OPEN ||
        !lumi_rig_state_at_rest(snapshot->status.state) ||
        (int32_t)(course->next_event - snapshot->status.events_next) < 0) {
        course->rest_ns = now;
        return false;
    }
    return now - course->rest_ns >= REST_NS;
}

static int follow(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_link_snapshot snapshot;

    course->begun_ns = course->heard_ns = course->rest_ns = lumi_rig_link_now();
    while (!run->ended) {
        listen(course, 0.1);
        obey(course);
        lumi_rig_link_snapshot(run->link, &snapshot);
        show(course, &snapshot);
        if (course->log_error.code)
            return lumi_fail(error, course->log_error.code, "%s", course->log_error.text);
        if (course->restarted)
            return lumi_fail(error, LUMI_ERR_IO,
                             "the board has started again in the middle of the sweep; home it, then run --resume");
        if (snapshot.state == LUMI_RIG_LINK_OPEN)
            course->heard_ns = lumi_rig_link_now();
        else if ((double)(lumi_rig_link_now() - course->heard_ns) * 1e-9 > run->patience)
            return lumi_fail(error, LUMI_ERR_IO,
                             "%s; no word for %.3g s. What the board does now stands in its profile (host-lost)",
                             snapshot.text, run->patience);
        if (rests(course, &snapshot))
            break;
    }
    return LUMI_OK;
}

/* ---- with an external drive ---- */

static bool drive_cancelled(void *context)
{
    struct course *course = context;
    struct lumi_rig_link_snapshot snapshot;

    lumi_rig_link_snapshot(course->run->link, &snapshot);
    show(course, &snapshot);
    return course->log_error.code || (course->run->interrupts && course->run->interrupts(course->run->context) > 0);
}

static void drive_notice(void *context, const struct lumi_rig_notice *notice)
{
    struct course *course = context;

    take(course, notice);
    course->run->ended = false; /* that was one position */
    if (course->run->interrupts && course->run->interrupts(course->run->context) > 1)
        lumi_rig_link_emergency_stop(course->run->link);
}

static int drive_it(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_drive_sweep sweep = {.link = run->link,
                                         .drive = run->drive,
                                         .rig = run->rig,
                                         .plan = run->plan,
                                         .first_shot = run->fired,
                                         .states = course->states,
                                         .home = run->home_drive,
                                         .reset = run->reset_drive,
                                         .context = course,
                                         .notice = drive_notice,
                                         .cancelled = drive_cancelled};
    int code = lumi_rig_drive_sweep(&sweep, error);

    if (course->log_error.code)
        return lumi_fail(error, course->log_error.code, "%s", course->log_error.text);
    if (code == LUMI_ERR_CANCELLED) {
        run->how = lumi_wire_SweepEnded_How_PAUSED_BY_HOST;
        code = LUMI_OK;
    }
    run->ended = code == LUMI_OK;
    return code;
}

/* ---- the end ---- */

/* Those that are on their way, be the line ever so slow. */
static void await_events(struct course *course, uint32_t next)
{
    uint64_t until = lumi_rig_link_now() + LATE_NS;

    while ((int32_t)(course->next_event - next) < 0 && lumi_rig_link_now() < until) {
        uint32_t before = course->next_event;
        listen(course, 0.1);
        if (course->next_event != before)
            until = lumi_rig_link_now() + LATE_NS;
    }
}

static int account(struct course *course, struct lumi_error *error)
{
    struct lumi_rig_sweep_run *run = course->run;
    struct lumi_rig_link_snapshot snapshot;
    uint8_t *states = course->states;
    lumi_wire_Status status;
    char missing[200];

    LUMI_TRY(lumi_rig_bench_status(run->link, &status, error));
    await_events(course, status.events_next);
    lumi_rig_link_snapshot(run->link, &snapshot);
    if (run->log && run->ended && course->begun)
        LUMI_TRY(lumi_rig_sweep_log_clock(run->log, &snapshot, error));
    LUMI_TRY(lumi_rig_read_shots(run->link, run->shots, states, error));
    run->fired = run->lost = 0;
    for (uint32_t shot = 0; shot < run->shots; shot++) {
        run->fired += states[shot] == 1;
        run->lost += states[shot] == 2;
        if (run->log && states[shot] == 1 && !lumi_rig_sweep_log_has(run->log, shot))
            LUMI_TRY(lumi_rig_sweep_log_shot(run->log, shot, course->boot, error));
    }
    run->missing = 0;
    for (uint32_t shot = 0; shot < run->shots; shot++)
        run->missing += states[shot] != 1;
    if (course->log_error.code)
        return lumi_fail(error, course->log_error.code, "%s", course->log_error.text);
    if (!run->missing && (run->shots || run->how == lumi_wire_SweepEnded_How_COMPLETE))
        return LUMI_OK;
    lumi_rig_missing_text(states, run->shots, missing, sizeof missing);
    return lumi_fail(
        error,
        run->how == lumi_wire_SweepEnded_How_PAUSED_BY_HOST || run->how == lumi_wire_SweepEnded_How_STOPPED_BY_HOST
            ? LUMI_ERR_CANCELLED
            : LUMI_ERR_IO,
        "%s%s%s%s: %u of %u shots are missing%s%s; run --resume takes them",
        run->ended ? lumi_rig_ended_name(run->how) : "ended", course->reason[0] ? " (" : "", course->reason,
        course->reason[0] ? ")" : "", (unsigned)run->missing, (unsigned)run->shots, missing[0] ? ": " : "", missing);
}

int lumi_rig_sweep_run(struct lumi_rig_sweep_run *run, struct lumi_error *error)
{
    struct course course = {.run = run};

    run->shots = (uint32_t)lumi_plan_shots(run->plan);
    run->fired = run->lost = run->missing = 0;
    run->ended = false;
    run->how = lumi_wire_SweepEnded_How_COMPLETE;
    if ((run->rig->control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL) != (run->drive != NULL))
        return lumi_fail(error, LUMI_ERR_ARG, "rig %s: its profile says that %s", run->rig->name,
                         run->drive ? "the board steps the motor itself" : "an external drive turns it: which one?");
    LUMI_TRY(lumi_plan_check(run->plan, run->rig, error));
    LUMI_TRY(begin(&course, error));
    if (course.left)
        return LUMI_OK;
    if (!run->ended)
        LUMI_TRY(run->drive ? drive_it(&course, error) : follow(&course, error));
    return account(&course, error);
}
