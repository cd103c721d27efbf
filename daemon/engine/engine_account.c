/* The account: shots and frames of the plan, where each is, and the store's jobs that move them on. */
#include "daemon/camera/frame_file.h"
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define RETRY_SECONDS 2.0
#define SOFTWARE_LATEST 0.5 /* s after a shot that a camera without a line is still fired for it */

/* ---- frames ---- */

struct engine_frame *engine_frame_at(struct lumi_engine *e, int shot, int camera)
{
    return e->frames + (size_t)shot * (size_t)e->config.camera_count + (size_t)camera;
}

void engine_frame_go(struct lumi_engine *e, int shot, int camera, enum engine_at at, const char *reason)
{
    struct engine_frame *frame = engine_frame_at(e, shot, camera);

    e->at_count[frame->at]--;
    e->at_count[at]++;
    frame->at = (uint8_t)at;
    lumi_free(frame->reason);
    frame->reason = reason && reason[0] ? engine_copy(reason) : NULL;
    engine_tell(e, LUMI_TALE_FRAME, shot, camera, reason);
}

bool engine_frame_needed(const struct engine_frame *frame)
{
    return frame->at == AT_PLANNED || frame->at == AT_REJECTED || frame->at == AT_MISSING;
}

int engine_frames_needed(const struct lumi_engine *e)
{
    return e->at_count[AT_PLANNED] + e->at_count[AT_REJECTED] + e->at_count[AT_MISSING];
}

bool engine_shot_needed(const struct lumi_engine *e, int shot)
{
    const struct engine_frame *frames = e->frames + (size_t)shot * (size_t)e->config.camera_count;

    for (int c = 0; c < e->config.camera_count; c++)
        if (frames[c].at == AT_PLANNED)
            return true;
    return false;
}

void engine_held_drop(struct engine_held *held)
{
    if (!held || --held->users > 0)
        return;
    lumi_camera_frame_release(held->frame);
    --*held->of;
    lumi_free(held);
}

void engine_account_free(struct lumi_engine *e)
{
    if (e->frames)
        for (size_t i = 0; i < (size_t)e->shots * (size_t)e->config.camera_count; i++)
            lumi_free(e->frames[i].reason);
    engine_judge_forget(e);
    lumi_free(e->frames);
    lumi_free(e->account_shots);
    lumi_free(e->names);
    lumi_free(e->board_shots);
    lumi_free(e->drive_states);
    lumi_free(e->chosen);
    for (int i = 0; i < e->flight_count; i++) {
        struct engine_flight *flight = e->flights[i];
        if (flight->used) {
            if (flight->filing)
                lumi_frame_file_finish(&flight->filing->file);
            engine_held_drop(flight->held);
        }
        lumi_free(flight->filing);
        lumi_free(flight->path);
        lumi_free(flight);
    }
    lumi_free(e->flights);
    e->frames = NULL;
    e->account_shots = NULL;
    e->names = NULL;
    e->board_shots = NULL;
    e->drive_states = NULL;
    e->chosen = NULL;
    e->flights = NULL;
    e->flight_count = e->flight_room = e->flying = 0;
    e->disk_full = false;
}

/* ---- jobs ---- */

struct engine_flight *engine_flight(struct lumi_engine *e, enum lumi_store_job_kind kind)
{
    struct engine_flight *flight = NULL;
    int place = 0;

    while (place < e->flight_count && e->flights[place]->used)
        place++;
    if (place == e->flight_count) {
        if (e->flight_count == e->flight_room) {
            int room = e->flight_room ? 2 * e->flight_room : 64;
            struct engine_flight **flights = lumi_realloc(e->flights, (size_t)room, sizeof(struct engine_flight *));
            if (!flights)
                return NULL;
            e->flights = flights;
            e->flight_room = room;
        }
        flight = lumi_calloc(1, sizeof *flight);
        if (!flight)
            return NULL;
        e->flights[e->flight_count++] = flight;
    }
    flight = e->flights[place];
    *flight = (struct engine_flight){.used = true, .generation = flight->generation + 1, .shot = -1, .camera = -1};
    flight->job = (struct lumi_store_job){
        .kind = kind, .id = (uint64_t)flight->generation << 32 | (uint32_t)place, .exposed_us = LUMI_NO_TIME};
    flight->job.file.camera_time_us = LUMI_NO_TIME;
    flight->job.sweep = e->sweep_number;
    e->flying++;
    return flight;
}

