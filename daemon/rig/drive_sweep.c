/* A start-stop sweep with an industrial drive: go there, see that it stands there, have the board fire, next.
 *
 * 1. The board owns the drive's enable line and the emergency stop; the drive's position-reached line goes to the
 * board, which fires only while it is active. What the drive says over Modbus is asked as well, and must agree.
 * 2. A fault of the board or of the drive ends the sweep; so does a position that is not reached in time. */
#include "daemon/rig/drive.h"
#include "daemon/rig/link_priv.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define ASK_SECONDS 0.02    /* between two looks at a drive that moves */
#define ENABLE_SECONDS 2.0  /* from the enable line to the drive's word that it is enabled */
#define ANSWER_SECONDS 3.0  /* of the board */
#define BEGUN_SECONDS 1.0   /* a drive that is told to home has begun by then: "homed" from before is gone */
#define REACHED_SECONDS 2.0 /* the board waits for the line after the drive has said that it stands */

struct watch {
    struct lumi_rig_drive_sweep *sweep;
    uint32_t awaited_first, awaited_count; /* shots */
    uint32_t seen;                         /* of them, fired or lost */
    bool faulted, restarted, ended, complete;
    char fault[160], note[80];
};

static uint64_t seconds_from_now(double seconds)
{
    return lumi_rig_link_now() + (uint64_t)(seconds * 1e9);
}

static void take(struct watch *watch, const struct lumi_rig_notice *notice)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    const lumi_wire_Event *event = &notice->event;

    if (sweep->notice)
        sweep->notice(sweep->context, notice);
    if (notice->kind == LUMI_RIG_NOTICE_CONNECTED && notice->restarted)
        watch->restarted = true;
    if (notice->kind != LUMI_RIG_NOTICE_EVENT)
        return;
    if (event->which_kind == lumi_wire_Event_shot_tag &&
        event->kind.shot.number - watch->awaited_first < watch->awaited_count) {
        watch->seen++;
        if (event->kind.shot.lost)
            sweep->lost++;
        else
            sweep->fired++;
    } else if (event->which_kind == lumi_wire_Event_sweep_ended_tag) {
        watch->ended = true;
        watch->complete = event->kind.sweep_ended.how == lumi_wire_SweepEnded_How_COMPLETE;
    } else if (event->which_kind == lumi_wire_Event_note_tag) {
        snprintf(watch->note, sizeof watch->note, "%s", event->kind.note.text);
    } else if (event->which_kind == lumi_wire_Event_fault_tag && event->kind.fault.set) {
        uint32_t fault = event->kind.fault.fault;
        watch->faulted = true;
        snprintf(watch->fault, sizeof watch->fault, "%s%s%s",
                 fault < LUMI_RIG_FAULTS ? lumi_rig_fault_names[fault] : "unknown fault",
                 event->kind.fault.text[0] ? ": " : "", event->kind.fault.text);
    }
}

/* Takes what the board has told; waits so long for the first. */
static void listen(struct watch *watch, double seconds)
{
    struct lumi_rig_notice notice;

    while (lumi_rig_link_notice(watch->sweep->link, seconds, &notice)) {
        take(watch, &notice);
        seconds = 0;
    }
}

static int judge(const struct watch *watch, struct lumi_error *error)
{
    if (watch->faulted)
        return lumi_fail(error, LUMI_ERR_BUSY, "the board: %s", watch->fault);
    if (watch->sweep->stopped && watch->sweep->stopped(watch->sweep->context))
        return lumi_fail(error, LUMI_ERR_CANCELLED, "emergency stop");
    if (watch->restarted)
        return lumi_fail(error, LUMI_ERR_IO, "the board has started again in the middle of the sweep");
    return LUMI_OK;
}

static int judge_drive(struct lumi_rig_drive_sweep *sweep, const struct lumi_rig_drive_status *status,
                       struct lumi_error *error)
{
    const char *name = lumi_rig_drive_map(sweep->drive)->name;

    if (status->fault)
        return lumi_fail(error, LUMI_ERR_BUSY, "drive %s: fault %d", name, status->fault_code);
    if (!status->enabled)
        return lumi_fail(error, LUMI_ERR_BUSY, "drive %s is not enabled (the board's enable line, the emergency stop)",
                         name);
    return LUMI_OK;
}

