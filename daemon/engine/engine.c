/* The engine's life, its time, and what it tells. engine_priv.h says what is where. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const engine_stage_fn stages[ENGINE_STAGES] = {
    [STAGE_LINK] = engine_stage_link,       [STAGE_PROFILE] = engine_stage_profile,
    [STAGE_CAMERAS] = engine_stage_cameras, [STAGE_TRIGGERS] = engine_stage_triggers,
    [STAGE_VERDICT] = engine_stage_verdict, [STAGE_ROWS] = engine_stage_rows,
    [STAGE_HOME] = engine_stage_home,       [STAGE_ARM] = engine_stage_arm,
    [STAGE_TEST] = engine_stage_test,       [STAGE_LOAD] = engine_stage_load,
    [STAGE_READ] = engine_stage_read,       [STAGE_MARK] = engine_stage_mark,
    [STAGE_START] = engine_stage_start,     [STAGE_SWEEP] = engine_stage_sweep,
    [STAGE_PAUSED] = engine_stage_paused,   [STAGE_INTERRUPTED] = engine_stage_interrupted,
    [STAGE_AFTER] = engine_stage_after,     [STAGE_DRAIN] = engine_stage_drain,
    [STAGE_SEAL] = engine_stage_seal,       [STAGE_CLOSE] = engine_stage_close,
};

int lumi_engine_create(const struct lumi_engine_config *config, const struct lumi_engine_ports *ports, int64_t now_ns,
                       struct lumi_engine **engine, struct lumi_error *error)
{
    struct lumi_engine *e;

    if (config->camera_count < 0 || config->camera_count > LUMI_RIG_CAMERAS)
        return lumi_fail(error, LUMI_ERR_ARG, "%d cameras are configured: at most %d", config->camera_count,
                         LUMI_RIG_CAMERAS);
    for (int i = 0; i < config->camera_count; i++)
        for (int k = 0; k < i; k++)
            if (!strcmp(config->cameras[i].name, config->cameras[k].name))
                return lumi_fail(error, LUMI_ERR_ARG, "camera '%s' is configured twice", config->cameras[i].name);
    e = lumi_calloc(1, sizeof *e);
    if (e)
        e->jobs = lumi_calloc(ENGINE_JUDGING, sizeof *e->jobs);
    if (!e || !e->jobs) {
        lumi_free(e);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the capture engine");
    }
    e->config = *config;
    e->ports = *ports;
    e->now = now_ns;
    e->utc_offset = config->utc_offset_ns;
    e->disk_free = -1;
    e->test_camera = -1;
    e->wake = INT64_MAX;
    for (int c = 0; c < LUMI_RIG_CAMERAS; c++) {
        e->cameras[c].rig = -1;
        e->cameras[c].away_ns = now_ns;
        e->cameras[c].status.temperature = e->cameras[c].status.battery = NAN;
        e->cameras[c].status.card_free_bytes = -1;
    }
    *engine = e;
    return LUMI_OK;
}

void lumi_engine_destroy(struct lumi_engine *e)
{
    struct lumi_error ignored;

    if (!e)
        return;
    if (e->store)
        lumi_store_close(e->store, &ignored); /* what is given is finished first */
    e->store = NULL;
    engine_judge_reset(e);
    engine_account_free(e);
    for (int c = 0; c < LUMI_RIG_CAMERAS; c++) {
        engine_camera_reset(e, c);
        lumi_match_destroy(e->cameras[c].match);
    }
    for (int i = 0; i < e->override_count; i++)
        lumi_free(e->override[i]);
    lumi_free(e->override);
    lumi_free(e->plan_text);
    lumi_free(e->events);
    lumi_free(e->jobs);
    lumi_free(e);
}

/* ---- time ---- */

static void set_now(struct lumi_engine *e, int64_t now_ns)
{
    e->now = now_ns > e->now ? now_ns : e->now;
}

void engine_wake(struct lumi_engine *e, double seconds)
{
    int64_t at = e->now + (int64_t)(seconds * 1e9);

    e->wake = at < e->wake ? at : e->wake;
}

double engine_since(const struct lumi_engine *e, int64_t ns)
{
    return (double)(e->now - ns) * 1e-9;
}

int64_t engine_unix_us(const struct lumi_engine *e, int64_t host_ns)
{
    return host_ns == LUMI_NO_TIME ? LUMI_NO_TIME : (host_ns + e->utc_offset) / 1000;
}

void engine_go(struct lumi_engine *e, enum engine_stage stage)
{
    if (e->stage == STAGE_REST && stage != STAGE_REST)
        engine_look_none(e);
    e->stage = stage;
    e->stage_ns = e->now;
    e->stage_at = 0;
    engine_ask_none(e);
}

/* On while the rig may move. */
static void light_lamp(struct lumi_engine *e)
{
    const bool lit = e->moving || ((e->home_wanted || e->jogging) && !engine_board_rests(e)) ||
                     e->state == LUMI_ENGINE_HOMING || e->state == LUMI_ENGINE_SWEEPING ||
                     e->state == LUMI_ENGINE_PAUSING;

    if (lit != e->lit && e->ports.lamp)
        e->ports.lamp(e->ports.context, lit);
    e->lit = lit;
}

