/* Making a capture for a plan, and opening one that is there: the account is read from its rows. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

static int allocate(struct lumi_engine *e, struct lumi_error *error)
{
    const size_t shots = (size_t)e->shots, all = shots * (size_t)e->config.camera_count;

    engine_account_free(e);
    e->account_shots = lumi_calloc(shots + 1, sizeof *e->account_shots);
    e->frames = lumi_calloc(all + 1, sizeof *e->frames);
    e->names = lumi_calloc(all + 1, sizeof *e->names);
    e->board_shots = lumi_calloc(shots + 1, 1);
    e->drive_states = lumi_calloc(shots + 1, 1);
    if (!e->account_shots || !e->frames || !e->names || !e->board_shots || !e->drive_states)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the account of %d shots", e->shots);
    for (size_t i = 0; i < shots; i++)
        e->account_shots[i] = (struct engine_shot){.turns = NAN, .expected_ns = LUMI_NO_TIME};
    for (size_t i = 0; i < all; i++)
        e->frames[i].exposed_ns = LUMI_NO_TIME;
    memset(e->at_count, 0, sizeof e->at_count);
    e->at_count[AT_NONE] = (int)all;
    e->shots_fired = e->shots_lost = 0;
    e->bytes = 0;
    e->sweep_number = -1;
    e->sweep_open = false;
    e->round = 0;
    e->retakes_left = e->config.retakes;
    e->tries = 0;
    e->fresh = true;
    e->want_pause = e->want_stop = false;
    e->pause = PAUSE_NONE;
    e->judge_due = 0;
    e->check_rig = false;
    return LUMI_OK;
}

static int camera_named(const struct lumi_engine *e, const char *name)
{
    for (int c = 0; c < e->config.camera_count; c++)
        if (!strcmp(e->config.cameras[c].name, name))
            return c;
    return -1;
}

/* A rejected row says why in words and numbers: the verdict on the numbers says it again, against what the camera's
 * accepted frames before it have. */
static enum lumi_judge_fault fault_of(const struct lumi_engine *e, const struct lumi_judge_usual *usual,
                                      const struct lumi_capture_frame *row)
{
    const struct lumi_capture_judgement *j = &row->judgement;
    const struct lumi_judge_numbers numbers = {.sharpness = row->sharpness,
                                               .blur_pixels = j->blur_pixels,
                                               .clipped = j->clipped,
                                               .dark = j->dark,
                                               .mean = j->mean,
                                               .exposure_stops = j->exposure_stops,
                                               .shift_pixels = j->shift_pixels,
                                               .moved = j->moved};
    enum lumi_judge_fault fault;

    if (lumi_judge_verdict(&numbers, &e->config.judge, lumi_judge_usual_sharpness(usual), &fault, NULL, 0))
        fault = LUMI_JUDGE_OTHER;
    return fault;
}

static void place(struct lumi_engine *e, size_t i, const struct lumi_capture_frame *row, struct lumi_judge_usual *usual)
{
    struct engine_frame *frame = e->frames + i;
    struct engine_shot *shot = e->account_shots + row->plan_shot;
    enum engine_at at = AT_PLANNED;

    switch (row->state) {
    case LUMI_FRAME_PLANNED:
        break;
    case LUMI_FRAME_TRIGGERED:
        at = AT_TRIGGERED;
        break;
    case LUMI_FRAME_RECEIVED:
        at = AT_STORED;
        break;
    case LUMI_FRAME_ACCEPTED:
        at = AT_ACCEPTED;
        break;
    default:
        at = row->file[0] ? AT_REJECTED : AT_MISSING;
        frame->dead_row = true;
        break;
    }
    frame->row = row->id;
    frame->fault = (uint8_t)(at == AT_REJECTED ? fault_of(e, usual, row) : LUMI_JUDGE_GOOD);
    if (at == AT_ACCEPTED)
        lumi_judge_usual_add(usual, row->sharpness);
    frame->retakes = row->retake_of ? atoi(strrchr(row->name, '.') ? strrchr(row->name, '.') + 1 : "") - 1 : 0;
    if (row->exposed_time_us != LUMI_NO_TIME)
        frame->exposed_ns = row->exposed_time_us * 1000 - e->utc_offset;
    snprintf(e->names[i], sizeof e->names[i], "%s", row->name);
    e->at_count[frame->at]--;
    e->at_count[at]++;
    frame->at = (uint8_t)at;
    lumi_free(frame->reason);
    frame->reason = row->reason[0] ? engine_copy(row->reason) : NULL;
    if (row->sweep > e->sweep_number)
        e->sweep_number = row->sweep;
    if (row->trigger_time_us != LUMI_NO_TIME)
        shot->expected_ns = row->trigger_time_us * 1000 - e->utc_offset;
    if (at == AT_PLANNED && !row->retake_of)
        return;
    e->fresh = false;
    if (shot->state != SHOT_FIRED)
        e->shots_fired++;
    shot->state = SHOT_FIRED;
}

