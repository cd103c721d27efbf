/* Taking what is needed: rows for retakes, home, arm, load, mark, start. Whatever interrupts, it begins here again. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PAUSE_SECONDS 5.0 /* until a board that goes on sweeping is asked once more to pause */
#define FLIGHTS_AT_ONCE 256
#define HOME_SECONDS 1800.0
#define STATUS_SECONDS 10.0
#define ARM_SECONDS 10.0

void engine_take(struct lumi_engine *e)
{
    e->want_pause = false;
    e->pause = PAUSE_NONE;
    e->go_on = false;
    e->ended = false;
    engine_go(e, engine_frames_needed(e) > 0 ? STAGE_ROWS : STAGE_DRAIN);
}

/* What is said about a board that did not do as it was asked; true: handled. */
static bool refused(struct lumi_engine *e, const char *what)
{
    if (e->ask.code == LUMI_OK)
        return false;
    engine_interrupt(e, e->ask.code == LUMI_ERR_IO || e->ask.code == LUMI_ERR_BUSY, "%s: %s", what, e->ask.text);
    return true;
}

/* ---- rows ---- */

static bool wanted(const struct lumi_engine *e, size_t i)
{
    return e->frames[i].at != AT_NONE && engine_frame_needed(&e->frames[i]) && (!e->chosen || e->chosen[i]);
}

/* Those that were not chosen stay as they are. */
bool engine_stage_rows(struct lumi_engine *e)
{
    const size_t all = (size_t)e->shots * (size_t)e->config.camera_count;
    bool flying = false;
    int given = 0;

    if (e->disk_full)
        return false;
    for (size_t i = 0; i < all; i++) {
        struct engine_frame *frame = e->frames + i;
        const int shot = (int)(i / (size_t)e->config.camera_count), camera = (int)(i % (size_t)e->config.camera_count);
        flying |= frame->flying;
        if (frame->flying || frame->stuck || frame->at == AT_PLANNED || !wanted(e, i))
            continue;
        if (!frame->dead_row) {
            engine_frame_go(e, shot, camera, AT_PLANNED, NULL);
            continue;
        }
        if (given++ >= FLIGHTS_AT_ONCE)
            continue;
        struct engine_flight *flight = engine_flight(e, LUMI_STORE_RETAKE);
        if (!flight)
            continue;
        flight->shot = shot;
        flight->camera = camera;
        flight->job.frame = frame->row;
        snprintf(flight->job.text, sizeof flight->job.text, "%s", frame->reason ? frame->reason : "");
        frame->flying = flying = true;
        engine_flight_give(e, flight);
    }
    if (flying || given > 0)
        return false;
    engine_go(e, STAGE_HOME);
    return true;
}

/* ---- home ---- */

static bool position_known(const struct lumi_engine *e)
{
    const lumi_wire_Status *status = &e->link.status;

    return e->link.status_known && status->position_known && (e->rig.string.held || status->turn_known) &&
           (status->state == lumi_wire_State_IDLE || status->state == lumi_wire_State_PAUSED);
}

static bool ask_home(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};

    if (!e->rig.string.held && e->rig.turns > 1 && !e->config.wind_up && !e->fresh) {
        engine_interrupt(
            e, false,
            "nobody knows in which turn of its string the rig is: say so (lumi capture home --turn N, or --wind-up), "
            "then resume");
        return true;
    }
    request.command.home.wind_up = e->config.wind_up && !e->rig.string.held;
    request.command.home.turn = e->config.home_turn;
    e->homed = false;
    engine_state(e, LUMI_ENGINE_HOMING, "looking for the index mark");
    engine_ask(e, &request);
    return false;
}

static bool cameras_ready(const struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used && !e->cameras[c].identity.records_itself && !engine_camera_ready(e, c))
            return false;
    return true;
}

/* The board goes on by itself, and nobody takes what it fires: it waits until the cameras are armed again. */
static bool pause_board(struct lumi_engine *e)
{
    const lumi_wire_Request request = {.which_command = lumi_wire_Request_pause_tag};

    if (engine_since(e, e->stage_ns) >= PAUSE_SECONDS * e->stage_at) {
        e->stage_at++;
        engine_send(e, &request);
    }
    engine_wake(e, 0.5);
    if (engine_since(e, e->stage_ns) > e->config.rig_patience)
        engine_interrupt(e, false, "the board does not come to rest");
    return e->stage != STAGE_HOME;
}

