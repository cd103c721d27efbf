/* What can be seen of the engine. */
#include "daemon/engine/engine_priv.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *lumi_engine_state_name(enum lumi_engine_state state)
{
    static const char *const names[LUMI_ENGINE_STATES] = {"idle",     "preflight", "red",    "homing",      "arming",
                                                          "sweeping", "pausing",   "paused", "interrupted", "draining",
                                                          "sealing",  "done",      "failed"};

    return (int)state >= 0 && state < LUMI_ENGINE_STATES ? names[state] : "unknown";
}

const char *lumi_verdict_name(enum lumi_verdict verdict)
{
    static const char *const names[] = {"green", "yellow", "red", "undecided"};

    return (int)verdict >= 0 && verdict <= LUMI_UNDECIDED ? names[verdict] : "unknown";
}

static void camera_status(const struct lumi_engine *e, int camera, struct lumi_engine_camera_status *status)
{
    const struct engine_camera *c = e->cameras + camera;
    struct lumi_match_clock clock = {0};

    snprintf(status->name, sizeof status->name, "%s", e->config.cameras[camera].name);
    status->there = c->there;
    status->armed = c->armed;
    status->configured = c->configured;
    status->identity = c->identity;
    status->status = c->status;
    if (c->match)
        lumi_match_clock(c->match, &clock);
    status->clock_fitted = clock.known;
    status->clock_offset_s = clock.offset_s;
    status->clock_drift_ppm = clock.drift_ppm;
    status->clock_residual_s = clock.residual_s;
    status->clock_residual_worst_s = clock.residual_worst_s;
    status->matched = clock.matched;
    status->dropped = clock.dropped;
    status->doubled = clock.doubled;
    status->late = clock.late;
    status->out_of_order = clock.out_of_order;
    status->surplus = c->surplus;
}

static double seconds_left(const struct lumi_engine *e)
{
    int left = 0;

    if (!e->plan_known || !e->store)
        return NAN;
    for (int shot = 0; shot < e->shots; shot++)
        left += engine_shot_needed(e, shot);
    return lumi_plan_seconds(&e->plan, &e->rig) * left / e->shots;
}

void lumi_engine_status(const struct lumi_engine *e, struct lumi_engine_status *status)
{
    const int *at = e->at_count;

    memset(status, 0, sizeof *status);
    status->state = e->state;
    snprintf(status->text, sizeof status->text, "%s", e->text);
    snprintf(status->capture, sizeof status->capture, "%s", e->capture);
    if (e->plan_known) {
        snprintf(status->plan_name, sizeof status->plan_name, "%s", e->plan.name);
        status->shots = e->shots;
        status->frames = e->frames ? lumi_plan_frames(&e->plan, &e->rig) : 0;
    }
    status->round = e->round;
    status->fired = e->shots_fired;
    status->lost = e->shots_lost;
    status->planned = at[AT_PLANNED];
    status->triggered = at[AT_TRIGGERED];
    for (int i = 0; at[AT_TRIGGERED] && i < e->shots * e->config.camera_count; i++)
        status->exposed += e->frames[i].at == AT_TRIGGERED && e->frames[i].exposed_ns != LUMI_NO_TIME;
    status->triggered -= status->exposed;
    status->received = at[AT_RECEIVED];
    status->stored = at[AT_STORED];
    status->accepted = at[AT_ACCEPTED];
    status->rejected = at[AT_REJECTED];
    status->missing = at[AT_MISSING];
    status->seconds_left = seconds_left(e);
    status->complete = status->frames > 0 && at[AT_STORED] + at[AT_ACCEPTED] == status->frames;
    status->bytes = e->bytes;
    if (e->store)
        lumi_store_figures(e->store, &status->store);
    status->disk_free_bytes = e->disk_free;
    status->disk_bytes_per_second = e->disk_speed;
    status->rig = e->link;
    status->estop = e->estop;
    engine_arm(e, &status->arm);
    status->camera_count = e->config.camera_count;
    status->check_count = e->check_count;
    for (int c = 0; c < e->config.camera_count; c++)
        camera_status(e, c, &status->cameras[c]);
    memcpy(status->checks, e->checks, sizeof status->checks);
}

int lumi_engine_missing(const struct lumi_engine *e, struct lumi_engine_missing *list, int max)
{
    const int all = e->frames ? e->shots * e->config.camera_count : 0;
    int count = 0;

    for (int i = 0; i < all; i++) {
        const struct engine_frame *frame = e->frames + i;
        if (frame->at == AT_NONE || frame->at == AT_STORED || frame->at == AT_ACCEPTED)
            continue;
        if (frame->at < AT_REJECTED && !frame->reason && engine_taking(e)) /* its turn is to come */
            continue;
        if (count < max) {
            struct lumi_engine_missing *entry = list + count;
            snprintf(entry->frame, sizeof entry->frame, "%s", e->names[i]);
            snprintf(entry->camera, sizeof entry->camera, "%s", e->config.cameras[i % e->config.camera_count].name);
            entry->shot = i / e->config.camera_count;
            entry->state = frame->at == AT_PLANNED    ? LUMI_FRAME_PLANNED
                           : frame->at <= AT_RECEIVED ? LUMI_FRAME_TRIGGERED
                                                      : LUMI_FRAME_REJECTED;
            entry->fault = frame->at == AT_REJECTED ? frame->fault : LUMI_JUDGE_GOOD;
            snprintf(entry->reason, sizeof entry->reason, "%s", frame->reason ? frame->reason : "");
        }
        count++;
    }
    return count;
}

struct lumi_store *lumi_engine_store(struct lumi_engine *e)
{
    return e->store;
}
