/* The cameras: commands to them, what they tell. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

int engine_camera_of(const struct lumi_engine *e, int rig_camera)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].rig == rig_camera)
            return c;
    return -1;
}

bool engine_camera_ready(const struct lumi_engine *e, int camera)
{
    return e->cameras[camera].there && e->cameras[camera].armed;
}

void engine_camera_do(struct lumi_engine *e, int camera, enum lumi_camera_command_kind kind, double exposure_s)
{
    struct engine_camera *c = e->cameras + camera;
    struct lumi_camera_command command = {.kind = kind, .setting = e->config.cameras[camera].setting};

    if (c->looking && command.setting.trigger != LUMI_TRIGGER_FREE && c->identity.software_trigger)
        command.setting.trigger = LUMI_TRIGGER_SOFTWARE;
    if (command.setting.exposure_s <= 0 && c->identity.exposure_control)
        command.setting.exposure_s = exposure_s;
    command.exposure_s = exposure_s;
    command.gain = command.setting.gain;
    c->exposure_s = exposure_s;
    c->command = ++e->next_number;
    c->command_kind = kind;
    c->command_code = LUMI_OK;
    c->command_text[0] = '\0';
    e->ports.camera_command(e->ports.context, camera, c->command, &command);
}

/* Frames and pictures of it go. */
void engine_camera_reset(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;
    struct lumi_match_result result;

    if (c->match) {
        lumi_match_finish(c->match);
        while (lumi_match_next(c->match, e->now, &result))
            if (result.frame)
                engine_held_drop(result.frame);
    }
    for (int i = 0; i < c->file_count; i++)
        engine_held_drop(c->files[i]);
    lumi_free(c->files);
    c->files = NULL;
    c->file_count = c->file_room = 0;
    engine_held_drop(c->test);
    c->test = NULL;
    for (int i = 0; i < ENGINE_PICTURES; i++)
        if (c->pictures[i]) {
            if (--c->pictures[i]->users == 0) {
                lumi_judge_picture_destroy(c->pictures[i]->picture);
                lumi_free(c->pictures[i]);
            }
            c->pictures[i] = NULL;
        }
    c->usual.count = 0;
    c->unseen = c->wrong_exposure = 0;
    c->surplus = 0;
}

static void came(struct lumi_engine *e, int camera, const struct lumi_camera_notice *notice)
{
    struct engine_camera *c = e->cameras + camera;
    const bool other = c->identity.serial[0] && strcmp(c->identity.serial, notice->identity.serial) != 0;

    if (!c->there && engine_taking(e) && c->used)
        engine_incident(e, camera, "camera", "camera %s is back", e->config.cameras[camera].name);
    if (other && engine_taking(e) && c->used)
        engine_incident(e, camera, "camera", "camera %s is now the device with serial number %s",
                        e->config.cameras[camera].name, notice->identity.serial);
    c->there = true;
    c->given_up = false;
    c->identity = notice->identity;
    c->trusted = c->doubtful = false;
    if (c->match) {
        struct lumi_match_options options; /* whether it has a clock is known only now */
        engine_match_options(e, camera, &options);
        lumi_match_change(c->match, &options);
        lumi_match_restart(c->match);
    }
}

static void gone(struct lumi_engine *e, int camera, const struct lumi_camera_notice *notice)
{
    struct engine_camera *c = e->cameras + camera;

    if (c->there && engine_taking(e) && c->used)
        engine_incident(e, camera, "camera", "camera %s is away: %s", e->config.cameras[camera].name, notice->text);
    if (c->there)
        c->away_ns = e->now;
    c->there = false;
}

static void done(struct lumi_engine *e, int camera, const struct lumi_camera_notice *notice)
{
    struct engine_camera *c = e->cameras + camera;

    if (notice->command != c->command || !c->command)
        return;
    c->command = 0;
    c->command_code = notice->code;
    snprintf(c->command_text, sizeof c->command_text, "%.255s", notice->text);
    if (notice->code != LUMI_OK) {
        if (c->command_kind == LUMI_CAMERA_EXPOSE && engine_taking(e))
            engine_incident(e, camera, "exposure", "camera %s did not take its exposure time: %s",
                            e->config.cameras[camera].name, notice->text);
        engine_look_done(e, camera);
        return;
    }
    if (c->command_kind == LUMI_CAMERA_CONFIGURE)
        c->configured = true;
    if (c->command_kind == LUMI_CAMERA_ARM)
        c->armed = true;
    if (c->command_kind == LUMI_CAMERA_DISARM)
        c->armed = false;
    engine_look_done(e, camera);
}

void lumi_engine_camera_notice(struct lumi_engine *e, int64_t now_ns, int camera,
                               const struct lumi_camera_notice *notice)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (camera < 0 || camera >= e->config.camera_count) {
        lumi_camera_frame_release(notice->frame);
        return;
    }
    switch (notice->kind) {
    case LUMI_CAMERA_CAME:
        came(e, camera, notice);
        break;
    case LUMI_CAMERA_GONE:
        gone(e, camera, notice);
        break;
    case LUMI_CAMERA_DONE:
        done(e, camera, notice);
        break;
    case LUMI_CAMERA_STATUS:
        e->cameras[camera].status = notice->status;
        e->cameras[camera].status_known = true;
        break;
    case LUMI_CAMERA_FRAME:
        engine_frame_came(e, camera, notice->frame);
        break;
    }
    engine_step(e);
}

void lumi_engine_sync_edge(struct lumi_engine *e, int64_t now_ns, int camera, int64_t at_ns, uint32_t lost)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (camera < 0 || camera >= e->config.camera_count)
        return;
    if (lost && engine_taking(e))
        engine_incident(e, camera, "sync", "%u sync edges of camera %s were lost on the way", lost,
                        e->config.cameras[camera].name);
    e->cameras[camera].edge_seen |= e->stage == STAGE_TRIGGERS && e->test_camera == camera;
    if (e->cameras[camera].match && engine_taking(e))
        lumi_match_edge(e->cameras[camera].match, at_ns);
    engine_step(e);
}