bool engine_stage_home(struct lumi_engine *e)
{
    /* What it said before this stage may be of a sweep that has ended since. */
    if (!e->connected || !e->link.status_known || (!engine_asked(e) && (int64_t)e->link.status_ns <= e->stage_ns)) {
        engine_wake(e, 0.5);
        if (engine_since(e, e->stage_ns) < STATUS_SECONDS)
            return false;
        engine_interrupt(e, true, "the board is away");
        return true;
    }
    if (!engine_asked(e)) {
        if (e->link.status.state == lumi_wire_State_SWEEPING || e->link.status.state == lumi_wire_State_WINDING) {
            /* It goes on with what this program started before it died. */
            if (e->link.status.plan_crc == lumi_wire_plan_crc(&e->plan)) {
                if (!cameras_ready(e))
                    return pause_board(e);
                engine_go(e, STAGE_SWEEP);
                e->begun_ns = e->rest_ns = (int64_t)e->link.status_ns;
                e->moving = true;
                return true;
            }
            engine_interrupt(e, false, "the board is sweeping another plan");
            return true;
        }
        if (position_known(e)) {
            engine_go(e, STAGE_ARM);
            return true;
        }
        if (!engine_board_rests(e)) {
            engine_wake(e, 0.5);
            if (engine_since(e, e->stage_ns) > e->config.rig_patience)
                engine_interrupt(e, false, "the board does not come to rest");
            return e->stage != STAGE_HOME;
        }
        return ask_home(e);
    }
    if (!e->ask.answered)
        return false;
    if (refused(e, "homing"))
        return true;
    if (e->homed && !e->home_found) {
        engine_interrupt(e, false, "the index mark was not found: %s", e->home_text);
        return true;
    }
    if (e->homed || (position_known(e) && engine_since(e, e->stage_ns) > 3)) {
        engine_go(e, STAGE_ARM);
        return true;
    }
    engine_wake(e, 1);
    if (engine_since(e, e->stage_ns) > HOME_SECONDS)
        engine_interrupt(e, false, "homing does not come to an end");
    return e->stage != STAGE_HOME;
}

/* ---- arm ---- */

static double first_exposure(const struct lumi_engine *e)
{
    int shot = 0;

    while (shot < e->shots && !engine_shot_needed(e, shot))
        shot++;
    return e->plan.exposures[shot % e->plan.bracket];
}

/* True: it is as it should be, or nobody waits for it any more. */
static bool arm(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;
    const double exposure = first_exposure(e);
    const char *name = e->config.cameras[camera].name;

    if (c->command && c->there)
        return c->given_up;
    if (!c->there) {
        double patience = e->config.cameras[camera].optional ? ARM_SECONDS : e->config.rig_patience;
        if (!c->given_up && engine_since(e, e->stage_ns) > patience) {
            c->given_up = true;
            engine_incident(e, camera, "camera", "the sweep goes on without camera %s", name);
        }
        return c->given_up;
    }
    if (c->command_code != LUMI_OK && !c->given_up) {
        c->given_up = engine_since(e, e->stage_ns) > ARM_SECONDS;
        engine_state(e, LUMI_ENGINE_ARMING, "camera %s: %s", name, c->command_text);
        if (c->given_up)
            engine_incident(e, camera, "camera", "camera %s cannot be armed: %s", name, c->command_text);
        c->configured = c->armed = false;
        c->command_code = LUMI_OK;
        return c->given_up;
    }
    if (!c->configured)
        engine_camera_do(e, camera, LUMI_CAMERA_CONFIGURE, exposure);
    else if (!c->armed)
        engine_camera_do(e, camera, LUMI_CAMERA_ARM, exposure);
    else if (c->exposure_s != exposure && c->identity.exposure_control &&
             e->config.cameras[camera].setting.exposure_s <= 0 && !c->identity.records_itself)
        engine_camera_do(e, camera, LUMI_CAMERA_EXPOSE, exposure);
    else
        return true;
    return false;
}

