/* Frames: which shot each is of, and onto the disk with it. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FREE_PERIOD (1.0 / 30) /* s, of a free-running camera's frames before it is measured */
#define FREE_SETTLE 0.3        /* s, that they are kept for a shot that is not known yet */
#define TELL_BY_NAME 20        /* incidents of one kind and camera that are told one by one */

/* ---- coming in ---- */

static void keep_file(struct lumi_engine *e, int camera, struct engine_held *held)
{
    struct engine_camera *c = e->cameras + camera;

    if (c->file_count == c->file_room) {
        int room = c->file_room ? 2 * c->file_room : 64;
        struct engine_held **files = lumi_realloc(c->files, (size_t)room, sizeof(struct engine_held *));
        if (!files) {
            engine_held_drop(held);
            return;
        }
        c->files = files;
        c->file_room = room;
    }
    c->files[c->file_count++] = held;
    c->file_ns = e->now;
}

void engine_frame_came(struct lumi_engine *e, int camera, struct lumi_camera_frame *frame)
{
    struct engine_camera *c = e->cameras + camera;
    struct engine_held *held;

    if (!frame)
        return;
    if (e->config.cameras[camera].black > 0)
        frame->black = e->config.cameras[camera].black;
    if (e->stage == STAGE_TRIGGERS || (e->stage == STAGE_TEST && e->test_camera >= 0 && !c->identity.records_itself)) {
        engine_test_frame(e, camera, frame);
        return;
    }
    if (!engine_taking(e) || !c->used || !c->match) {
        if (c->looking)
            engine_picture(e, -1, camera, frame);
        lumi_camera_frame_release(frame);
        return;
    }
    held = lumi_calloc(1, sizeof *held);
    if (!held) {
        engine_incident(e, camera, "memory", "no memory for a frame of %s", e->config.cameras[camera].name);
        lumi_camera_frame_release(frame);
        return;
    }
    *held = (struct engine_held){.frame = frame, .users = 1, .bytes = frame->size, .of = &c->held};
    c->held++;
    if (c->identity.records_itself || frame->format.layout == LUMI_LAYOUT_FILE) {
        keep_file(e, camera, held);
        return;
    }
    if (frame->gap && e->config.cameras[camera].setting.trigger != LUMI_TRIGGER_FREE)
        engine_incident(e, camera, "gap", "%s lost %u frames before number %llu", e->config.cameras[camera].name,
                        frame->gap, (unsigned long long)frame->sequence);
    lumi_match_frame(c->match, &(struct lumi_match_frame){.device_ns = c->identity.device_clock ? frame->device_ns
                                                                                                : LUMI_MATCH_NO_TIME,
                                                          .host_ns = frame->host_ns,
                                                          .sequence = frame->sequence,
                                                          .gap = frame->gap,
                                                          .tag = held});
}

/* ---- onto the disk ---- */

/* In a writer's thread: the file's bytes are made. */
static int make_file(void *context, struct lumi_store_job *job, struct lumi_error *error)
{
    struct engine_flight *flight = context;
    struct lumi_frame_file *file = &flight->filing->file;

    lumi_frame_file_finish(file); /* of an attempt before */
    LUMI_TRY(lumi_frame_file_make(flight->held->frame, &flight->filing->about, file, error));
    job->piece_count = file->count;
    for (int i = 0; i < file->count; i++)
        job->pieces[i] = file->pieces[i];
    job->path = file->count ? NULL : file->path;
    job->file.extension = file->extension;
    job->file.width = file->width;
    job->file.height = file->height;
    job->file.exposure_s = file->exposure_s;
    job->file.iso = file->iso;
    return LUMI_OK;
}

/* The exposure that the camera says is the plan's, to a sixth of a stop. */
static bool exposure_as_planned(const struct lumi_engine *e, int shot, int camera,
                                const struct lumi_camera_frame *frame)
{
    double planned = e->config.cameras[camera].setting.exposure_s;

    planned = planned > 0 ? planned : e->plan.exposures[shot % e->plan.bracket];
    return frame->exposure_s <= 0 || fabs(log2(frame->exposure_s / planned)) < 1.0 / 6;
}

/* What the file says besides the frame: the camera may be another one by the time that it is written. */
static struct engine_filing *describe(const struct lumi_engine *e, int shot, int camera)
{
    const struct lumi_engine_camera *set = e->config.cameras + camera;
    const struct lumi_camera_identity *identity = &e->cameras[camera].identity;
    const struct engine_frame *frame = e->frames + (size_t)shot * (size_t)e->config.camera_count + (size_t)camera;
    int64_t exposed_ns = frame->exposed_ns != LUMI_NO_TIME ? frame->exposed_ns : e->account_shots[shot].expected_ns;
    struct engine_filing *filing = lumi_calloc(1, sizeof *filing);