static void land(struct lumi_engine *e, struct engine_flight *flight)
{
    if (flight->event && e->event_count > 0 && flight->event >= e->events[0].serial) {
        uint64_t at = flight->event - e->events[0].serial;
        if (at < (uint64_t)e->event_count && e->events[at].pending > 0)
            e->events[at].pending--;
    }
    if (flight->filing) {
        lumi_frame_file_finish(&flight->filing->file);
        lumi_free(flight->filing);
        flight->filing = NULL;
    }
    lumi_free(flight->path);
    flight->path = NULL;
    engine_held_drop(flight->held);
    flight->held = NULL;
    flight->used = false;
    e->flying--;
}

/* What the disk did to a job. Full, or out of order: given once more later; anything else would fail again. */
static bool again_later(struct lumi_engine *e, struct engine_flight *flight, int code, const char *text)
{
    if (code != LUMI_ERR_NOSPACE && code != LUMI_ERR_IO && code != LUMI_ERR_NOMEM && code != LUMI_ERR_BUSY)
        return false;
    if (!e->disk_full)
        engine_tell(e, LUMI_TALE_INCIDENT, -1, -1, text);
    e->disk_full = true;
    snprintf(e->disk_text, sizeof e->disk_text, "%.200s", text);
    flight->given = false;
    flight->tries++;
    flight->retry_ns = e->now + (int64_t)(RETRY_SECONDS * 1e9);
    return true;
}

static void failed(struct lumi_engine *e, struct engine_flight *flight, int code, const char *text)
{
    const enum lumi_store_job_kind kind = flight->job.kind;
    const int shot = flight->shot, camera = flight->camera;

    if (kind == LUMI_STORE_SEAL) {
        e->sealed_ok = false;
        land(e, flight);
        engine_fail(e, "%s", text);
        return;
    }
    (void)code;
    if (kind == LUMI_STORE_FRAME) {
        struct engine_frame *frame = engine_frame_at(e, shot, camera);
        if (frame->at == AT_RECEIVED && frame->row == flight->job.frame)
            engine_frame_lost(e, shot, camera, "could not be stored: %s", text);
    } else if (kind == LUMI_STORE_RETAKE) {
        engine_frame_at(e, shot, camera)->flying = false;
        engine_frame_at(e, shot, camera)->stuck = true;
        engine_tell(e, LUMI_TALE_INCIDENT, -1, camera, text);
    } else {
        engine_tell(e, LUMI_TALE_INCIDENT, -1, camera, text);
    }
    land(e, flight);
}

void engine_flight_give(struct lumi_engine *e, struct engine_flight *flight)
{
    struct lumi_error error;
    int code;

    if (!e->store) {
        land(e, flight);
        return;
    }
    flight->given = true;
    code = lumi_store_give(e->store, &flight->job, &error);
    if (code == LUMI_OK)
        return;
    flight->given = false;
    if (code == LUMI_ERR_LIMIT) {
        struct lumi_store_figures figures;
        lumi_store_figures(e->store, &figures);
        snprintf(error.text, sizeof error.text, "no memory is left, the disk is too slow (%.1f MB/s)",
                 figures.bytes_per_second * 1e-6);
        if (flight->job.kind != LUMI_STORE_FRAME)
            code = LUMI_ERR_NOMEM;
    }
    if (!again_later(e, flight, code, error.text))
        failed(e, flight, code, error.text);
}

/* ---- what the store has done ---- */

static void stored(struct lumi_engine *e, struct engine_flight *flight, const struct lumi_store_done *done)
{
    struct engine_frame *frame = engine_frame_at(e, flight->shot, flight->camera);

    if (frame->row != flight->job.frame || frame->at != AT_RECEIVED)
        return;
    e->bytes += (int64_t)done->bytes;
    e->tries = 0;
    frame->dead_row = false;
    engine_frame_go(e, flight->shot, flight->camera, AT_STORED, NULL);
    if (frame->asked)
        engine_reject_asked(e, flight->shot, flight->camera);
    else if (e->config.judging)
        engine_judge(e, flight->shot, flight->camera, flight->held);
}

/* As lumi_capture_retake_frame calls it: NAME.2, NAME.3 … */
static void rename_retake(char name[LUMI_CAPTURE_NAME], int retakes)
{
    size_t length = strlen(name);
    char *dot = retakes > 1 ? strrchr(name, '.') : NULL;

    if (dot)
        length = (size_t)(dot - name);
    snprintf(name + length, LUMI_CAPTURE_NAME - length, ".%d", retakes + 1);
}

