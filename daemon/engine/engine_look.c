/* Frames for who shows pictures; and pictures while nothing is under way, for who stands before a camera. */
#include "daemon/engine/engine_priv.h"

#include <string.h>

#define LOOK_NS (ENGINE_NS * 9 / 20)  /* from one picture to the next of a camera, at least */
#define LOOK_AGAIN_NS (5 * ENGINE_NS) /* after something that failed */
#define BUFFERS 8                     /* of a camera whose setting does not say */

/* ---- what is shown ---- */

static bool has_spare(const struct lumi_engine *e, int camera, const struct lumi_camera_frame *frame)
{
    const struct engine_camera *c = e->cameras + camera;
    const int buffers = e->config.cameras[camera].setting.buffers;

    if (e->judge_due > 0 || e->judging > ENGINE_JUDGING / 2)
        return false;
    if (frame->format.layout != LUMI_LAYOUT_FILE && 2 * c->held > (buffers > 0 ? buffers : BUFFERS))
        return false;
    return !e->store || lumi_store_room(e->store) >= e->config.store.memory / 2;
}

static int64_t taken_at(const struct lumi_engine *e, int shot, int camera, const struct lumi_camera_frame *frame)
{
    int64_t at = LUMI_NO_TIME;

    if (frame->file_mtime_ns != LUMI_CAMERA_NO_TIME && frame->format.layout == LUMI_LAYOUT_FILE)
        return frame->file_mtime_ns / 1000;
    if (shot >= 0) {
        at = e->frames[(size_t)shot * (size_t)e->config.camera_count + (size_t)camera].exposed_ns;
        at = at != LUMI_NO_TIME ? at : e->account_shots[shot].expected_ns;
    }
    return engine_unix_us(e, at != LUMI_NO_TIME ? at : frame->host_ns > 0 ? frame->host_ns : e->now);
}

void engine_picture(struct lumi_engine *e, int shot, int camera, struct lumi_camera_frame *frame)
{
    const struct lumi_engine_camera *set = e->config.cameras + camera;

    if (!e->ports.picture)
        return;
    const struct lumi_engine_picture picture = {
        .camera = camera,
        .frame = frame,
        .name = shot >= 0 ? e->names[(size_t)shot * (size_t)e->config.camera_count + (size_t)camera] : "",
        .shot = shot,
        .unix_us = taken_at(e, shot, camera, frame),
        .white = {set->white_red, set->white_blue},
        .spare = has_spare(e, camera, frame)};
    e->ports.picture(e->ports.context, &picture);
}

/* ---- looking ---- */

static bool by_board(const struct lumi_engine *e, int camera)
{
    return e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_HARDWARE &&
           !e->cameras[camera].identity.software_trigger;
}

/* The plan's, where there was one; otherwise the camera's own choice. */
static double look_exposure(const struct lumi_engine *e)
{
    return e->plan_known ? e->plan.exposures[0] : 0;
}

static bool board_is_free(const struct lumi_engine *e)
{
    return e->connected && !e->look && !e->home_wanted && !e->estop && !e->faults && engine_board_rests(e);
}

static void fire(struct lumi_engine *e, int camera)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_test_triggers_tag};
    struct engine_camera *c = e->cameras + camera;

    c->look_ns = e->now + LOOK_NS;
    if (e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_FREE)
        return;
    if (!by_board(e, camera)) {
        engine_camera_do(e, camera, LUMI_CAMERA_TRIGGER, look_exposure(e));
    } else if (board_is_free(e)) {
        request.command.test_triggers.cameras = 1u << c->rig;
        request.command.test_triggers.exposure = e->plan.exposures[0];
        e->look = ++e->next_number;
        e->ports.rig_request(e->ports.context, e->look, &request);
    }
}

int lumi_engine_look_check(const struct lumi_engine *e, int camera, struct lumi_error *error)
{
    if (camera < 0 || camera >= e->config.camera_count)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "there is no such camera");
    if (!e->cameras[camera].there)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "camera %s is not there", e->config.cameras[camera].name);
    if (e->cameras[camera].identity.records_itself)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s records by itself: it cannot be looked through",
                         e->config.cameras[camera].name);
    if (by_board(e, camera) && (!e->rig_known || e->cameras[camera].rig < 0 || !e->plan_known))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "camera %s is fired by the board alone: it shows pictures after the first preflight",
                         e->config.cameras[camera].name);
    return LUMI_OK;
}

int lumi_engine_look(struct lumi_engine *e, int64_t now_ns, int camera, struct lumi_error *error)
{
    struct engine_camera *c;

    e->now = now_ns > e->now ? now_ns : e->now;
    LUMI_TRY(lumi_engine_look_check(e, camera, error));
    c = e->cameras + camera;
    if (e->stage != STAGE_REST || e->store)
        return lumi_fail(error, LUMI_ERR_BUSY, "a capture is under way (%s)", lumi_engine_state_name(e->state));
    if (e->now < c->look_ns || (c->looking && c->command))
        return LUMI_OK;
    if (by_board(e, camera) && !board_is_free(e))
        return lumi_fail(error, LUMI_ERR_BUSY, "the board cannot fire camera %s now", e->config.cameras[camera].name);
    if (!c->looking) { /* as a capture wants it or not at all: it is set up anew */
        c->looking = true;
        c->configured = c->armed = c->trusted = false;
    }
    if (!c->configured)
        engine_camera_do(e, camera, LUMI_CAMERA_CONFIGURE, look_exposure(e));
    else if (!c->armed)
        engine_camera_do(e, camera, LUMI_CAMERA_ARM, look_exposure(e));
    else
        fire(e, camera);
    return LUMI_OK;
}

/* One step leads to the next: set up, armed, fired. */
void engine_look_done(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;

    if (!c->looking || c->command)
        return;
    if (c->command_code != LUMI_OK) {
        c->configured = c->armed = false;
        c->look_ns = e->now + LOOK_AGAIN_NS;
    } else if (c->command_kind == LUMI_CAMERA_CONFIGURE) {
        engine_camera_do(e, camera, LUMI_CAMERA_ARM, look_exposure(e));
    } else if (c->command_kind == LUMI_CAMERA_ARM) {
        fire(e, camera);
    }
}

void engine_look_reply(struct lumi_engine *e, uint32_t number)
{
    if (number && number == e->look)
        e->look = 0;
}

/* What comes of it is not waited for: commands are done in their order, and the next sets it up anew. */
static void end(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;
    const struct lumi_camera_command command = {.kind = LUMI_CAMERA_DISARM,
                                                .setting = e->config.cameras[camera].setting};

    if (!c->looking)
        return;
    c->looking = c->configured = c->armed = c->trusted = false;
    c->command = 0;
    c->command_code = LUMI_OK;
    c->look_ns = 0;
    e->ports.camera_command(e->ports.context, camera, ++e->next_number, &command);
}

void engine_look_none(struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++)
        end(e, c);
    e->look = 0;
}

void lumi_engine_look_end(struct lumi_engine *e, int64_t now_ns, int camera)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (camera >= 0 && camera < e->config.camera_count)
        end(e, camera);
}
