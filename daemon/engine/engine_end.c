/* The end of a sweep: frames that are still coming, retakes, sealing, closing. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

void engine_sweep_row(struct lumi_engine *e, bool ended, const char *text)
{
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_SWEEP);

    if (!flight)
        return;
    flight->job.sweep = e->sweep_number;
    flight->job.ended = ended;
    flight->job.time_us = engine_unix_us(e, e->now);
    snprintf(flight->job.text, sizeof flight->job.text, "%s", text);
    engine_flight_give(e, flight);
}

/* The clocks as they were fitted, and what was found. */
static void close_sweep(struct lumi_engine *e, const char *text)
{
    struct lumi_match_clock clock;

    if (!e->sweep_open)
        return;
    e->sweep_open = false;
    for (int c = 0; c < e->config.camera_count; c++) {
        struct engine_flight *flight;
        if (!e->cameras[c].used || !e->cameras[c].match)
            continue;
        lumi_match_clock(e->cameras[c].match, &clock);
        if (!clock.known || !(flight = engine_flight(e, LUMI_STORE_CLOCK)))
            continue;
        flight->job.camera = e->cameras[c].rig;
        flight->job.clock.frames = (int)clock.matched;
        flight->job.clock.offset_s = clock.offset_s;
        flight->job.clock.drift_ppm = clock.drift_ppm;
        flight->job.clock.residual_s = clock.residual_s;
        flight->job.clock.worst_s = clock.residual_worst_s;
        engine_flight_give(e, flight);
    }
    engine_sweep_row(e, true, text);
}

/* ---- draining ---- */

static bool files_waited_for(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;
    int waiting = 0;

    for (int shot = 0; shot < e->shots; shot++)
        waiting += engine_frame_at(e, shot, camera)->at == AT_TRIGGERED;
    if (waiting == 0)
        return false;
    if (c->file_count < waiting && !(c->file_count > 0 && engine_since(e, c->file_ns) > 3 * e->config.frame_patience)) {
        /* None at all: somebody has to bring the card, or say (resume) that there is none. */
        if (!c->given_up) {
            engine_state(e, LUMI_ENGINE_DRAINING, "waiting for the files of %s: %d of %d have come",
                         e->config.cameras[camera].name, c->file_count, waiting);
            return true;
        }
    }
    engine_match_files(e, camera);
    return false;
}

static bool drained(struct lumi_engine *e)
{
    if (e->event_count > 0 || e->side)
        return false;
    for (int c = 0; c < e->config.camera_count; c++) {
        if (!e->cameras[c].used)
            continue;
        if (e->cameras[c].identity.records_itself && files_waited_for(e, c))
            return false;
        if (e->cameras[c].match && lumi_match_open(e->cameras[c].match) > 0)
            return false;
    }
    return e->flying == 0 && e->judging == 0 && e->judge_due == 0 && e->at_count[AT_TRIGGERED] == 0 &&
           e->at_count[AT_RECEIVED] == 0;
}

/* What has not come and has nothing left that could bring it. */
static void give_up_stranded(struct lumi_engine *e)
{
    if (e->at_count[AT_TRIGGERED] == 0 || e->flying > 0)
        return;
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used && (e->cameras[c].identity.records_itself ||
                                   (e->cameras[c].match && lumi_match_open(e->cameras[c].match) > 0)))
            return;
    for (int shot = 0; shot < e->shots; shot++)
        for (int c = 0; c < e->config.camera_count; c++)
            if (engine_frame_at(e, shot, c)->at == AT_TRIGGERED)
                engine_frame_lost(e, shot, c, "its frame never came");
}

static void disarm(struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used && e->cameras[c].armed && e->cameras[c].there)
            engine_camera_do(e, c, LUMI_CAMERA_DISARM, e->cameras[c].exposure_s);
}

static void name_missing(struct lumi_engine *e)
{
    for (int shot = 0; shot < e->shots; shot++)
        for (int c = 0; c < e->config.camera_count; c++)
            if (engine_frame_at(e, shot, c)->at == AT_PLANNED)
                engine_frame_lost(e, shot, c,
                                  e->account_shots[shot].state == SHOT_LOST ? "its shot was lost"
                                                                            : "its shot was not taken");
}

