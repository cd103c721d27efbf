/* What has to be right before anything is started: each check with a verdict and a reason. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define LINK_SECONDS 10.0
#define CAMERA_SECONDS 10.0
#define DISK_SPARE 1.1 /* what writing must give of what the sweep makes */

void engine_check(struct lumi_engine *e, bool hard, enum lumi_verdict verdict, const char *name, const char *format,
                  ...)
{
    struct lumi_engine_check *check;
    int place = 0;
    va_list list;

    while (place < e->check_count && strcmp(e->checks[place].name, name))
        place++;
    if (place == LUMI_ENGINE_CHECKS)
        return;
    if (place == e->check_count)
        e->check_count++;
    check = &e->checks[place];
    *check = (struct lumi_engine_check){.verdict = verdict};
    e->check_hard[place] = hard;
    snprintf(check->name, sizeof check->name, "%s", name);
    va_start(list, format);
    vsnprintf(check->reason, sizeof check->reason, format, list);
    va_end(list);
    for (int i = 0; i < e->override_count && !hard; i++)
        check->overridden |= !strcmp(e->override[i], name);
    engine_tell(e, LUMI_TALE_CHECK, place, -1, check->reason);
}

static void check_camera(struct lumi_engine *e, int camera, enum lumi_verdict verdict, const char *what,
                         const char *text)
{
    char name[48];

    snprintf(name, sizeof name, "%s %.30s", what, e->config.cameras[camera].name);
    engine_check(e, false, verdict, name, "%s", text);
}

/* Nothing further can be looked at. */
static bool hopeless(struct lumi_engine *e)
{
    engine_go(e, STAGE_VERDICT);
    return true;
}

/* ---- the board ---- */

bool engine_stage_link(struct lumi_engine *e)
{
    char names[128];

    if (!e->connected || !e->link.status_known) {
        engine_wake(e, 0.5);
        if (engine_since(e, e->stage_ns) < LINK_SECONDS)
            return false;
        engine_check(e, true, LUMI_RED, "link", "%s",
                     e->link_known && e->link.text[0] ? e->link.text : "nothing is heard of the board");
        return hopeless(e);
    }
    engine_check(e, true, LUMI_GREEN, "link", "%s, round trip %.2f ms", e->link.name, e->link.round_trip_ns * 1e-6);
    engine_check(e, true, LUMI_GREEN, "versions", "board %.60s, firmware %.60s, protocol %u", e->link.welcome.board,
                 e->link.welcome.firmware, (unsigned)e->link.welcome.version);
    if (e->estop)
        engine_check(e, false, LUMI_RED, "e-stop", "it is pressed");
    else
        engine_check(e, false, LUMI_GREEN, "e-stop", "free");
    engine_faults_text(e->faults, names, sizeof names);
    if (e->faults && engine_clear_host_lost(e))
        return false;
    engine_check(e, false, e->faults ? LUMI_RED : LUMI_GREEN, "faults", "%s", e->faults ? names : "none");
    if (!e->link.clock_matched)
        engine_check(e, false, LUMI_YELLOW, "clock", "the board's clock is not matched yet");
    else
        engine_check(e, false, LUMI_GREEN, "clock", "the board's, residual %.1f us, drift %.1f ppm",
                     e->link.clock_residual_ns * 1e-3, e->link.clock_drift_ppm);
    engine_go(e, STAGE_PROFILE);
    return true;
}

int engine_map_cameras(struct lumi_engine *e, struct lumi_error *error)
{
    const uint32_t wanted = lumi_plan_cameras(&e->plan, &e->rig);

    for (int c = 0; c < LUMI_RIG_CAMERAS; c++) {
        e->cameras[c].rig = -1;
        e->cameras[c].used = false;
    }
    for (int r = 0; r < e->rig.camera_count; r++) {
        int c = 0;
        while (c < e->config.camera_count && strcmp(e->config.cameras[c].name, e->rig.cameras[r].name))
            c++;
        if (c < e->config.camera_count) {
            e->cameras[c].rig = r;
            e->cameras[c].used = (wanted & 1u << r) != 0;
        } else if (wanted & 1u << r) {
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "camera '%s' of the plan is not configured",
                             e->rig.cameras[r].name);
        }
    }
    return LUMI_OK;
}

int engine_parse_plan(struct lumi_engine *e, struct lumi_error *error)
{
    e->plan_known = false;
    LUMI_TRY(lumi_plan_parse(e->plan_text, strlen(e->plan_text), "the plan", &e->rig, &e->plan, error));
    if (e->plan.mode == LUMI_PLAN_VIDEO)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "a video has no shots to keep account of: film it with lumi rig run, take the films in with "
                         "lumi import");
    e->shots = lumi_plan_shots(&e->plan);
    e->plan_known = true;
    return LUMI_OK;
}

