/* What an operator wants. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#define JOG_MOST (2 * LUMI_PI) /* radians at once */

static int copy_overrides(struct lumi_engine *e, const char *const *names, struct lumi_error *error)
{
    int count = 0;

    for (int i = 0; i < e->override_count; i++)
        lumi_free(e->override[i]);
    lumi_free(e->override);
    e->override = NULL;
    e->override_count = 0;
    while (names && names[count])
        count++;
    if (count == 0)
        return LUMI_OK;
    e->override = lumi_calloc((size_t)count, sizeof(char *));
    if (!e->override)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory");
    for (int i = 0; i < count; i++)
        if ((e->override[i] = engine_copy(names[i])))
            e->override_count = i + 1;
        else
            break;
    return LUMI_OK;
}

static int check_name(const struct lumi_engine *e, const char *name, struct lumi_error *error)
{
    char path[1400];
    struct stat status;

    if (!name || !name[0])
        return LUMI_OK;
    if (name[0] == '.' || strlen(name) > 200 ||
        strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") != strlen(name))
        return lumi_fail(error, LUMI_ERR_ARG, "'%.60s' is no name for a capture: letters, digits, '.', '_', '-'", name);
    snprintf(path, sizeof path, "%s/%s", e->config.folder, name);
    if (!stat(path, &status))
        return lumi_fail(error, LUMI_ERR_EXISTS, "%s: there is one already", path);
    return LUMI_OK;
}

int lumi_engine_start(struct lumi_engine *e, int64_t now_ns, const char *plan_text, size_t plan_size,
                      const struct lumi_engine_start *start, struct lumi_error *error)
{
    static const struct lumi_engine_start defaults = {0};
    char *text;

    start = start ? start : &defaults;
    e->now = now_ns > e->now ? now_ns : e->now;
    if (!engine_resting(e))
        return engine_busy(e, error);
    if (plan_size > LUMI_PLAN_TEXT_MAX || memchr(plan_text, 0, plan_size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the plan is longer than %d bytes, or no text", LUMI_PLAN_TEXT_MAX);
    LUMI_TRY(lumi_plan_check_text(plan_text, plan_size, "the plan", error));
    LUMI_TRY(check_name(e, start->name, error));
    LUMI_TRY(copy_overrides(e, start->override, error));
    text = lumi_calloc(plan_size + 1, 1);
    if (!text)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory");
    memcpy(text, plan_text, plan_size);
    lumi_free(e->plan_text);
    e->plan_text = text;
    e->plan_known = false;
    snprintf(e->name, sizeof e->name, "%s", start->name ? start->name : "");
    snprintf(e->title, sizeof e->title, "%s", start->title ? start->title : "");
    e->capture[0] = '\0';
    e->preflight_only = start->preflight_only;
    e->check_count = 0;
    engine_account_free(e);
    memset(e->at_count, 0, sizeof e->at_count);
    for (int c = 0; c < LUMI_RIG_CAMERAS; c++)
        engine_camera_reset(e, c);
    engine_state(e, LUMI_ENGINE_PREFLIGHT, "looking whether all is well");
    engine_go(e, STAGE_LINK);
    engine_step(e);
    return LUMI_OK;
}

static void set_session(struct lumi_engine *e, const char *value)
{
    struct engine_flight *flight = e->store ? engine_flight(e, LUMI_STORE_META) : NULL;

    if (!flight)
        return;
    snprintf(flight->job.key, sizeof flight->job.key, "session");
    snprintf(flight->job.text, sizeof flight->job.text, "%s", value);
    engine_flight_give(e, flight);
}

int lumi_engine_pause(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (!engine_taking(e) || e->stage == STAGE_DRAIN || e->stage == STAGE_AFTER)
        return lumi_fail(error, LUMI_ERR_BUSY, "there is no sweep to pause (%s)", lumi_engine_state_name(e->state));
    set_session(e, "paused");
    e->go_on = false;
    if (e->stage == STAGE_SWEEP || e->stage == STAGE_START) {
        e->want_pause = true; /* when it has begun */
    } else {
        e->pause = PAUSE_OPERATOR;
        engine_go(e, STAGE_PAUSED);
        engine_state(e, LUMI_ENGINE_PAUSED, "by the operator");
    }
    engine_step(e);
    return LUMI_OK;
}

int lumi_engine_resume(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    char names[128];

    e->now = now_ns > e->now ? now_ns : e->now;
    if (e->stage == STAGE_DRAIN) { /* no more files will come */
        for (int c = 0; c < e->config.camera_count; c++)
            e->cameras[c].given_up |= e->cameras[c].identity.records_itself;
        engine_step(e);
        return LUMI_OK;
    }
    if (e->stage != STAGE_PAUSED && e->stage != STAGE_INTERRUPTED)
        return lumi_fail(error, LUMI_ERR_BUSY, "there is nothing to resume (%s)", lumi_engine_state_name(e->state));
    if (e->estop)
        return lumi_fail(error, LUMI_ERR_BUSY, "the emergency stop is pressed");
    if (e->faults & ~(1u << LUMI_RIG_FAULT_HOST_LOST)) {
        engine_faults_text(e->faults, names, sizeof names);
        return lumi_fail(error, LUMI_ERR_BUSY, "a fault stands: %s: look at the rig, clear, resume", names);
    }
    set_session(e, "taking");
    e->tries = 0;
    e->drive_reset = true;
    e->pause = PAUSE_NONE;
    e->want_pause = false;
    e->go_on = true;
    if (e->stage != STAGE_INTERRUPTED) {
        engine_go(e, STAGE_INTERRUPTED);
        e->stage_ns = INT64_MIN; /* the board's status need not be newer */
    } else {
        e->stage_ns = INT64_MIN;
    }
    engine_state(e, LUMI_ENGINE_INTERRUPTED, "going on");
    engine_step(e);
    return LUMI_OK;
}

static void send_stop(struct lumi_engine *e, bool at_once)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_stop_tag};

    request.command.stop.at_once = at_once;
    engine_send(e, &request);
}

int lumi_engine_stop(struct lumi_engine *e, int64_t now_ns, bool at_once, bool seal, struct lumi_error *error)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (e->state == LUMI_ENGINE_PREFLIGHT) {
        engine_ask_none(e);
        e->test_camera = -1;
        engine_rest(e, LUMI_ENGINE_IDLE);
        engine_state(e, LUMI_ENGINE_IDLE, "stopped by the operator");
        return LUMI_OK;
    }
    if (engine_resting(e) && e->connected && !engine_board_rests(e)) { /* homing, a jog */
        send_stop(e, at_once);
        return LUMI_OK;
    }
    if (!engine_taking(e))
        return lumi_fail(error, LUMI_ERR_BUSY, "there is nothing to stop (%s)", lumi_engine_state_name(e->state));
    e->want_stop = true;
    e->want_seal = seal;
    e->stop_at_once = at_once;
    for (int c = 0; c < e->config.camera_count && e->stage == STAGE_DRAIN; c++) /* no more files are waited for */
        e->cameras[c].given_up |= e->cameras[c].identity.records_itself;
    if (e->stage != STAGE_START && e->stage != STAGE_SWEEP && e->stage != STAGE_PAUSED &&
        e->stage != STAGE_INTERRUPTED && e->stage != STAGE_AFTER && e->stage != STAGE_DRAIN) {
        if (!engine_board_rests(e) && e->connected) /* homing, or about to start */
            send_stop(e, at_once);
        e->moving = false;
        engine_go(e, STAGE_DRAIN);
    }
    engine_step(e);
    return LUMI_OK;
}

