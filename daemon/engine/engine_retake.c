/* Retakes that somebody asks for. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool engine_resting(const struct lumi_engine *e)
{
    return e->stage == STAGE_REST && !e->store;
}

int engine_busy(const struct lumi_engine *e, struct lumi_error *error)
{
    const char *path = e->capture[0] ? strrchr(e->capture, '/') : NULL;
    const char *name = path ? path + 1 : e->name;

    return lumi_fail(error, LUMI_ERR_BUSY, "another capture is under way: %.200s%s%.200s%s%s", name,
                     name[0] && e->title[0] ? ", " : "", e->title, name[0] || e->title[0] ? ", " : "",
                     lumi_engine_state_name(e->state));
}

/* From where it was found last: lists are in the order of the frames more often than not. */
static bool find(const struct lumi_engine *e, const char *name, size_t *at)
{
    const size_t all = (size_t)e->shots * (size_t)e->config.camera_count;

    for (size_t k = 0; k < all; k++) {
        const size_t i = (*at + k) % all;
        if (e->frames[i].at != AT_NONE && !strcmp(e->names[i], name)) {
            *at = i;
            return true;
        }
    }
    return false;
}

static int choose(struct lumi_engine *e, const char *const *frames, struct lumi_error *error)
{
    size_t i = 0;

    if (!frames || !frames[0])
        return LUMI_OK;
    e->chosen = lumi_calloc((size_t)e->shots * (size_t)e->config.camera_count + 1, sizeof *e->chosen);
    if (!e->chosen)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory");
    for (int k = 0; frames[k]; k++) {
        if (!find(e, frames[k], &i))
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no frame '%.80s'", e->capture, frames[k]);
        e->chosen[i] = true;
    }
    return LUMI_OK;
}

void engine_reject_asked(struct lumi_engine *e, int shot, int camera)
{
    struct engine_frame *frame = engine_frame_at(e, shot, camera);
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_JUDGED);

    if (!flight)
        return;
    frame->asked = frame->dead_row = true;
    if (frame->judge_due)
        e->judge_due--;
    frame->judge_due = false;
    frame->fault = LUMI_JUDGE_OTHER;
    engine_frame_go(e, shot, camera, AT_REJECTED, "retake asked for");
    flight->shot = shot;
    flight->camera = camera;
    flight->job.frame = frame->row;
    flight->job.judgement = (struct lumi_capture_judgement){NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    snprintf(flight->job.text, sizeof flight->job.text, "retake asked for");
    engine_flight_give(e, flight);
}

/* Named frames that are good are thrown out: that is what was asked for. */
static void reject_chosen(struct lumi_engine *e)
{
    for (int shot = 0; e->chosen && shot < e->shots; shot++)
        for (int c = 0; c < e->config.camera_count; c++) {
            const struct engine_frame *frame = engine_frame_at(e, shot, c);
            if (e->chosen[shot * e->config.camera_count + c] && (frame->at == AT_STORED || frame->at == AT_ACCEPTED))
                engine_reject_asked(e, shot, c);
        }
}

/* ---- while the sweep goes on ---- */

/* What is good is rejected now, so that a crash forgets nothing; what is on its way when it is stored; what is planned
 * yet is taken anyway. The round that follows the sweep takes them. */
static int ask_later(struct lumi_engine *e, const char *const *frames, struct lumi_error *error)
{
    size_t i = 0;

    if (e->stage == STAGE_SEAL || e->stage == STAGE_CLOSE || e->want_stop ||
        (e->stage == STAGE_DRAIN && e->stage_at > 1))
        return lumi_fail(error, LUMI_ERR_BUSY, "%s is being closed: ask again when that is done", e->capture);
    for (int k = 0; frames[k]; k++)
        if (!find(e, frames[k], &i))
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no frame '%.80s'", e->capture, frames[k]);
    for (int k = 0; frames[k]; k++) {
        find(e, frames[k], &i);
        struct engine_frame *frame = e->frames + i;
        if (e->chosen)
            e->chosen[i] = true;
        if (frame->at == AT_STORED || frame->at == AT_ACCEPTED)
            engine_reject_asked(e, (int)(i / (size_t)e->config.camera_count),
                                (int)(i % (size_t)e->config.camera_count));
        else if (frame->at == AT_TRIGGERED || frame->at == AT_RECEIVED)
            frame->asked = true;
    }
    if (e->retakes_left < 1)
        e->retakes_left = 1;
    engine_step(e);
    return LUMI_OK;
}

static bool is_open(const struct lumi_engine *e, const char *capture)
{
    const char *name = strrchr(e->capture, '/');

    return !capture || !capture[0] || !strcmp(capture, e->capture) || (name && !strcmp(capture, name + 1));
}

int lumi_engine_retake(struct lumi_engine *e, int64_t now_ns, const char *capture, const char *const *frames,
                       struct lumi_error *error)
{
    char path[1400];

    e->now = now_ns > e->now ? now_ns : e->now;
    if (!engine_resting(e) && engine_taking(e) && e->frames && frames && frames[0] && is_open(e, capture))
        return ask_later(e, frames, error);
    if (!engine_resting(e))
        return engine_busy(e, error);
    path[0] = '\0';
    if (!capture || !capture[0]) {
        if (e->capture[0])
            snprintf(path, sizeof path, "%s", e->capture);
        else
            engine_youngest(e, path, sizeof path);
    } else if (capture[0] == '/')
        snprintf(path, sizeof path, "%s", capture);
    else
        snprintf(path, sizeof path, "%s/%s", e->config.folder, capture);
    if (!path[0])
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no capture is there; name one (--capture NAME)",
                         e->config.folder);
    for (int c = 0; c < LUMI_RIG_CAMERAS; c++)
        engine_camera_reset(e, c);
    /* Nothing is unsealed for nothing. */
    LUMI_TRY(engine_look(e, path, error));
    LUMI_TRY(choose(e, frames, error));
    if (!e->chosen && engine_frames_needed(e) + e->at_count[AT_TRIGGERED] == 0)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: nothing is missing or rejected", path);
    LUMI_TRY(engine_reopen(e, path, error));
    LUMI_TRY(choose(e, frames, error));
    reject_chosen(e);
    e->round = 1;
    e->retakes_left = e->config.retakes > 0 ? e->config.retakes - 1 : 0;
    e->fresh = false;
    engine_state(e, LUMI_ENGINE_INTERRUPTED, "retakes");
    e->go_on = true;
    engine_go(e, STAGE_INTERRUPTED);
    e->stage_ns = INT64_MIN;
    engine_step(e);
    return LUMI_OK;
}