/* Rows to account: of a frame and its retakes the last counts. */
static int read_rows(struct lumi_engine *e, struct lumi_capture *capture, struct lumi_error *error)
{
    struct lumi_judge_usual usual[LUMI_RIG_CAMERAS] = {0};
    struct lumi_capture_frame *rows = NULL;
    int count = 0, placed = 0;

    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &rows, &count, error));
    for (int i = 0; i < count; i++) {
        const int camera = camera_named(e, rows[i].camera_name);
        if (camera < 0 || !e->cameras[camera].used || rows[i].plan_shot < 0 || rows[i].plan_shot >= e->shots)
            continue;
        const size_t at = (size_t)rows[i].plan_shot * (size_t)e->config.camera_count + (size_t)camera;
        e->bytes += rows[i].bytes;
        if (rows[i].state == LUMI_FRAME_RETAKEN || e->frames[at].row > rows[i].id)
            continue;
        placed += e->frames[at].row == 0;
        place(e, at, &rows[i], &usual[camera]);
    }
    lumi_free(rows);
    if (placed != e->at_count[AT_PLANNED] + e->at_count[AT_TRIGGERED] + e->at_count[AT_STORED] +
                      e->at_count[AT_ACCEPTED] + e->at_count[AT_REJECTED] + e->at_count[AT_MISSING] ||
        placed != lumi_plan_frames(&e->plan, &e->rig))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its frames are not those of its plan", e->capture);
    return LUMI_OK;
}

static void tell_devices(struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++) {
        const struct lumi_camera_identity *identity = &e->cameras[c].identity;
        struct engine_flight *flight;
        if (!e->cameras[c].used || !e->cameras[c].there || !(flight = engine_flight(e, LUMI_STORE_DEVICE)))
            continue;
        struct lumi_capture_device *device = &flight->job.device;
        flight->job.camera = e->cameras[c].rig;
        snprintf(device->vendor, sizeof device->vendor, "%.63s", identity->vendor);
        snprintf(device->model, sizeof device->model, "%.63s", identity->model);
        snprintf(device->serial, sizeof device->serial, "%.63s", identity->serial);
        snprintf(device->firmware, sizeof device->firmware, "%.63s", identity->firmware);
        snprintf(device->address, sizeof device->address, "%s", identity->address);
        engine_flight_give(e, flight);
    }
}

static int describe(struct lumi_engine *e, struct lumi_capture *capture, struct lumi_error *error)
{
    time_t seconds = (time_t)(engine_unix_us(e, e->now) / 1000000);
    char created[32];
    struct tm day;

    gmtime_r(&seconds, &day);
    strftime(created, sizeof created, "%Y-%m-%dT%H:%M:%SZ", &day);
    LUMI_TRY(lumi_capture_set_meta(capture, "surface", "sphere", error));
    LUMI_TRY(lumi_capture_set_meta(capture, "source", "lumid", error));
    LUMI_TRY(lumi_capture_set_meta(capture, "created", created, error));
    if (e->title[0])
        LUMI_TRY(lumi_capture_set_meta(capture, "title", e->title, error));
    LUMI_TRY(lumi_store_plan(capture, &e->rig, &e->plan, error));
    return lumi_capture_set_meta(capture, "session", "taking", error);
}