    if (!filing)
        return NULL;
    memcpy(filing->vendor, identity->vendor, sizeof filing->vendor);
    memcpy(filing->model, identity->model, sizeof filing->model);
    memcpy(filing->serial, identity->serial, sizeof filing->serial);
    filing->about = (struct lumi_frame_about){.make = filing->vendor,
                                              .model = filing->model[0] ? filing->model : NULL,
                                              .serial = filing->serial,
                                              .white = {set->white_red, set->white_blue},
                                              .unix_us = engine_unix_us(e, exposed_ns)};
    return filing;
}

static void store_frame(struct lumi_engine *e, int shot, int camera, struct engine_held *held)
{
    const struct lumi_camera_frame *frame = held->frame;
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_FRAME);

    if (flight)
        flight->filing = describe(e, shot, camera);
    engine_frame_go(e, shot, camera, AT_RECEIVED, NULL);
    if (!flight || !flight->filing) {
        engine_frame_lost(e, shot, camera, "no memory");
        engine_held_drop(held);
        if (flight) {
            flight->used = false;
            e->flying--;
        }
        return;
    }
    engine_picture(e, shot, camera, held->frame);
    flight->shot = shot;
    flight->camera = camera;
    flight->held = held;
    flight->job.frame = engine_frame_at(e, shot, camera)->row;
    flight->job.prepare = make_file;
    flight->job.context = flight;
    flight->job.bytes = frame->format.layout == LUMI_LAYOUT_FILE ? 0 : lumi_frame_file_bytes(frame);
    if (frame->device_ns != LUMI_CAMERA_NO_TIME)
        flight->job.file.camera_time_us = frame->device_ns / 1000;
    engine_flight_give(e, flight);
}

static void take_hit(struct lumi_engine *e, int camera, const struct lumi_match_result *result)
{
    struct engine_held *held = result->frame;
    struct engine_frame *frame = engine_frame_at(e, result->shot, camera);
    struct engine_camera *c = e->cameras + camera;
    const char *name = e->config.cameras[camera].name;

    if (result->late)
        engine_incident(e, camera, "late", "frame of shot %d, %s, came %.2f s after its exposure", result->shot, name,
                        result->latency);
    if (result->out_of_order)
        engine_incident(e, camera, "order", "frame of shot %d, %s, came after a later one", result->shot, name);
    if (frame->at != AT_TRIGGERED) { /* a retake's, of a camera whose frame was good */
        c->surplus++;
        engine_held_drop(held);
        return;
    }
    if (c->doubtful) {
        engine_frame_lost(e, result->shot, camera, "whether this frame is its own is not known: no test was answered");
        engine_held_drop(held);
        return;
    }
    if (held->frame->damaged) {
        engine_incident(e, camera, "damaged", "the frame of shot %d from %s came damaged", result->shot, name);
        engine_frame_lost(e, result->shot, camera, "it came damaged: %u packets are missing",
                          held->frame->packets_missing);
        engine_held_drop(held);
        return;
    }
    if (!exposure_as_planned(e, result->shot, camera, held->frame)) {
        if (c->wrong_exposure++ < TELL_BY_NAME)
            engine_incident(e, camera, "exposure", "%s took shot %d with %.6g s instead of %.6g s", name, result->shot,
                            held->frame->exposure_s, e->plan.exposures[result->shot % e->plan.bracket]);
        engine_frame_lost(e, result->shot, camera, "taken with %.6g s instead of %.6g s", held->frame->exposure_s,
                          e->plan.exposures[result->shot % e->plan.bracket]);
        engine_held_drop(held);
        return;
    }
    store_frame(e, result->shot, camera, held);
}

static void take_dropped(struct lumi_engine *e, int camera, const struct lumi_match_result *result)
{
    e->cameras[camera].misses++;
    if (engine_frame_at(e, result->shot, camera)->at != AT_TRIGGERED)
        return;
    engine_incident(e, camera, "dropped", "no frame of shot %d came from %s", result->shot,
                    e->config.cameras[camera].name);
    engine_frame_lost(e, result->shot, camera,
                      e->cameras[camera].there ? "its frame never came" : "the camera was away");
}

static void take_exposed(struct lumi_engine *e, int camera, const struct lumi_match_result *result)
{
    struct engine_frame *frame = engine_frame_at(e, result->shot, camera);
    struct engine_flight *flight;

    if (frame->exposed_ns != LUMI_NO_TIME || !(flight = engine_flight(e, LUMI_STORE_EXPOSED)))
        return;
    frame->exposed_ns = result->at_ns;
    flight->shot = result->shot;
    flight->camera = camera;
    flight->job.frame = frame->row;
    flight->job.exposed_us = engine_unix_us(e, result->at_ns);
    engine_flight_give(e, flight);
}