static void retake_row(struct lumi_engine *e, struct engine_flight *flight, const struct lumi_store_done *done)
{
    struct engine_frame *frame = engine_frame_at(e, flight->shot, flight->camera);

    frame->flying = false;
    frame->row = done->frame;
    frame->dead_row = frame->asked = false;
    frame->exposed_ns = LUMI_NO_TIME;
    rename_retake(e->names[(size_t)flight->shot * (size_t)e->config.camera_count + (size_t)flight->camera],
                  ++frame->retakes);
    engine_frame_go(e, flight->shot, flight->camera, AT_PLANNED, NULL);
}

static void take_done(struct lumi_engine *e, const struct lumi_store_done *done)
{
    uint32_t place = (uint32_t)done->id;
    struct engine_flight *flight = place < (uint32_t)e->flight_count ? e->flights[place] : NULL;

    if (!flight || !flight->used || !flight->given || flight->generation != (uint32_t)(done->id >> 32))
        return;
    if (done->code != LUMI_OK) {
        if (!again_later(e, flight, done->code, done->text))
            failed(e, flight, done->code, done->text);
        return;
    }
    switch (flight->job.kind) {
    case LUMI_STORE_FRAME:
        stored(e, flight, done);
        break;
    case LUMI_STORE_RETAKE:
        retake_row(e, flight, done);
        break;
    case LUMI_STORE_SEAL:
        e->sealed_ok = true;
        break;
    default:
        break;
    }
    land(e, flight);
}

void engine_store_collect(struct lumi_engine *e)
{
    struct lumi_store_done done;
    bool waiting = false;

    if (!e->store)
        return;
    while (lumi_store_done(e->store, &done))
        take_done(e, &done);
    for (int i = 0; i < e->flight_count; i++) {
        struct engine_flight *flight = e->flights[i];
        if (!flight->used || flight->given)
            continue;
        if (flight->retry_ns <= e->now)
            engine_flight_give(e, flight);
        waiting |= flight->used && (!flight->given || flight->tries > 0);
    }
    for (int i = 0; i < e->flight_count && !waiting; i++)
        waiting = e->flights[i]->used && e->flights[i]->tries > 0;
    e->disk_full = waiting;
}

/* ---- shots ---- */

void engine_frame_lost(struct lumi_engine *e, int shot, int camera, const char *format, ...)
{
    struct engine_frame *frame = engine_frame_at(e, shot, camera);
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_LOST);
    char text[256];
    va_list list;

    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    frame->dead_row |= frame->at == AT_TRIGGERED || frame->at == AT_RECEIVED;
    frame->asked = false; /* it is taken again for that it is missing */
    engine_frame_go(e, shot, camera, AT_MISSING, text);
    if (!flight)
        return;
    flight->job.frame = frame->row;
    flight->shot = shot;
    flight->camera = camera;
    snprintf(flight->job.text, sizeof flight->job.text, "%s", text);
    engine_flight_give(e, flight);
}

static void expect(struct lumi_engine *e, int shot, int camera, int64_t begin_ns)
{
    struct engine_camera *c = e->cameras + camera;
    double exposure = e->plan.exposures[shot % e->plan.bracket];

    if (c->identity.records_itself)
        return; /* its files are matched when the sweep is over */
    if (begin_ns != LUMI_NO_TIME && c->match && lumi_match_expect(c->match, begin_ns, exposure, shot))
        return;
    engine_frame_lost(e, shot, camera, "the time of its exposure is not known");
}

/* A camera without a line from the board is fired now, if it is still the time of the shot: a start-stop sweep stands
 * until the next position is due. Returns when the exposure begins. */
static int64_t fired_by_software(struct lumi_engine *e, int camera, int64_t begin_ns)
{
    if (e->config.cameras[camera].setting.trigger != LUMI_TRIGGER_SOFTWARE || begin_ns == LUMI_NO_TIME ||
        engine_since(e, begin_ns) > SOFTWARE_LATEST)
        return begin_ns;
    engine_camera_do(e, camera, LUMI_CAMERA_TRIGGER, e->cameras[camera].exposure_s);
    return e->now;
}