void lumi_engine_emergency_stop(struct lumi_engine *e, int64_t now_ns)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    e->ports.rig_emergency_stop(e->ports.context);
    engine_incident(e, -1, "estop", "emergency stop");
    if (e->driving && e->ports.drive_cancel)
        e->ports.drive_cancel(e->ports.context);
    engine_step(e);
}

int lumi_engine_clear(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_clear_tag};

    e->now = now_ns > e->now ? now_ns : e->now;
    if (!e->connected)
        return lumi_fail(error, LUMI_ERR_IO, "the board is away");
    request.command.clear.faults = e->link.status_known ? e->link.status.faults : e->faults;
    engine_send(e, &request);
    engine_step(e);
    return LUMI_OK;
}

/* ---- by hand ---- */

static bool has_drive(const struct lumi_engine *e)
{
    return (e->rig_known && e->rig.control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL) ||
           (e->board_rig_known && e->board_rig.control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL);
}

static int may_move(const struct lumi_engine *e, const char *what, struct lumi_error *error)
{
    char names[128];

    if (!e->connected || !e->link.status_known)
        return lumi_fail(error, LUMI_ERR_IO, "the board is away");
    if (!engine_resting(e) && e->stage != STAGE_PAUSED && e->stage != STAGE_INTERRUPTED)
        return lumi_fail(error, LUMI_ERR_BUSY, "a capture is under way (%s)", lumi_engine_state_name(e->state));
    if (e->estop)
        return lumi_fail(error, LUMI_ERR_BUSY, "the emergency stop is pressed");
    if (e->faults) {
        engine_faults_text(e->faults, names, sizeof names);
        return lumi_fail(error, LUMI_ERR_BUSY, "a fault stands: %s: look at the rig, clear, %s", names, what);
    }
    if (!engine_board_rests(e))
        return lumi_fail(error, LUMI_ERR_BUSY, "the rig moves already");
    return LUMI_OK;
}

int lumi_engine_home(struct lumi_engine *e, int64_t now_ns, int turn, bool wind_up, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};

    e->now = now_ns > e->now ? now_ns : e->now;
    LUMI_TRY(may_move(e, "home", error));
    if (has_drive(e))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "the rig's drive homes by itself when a sweep begins");
    request.command.home.wind_up = wind_up;
    request.command.home.turn = turn;
    e->home_wanted = true;
    engine_send(e, &request);
    engine_step(e);
    return LUMI_OK;
}

int lumi_engine_jog(struct lumi_engine *e, int64_t now_ns, double radians, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_jog_tag};

    e->now = now_ns > e->now ? now_ns : e->now;
    LUMI_TRY(may_move(e, "jog", error));
    if (has_drive(e))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "the rig's drive is turned at the drive itself");
    if (!isfinite(radians) || fabs(radians) > JOG_MOST || radians == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "a jog of %g degrees: up to %g either way, and not none",
                         radians * 180 / LUMI_PI, JOG_MOST * 180 / LUMI_PI);
    if (!e->link.status.position_known)
        return lumi_fail(error, LUMI_ERR_BUSY, "nobody knows where the arm is: home first");
    request.command.jog.turns = radians / (2 * LUMI_PI);
    e->jogging = true;
    e->jog_ns = e->now;
    engine_send(e, &request);
    engine_step(e);
    return LUMI_OK;
}