double engine_spacing(const struct lumi_engine *e)
{
    double least = e->plan.mode == LUMI_PLAN_START_STOP ? lumi_plan_position_seconds(&e->plan)
                                                        : e->plan.turn_time / e->plan.positions;

    if (e->plan.mode == LUMI_PLAN_START_STOP)
        for (int k = 0; k + 1 < e->plan.bracket; k++) {
            double apart =
                lumi_plan_exposure_offset(&e->plan, &e->rig, k + 1) - lumi_plan_exposure_offset(&e->plan, &e->rig, k);
            least = apart < least ? apart : least;
        }
    return least;
}

/* ---- what the plan asks of the rig ---- */

static void check_motion(struct lumi_engine *e)
{
    const double blur = lumi_plan_blur(&e->plan, &e->rig);
    const double most = e->plan.blur_max > 0 ? e->plan.blur_max : LUMI_PLAN_BLUR;
    const lumi_wire_Status *status = &e->link.status;

    engine_check(e, true, LUMI_GREEN, "plan", "%.31s: %d shots, %d frames, %.0f s", e->plan.name, e->shots,
                 lumi_plan_frames(&e->plan, &e->rig), lumi_plan_seconds(&e->plan, &e->rig));
    engine_check(e, false,
                 blur > most         ? LUMI_RED
                 : blur > 0.9 * most ? LUMI_YELLOW
                                     : LUMI_GREEN,
                 "blur", "%.2f pixels at this speed, %.2f allowed", blur, most);
    if (e->rig.string.held)
        engine_check(e, false, LUMI_GREEN, "string", "the arm is held");
    else
        engine_check(e, false, LUMI_GREEN, "string", "%.2f m pay out in turns %d to %d, of %.2f m",
                     e->rig.string.per_turn * e->plan.turns, e->plan.first_turn, e->plan.first_turn + e->plan.turns - 1,
                     e->rig.string.length);
    if (status->position_known && (e->rig.string.held || status->turn_known))
        engine_check(e, false, LUMI_GREEN, "homed", "position known");
    else if (!e->rig.string.held && e->rig.turns > 1 && !e->config.wind_up)
        engine_check(e, false, LUMI_YELLOW, "homed", "it will be homed; the arm is taken to be in turn %d",
                     e->config.home_turn);
    else
        engine_check(e, false, LUMI_GREEN, "homed", "it will be homed first");
    if (status->supply_mv && e->rig.control.safety.supply_minimum > 0)
        engine_check(
            e, false, status->supply_mv * 1e-3 < 1.05 * e->rig.control.safety.supply_minimum ? LUMI_YELLOW : LUMI_GREEN,
            "supply", "%.2f V, at least %.2f V", status->supply_mv * 1e-3, e->rig.control.safety.supply_minimum);
}

/* True: it is said what there is to say. */
static bool check_drive(struct lumi_engine *e)
{
    if (e->stage_at == 0) {
        if (e->rig.control.motion.drive != LUMI_RIG_DRIVE_EXTERNAL)
            return true;
        if (!e->ports.drive_sweep) {
            engine_check(e, true, LUMI_RED, "drive", "the rig has an external drive, and none is configured");
            return true;
        }
        e->stage_at = 1;
        e->ask = (struct engine_ask){.number = ++e->next_number};
        e->ports.drive_check(e->ports.context, e->ask.number);
        return false;
    }
    if (!e->ask.answered)
        return false;
    /* An alarm is reset by who resumes what it has interrupted. */
    engine_check(e, e->ask.code != LUMI_ERR_BUSY, e->ask.code == LUMI_OK ? LUMI_GREEN : LUMI_RED, "drive", "%s",
                 e->ask.text);
    return true;
}

bool engine_stage_profile(struct lumi_engine *e)
{
    struct lumi_error error = {0};

    if (e->stage_at == 1) {
        if (!check_drive(e))
            return false;
        engine_go(e, STAGE_CAMERAS);
        return true;
    }
    if (!engine_asked(e)) {
        e->ask = (struct engine_ask){.number = ++e->next_number};
        e->ports.rig_read_profile(e->ports.context, e->ask.number);
        return false;
    }
    if (!e->ask.answered)
        return false;
    if (e->ask.code != LUMI_OK) {
        engine_check(e, true, LUMI_RED, "profile", "%s", e->ask.text);
        return hopeless(e);
    }
    engine_check(e, true, LUMI_GREEN, "profile", "%s, %d cameras", e->rig.name, e->rig.camera_count);
    if (engine_parse_plan(e, &error) != LUMI_OK || engine_map_cameras(e, &error) != LUMI_OK) {
        engine_check(e, true, LUMI_RED, "plan", "%s", error.text);
        return hopeless(e);
    }
    check_motion(e);
    engine_match_begin(e);
    if (!check_drive(e))
        return false;
    engine_go(e, STAGE_CAMERAS);
    return true;
}