bool engine_stage_arm(struct lumi_engine *e)
{
    bool ready = true;

    if (e->stage_at == 0) {
        e->stage_at = 1;
        for (int c = 0; c < e->config.camera_count; c++)
            e->cameras[c].given_up = false;
        engine_state(e, LUMI_ENGINE_ARMING, "the cameras are made ready");
    }
    for (int c = 0; c < e->config.camera_count; c++)
        ready &= !e->cameras[c].used || arm(e, c);
    if (!ready) {
        engine_wake(e, 0.5);
        return false;
    }
    engine_go(e, STAGE_TEST);
    return true;
}

/* ---- load, read, mark, start ---- */

/* A capture that was opened again is of a rig: is this it? */
static bool same_rig(struct lumi_engine *e)
{
    if (!engine_asked(e)) {
        e->ask = (struct engine_ask){.number = ++e->next_number};
        e->ports.rig_read_profile(e->ports.context, e->ask.number);
        return false;
    }
    if (!e->ask.answered || refused(e, "the profile"))
        return false;
    engine_ask_none(e);
    e->check_rig = false;
    if (e->rig_known)
        return true;
    e->rig_known = true;
    engine_interrupt(e, false, "the board's profile is not the capture's: this is another rig, or it was changed");
    e->check_rig = true;
    return false;
}

bool engine_stage_load(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_load_plan_tag};

    if (e->check_rig && !same_rig(e))
        return e->stage != STAGE_LOAD;
    if (!engine_asked(e)) {
        request.command.load_plan.has_plan = true;
        lumi_wire_from_plan(&e->plan, &request.command.load_plan.plan);
        engine_ask(e, &request);
        return false;
    }
    if (!e->ask.answered)
        return false;
    if (refused(e, "the plan"))
        return true;
    engine_go(e, STAGE_READ);
    return true;
}

/* The part of the board's map that was asked for; false: it makes no sense. */
static bool take_map(struct lumi_engine *e, uint32_t first)
{
    const lumi_wire_Shots *shots = &e->ask.reply.payload.shots;
    const uint32_t all = (uint32_t)e->shots;

    if (!e->ask.has_reply || e->ask.reply.which_payload != lumi_wire_Reply_shots_tag || shots->first != first ||
        !shots->count || shots->count > all - first || shots->states.size < (shots->count + 3) / 4 ||
        (shots->count % 4 && first + shots->count < all))
        return false;
    for (uint32_t i = 0; i < shots->count; i++)
        e->board_shots[first + i] = shots->states.bytes[i / 4] >> i % 4 * 2 & 3;
    e->stage_at = (int)(first + shots->count);
    return true;
}

/* Reads the whole map, part after part. 1: it is read; 0: not yet; −1: it went wrong (interrupted). */
static int read_map(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_read_shots_tag};

    if (engine_asked(e)) {
        if (!e->ask.answered)
            return 0;
        if (refused(e, "the board's account of the shots"))
            return -1;
        if (!take_map(e, (uint32_t)e->stage_at)) {
            engine_interrupt(e, true, "the board's account of the shots makes no sense");
            return -1;
        }
        engine_ask_none(e);
    }
    if (e->stage_at >= e->shots)
        return 1;
    request.command.read_shots.first = (uint32_t)e->stage_at;
    engine_ask(e, &request);
    return 0;
}

bool engine_stage_read(struct lumi_engine *e)
{
    int read = read_map(e);

    if (read > 0)
        engine_go(e, STAGE_MARK);
    return read != 0;
}

/* The next run of shots whose state on the board is not what the account wants; false: none. */
static bool next_run(const struct lumi_engine *e, uint32_t *first, uint32_t *count, bool *fired)
{
    uint32_t shot = *first;

    while (shot < (uint32_t)e->shots && (e->board_shots[shot] == SHOT_FIRED) == !engine_shot_needed(e, (int)shot))
        shot++;
    if (shot >= (uint32_t)e->shots)
        return false;
    *first = shot;
    *fired = !engine_shot_needed(e, (int)shot);
    while (shot < (uint32_t)e->shots && (e->board_shots[shot] == SHOT_FIRED) != *fired &&
           !engine_shot_needed(e, (int)shot) == *fired)
        shot++;
    *count = shot - *first;
    return true;
}