void engine_shot_fired(struct lumi_engine *e, int shot, const int64_t *begin_ns, uint32_t cameras, uint64_t event)
{
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_SHOT);
    struct engine_shot *s = e->account_shots + shot;
    int rows = 0;

    if (s->state != SHOT_FIRED)
        e->shots_fired++;
    if (s->state == SHOT_LOST)
        e->shots_lost--;
    s->state = SHOT_FIRED;
    e->fresh = false;
    for (int c = 0; c < e->config.camera_count; c++) {
        struct engine_frame *frame = engine_frame_at(e, shot, c);
        if (flight)
            flight->job.trigger_us[c] = LUMI_NO_TIME;
        if (frame->at == AT_NONE || !(cameras & 1u << c))
            continue;
        if (begin_ns[c] != LUMI_NO_TIME)
            s->expected_ns = begin_ns[c];
        if (frame->at != AT_PLANNED) { /* good already: what comes of it is surplus */
            if (begin_ns[c] != LUMI_NO_TIME && e->cameras[c].match && !e->cameras[c].identity.records_itself)
                lumi_match_expect(e->cameras[c].match, begin_ns[c], e->plan.exposures[shot % e->plan.bracket], shot);
            continue;
        }
        if (flight) {
            double lag = e->rig.control.triggers[e->cameras[c].rig].shutter_lag;
            flight->job.frames[c] = frame->row;
            if (begin_ns[c] != LUMI_NO_TIME)
                flight->job.trigger_us[c] = engine_unix_us(e, begin_ns[c] - (int64_t)(lag * 1e9));
        }
        rows++;
        engine_frame_go(e, shot, c, AT_TRIGGERED, NULL);
    }
    engine_tell(e, LUMI_TALE_SHOT, shot, -1, NULL);
    if (flight && rows > 0) {
        flight->shot = shot;
        flight->event = event;
        if (event)
            e->events[event - e->events[0].serial].pending++;
        engine_flight_give(e, flight);
    } else if (flight) {
        land(e, flight);
    }
    for (int c = 0; c < e->config.camera_count; c++)
        if (cameras & 1u << c && engine_frame_at(e, shot, c)->at == AT_TRIGGERED)
            expect(e, shot, c, fired_by_software(e, c, begin_ns[c]));
}

/* The next exposure of a bracket, told to the cameras that can be told. */
static void next_exposure(struct lumi_engine *e, int shot)
{
    int next = shot + 1;

    if (e->plan.bracket < 2)
        return;
    while (next < e->shots && !engine_shot_needed(e, next))
        next++;
    double exposure = e->plan.exposures[next % e->plan.bracket];
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used && e->cameras[c].there && e->cameras[c].identity.exposure_control &&
            e->config.cameras[c].setting.exposure_s <= 0 && e->cameras[c].exposure_s != exposure)
            engine_camera_do(e, c, LUMI_CAMERA_EXPOSE, exposure);
}

void engine_shot_event(struct lumi_engine *e, struct engine_event *event)
{
    const lumi_wire_Shot *told = &event->event.kind.shot;
    int64_t begin_ns[LUMI_RIG_CAMERAS];
    uint32_t cameras = 0;

    if (!e->frames || !e->store || told->number >= (uint32_t)e->shots)
        return; /* of no plan of ours */
    const int shot = (int)told->number;
    if (told->lost) {
        if (e->account_shots[shot].state == SHOT_PLANNED) {
            e->account_shots[shot].state = SHOT_LOST;
            e->shots_lost++;
        }
        engine_incident(e, -1, "lost", "shot %d was lost", shot);
        engine_tell(e, LUMI_TALE_SHOT, shot, -1, NULL);
        next_exposure(e, shot);
        return;
    }
    for (int c = 0; c < e->config.camera_count; c++)
        begin_ns[c] = LUMI_NO_TIME;
    for (int channel = 0, edge = 0; channel < LUMI_RIG_CHANNELS; channel++) {
        if (!(told->channels & 1u << channel) || edge >= (int)told->edge_ns_count)
            continue;
        int64_t at = e->ports.rig_to_host(e->ports.context, (uint64_t)((int64_t)told->middle_ns + told->edge_ns[edge]));
        edge++;
        for (int c = 0; c < e->config.camera_count; c++) {
            const int rig = e->cameras[c].rig;
            if (rig < 0 || !e->cameras[c].used || e->rig.control.triggers[rig].channel != channel)
                continue;
            cameras |= 1u << c;
            if (at)
                begin_ns[c] = at + (int64_t)(e->rig.control.triggers[rig].shutter_lag * 1e9);
        }
    }
    e->account_shots[shot].turns = told->step / lumi_rig_steps_per_turn(&e->rig);
    engine_shot_fired(e, shot, begin_ns, cameras, event->serial);
    next_exposure(e, shot);
}