int engine_make(struct lumi_engine *e, struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    int code;

    if (!e->name[0]) {
        time_t seconds = (time_t)(engine_unix_us(e, e->now) / 1000000);
        struct tm day;
        char date[32];
        gmtime_r(&seconds, &day);
        strftime(date, sizeof date, "%Y%m%d-%H%M%S", &day);
        snprintf(e->name, sizeof e->name, "%s-%s.capture", date, e->plan.name);
    }
    if ((size_t)snprintf(e->capture, sizeof e->capture, "%s/%s", e->config.folder, e->name) >= sizeof e->capture)
        return lumi_fail(error, LUMI_ERR_ARG, "the capture's path is too long");
    LUMI_TRY(allocate(e, error));
    LUMI_TRY(lumi_capture_create_live(e->capture, &capture, error));
    LUMI_GOTO(code, failed, describe(e, capture, error));
    LUMI_GOTO(code, failed, read_rows(e, capture, error));
    LUMI_GOTO(code, failed, lumi_store_open(capture, &e->config.store, &e->store, error));
    tell_devices(e);
    return LUMI_OK;
failed: /* a capture that cannot be begun (the disk is full) leaves nothing, and its name is free */
    lumi_capture_discard(capture);
    return code;
}

/* ---- one that is there ---- */

static int read_plan(struct lumi_engine *e, struct lumi_capture *capture, struct lumi_error *error)
{
    char *profile = NULL, *plan = NULL;
    int code;

    LUMI_GOTO(code, done, lumi_capture_get_profile(capture, &profile, error));
    LUMI_GOTO(code, done, lumi_capture_get_plan(capture, &plan, error));
    LUMI_GOTO(code, done, lumi_rig_parse(profile, strlen(profile), e->capture, &e->rig, error));
    e->rig_known = true;
    lumi_free(e->plan_text);
    e->plan_text = plan;
    plan = NULL;
    LUMI_GOTO(code, done, engine_parse_plan(e, error));
    LUMI_GOTO(code, done, engine_map_cameras(e, error));
done:
    lumi_free(profile);
    lumi_free(plan);
    return code;
}

/* What was under way when the program died: its pictures are gone with its memory; files come yet. */
static void settle_rows(struct lumi_engine *e)
{
    for (int shot = 0; shot < e->shots; shot++)
        for (int c = 0; c < e->config.camera_count; c++) {
            struct engine_frame *frame = engine_frame_at(e, shot, c);
            if (frame->at == AT_TRIGGERED && e->config.cameras[c].address[0] &&
                !strncmp(e->config.cameras[c].address, "files:", 6))
                continue;
            if (frame->at == AT_TRIGGERED)
                engine_frame_lost(e, shot, c, "the program was interrupted before it was stored");
            if (frame->at == AT_STORED && e->config.judging && e->ports.judge) {
                frame->judge_due = true;
                e->judge_due++;
            }
        }
}

int engine_look(struct lumi_engine *e, const char *path, struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    int code;

    engine_account_free(e);
    snprintf(e->capture, sizeof e->capture, "%s", path);
    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    LUMI_GOTO(code, done, read_plan(e, capture, error));
    LUMI_GOTO(code, done, allocate(e, error));
    LUMI_GOTO(code, done, read_rows(e, capture, error));
done:
    lumi_capture_close(capture);
    return code;
}

int engine_reopen(struct lumi_engine *e, const char *path, struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    int code;

    engine_account_free(e); /* while the plan is still that of before */
    snprintf(e->capture, sizeof e->capture, "%s", path);
    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    LUMI_GOTO(code, failed, read_plan(e, capture, error));
    LUMI_GOTO(code, failed, allocate(e, error));
    LUMI_GOTO(code, failed, read_rows(e, capture, error));
    LUMI_GOTO(code, failed, lumi_capture_set_meta(capture, "session", "taking", error));
    LUMI_GOTO(code, failed, lumi_store_open(capture, &e->config.store, &e->store, error));
    e->check_rig = true;
    engine_match_begin(e);
    for (int c = 0; c < e->config.camera_count; c++)
        e->cameras[c].trusted = false;
    settle_rows(e);
    return LUMI_OK;
failed:
    lumi_capture_close(capture);
    return code;
}