bool engine_stage_mark(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_mark_shots_tag};
    uint32_t first, count;
    bool fired;

    if (engine_asked(e)) {
        if (!e->ask.answered)
            return false;
        if (refused(e, "the board's account of the shots"))
            return true;
        engine_ask_none(e);
    }
    first = (uint32_t)e->stage_at;
    if (!next_run(e, &first, &count, &fired)) {
        engine_go(e, STAGE_START);
        return true;
    }
    e->stage_at = (int)(first + count);
    request.command.mark_shots = (lumi_wire_MarkShots){.first = first, .count = count, .fired = fired};
    engine_ask(e, &request);
    return false;
}

static void begin_driving(struct lumi_engine *e, int first)
{
    for (int shot = 0; shot < e->shots; shot++)
        e->drive_states[shot] = !engine_shot_needed(e, shot);
    e->driving = true;
    e->ask = (struct engine_ask){.number = ++e->next_number};
    e->drive_out = e->ask.number;
    e->ports.drive_sweep(e->ports.context, e->ask.number, &e->rig, &e->plan, (uint32_t)first, e->drive_states,
                         e->drive_reset);
    e->drive_reset = false;
}

static bool ask_start(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_start_sweep_tag};
    int first = 0;

    if (e->drive_out) /* one that was cancelled is still on its way to an end */
        return false;

    while (first < e->shots && !engine_shot_needed(e, first))
        first++;
    if (first == e->shots) { /* all of it is on its way already */
        engine_go(e, STAGE_DRAIN);
        return true;
    }
    if (e->tries++ >= ENGINE_TRIES) {
        engine_interrupt(e, false, "begun %d times without a new frame: %s", ENGINE_TRIES,
                         e->text[0] ? "see the incidents" : "");
        return true;
    }
    if (!e->sweep_open) {
        e->sweep_number++;
        e->sweep_open = true;
        engine_match_begin(e);
        engine_sweep_row(e, false, e->round ? "retakes" : "sweep");
    }
    e->ended = false;
    e->moving = true;
    e->begun_ns = e->rest_ns = e->now;
    if (e->rig.control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL) {
        begin_driving(e, first);
        return false;
    }
    request.command.start_sweep.first_shot = (uint32_t)first;
    request.command.start_sweep.only_missing = !e->fresh;
    request.command.start_sweep.plan_crc = lumi_wire_plan_crc(&e->plan);
    engine_ask(e, &request);
    return false;
}

bool engine_stage_start(struct lumi_engine *e)
{
    if (!engine_asked(e) && ask_start(e))
        return true;
    if (!engine_asked(e))
        return false;
    if (e->driving) { /* answered when it is over */
        struct engine_ask ask = e->ask;
        engine_state(e, LUMI_ENGINE_SWEEPING, e->round ? "retakes, round %d" : "the sweep", e->round);
        engine_go(e, STAGE_SWEEP);
        e->ask = ask;
        return true;
    }
    if (!e->ask.answered)
        return false;
    if (refused(e, "the sweep")) {
        e->moving = false;
        return true;
    }
    engine_state(e, LUMI_ENGINE_SWEEPING, e->round ? "retakes, round %d" : "the sweep", e->round);
    e->begun_ns = e->rest_ns = e->now;
    engine_go(e, STAGE_SWEEP);
    return true;
}

/* ---- after ---- */

/* Shots that the board has fired and no event has told of: their time is not known, and so their frames are not. */
bool engine_stage_after(struct lumi_engine *e)
{
    int64_t begin_ns[LUMI_RIG_CAMERAS];
    int read = e->connected ? read_map(e) : 1;

    if (read == 0)
        return false;
    if (read < 0)
        return true;
    for (int c = 0; c < LUMI_RIG_CAMERAS; c++)
        begin_ns[c] = LUMI_NO_TIME;
    if (e->connected) {
        engine_events_settle(e);
        for (int shot = 0; shot < e->shots; shot++)
            if (e->board_shots[shot] == SHOT_FIRED && e->account_shots[shot].state != SHOT_FIRED) {
                engine_incident(e, -1, "events", "shot %d was fired, its event was lost", shot);
                engine_shot_fired(e, shot, begin_ns, UINT32_MAX, 0);
            }
    }
    engine_go(e, STAGE_DRAIN);
    return true;
}