/* ---- the cameras ---- */

static enum lumi_verdict absent(const struct lumi_engine *e, int camera)
{
    return e->config.cameras[camera].optional ? LUMI_YELLOW : LUMI_RED;
}

static bool twins(const struct lumi_engine *e, int camera)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (c != camera && e->cameras[c].there && e->cameras[c].identity.serial[0] &&
            e->cameras[c].identity.backend == e->cameras[camera].identity.backend &&
            !strcmp(e->cameras[c].identity.serial, e->cameras[camera].identity.serial))
            return true;
    return false;
}

/* True: there is nothing more to wait for. */
static bool ready(struct lumi_engine *e, int camera)
{
    struct engine_camera *c = e->cameras + camera;

    if (!c->there || c->command_code != LUMI_OK)
        return engine_since(e, e->stage_ns) > (c->there ? 0 : CAMERA_SECONDS);
    if (c->command)
        return engine_since(e, e->stage_ns) > 3 * CAMERA_SECONDS;
    if (!c->configured)
        engine_camera_do(e, camera, LUMI_CAMERA_CONFIGURE, e->plan.exposures[0]);
    else if (!c->armed)
        engine_camera_do(e, camera, LUMI_CAMERA_ARM, e->plan.exposures[0]);
    else
        return c->status_known || engine_since(e, e->stage_ns) > 3;
    return false;
}

static void check_health(struct lumi_engine *e, int camera)
{
    const struct engine_camera *c = e->cameras + camera;
    const struct lumi_camera_status *status = &c->status;
    char text[200];

    snprintf(text, sizeof text,
             c->identity.device_clock ? "its own, steps of %.0f ns"
                                      : "none: frames are matched by "
                                        "arrival and number",
             c->identity.clock_step_ns);
    check_camera(e, camera, c->identity.device_clock || c->identity.records_itself ? LUMI_GREEN : LUMI_YELLOW, "clock",
                 text);
    if (isfinite(status->battery)) {
        snprintf(text, sizeof text, "%.0f %%", status->battery * 100);
        check_camera(e, camera, status->battery < e->config.battery_least ? LUMI_RED : LUMI_GREEN, "battery", text);
    }
    if (isfinite(status->temperature)) {
        snprintf(text, sizeof text, "%.1f °C", status->temperature);
        check_camera(e, camera, status->temperature > e->config.temperature_most ? LUMI_RED : LUMI_GREEN, "temperature",
                     text);
    }
    if (status->card_free_bytes >= 0) {
        double need = (double)e->shots * (c->frame_bytes ? (double)c->frame_bytes : 1e6);
        snprintf(text, sizeof text, "%.1f GB free", (double)status->card_free_bytes * 1e-9);
        check_camera(e, camera, (double)status->card_free_bytes < need ? LUMI_RED : LUMI_GREEN, "card", text);
    }
    if (status->exposure_s > 0) {
        double planned = e->config.cameras[camera].setting.exposure_s;
        planned = planned > 0 ? planned : e->plan.exposures[0];
        snprintf(text, sizeof text, "%.6g s, %.6g s planned", status->exposure_s, planned);
        check_camera(e, camera, fabs(log2(status->exposure_s / planned)) > 1.0 / 6 ? LUMI_RED : LUMI_GREEN, "exposure",
                     text);
    }
    if (e->plan.bracket > 1 && !c->identity.exposure_control)
        check_camera(e, camera, LUMI_YELLOW, "bracket", "its exposure time cannot be set: what it reports is checked");
}

static void check_present(struct lumi_engine *e, int camera)
{
    const struct engine_camera *c = e->cameras + camera;
    char text[256];

    if (!c->there) {
        check_camera(e, camera, absent(e, camera), "camera", "it is not there");
        return;
    }
    if (twins(e, camera)) {
        snprintf(text, sizeof text, "another camera has the same serial number, %.90s", c->identity.serial);
        check_camera(e, camera, LUMI_RED, "camera", text);
        return;
    }
    if (!c->armed) {
        snprintf(text, sizeof text, "%.200s", c->command_text[0] ? c->command_text : "it does not answer");
        check_camera(e, camera, absent(e, camera), "camera", text);
        return;
    }
    snprintf(text, sizeof text, "%.60s %.60s, serial number %.60s", c->identity.vendor, c->identity.model,
             c->identity.serial);
    check_camera(e, camera, LUMI_GREEN, "camera", text);
    check_health(e, camera);
}

