/* What happened while a capture was taken: devices, sweeps, clocks, judgements, incidents. */
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Shots and their frames ---- */

int lumi_capture_set_shot(struct lumi_capture *capture, int64_t shot, int plan_shot, int sweep,
                          struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "UPDATE shots SET plan_shot = nullif(?, -1), sweep = nullif(?, -1) WHERE id = ?", "iii",
                          (int64_t)plan_shot, (int64_t)sweep, shot);
}

int lumi_capture_fire_shot(struct lumi_capture *capture, int64_t frame, int sweep, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "UPDATE shots SET sweep = nullif(?, -1) WHERE id = (SELECT shot FROM frames WHERE id = ?)",
                          "ii", (int64_t)sweep, frame);
}

int lumi_capture_shot_of(struct lumi_capture *capture, int64_t frame, int64_t *shot, struct lumi_error *error)
{
    return capture_db_int(capture, shot, error, "SELECT shot FROM frames WHERE id = ?", "i", frame);
}

int lumi_capture_shot_frames(struct lumi_capture *capture, int64_t shot, int64_t *frames, int cameras,
                             struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    for (int i = 0; i < cameras; i++)
        frames[i] = 0;
    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT f.id, (SELECT count(*) FROM cameras c WHERE c.id < f.camera) FROM frames f "
                                "WHERE f.shot = ?",
                                "i", shot));
    for (;;) {
        LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
        if (!row)
            break;
        int camera = sqlite3_column_int(statement, 1);
        if (camera >= 0 && camera < cameras)
            frames[camera] = sqlite3_column_int64(statement, 0);
    }
done:
    sqlite3_finalize(statement);
    return code;
}

int lumi_capture_camera(struct lumi_capture *capture, int index, int64_t *id, char name[LUMI_CAPTURE_NAME],
                        struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    LUMI_TRY(capture_db_prepare(capture, &statement, error, "SELECT id, name FROM cameras ORDER BY id LIMIT 1 OFFSET ?",
                                "i", (int64_t)index));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && !row)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no camera number %d", capture->path, index);
    if (code == LUMI_OK) {
        *id = sqlite3_column_int64(statement, 0);
        capture_db_text(statement, 1, name, LUMI_CAPTURE_NAME);
    }
    sqlite3_finalize(statement);
    return code;
}

/* ---- Devices ---- */

int lumi_capture_set_device(struct lumi_capture *capture, int64_t camera, const struct lumi_capture_device *device,
                            struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "INSERT OR REPLACE INTO devices(camera, vendor, model, serial, firmware, address) VALUES(?, "
                          "?, ?, ?, ?, ?)",
                          "ittttt", camera, device->vendor, device->model, device->serial, device->firmware,
                          device->address);
}

int lumi_capture_get_device(struct lumi_capture *capture, int64_t camera, struct lumi_capture_device *device,
                            struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    memset(device, 0, sizeof *device);
    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT vendor, model, serial, firmware, address FROM devices WHERE camera = ?", "i",
                                camera));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && row) {
        capture_db_text(statement, 0, device->vendor, sizeof device->vendor);
        capture_db_text(statement, 1, device->model, sizeof device->model);
        capture_db_text(statement, 2, device->serial, sizeof device->serial);
        capture_db_text(statement, 3, device->firmware, sizeof device->firmware);
        capture_db_text(statement, 4, device->address, sizeof device->address);
    }
    sqlite3_finalize(statement);
    return code;
}

/* ---- Sweeps and clocks ---- */

int lumi_capture_set_sweep(struct lumi_capture *capture, const struct lumi_capture_sweep *sweep,
                           struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "INSERT INTO sweeps(number, began_us, ended_us, outcome) VALUES(?1, nullif(?2, ?5), "
                          "nullif(?3, ?5), ?4) ON CONFLICT(number) DO UPDATE SET began_us = ifnull(excluded.began_us, "
                          "began_us), ended_us = excluded.ended_us, outcome = excluded.outcome",
                          "iiiti", (int64_t)sweep->number, sweep->began_us, sweep->ended_us, sweep->outcome,
                          LUMI_NO_TIME);
}

int lumi_capture_set_clock(struct lumi_capture *capture, int sweep, int64_t camera,
                           const struct lumi_capture_clock *clock, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "INSERT OR REPLACE INTO clocks(sweep, camera, frames, offset_s, drift_ppm, residual_s, "
                          "worst_s) VALUES(?, ?, ?, ?, ?, ?, ?)",
                          "iiidddd", (int64_t)sweep, camera, (int64_t)clock->frames, clock->offset_s, clock->drift_ppm,
                          clock->residual_s, clock->worst_s);
}