bool engine_stage_drain(struct lumi_engine *e)
{
    int needed;

    if (e->stage_at == 0) {
        e->stage_at = 1;
        engine_state(e, LUMI_ENGINE_DRAINING, "frames are still coming");
    }
    if (e->stage_at == 1) {
        engine_wake(e, 0.2);
        give_up_stranded(e);
        if (!drained(e))
            return false;
        for (int c = 0; c < e->config.camera_count; c++) /* edges that are missing are told of, strays let go */
            if (e->cameras[c].used && e->cameras[c].match)
                lumi_match_finish(e->cameras[c].match);
        engine_match_all(e);
        e->stage_at = 2;
        needed = engine_frames_needed(e);
        if (needed > 0 && e->retakes_left > 0 && !e->want_stop) {
            close_sweep(e, "retakes follow");
            e->retakes_left--;
            e->round++;
            e->tries = 0;
            engine_take(e);
            return true;
        }
        close_sweep(e, needed ? "frames are missing" : "complete");
        name_missing(e);
        disarm(e);
    }
    if (e->flying > 0)
        return false;
    engine_go(e, e->want_stop && !e->want_seal ? STAGE_CLOSE : STAGE_SEAL);
    return true;
}

/* ---- sealing ---- */

static void set_meta(struct lumi_engine *e, const char *key, const char *value)
{
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_META);

    if (!flight)
        return;
    snprintf(flight->job.key, sizeof flight->job.key, "%s", key);
    snprintf(flight->job.text, sizeof flight->job.text, "%s", value);
    engine_flight_give(e, flight);
}

static void give_seal(struct lumi_engine *e)
{
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_SEAL);
    time_t seconds = (time_t)(engine_unix_us(e, e->now) / 1000000);
    struct tm day;

    if (!flight)
        return;
    gmtime_r(&seconds, &day);
    strftime(flight->job.date, sizeof flight->job.date, "%Y-%m-%d", &day);
    flight->job.verify = e->config.verify;
    engine_flight_give(e, flight);
}

bool engine_stage_seal(struct lumi_engine *e)
{
    struct lumi_error error = {0};
    const int missing = engine_frames_needed(e);

    if (e->stage_at == 0) {
        e->stage_at = 1;
        e->sealed_ok = false;
        engine_state(e, LUMI_ENGINE_SEALING, "checksums are verified, the capture is closed");
        set_meta(e, "session", "sealed");
    }
    if (e->stage_at == 1 && e->flying == 0) {
        e->stage_at = 2;
        give_seal(e);
    }
    if (e->stage != STAGE_SEAL) /* it failed at once */
        return true;
    if (e->flying > 0) {
        if (e->disk_full)
            engine_state(e, LUMI_ENGINE_SEALING, "%s", e->disk_text);
        return false;
    }
    if (!e->sealed_ok) {
        engine_fail(e, "%s: could not be sealed", e->capture);
        return true;
    }
    if (lumi_store_close(e->store, &error) != LUMI_OK) {
        e->store = NULL;
        engine_fail(e, "%s", error.text);
        return true;
    }
    e->store = NULL;
    engine_tell(e, LUMI_TALE_SEALED, -1, -1, e->capture);
    if (missing)
        engine_state(e, LUMI_ENGINE_DONE, "sealed, with %d frames missing", missing);
    else
        engine_state(e, LUMI_ENGINE_DONE, "sealed, complete");
    engine_go(e, STAGE_REST);
    if (!missing && e->ports.hand_over)
        e->ports.hand_over(e->ports.context, e->capture);
    return false;
}

/* Kept open, for whoever takes what is missing later. */
bool engine_stage_close(struct lumi_engine *e)
{
    struct lumi_error error = {0};

    if (e->stage_at == 0) {
        e->stage_at = 1;
        set_meta(e, "session", "stopped");
    }
    if (e->flying > 0)
        return false;
    if (e->store && lumi_store_close(e->store, &error) != LUMI_OK) {
        e->store = NULL;
        engine_fail(e, "%s", error.text);
        return true;
    }
    e->store = NULL;
    engine_rest(e, LUMI_ENGINE_IDLE);
    engine_state(e, LUMI_ENGINE_IDLE, "%s is kept open, with %d frames missing", e->capture, engine_frames_needed(e));
    return false;
}

void engine_rest(struct lumi_engine *e, enum lumi_engine_state state)
{
    engine_go(e, STAGE_REST);
    if (state == LUMI_ENGINE_IDLE || state == LUMI_ENGINE_RED)
        disarm(e);
    e->want_stop = e->want_pause = false;
}

void engine_fail(struct lumi_engine *e, const char *format, ...)
{
    struct lumi_error ignored;
    char text[400];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (e->store)
        lumi_store_close(e->store, &ignored);
    e->store = NULL;
    disarm(e);
    engine_go(e, STAGE_REST);
    engine_state(e, LUMI_ENGINE_FAILED, "%s", text);
}