bool engine_stage_cameras(struct lumi_engine *e)
{
    bool all = true;

    if (e->stage_at == 0) {
        e->stage_at = 1;
        for (int c = 0; c < e->config.camera_count; c++) {
            e->cameras[c].configured = e->cameras[c].armed = false;
            e->cameras[c].command_code = LUMI_OK;
            e->cameras[c].frame_bytes = 0;
            e->cameras[c].seen = 0;
            e->cameras[c].edge_seen = false;
        }
    }
    for (int c = 0; c < e->config.camera_count; c++)
        all &= !e->cameras[c].used || ready(e, c);
    if (!all) {
        engine_wake(e, 0.5);
        return false;
    }
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used)
            check_present(e, c);
    engine_go(e, STAGE_TRIGGERS);
    return true;
}

/* ---- the disk, the verdict ---- */

static double bytes_per_shot(const struct lumi_engine *e)
{
    double bytes = 0;

    for (int c = 0; c < e->config.camera_count; c++) {
        const struct engine_camera *camera = e->cameras + c;
        if (!camera->used || camera->identity.records_itself)
            continue;
        bytes += camera->frame_bytes    ? (double)camera->frame_bytes
                 : camera->status_known ? (double)lumi_frame_bytes(&camera->status.format)
                                        : 0;
    }
    return bytes;
}

static void check_disk(struct lumi_engine *e)
{
    const double shot = bytes_per_shot(e), need = shot * e->shots, rate = shot / engine_spacing(e);
    const bool turning = e->plan.mode == LUMI_PLAN_CONTINUOUS;
    int64_t free_bytes = e->disk_free, seen;
    struct lumi_error error;

    /* Asked now, also where the free bytes were told: a disk may have become read-only since. */
    if (lumi_store_disk(e->config.folder, &seen, &error) != LUMI_OK) {
        engine_check(e, false, LUMI_RED, "disk", "%.240s", error.text);
        return;
    }
    if (free_bytes < 0)
        free_bytes = seen;
    if (need > (double)free_bytes * (1 - e->config.disk_reserve)) {
        engine_check(e, false, LUMI_RED, "disk", "%.2f GB are needed, %.2f GB are free", need * 1e-9,
                     (double)free_bytes * 1e-9);
        return;
    }
    engine_check(e, false, LUMI_GREEN, "disk", "%.2f GB are needed, %.2f GB are free", need * 1e-9,
                 (double)free_bytes * 1e-9);
    if (e->disk_speed <= 0)
        engine_check(e, false, LUMI_YELLOW, "disk speed", "not measured; the sweep makes %.1f MB/s", rate * 1e-6);
    else
        engine_check(e, false,
                     e->disk_speed >= DISK_SPARE * rate ? LUMI_GREEN
                     : turning && (rate - e->disk_speed) * lumi_plan_seconds(&e->plan, &e->rig) >
                                      (double)e->config.store.memory / 2
                         ? LUMI_RED
                         : LUMI_YELLOW,
                     "disk speed", "%.1f MB/s, the sweep makes %.1f MB/s", e->disk_speed * 1e-6, rate * 1e-6);
}

/* A mistyped name lets nothing pass: it is told, so that nobody believes it does. */
static void check_overrides(struct lumi_engine *e)
{
    for (int i = 0; i < e->override_count; i++) {
        int at = 0;
        while (at < e->check_count && strcmp(e->checks[at].name, e->override[i]))
            at++;
        if (at == e->check_count && !e->plan_known)
            continue; /* most checks were not come to */
        if (at == e->check_count)
            engine_check(e, false, LUMI_YELLOW, "override", "no check is called '%.60s'", e->override[i]);
        else if (e->check_hard[at])
            engine_check(e, false, LUMI_YELLOW, "override", "'%.60s' cannot be overridden", e->override[i]);
    }
}

bool engine_stage_verdict(struct lumi_engine *e)
{
    struct lumi_error error = {0};
    int red = 0, first = -1;

    if (e->plan_known)
        check_disk(e);
    check_overrides(e);
    for (int i = 0; i < e->check_count; i++)
        if (e->checks[i].verdict == LUMI_RED && !e->checks[i].overridden) {
            first = red++ ? first : i;
        }
    if (red) {
        engine_state(e, LUMI_ENGINE_RED, "%s: %.255s%s", e->checks[first].name, e->checks[first].reason,
                     red > 1 ? " (and others)" : "");
        engine_rest(e, LUMI_ENGINE_RED);
        return false;
    }
    if (e->preflight_only) {
        engine_state(e, LUMI_ENGINE_IDLE, "nothing is in the way");
        engine_rest(e, LUMI_ENGINE_IDLE);
        return false;
    }
    if (engine_make(e, &error) != LUMI_OK) {
        engine_fail(e, "%s", error.text);
        return false;
    }
    engine_take(e);
    return true;
}