/* ---- after a crash ---- */

static bool unfinished(const char *path)
{
    struct lumi_capture *capture = NULL;
    struct lumi_error ignored;
    char session[32] = "", file[1400];
    struct stat status;

    if ((size_t)snprintf(file, sizeof file, "%s/data/capture.db", path) >= sizeof file || stat(file, &status) ||
        lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &ignored) != LUMI_OK)
        return false;
    if (!lumi_capture_sealed(capture))
        lumi_capture_get_meta(capture, "session", session, sizeof session, &ignored);
    lumi_capture_close(capture);
    return !strcmp(session, "taking") || !strcmp(session, "paused") || !strcmp(session, "sealed");
}

static bool is_capture(const char *path)
{
    char database[1500];
    struct stat status;

    snprintf(database, sizeof database, "%s/data/capture.db", path);
    return stat(database, &status) == 0;
}

/* The youngest, by name: names begin with the date unless somebody chose another. */
static bool find(const struct lumi_engine *e, bool (*wanted)(const char *path), char *found, size_t size)
{
    DIR *folder = opendir(e->config.folder);
    struct dirent *entry;
    char best[256] = "", path[1400];

    while (folder && (entry = readdir(folder))) {
        const char *dot = strrchr(entry->d_name, '.'); /* NAME.partial: what is being taken in */
        if (entry->d_name[0] == '.' || strcmp(entry->d_name, best) <= 0 || (dot && !strcmp(dot, ".partial")))
            continue;
        snprintf(path, sizeof path, "%s/%s", e->config.folder, entry->d_name);
        if (wanted(path))
            snprintf(best, sizeof best, "%s", entry->d_name);
    }
    if (folder)
        closedir(folder);
    return best[0] && (size_t)snprintf(found, size, "%s/%s", e->config.folder, best) < size;
}

bool engine_youngest(const struct lumi_engine *e, char *found, size_t size)
{
    return find(e, is_capture, found, size);
}

static bool was_paused(const char *path)
{
    struct lumi_capture *capture = NULL;
    struct lumi_error ignored;
    char session[32] = "";

    if (lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &ignored) != LUMI_OK)
        return false;
    lumi_capture_get_meta(capture, "session", session, sizeof session, &ignored);
    lumi_capture_close(capture);
    return !strcmp(session, "paused");
}

int lumi_engine_recover(struct lumi_engine *e, int64_t now_ns, bool *found, struct lumi_error *error)
{
    char path[1400];
    struct lumi_error failed;
    int code;

    e->now = now_ns > e->now ? now_ns : e->now;
    *found = false;
    if (e->store || e->stage != STAGE_REST)
        return lumi_fail(error, LUMI_ERR_BUSY, "another capture is under way");
    if (!find(e, unfinished, path, sizeof path))
        return LUMI_OK;
    const bool paused = was_paused(path);
    code = engine_reopen(e, path, &failed);
    if (code != LUMI_OK) {
        engine_account_free(e);
        e->capture[0] = '\0';
        engine_incident(e, -1, "left", "%s was interrupted, cannot be gone on with, and stays as it is: %s", path,
                        failed.text);
        return lumi_fail(error, code, "%s: %s", path, failed.text);
    }
    *found = true;
    engine_incident(e, -1, "recovered", "the program had died; %d of %d frames are stored",
                    e->at_count[AT_STORED] + e->at_count[AT_ACCEPTED] + e->at_count[AT_REJECTED],
                    lumi_plan_frames(&e->plan, &e->rig));
    if (paused) {
        e->pause = PAUSE_OPERATOR;
        engine_go(e, STAGE_PAUSED);
        engine_state(e, LUMI_ENGINE_PAUSED, "it was paused when the program died: resume goes on");
    } else {
        e->go_on = true;
        engine_go(e, STAGE_INTERRUPTED);
        engine_state(e, LUMI_ENGINE_INTERRUPTED, "the program had died; it goes on when board and cameras are there");
    }
    engine_step(e);
    return LUMI_OK;
}