void engine_step(struct lumi_engine *e)
{
    if (e->stepping)
        return;
    e->stepping = true;
    e->wake = INT64_MAX;
    engine_store_collect(e);
    engine_events_settle(e);
    engine_match_all(e);
    engine_judge_due(e);
    engine_watch(e);
    for (int i = 0; i < 64 && stages[e->stage] && stages[e->stage](e); i++)
        ;
    light_lamp(e);
    e->stepping = false;
}

void lumi_engine_run(struct lumi_engine *e, int64_t now_ns)
{
    set_now(e, now_ns);
    engine_step(e);
}

int64_t lumi_engine_next(const struct lumi_engine *e)
{
    const int64_t soon = e->now + ENGINE_NS / 100;
    int64_t next = e->wake, match = engine_match_wake(e);

    next = match < next ? match : next;
    if (e->flying > 0) { /* what has to be given once more; the rest is told by the store's wake */
        for (int i = 0; i < e->flight_count; i++)
            if (e->flights[i]->used && !e->flights[i]->given && e->flights[i]->retry_ns < next)
                next = e->flights[i]->retry_ns;
    }
    return next == INT64_MAX || next > soon ? next : soon;
}

void lumi_engine_clock(struct lumi_engine *e, int64_t utc_offset_ns)
{
    double step = (double)(utc_offset_ns - e->utc_offset) * 1e-9;

    e->utc_offset = utc_offset_ns;
    if (fabs(step) > 0.1)
        engine_incident(e, -1, "clock", "the wall clock was set by %+.3f s", step);
}

/* ---- telling ---- */

char *engine_copy(const char *text)
{
    size_t size = text ? strlen(text) + 1 : 0;
    char *copy = size ? lumi_alloc(size, 1) : NULL;

    if (copy)
        memcpy(copy, text, size);
    return copy;
}

static void tell(struct lumi_engine *e, enum lumi_engine_tale kind, int shot, int camera, const char *what,
                 const char *text)
{
    struct lumi_engine_told told = {.kind = kind,
                                    .number = ++e->told_number,
                                    .unix_us = engine_unix_us(e, e->now),
                                    .state = e->state,
                                    .shot = shot,
                                    .camera = camera,
                                    .check = kind == LUMI_TALE_CHECK ? shot : -1};

    if (!e->ports.told)
        return;
    snprintf(told.what, sizeof told.what, "%s", what);
    snprintf(told.text, sizeof told.text, "%s", text ? text : "");
    if (kind == LUMI_TALE_SHOT)
        told.lost = e->account_shots && e->account_shots[shot].state == SHOT_LOST;
    if (kind == LUMI_TALE_FRAME) {
        static const enum lumi_frame_state states[] = {
            [AT_NONE] = LUMI_FRAME_PLANNED,        [AT_PLANNED] = LUMI_FRAME_PLANNED,
            [AT_TRIGGERED] = LUMI_FRAME_TRIGGERED, [AT_RECEIVED] = LUMI_FRAME_TRIGGERED,
            [AT_STORED] = LUMI_FRAME_RECEIVED,     [AT_ACCEPTED] = LUMI_FRAME_ACCEPTED,
            [AT_REJECTED] = LUMI_FRAME_REJECTED,   [AT_MISSING] = LUMI_FRAME_REJECTED};
        const struct engine_frame *frame = engine_frame_at(e, shot, camera);
        told.frame_state = states[frame->at];
        told.frame = engine_frame_number(e, shot, camera);
        told.letter = engine_frame_letter(e, frame);
        told.fault = frame->at == AT_REJECTED ? frame->fault : LUMI_JUDGE_GOOD;
    }
    if (kind == LUMI_TALE_CHECK)
        told.shot = -1;
    e->ports.told(e->ports.context, &told);
}

void engine_tell(struct lumi_engine *e, enum lumi_engine_tale kind, int shot, int camera, const char *text)
{
    tell(e, kind, shot, camera, "", text);
}

void engine_state(struct lumi_engine *e, enum lumi_engine_state state, const char *format, ...)
{
    char text[sizeof e->text];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (e->state == state && !strcmp(text, e->text))
        return;
    e->state = state;
    memcpy(e->text, text, sizeof text);
    engine_tell(e, LUMI_TALE_STATE, -1, -1, text);
}

void engine_incident(struct lumi_engine *e, int camera, const char *kind, const char *format, ...)
{
    char text[512];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    tell(e, LUMI_TALE_INCIDENT, -1, camera, kind, text);
    engine_incident_row(e, camera, kind, text);
}

void engine_incident_row(struct lumi_engine *e, int camera, const char *kind, const char *text)
{
    struct engine_flight *flight = e->store ? engine_flight(e, LUMI_STORE_INCIDENT) : NULL;

    if (!flight)
        return;
    snprintf(flight->job.text, sizeof flight->job.text, "%s", text);
    snprintf(flight->job.key, sizeof flight->job.key, "%s", kind);
    flight->job.camera = camera >= 0 ? e->cameras[camera].rig : -1;
    flight->job.time_us = engine_unix_us(e, e->now);
    engine_flight_give(e, flight);
}