static bool there(struct lumi_rig_drive_sweep *sweep, const struct lumi_rig_drive_status *status, double turns)
{
    const struct lumi_drive_map *map = lumi_rig_drive_map(sweep->drive);
    double away = fabs(status->counts - (map->zero_counts + turns * map->counts_per_turn));

    return status->reached && status->ready && (!status->position_known || away <= fmax(map->tolerance, 0.5));
}

/* Asks the drive until `turns` is reached (NAN: until it has homed), the board being listened to meanwhile. */
static int wait_for_drive(struct watch *watch, double turns, double seconds, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    uint64_t deadline = seconds_from_now(seconds), begun = seconds_from_now(BEGUN_SECONDS);
    struct lumi_rig_drive_status status;

    for (;;) {
        LUMI_TRY(judge(watch, error));
        LUMI_TRY(lumi_rig_drive_status(sweep->drive, &status, error));
        LUMI_TRY(judge_drive(sweep, &status, error));
        bool rests = isnan(turns) ? status.homed && status.reached : there(sweep, &status, turns);
        if (!rests)
            begun = 0;
        if (rests && (!isnan(turns) || lumi_rig_link_now() >= begun))
            return LUMI_OK;
        if (lumi_rig_link_now() >= deadline)
            break;
        listen(watch, ASK_SECONDS);
    }
    if (isnan(turns))
        return lumi_fail(error, LUMI_ERR_IO, "drive %s has not homed within %.3g s",
                         lumi_rig_drive_map(sweep->drive)->name, seconds);
    return lumi_fail(error, LUMI_ERR_IO, "drive %s has not reached %.4f turns within %.3g s (%s at %.4f)",
                     lumi_rig_drive_map(sweep->drive)->name, turns, seconds,
                     status.reached ? "it says it stands" : "it moves or stands", status.turns);
}

/* Only what was there before, and only on the operator's word: an alarm in the middle ends the sweep. */
static int reset_alarm(struct watch *watch, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    uint64_t deadline = seconds_from_now(ENABLE_SECONDS);
    struct lumi_rig_drive_status status;

    LUMI_TRY(lumi_rig_drive_status(sweep->drive, &status, error));
    if (!status.fault || !sweep->reset)
        return LUMI_OK;
    LUMI_TRY(lumi_rig_drive_reset(sweep->drive, error));
    while (status.fault && lumi_rig_link_now() < deadline) {
        listen(watch, ASK_SECONDS);
        LUMI_TRY(lumi_rig_drive_status(sweep->drive, &status, error));
    }
    return LUMI_OK; /* one that stands is seen when the drive is switched on */
}

static int switch_on(struct watch *watch, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_set_output_tag};
    uint64_t deadline = seconds_from_now(ENABLE_SECONDS);
    struct lumi_rig_drive_status status;

    request.command.set_output.output = lumi_wire_SetOutput_Output_ENABLE;
    request.command.set_output.active = true;
    LUMI_TRY(lumi_rig_link_command(sweep->link, &request, ANSWER_SECONDS, NULL, error));
    for (;;) {
        LUMI_TRY(lumi_rig_drive_status(sweep->drive, &status, error));
        if (status.enabled || status.fault || lumi_rig_link_now() >= deadline)
            return judge_drive(sweep, &status, error);
        listen(watch, ASK_SECONDS);
    }
}

static int home(struct watch *watch, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;

    LUMI_TRY(lumi_rig_drive_home(sweep->drive, error));
    return wait_for_drive(watch, NAN, lumi_rig_drive_map(sweep->drive)->home_timeout, error);
}

/* The board counts steps that it does not make: it takes the host's word for where the platform is. */
static int tell_place(struct watch *watch, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_get_status_tag};
    lumi_wire_Reply reply;

    LUMI_TRY(lumi_rig_link_command(sweep->link, &request, ANSWER_SECONDS, &reply, error));
    if (reply.which_payload == lumi_wire_Reply_status_tag && reply.payload.status.position_known)
        return LUMI_OK;
    request.which_command = lumi_wire_Request_home_tag;
    request.command.home = (lumi_wire_Home){.turn = sweep->plan->first_turn};
    return lumi_rig_link_command(sweep->link, &request, ANSWER_SECONDS, NULL, error);
}

static double bracket_seconds(const struct lumi_plan *plan)
{
    double seconds = 0;

    for (int i = 0; i < plan->bracket; i++)
        seconds += plan->exposures[i] + plan->bracket_gap;
    return seconds;
}