int lumi_capture_get_clock(struct lumi_capture *capture, int sweep, int64_t camera, struct lumi_capture_clock *clock,
                           struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    memset(clock, 0, sizeof *clock);
    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT frames, offset_s, drift_ppm, residual_s, worst_s FROM clocks WHERE sweep = ? "
                                "AND camera = ?",
                                "ii", (int64_t)sweep, camera));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && !row)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no clock of camera %lld in sweep %d", capture->path,
                         (long long)camera, sweep);
    if (code == LUMI_OK) {
        clock->frames = sqlite3_column_int(statement, 0);
        clock->offset_s = sqlite3_column_double(statement, 1);
        clock->drift_ppm = sqlite3_column_double(statement, 2);
        clock->residual_s = sqlite3_column_double(statement, 3);
        clock->worst_s = sqlite3_column_double(statement, 4);
    }
    sqlite3_finalize(statement);
    return code;
}

/* ---- Judgements and incidents ---- */

int lumi_capture_set_judgement(struct lumi_capture *capture, int64_t frame,
                               const struct lumi_capture_judgement *judgement, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "INSERT OR REPLACE INTO judgements(frame, blur_pixels, clipped, dark, mean, exposure_stops, "
                          "shift_pixels, moved) VALUES(?, ?, ?, ?, ?, ?, ?, ?)",
                          "iddddddd", frame, judgement->blur_pixels, judgement->clipped, judgement->dark,
                          judgement->mean, judgement->exposure_stops, judgement->shift_pixels, judgement->moved);
}

int lumi_capture_add_incident(struct lumi_capture *capture, const struct lumi_capture_incident *incident,
                              struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error,
                          "INSERT INTO incidents(time_us, kind, camera, frame, text) VALUES(nullif(?, ?), ?, nullif(?, "
                          "0), nullif(?, 0), ?)",
                          "iitiit", incident->time_us, LUMI_NO_TIME, incident->kind, incident->camera, incident->frame,
                          incident->text);
}

/* ---- Lists ---- */

/* Rows of equal size, one after another; `read` fills one in from a row. A damaged database can claim more rows than
 * it has bytes. */
static int read_list(struct lumi_capture *capture, const char *sql, size_t size,
                     void (*read)(sqlite3_stmt *row, void *entry), void **list, int *count, struct lumi_error *error)
{
    int64_t limit = capture->writable || capture->db_bytes == 0 ? INT32_MAX / 2 : capture->db_bytes / 4 + 1;
    int capacity = 0, code;
    sqlite3_stmt *statement;
    bool row;

    *list = NULL;
    *count = 0;
    LUMI_TRY(capture_db_prepare(capture, &statement, error, sql, ""));
    for (;;) {
        LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
        if (!row)
            break;
        if (*count >= limit) {
            code = lumi_fail(error, LUMI_ERR_FORMAT, "%s/" CAPTURE_DB ": damaged: a table has no end", capture->path);
            goto done;
        }
        if (*count == capacity) {
            capacity = capacity ? capacity * 2 : 16;
            void *more = lumi_realloc(*list, (size_t)capacity, size);
            if (!more) {
                code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
                goto done;
            }
            *list = more;
        }
        void *entry = (char *)*list + (size_t)*count * size;
        memset(entry, 0, size);
        read(statement, entry);
        ++*count;
    }
done:
    sqlite3_finalize(statement);
    if (code != LUMI_OK) {
        lumi_free(*list);
        *list = NULL;
        *count = 0;
    }
    return code;
}

static int64_t time_of(sqlite3_stmt *row, int column)
{
    return sqlite3_column_type(row, column) == SQLITE_NULL ? LUMI_NO_TIME : sqlite3_column_int64(row, column);
}

static void read_incident(sqlite3_stmt *row, void *entry)
{
    struct lumi_capture_incident *incident = entry;

    incident->id = sqlite3_column_int64(row, 0);
    incident->time_us = time_of(row, 1);
    capture_db_text(row, 2, incident->kind, sizeof incident->kind);
    incident->camera = sqlite3_column_int64(row, 3);
    incident->frame = sqlite3_column_int64(row, 4);
    capture_db_text(row, 5, incident->text, sizeof incident->text);
}

int lumi_capture_incidents(struct lumi_capture *capture, struct lumi_capture_incident **incidents, int *count,
                           struct lumi_error *error)
{
    void *list;
    int code = read_list(capture, "SELECT id, time_us, kind, camera, frame, text FROM incidents ORDER BY id",
                         sizeof **incidents, read_incident, &list, count, error);

    *incidents = list;
    return code;
}

static void read_sweep(sqlite3_stmt *row, void *entry)
{
    struct lumi_capture_sweep *sweep = entry;

    sweep->number = sqlite3_column_int(row, 0);
    sweep->began_us = time_of(row, 1);
    sweep->ended_us = time_of(row, 2);
    capture_db_text(row, 3, sweep->outcome, sizeof sweep->outcome);
}

int lumi_capture_sweeps(struct lumi_capture *capture, struct lumi_capture_sweep **sweeps, int *count,
                        struct lumi_error *error)
{
    void *list;
    int code = read_list(capture, "SELECT number, began_us, ended_us, outcome FROM sweeps ORDER BY number",
                         sizeof **sweeps, read_sweep, &list, count, error);

    *sweeps = list;
    return code;
}
