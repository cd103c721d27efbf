/* The sweep goes on by itself on the board: what is watched meanwhile, what pauses and what interrupts it, and how it
 * goes on. */
#include "daemon/engine/engine_priv.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define REST_SECONDS 1.5 /* at rest for so long without a word of the end: it has ended */

bool engine_taking(const struct lumi_engine *e)
{
    return e->store && e->stage >= STAGE_ROWS && e->stage <= STAGE_DRAIN;
}

void engine_interrupt(struct lumi_engine *e, bool go_on, const char *format, ...)
{
    char text[400];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (e->driving && e->ports.drive_cancel)
        e->ports.drive_cancel(e->ports.context);
    e->driving = false;
    e->moving = false;
    e->go_on = go_on && e->tries < ENGINE_TRIES;
    engine_incident(e, -1, "interrupted", "%s", text);
    engine_state(e, LUMI_ENGINE_INTERRUPTED, "%s%s", text, e->go_on ? "; it goes on by itself" : "");
    engine_go(e, STAGE_INTERRUPTED);
}

void engine_restarted(struct lumi_engine *e)
{
    if (!engine_taking(e) || e->stage == STAGE_DRAIN || e->stage == STAGE_INTERRUPTED)
        return;
    e->moving = false;
    if (e->want_stop) {
        engine_go(e, STAGE_DRAIN);
        return;
    }
    if (e->stage == STAGE_PAUSED && e->pause == PAUSE_OPERATOR)
        return; /* resume homes it again */
    engine_interrupt(e, true, "the board has started again");
}

void engine_ended(struct lumi_engine *e, const lumi_wire_Event *event)
{
    const int64_t at = e->ports.rig_to_host(e->ports.context, event->time_ns);

    if (e->driving || !e->moving || (at && at < e->begun_ns)) /* of a sweep before */
        return;
    e->ended = true;
    e->how = event->kind.sweep_ended.how;
}

/* ---- the disk ---- */

bool engine_disk_eased(const struct lumi_engine *e)
{
    struct lumi_store_figures figures;

    lumi_store_figures(e->store, &figures);
    return !e->disk_full && figures.waiting < e->config.store.memory / 8;
}

static bool disk_behind(const struct lumi_engine *e, char *text, size_t size)
{
    struct lumi_store_figures figures;

    if (e->disk_full) {
        snprintf(text, size, "%s", e->disk_text);
        return true;
    }
    lumi_store_figures(e->store, &figures);
    if (figures.waiting <= e->config.store.memory / 4 * 3)
        return false;
    snprintf(text, size, "the disk is too slow: %.1f MB/s, %.0f MB wait to be written", figures.bytes_per_second * 1e-6,
             (double)figures.waiting * 1e-6);
    return true;
}

/* ---- pausing ---- */

static void ask_pause(struct lumi_engine *e, enum engine_pause why)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_pause_tag};

    e->pause = why;
    if (e->driving) {
        if (e->ports.drive_cancel)
            e->ports.drive_cancel(e->ports.context);
        return;
    }
    engine_send(e, &request);
}

static void ask_stop(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_stop_tag};

    if (e->driving && e->ports.drive_cancel)
        e->ports.drive_cancel(e->ports.context);
    request.command.stop.at_once = e->stop_at_once;
    if (!e->driving || e->stop_at_once)
        engine_send(e, &request);
}

static int camera_away(const struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used && !e->cameras[c].given_up && !e->cameras[c].there && !e->config.cameras[c].optional)
            return c;
    return -1;
}