static int fire(struct watch *watch, int position, struct lumi_error *error)
{
    struct lumi_rig_drive_sweep *sweep = watch->sweep;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_fire_here_tag};
    double settle = lumi_plan_settle(sweep->plan, sweep->rig);
    uint64_t deadline = seconds_from_now(REACHED_SECONDS + settle + bracket_seconds(sweep->plan) + 30);

    watch->awaited_first = (uint32_t)(position * sweep->plan->bracket);
    watch->awaited_count = (uint32_t)sweep->plan->bracket;
    watch->seen = 0;
    watch->ended = false;
    watch->note[0] = '\0';
    request.command.fire_here.first_shot = watch->awaited_first;
    request.command.fire_here.timeout = REACHED_SECONDS;
    LUMI_TRY(lumi_rig_link_command(sweep->link, &request, ANSWER_SECONDS, NULL, error));
    while (!watch->ended) {
        listen(watch, 0.25);
        LUMI_TRY(judge(watch, error));
        if (lumi_rig_link_now() >= deadline)
            return lumi_fail(error, LUMI_ERR_IO, "the board has told of %u of the %u shots of position %d", watch->seen,
                             watch->awaited_count, position);
    }
    if (!watch->complete)
        return lumi_fail(error, LUMI_ERR_IO, "the board ended position %d: %s", position,
                         watch->note[0] ? watch->note : "it gave no reason");
    sweep->next_shot = watch->awaited_first + watch->awaited_count;
    return LUMI_OK;
}

static bool is_done(const struct lumi_rig_drive_sweep *sweep, int position)
{
    const int bracket = sweep->plan->bracket;

    for (int i = 0; i < bracket; i++)
        if (!sweep->states || sweep->states[position * bracket + i] != 1)
            return false;
    return true;
}

static int check(struct lumi_rig_drive_sweep *sweep, struct lumi_error *error)
{
    struct lumi_rig_link_snapshot snapshot;

    if (sweep->plan->mode != LUMI_PLAN_START_STOP)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "plan %s: an external drive does start-stop sweeps only",
                         sweep->plan->name);
    if (sweep->rig->control.motion.drive != LUMI_RIG_DRIVE_EXTERNAL)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "rig %s: its profile says that the board steps the motor itself",
                         sweep->rig->name);
    LUMI_TRY(lumi_rig_link_wait(sweep->link, ANSWER_SECONDS, false, error));
    lumi_rig_link_snapshot(sweep->link, &snapshot);
    if (snapshot.status_known && snapshot.status.faults)
        return lumi_fail(error, LUMI_ERR_BUSY, "the board has faults that are not cleared (lumi rig status)");
    return LUMI_OK;
}

int lumi_rig_drive_sweep(struct lumi_rig_drive_sweep *sweep, struct lumi_error *error)
{
    struct watch watch = {.sweep = sweep};
    const struct lumi_plan *plan = sweep->plan;
    int first = (int)(sweep->first_shot / (uint32_t)plan->bracket), code;

    sweep->fired = sweep->lost = 0;
    sweep->next_shot = sweep->first_shot;
    LUMI_TRY(check(sweep, error));
    listen(&watch, 0); /* what was before this sweep is not its own */
    watch.faulted = watch.restarted = false;
    LUMI_GOTO(code, done, reset_alarm(&watch, error));
    LUMI_GOTO(code, done, switch_on(&watch, error));
    if (sweep->home)
        LUMI_GOTO(code, done, home(&watch, error));
    LUMI_GOTO(code, done, tell_place(&watch, error));
    for (int position = first; position < plan->positions * plan->turns; position++) {
        double turns = plan->first_turn + (double)position / plan->positions;
        if (is_done(sweep, position))
            continue;
        if (sweep->cancelled && sweep->cancelled(sweep->context)) {
            code = lumi_fail(error, LUMI_ERR_CANCELLED, "stopped before position %d", position);
            goto done;
        }
        LUMI_GOTO(code, done, lumi_rig_drive_go(sweep->drive, turns, error));
        LUMI_GOTO(code, done, wait_for_drive(&watch, turns, lumi_rig_drive_map(sweep->drive)->move_timeout, error));
        LUMI_GOTO(code, done, fire(&watch, position, error));
    }
done:
    /* It stands already, unless something is wrong: then it is told as well, though the board's enable line is what
     * counts. */
    if (code != LUMI_OK && lumi_rig_drive_map(sweep->drive)->stop.used)
        lumi_rig_drive_stop(sweep->drive, NULL);
    return code;
}