static void take_result(struct lumi_engine *e, int camera, const struct lumi_match_result *result)
{
    const char *name = e->config.cameras[camera].name;

    switch (result->kind) {
    case LUMI_MATCH_HIT:
        take_hit(e, camera, result);
        break;
    case LUMI_MATCH_DOUBLED:
        engine_incident(e, camera, "doubled", "a second frame of shot %d came from %s", result->shot, name);
        engine_held_drop(result->frame);
        break;
    case LUMI_MATCH_SURPLUS:
        e->cameras[camera].misses++;
        if (e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_FREE)
            ; /* as most of them */
        else if (e->cameras[camera].surplus++ < TELL_BY_NAME)
            engine_incident(e, camera, "surplus", "a frame of no shot came from %s", name);
        engine_held_drop(result->frame);
        break;
    case LUMI_MATCH_DROPPED:
        take_dropped(e, camera, result);
        break;
    case LUMI_MATCH_EXPOSED:
        take_exposed(e, camera, result);
        break;
    case LUMI_MATCH_UNSEEN:
        if (e->cameras[camera].unseen++ < TELL_BY_NAME)
            engine_incident(e, camera, "sync", "no sync edge of shot %d came from %s", result->shot, name);
        break;
    }
}

void engine_match_all(struct lumi_engine *e)
{
    struct lumi_match_result result;

    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].match && !e->connected)
            lumi_match_deaf(e->cameras[c].match, e->now);
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->frames && e->cameras[c].used && e->cameras[c].match)
            while (lumi_match_next(e->cameras[c].match, e->now, &result))
                take_result(e, c, &result);
}

int64_t engine_match_wake(const struct lumi_engine *e)
{
    int64_t wake = INT64_MAX;

    for (int c = 0; c < e->config.camera_count; c++)
        if (e->frames && e->cameras[c].used && e->cameras[c].match) {
            int64_t at = lumi_match_wake(e->cameras[c].match);
            wake = at < wake ? at : wake;
        }
    return wake;
}

void engine_match_options(const struct lumi_engine *e, int camera, struct lumi_match_options *options)
{
    const struct engine_camera *c = e->cameras + camera;

    lumi_match_options_init(options);
    options->spacing = engine_spacing(e);
    options->window = e->config.match_window;
    options->patience = e->config.frame_patience;
    options->device_clock = c->identity.device_clock;
    if (e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_FREE) {
        const double rate = e->config.cameras[camera].setting.frame_rate;
        options->period = rate > 0 ? 1 / rate : FREE_PERIOD;
        options->settle = FREE_SETTLE;
        options->device_clock = c->identity.device_clock && c->identity.monotonic_clock;
    }
    options->edges =
        e->config.cameras[camera].sync_line || (c->rig >= 0 && e->rig.control.triggers[c->rig].feedback >= 0);
}

void engine_match_begin(struct lumi_engine *e)
{
    struct lumi_match_options options;
    struct lumi_error ignored;

    for (int c = 0; c < e->config.camera_count; c++) {
        if (!e->cameras[c].used)
            continue;
        engine_match_options(e, c, &options);
        if (e->cameras[c].match)
            lumi_match_sweep(e->cameras[c].match, &options);
        else if (lumi_match_create(&options, &e->cameras[c].match, &ignored) != LUMI_OK)
            e->cameras[c].match = NULL;
    }
}

/* ---- cameras that record by themselves ---- */

static int by_path(const void *a, const void *b)
{
    return lumi_camera_file_order((*(struct engine_held *const *)a)->frame->path,
                                  (*(struct engine_held *const *)b)->frame->path);
}

/* All that has come, against all shots that were fired and have no file of this camera. */
void engine_match_files(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;
    int64_t *files = lumi_alloc((size_t)c->file_count + 1, sizeof *files);
    int64_t *times = lumi_alloc((size_t)e->shots + 1, sizeof *times);
    int *shots = lumi_alloc((size_t)e->shots + 1, sizeof *shots);
    int *pairs = lumi_alloc((size_t)c->file_count + 1, sizeof *pairs);
    int count = 0;

    if (files && times && shots && pairs && c->file_count > 0) {
        qsort(c->files, (size_t)c->file_count, sizeof(struct engine_held *), by_path);
        for (int i = 0; i < c->file_count; i++)
            files[i] = c->files[i]->frame->file_mtime_ns;
        for (int shot = 0; shot < e->shots; shot++)
            if (engine_frame_at(e, shot, camera)->at == AT_TRIGGERED) {
                shots[count] = shot;
                times[count++] = e->account_shots[shot].expected_ns + e->utc_offset;
            }
        double tolerance = engine_spacing(e) / 2 > 1 ? engine_spacing(e) / 2 : 1;
        lumi_match_files(files, c->file_count, times, count, tolerance, pairs, NULL);
        for (int i = 0; i < c->file_count; i++) {
            if (pairs[i] >= 0) {
                store_frame(e, shots[pairs[i]], camera, c->files[i]);
                continue;
            }
            c->surplus++;
            engine_incident(e, camera, "surplus", "%s is of no shot", c->files[i]->frame->path);
            engine_held_drop(c->files[i]);
        }
        c->file_count = 0;
    }
    lumi_free(files);
    lumi_free(times);
    lumi_free(shots);
    lumi_free(pairs);
    for (int shot = 0; shot < e->shots; shot++)
        if (engine_frame_at(e, shot, camera)->at == AT_TRIGGERED)
            engine_frame_lost(e, shot, camera, "no file of it was found");
}