static void watch_sweep(struct lumi_engine *e)
{
    char text[256];
    int away;

    if (e->want_stop && e->stage_at != 2) {
        e->stage_at = 2;
        ask_stop(e);
        engine_state(e, LUMI_ENGINE_PAUSING, "the sweep is being ended");
        return;
    }
    if (e->stage_at != 0)
        return;
    if (e->want_pause) {
        e->stage_at = 1;
        ask_pause(e, PAUSE_OPERATOR);
        engine_state(e, LUMI_ENGINE_PAUSING, "at the next safe place");
    } else if (disk_behind(e, text, sizeof text)) {
        e->stage_at = 1;
        engine_incident(e, -1, "disk", "%s", text);
        ask_pause(e, PAUSE_DISK);
        engine_state(e, LUMI_ENGINE_PAUSING, "%s", text);
    } else if (e->plan.mode == LUMI_PLAN_START_STOP && (away = camera_away(e)) >= 0) {
        e->stage_at = 1;
        ask_pause(e, PAUSE_CAMERA);
        engine_state(e, LUMI_ENGINE_PAUSING, "camera %s is away", e->config.cameras[away].name);
    }
}

/* ---- faults ---- */

static bool needs_board(enum engine_stage stage)
{
    return stage >= STAGE_HOME && stage <= STAGE_SWEEP;
}

void engine_watch(struct lumi_engine *e)
{
    char names[128];

    if (!e->store || !needs_board(e->stage))
        return;
    if (e->estop) {
        engine_interrupt(e, false, "the emergency stop is pressed: look at the rig, release it, clear, resume");
        return;
    }
    if (e->faults && e->stage != STAGE_SWEEP) {
        engine_faults_text(e->faults, names, sizeof names);
        engine_interrupt(e, e->faults == 1u << LUMI_RIG_FAULT_HOST_LOST, "fault: %s", names);
        return;
    }
    if (e->stage == STAGE_SWEEP)
        watch_sweep(e);
}

/* ---- the sweep ---- */

/* Whether the board rests though nothing has told of an end. */
static bool rests(struct lumi_engine *e)
{
    const bool seen = e->link.status_known && (int64_t)e->link.status_ns > e->begun_ns && e->connected;

    if (!seen || !engine_board_rests(e) || e->driving) {
        e->rest_ns = e->now;
        return false;
    }
    engine_wake(e, 0.5);
    return engine_since(e, e->rest_ns) >= REST_SECONDS;
}

static void fault_text(struct lumi_engine *e, char *text, size_t size)
{
    if (e->faults)
        engine_faults_text(e->faults, text, size);
    else
        snprintf(text, size, "unknown");
}

static void paused(struct lumi_engine *e)
{
    if (e->pause == PAUSE_DISK && e->plan.mode != LUMI_PLAN_START_STOP) {
        engine_interrupt(e, false, "a sweep that turns cannot wait for the disk (%s): resume takes what is missing",
                         e->disk_full ? e->disk_text : "it is too slow");
        return;
    }
    engine_state(e, LUMI_ENGINE_PAUSED, "%s",
                 e->pause == PAUSE_DISK     ? "the disk is slow or full; it goes on by itself"
                 : e->pause == PAUSE_CAMERA ? "a camera is away; it goes on by itself when it is back"
                                            : "by the operator");
    engine_go(e, STAGE_PAUSED);
}

static bool sweep_over(struct lumi_engine *e, lumi_wire_SweepEnded_How how)
{
    char text[200];

    e->moving = false;
    if (e->want_stop) {
        engine_go(e, STAGE_AFTER);
        return true;
    }
    switch (how) {
    case lumi_wire_SweepEnded_How_COMPLETE:
        engine_go(e, STAGE_AFTER);
        break;
    case lumi_wire_SweepEnded_How_PAUSED_BY_HOST:
        if (e->pause == PAUSE_NONE)
            e->pause = PAUSE_OPERATOR; /* from elsewhere */
        paused(e);
        break;
    case lumi_wire_SweepEnded_How_STOPPED_BY_HOST:
        engine_interrupt(e, false, "the sweep was stopped at the rig");
        break;
    case lumi_wire_SweepEnded_How_HOST_LOST:
        engine_interrupt(e, true, "the board heard nothing of this computer for too long");
        break;
    default:
        fault_text(e, text, sizeof text);
        engine_interrupt(e, false, "fault: %s: look at the rig, clear, resume", text);
        break;
    }
    return true;
}

static bool drive_over(struct lumi_engine *e)
{
    e->driving = false;
    e->moving = false;
    if (e->want_stop || e->ask.code == LUMI_OK) {
        engine_go(e, STAGE_AFTER);
        return true;
    }
    if (e->ask.code == LUMI_ERR_CANCELLED) {
        if (e->pause == PAUSE_NONE)
            e->pause = PAUSE_OPERATOR;
        paused(e);
        return true;
    }
    engine_interrupt(e, e->ask.code == LUMI_ERR_IO && !e->faults, "the drive: %s", e->ask.text);
    return true;
}

bool engine_stage_sweep(struct lumi_engine *e)
{
    if (e->state != LUMI_ENGINE_SWEEPING && e->state != LUMI_ENGINE_PAUSING) /* joined */
        engine_state(e, LUMI_ENGINE_SWEEPING, "the board was at it already");
    if (!e->sweep_open) {
        e->sweep_number++;
        e->sweep_open = true;
        engine_match_begin(e);
        engine_sweep_row(e, false, "joined");
    }
    if (e->driving) {
        if (!e->ask.answered)
            return false;
        return drive_over(e);
    }
    if (!e->connected) {
        engine_wake(e, 1);
        if (engine_since(e, e->lost_ns) < e->config.rig_patience)
            return false;
        engine_interrupt(e, true,
                         "no word from the board for %.3g s; what it does now stands in its profile "
                         "(host-lost)",
                         e->config.rig_patience);
        return true;
    }
    if (e->ended)
        return sweep_over(e, e->how);
    if (!rests(e)) {
        engine_wake(e, 1);
        return false;
    }
    /* Its end was among the events that were lost. */
    if (e->faults)
        return sweep_over(e, e->faults == 1u << LUMI_RIG_FAULT_HOST_LOST ? lumi_wire_SweepEnded_How_HOST_LOST
                                                                         : lumi_wire_SweepEnded_How_FAULTED);
    if (e->stage_at != 0)
        return sweep_over(e, lumi_wire_SweepEnded_How_PAUSED_BY_HOST);
    return sweep_over(e, lumi_wire_SweepEnded_How_COMPLETE);
}

/* ---- paused ---- */

bool engine_stage_paused(struct lumi_engine *e)
{
    if (e->want_stop) {
        engine_go(e, STAGE_AFTER);
        return true;
    }
    if (e->pause == PAUSE_OPERATOR)
        return false;
    engine_wake(e, 1);
    if (e->pause == PAUSE_DISK && !engine_disk_eased(e))
        return false;
    if (e->pause == PAUSE_CAMERA) {
        int away = camera_away(e);
        if (away >= 0 && engine_since(e, e->stage_ns) < e->config.rig_patience)
            return false;
        if (away >= 0) {
            e->cameras[away].given_up = true;
            engine_incident(e, away, "camera", "the sweep goes on without camera %s", e->config.cameras[away].name);
            return false;
        }
    }
    e->tries = 0;
    engine_take(e);
    return true;
}

/* ---- interrupted ---- */

bool engine_stage_interrupted(struct lumi_engine *e)
{
    if (e->want_stop) {
        engine_go(e, STAGE_DRAIN);
        return true;
    }
    if (!e->go_on)
        return false;
    engine_wake(e, 1);
    if (!e->connected || !e->link.status_known || e->estop)
        return false;
    if ((int64_t)e->link.status_ns <= e->stage_ns) /* as it was before */
        return false;
    if (e->faults) {
        char names[128];
        if (engine_clear_host_lost(e))
            return false;
        engine_faults_text(e->faults, names, sizeof names);
        e->go_on = false;
        engine_state(e, LUMI_ENGINE_INTERRUPTED, "fault: %s: look at the rig, clear, resume", names);
        return false;
    }
    if (e->link.status.state == lumi_wire_State_NO_PROFILE) {
        e->go_on = false;
        engine_state(e, LUMI_ENGINE_INTERRUPTED, "the board has no profile any more");
        return false;
    }
    if (!engine_board_rests(e) && e->link.status.state != lumi_wire_State_SWEEPING &&
        e->link.status.state != lumi_wire_State_WINDING)
        return false;
    engine_take(e);
    return true;
}
