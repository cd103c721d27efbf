/* Writing rows: what the capture is of, its cameras, positions and frames, and how frames move through their states. */
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/capture/capture_priv.h"
#include "proto/mechanism/rig.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const state_names[] = {"planned", "triggered", "received", "accepted", "rejected", "retaken"};
static const char *const source_names[] = {"none", "true", "estimated", "prior", "imported"};

const char *lumi_frame_state_name(enum lumi_frame_state state)
{
    return state >= LUMI_FRAME_PLANNED && state <= LUMI_FRAME_RETAKEN ? state_names[state] : "unknown";
}

const char *lumi_pose_source_name(enum lumi_pose_source source)
{
    return source >= LUMI_POSE_TRUE && source <= LUMI_POSE_IMPORTED ? source_names[source] : "none";
}

/* ---- Texts ---- */

int lumi_capture_set_meta(struct lumi_capture *capture, const char *key, const char *value, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error, "INSERT OR REPLACE INTO meta(key, value) VALUES(?, ?)", "tt", key, value);
}

int lumi_capture_get_meta(struct lumi_capture *capture, const char *key, char *value, size_t size,
                          struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    if (size)
        value[0] = '\0';
    LUMI_TRY(capture_db_prepare(capture, &statement, error, "SELECT value FROM meta WHERE key = ?", "t", key));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && row)
        capture_db_text(statement, 0, value, size);
    sqlite3_finalize(statement);
    return code;
}

static int get_text(struct lumi_capture *capture, const char *sql, const char *what, char **text,
                    struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    *text = NULL;
    LUMI_TRY(capture_db_prepare(capture, &statement, error, sql, ""));
    LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
    if (!row) {
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: the capture has no %s", capture->path, what);
        goto done;
    }
    const char *value = (const char *)sqlite3_column_text(statement, 0);
    size_t size = value ? strlen(value) + 1 : 1;
    *text = lumi_alloc(size, 1);
    if (*text)
        memcpy(*text, value ? value : "", size);
    else
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
done:
    sqlite3_finalize(statement);
    return code;
}

int lumi_capture_set_profile(struct lumi_capture *capture, const char *text, struct lumi_error *error)
{
    struct lumi_rig rig;

    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(lumi_rig_parse(text, strlen(text), "rig profile", &rig, error));
    return capture_db_run(capture, error, "INSERT OR REPLACE INTO profile(id, text) VALUES(1, ?)", "t", text);
}

int lumi_capture_get_profile(struct lumi_capture *capture, char **text, struct lumi_error *error)
{
    return get_text(capture, "SELECT text FROM profile", "rig profile", text, error);
}

int lumi_capture_set_plan(struct lumi_capture *capture, const char *text, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    return capture_db_run(capture, error, "INSERT OR REPLACE INTO plan(id, text) VALUES(1, ?)", "t", text);
}

int lumi_capture_get_plan(struct lumi_capture *capture, char **text, struct lumi_error *error)
{
    return get_text(capture, "SELECT text FROM plan", "plan", text, error);
}

/* ---- Lenses, cameras, positions, shots ---- */

static int insert_lens(struct lumi_capture *capture, const struct lumi_capture_lens *lens, int64_t *id,
                       struct lumi_error *error)
{
    const struct lumi_lens *l = &lens->lens;

    LUMI_TRY(capture_db_run(
        capture, error,
        "INSERT INTO lenses(name, model, width, height, fx, fy, cx, cy, k1, k2, k3, k4, p1, p2, source_model) "
        "VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        "ttiiddddddddddt", lens->name, l->model == LUMI_LENS_FISHEYE ? "fisheye" : "pinhole", (int64_t)l->width,
        (int64_t)l->height, l->fx, l->fy, l->cx, l->cy, l->k1, l->k2, l->k3, l->k4, l->p1, l->p2, lens->model));
    *id = sqlite3_last_insert_rowid(capture->db);
    for (int i = 0; i < lens->parameter_count; i++)
        LUMI_TRY(capture_db_run(capture, error, "INSERT INTO lens_parameters(lens, number, value) VALUES(?, ?, ?)",
                                "iid", *id, (int64_t)i, lens->parameters[i]));
    return LUMI_OK;
}

int lumi_capture_add_lens(struct lumi_capture *capture, const struct lumi_capture_lens *lens, int64_t *id,
                          struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    if (!lumi_lens_valid(&lens->lens) || lens->lens.model == LUMI_LENS_EQUIRECTANGULAR)
        return lumi_fail(error, LUMI_ERR_FORMAT, "lens '%s' is out of range", lens->name);
    if (lens->parameter_count < 0 || lens->parameter_count > LUMI_CAPTURE_PARAMETERS)
        return lumi_fail(error, LUMI_ERR_LIMIT, "lens '%s' has %d parameters", lens->name, lens->parameter_count);
    for (int i = 0; i < lens->parameter_count; i++)
        if (!isfinite(lens->parameters[i]))
            return lumi_fail(error, LUMI_ERR_FORMAT, "lens '%s': parameter %d is not finite", lens->name, i);
    LUMI_TRY(capture_db_enter(capture, error));
    return capture_db_leave(capture, insert_lens(capture, lens, id, error), error);
}

int lumi_capture_add_camera(struct lumi_capture *capture, const char *name, int64_t lens, int64_t *id,
                            struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    if (!capture_name_ok(name, LUMI_CAPTURE_NAME))
        return lumi_fail(error, LUMI_ERR_ARG, "'%s' is no name for a camera", name);
    int code = capture_db_run(capture, error, "INSERT INTO cameras(name, lens) VALUES(?, ?)", "ti", name, lens);
    if (code == LUMI_ERR_EXISTS)
        return lumi_fail(error, code, "two cameras of one name: '%s'", name);
    if (code == LUMI_OK)
        *id = sqlite3_last_insert_rowid(capture->db);
    return code;
}

int lumi_capture_add_position(struct lumi_capture *capture, const struct lumi_capture_position *position, int64_t *id,
                              struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(capture_db_run(capture, error,
                            "INSERT INTO positions(number, turn, step, turn_angle, drop_angle) VALUES(?, ?, ?, ?, ?)",
                            "iiidd", (int64_t)position->number, (int64_t)position->turn, position->step,
                            position->turn_angle, position->drop));
    *id = sqlite3_last_insert_rowid(capture->db);
    return LUMI_OK;
}

int lumi_capture_add_shot(struct lumi_capture *capture, int64_t position, int number, double exposure_offset,
                          int64_t *id, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(capture_db_run(capture, error, "INSERT INTO shots(position, number, exposure_offset) VALUES(?, ?, ?)",
                            "iid", position, (int64_t)number, exposure_offset));
    *id = sqlite3_last_insert_rowid(capture->db);
    return LUMI_OK;
}

/* ---- Frames ---- */

/* A position and a shot for a frame that comes without. */
static int own_shot(struct lumi_capture *capture, int64_t *shot, struct lumi_error *error)
{
    struct lumi_capture_position position = {0};
    int64_t next, id;

    LUMI_TRY(capture_db_int(capture, &next, error, "SELECT ifnull(max(number), -1) + 1 FROM positions", ""));
    position.number = (int)next;
    LUMI_TRY(lumi_capture_add_position(capture, &position, &id, error));
    return lumi_capture_add_shot(capture, id, 0, 0, shot, error);
}

static int insert_frame(struct lumi_capture *capture, const struct lumi_capture_new_frame *frame, int64_t retake_of,
                        int64_t *id, struct lumi_error *error)
{
    int64_t shot = frame->shot, taken;

    LUMI_TRY(capture_db_int(capture, &taken, error, "SELECT count(*) FROM frames WHERE name = ?", "t", frame->name));
    if (taken)
        return lumi_fail(error, LUMI_ERR_EXISTS, "two frames of one name: '%s'", frame->name);
    if (!shot)
        LUMI_TRY(own_shot(capture, &shot, error));
    LUMI_TRY(capture_db_run(capture, error,
                            "INSERT INTO frames(name, original, shot, camera, lens, grid_row, grid_column, retake_of) "
                            "VALUES(?1, ?2, ?3, ?4, CASE ?5 WHEN 0 THEN ifnull((SELECT lens FROM cameras WHERE id = "
                            "?4), 0) ELSE ?5 END, ?6, ?7, nullif(?8, 0))",
                            "ttiiiiii", frame->name, frame->original ? frame->original : "", shot, frame->camera,
                            frame->lens, (int64_t)frame->row, (int64_t)frame->column, retake_of));
    *id = sqlite3_last_insert_rowid(capture->db);
    return LUMI_OK;
}

int lumi_capture_add_frame(struct lumi_capture *capture, const struct lumi_capture_new_frame *frame, int64_t *id,
                           struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    if (!frame->name || !capture_name_ok(frame->name, LUMI_CAPTURE_NAME))
        return lumi_fail(error, LUMI_ERR_ARG, "'%s' is no name for a frame", frame->name ? frame->name : "");
    LUMI_TRY(capture_db_enter(capture, error));
    return capture_db_leave(capture, insert_frame(capture, frame, 0, id, error), error);
}

static int frame_state(struct lumi_capture *capture, int64_t frame, enum lumi_frame_state *state, char *name,
                       struct lumi_error *error)
{
    sqlite3_stmt *statement;
    char text[16];
    bool row;
    int code;

    LUMI_TRY(capture_db_prepare(capture, &statement, error, "SELECT state, name FROM frames WHERE id = ?", "i", frame));
    LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
    if (!row) {
        code = lumi_fail(error, LUMI_ERR_ARG, "%s: no frame %lld", capture->path, (long long)frame);
        goto done;
    }
    capture_db_text(statement, 0, text, sizeof text);
    capture_db_text(statement, 1, name, LUMI_CAPTURE_NAME);
    for (int i = 0; i <= LUMI_FRAME_RETAKEN; i++)
        if (!strcmp(text, state_names[i]))
            *state = (enum lumi_frame_state)i;
done:
    sqlite3_finalize(statement);
    return code;
}

/* LUMI_ERR_ARG unless the frame is in one of the states whose bits are set. */
static int need_state(struct lumi_capture *capture, int64_t frame, unsigned allowed, enum lumi_frame_state to,
                      char *name, struct lumi_error *error)
{
    enum lumi_frame_state state = LUMI_FRAME_PLANNED;

    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(frame_state(capture, frame, &state, name, error));
    if (!(allowed & 1u << state))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: frame '%s' is %s and cannot become %s", capture->path, name,
                         state_names[state], state_names[to]);
    return LUMI_OK;
}

int lumi_capture_trigger_frame(struct lumi_capture *capture, int64_t frame, int64_t trigger_time_us,
                               struct lumi_error *error)
{
    const unsigned any = ~0u;
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(need_state(capture, frame, any, LUMI_FRAME_TRIGGERED, name, error));
    LUMI_TRY(capture_db_enter(capture, error));
    int code = capture_db_run(capture, error,
                              "UPDATE frames SET trigger_time_us = ifnull(trigger_time_us, nullif(?, ?)) WHERE id = ?",
                              "iii", trigger_time_us, LUMI_NO_TIME, frame);
    if (code == LUMI_OK)
        code = capture_db_run(capture, error,
                              "UPDATE frames SET state = 'triggered' WHERE id = ? AND state = 'planned'", "i", frame);
    return capture_db_leave(capture, code, error);
}

int lumi_capture_expose_frame(struct lumi_capture *capture, int64_t frame, int64_t exposed_time_us,
                              struct lumi_error *error)
{
    const unsigned any = ~0u;
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(need_state(capture, frame, any, LUMI_FRAME_TRIGGERED, name, error));
    return capture_db_run(capture, error, "UPDATE frames SET exposed_time_us = nullif(?, ?) WHERE id = ?", "iii",
                          exposed_time_us, LUMI_NO_TIME, frame);
}

int lumi_capture_lose_frame(struct lumi_capture *capture, int64_t frame, const char *reason, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(need_state(capture, frame, 1u << LUMI_FRAME_PLANNED | 1u << LUMI_FRAME_TRIGGERED, LUMI_FRAME_REJECTED,
                        name, error));
    LUMI_TRY(capture_db_enter(capture, error));
    int code = capture_db_run(capture, error, "UPDATE frames SET reason = ? WHERE id = ?", "ti", reason, frame);
    if (code == LUMI_OK)
        code = capture_db_run(capture, error,
                              "UPDATE frames SET state = 'rejected' WHERE id = ? AND state = 'triggered'", "i", frame);
    return capture_db_leave(capture, code, error);
}

int lumi_capture_judge_frame(struct lumi_capture *capture, int64_t frame, bool accepted, double sharpness,
                             const char *reason, struct lumi_error *error)
{
    unsigned from = accepted ? 1u << LUMI_FRAME_RECEIVED | 1u << LUMI_FRAME_REJECTED
                             : 1u << LUMI_FRAME_RECEIVED | 1u << LUMI_FRAME_ACCEPTED | 1u << LUMI_FRAME_TRIGGERED;
    enum lumi_frame_state to = accepted ? LUMI_FRAME_ACCEPTED : LUMI_FRAME_REJECTED;
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(need_state(capture, frame, from, to, name, error));
    int code = capture_db_run(capture, error, "UPDATE frames SET state = ?, sharpness = ?, reason = ? WHERE id = ?",
                              "tdti", state_names[to], sharpness, reason, frame);
    if (code == LUMI_ERR_ARG)
        return lumi_fail(error, code, "%s: frame '%s' has no file and cannot become %s", capture->path, name,
                         state_names[to]);
    return code;
}

/* What a retake takes over from the frame it replaces. */
static int read_for_retake(struct lumi_capture *capture, int64_t frame, struct lumi_capture_new_frame *again,
                           int64_t *position, double *exposure_offset, struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT f.camera, f.lens, f.grid_row, f.grid_column, s.position, s.exposure_offset "
                                "FROM frames f JOIN shots s ON s.id = f.shot WHERE f.id = ?",
                                "i", frame));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK) {
        again->camera = sqlite3_column_int64(statement, 0);
        again->lens = sqlite3_column_int64(statement, 1);
        again->row = sqlite3_column_int(statement, 2);
        again->column = sqlite3_column_int(statement, 3);
        *position = sqlite3_column_int64(statement, 4);
        *exposure_offset = sqlite3_column_double(statement, 5);
    }
    sqlite3_finalize(statement);
    return code;
}

/* The shot that a retake belongs to: one that replaces the same shot and has not been fired, or a new one. */
static int retake_shot(struct lumi_capture *capture, int64_t frame, int64_t camera, int64_t position,
                       double exposure_offset, int64_t *shot, struct lumi_error *error)
{
    int64_t number;

    LUMI_TRY(capture_db_int(capture, shot, error,
                            "SELECT ifnull(max(n.shot), 0) FROM frames o JOIN frames p ON p.shot = o.shot JOIN frames "
                            "n ON n.retake_of = p.id WHERE o.id = ?1 AND NOT EXISTS(SELECT 1 FROM frames x WHERE "
                            "x.shot = n.shot AND (x.camera = ?2 OR x.state <> 'planned'))",
                            "ii", frame, camera));
    if (*shot)
        return LUMI_OK;
    LUMI_TRY(
        capture_db_int(capture, &number, error, "SELECT max(number) + 1 FROM shots WHERE position = ?", "i", position));
    LUMI_TRY(lumi_capture_add_shot(capture, position, (int)number, exposure_offset, shot, error));
    return capture_db_run(capture, error,
                          "UPDATE shots SET plan_shot = (SELECT s.plan_shot FROM shots s JOIN frames f ON f.shot = "
                          "s.id WHERE f.id = ?) WHERE id = ?",
                          "ii", frame, *shot);
}

/* Without the number that it has if it is a retake itself. */
static int first_name(struct lumi_capture *capture, int64_t frame, const char *name, char first[LUMI_CAPTURE_NAME],
                      struct lumi_error *error)
{
    int64_t retake;
    char *dot;

    LUMI_TRY(
        capture_db_int(capture, &retake, error, "SELECT retake_of IS NOT NULL FROM frames WHERE id = ?", "i", frame));
    snprintf(first, LUMI_CAPTURE_NAME, "%s", name);
    dot = retake ? strrchr(first, '.') : NULL;
    if (dot && dot != first)
        *dot = '\0';
    return LUMI_OK;
}

static int insert_retake(struct lumi_capture *capture, int64_t frame, const char *old_name, int64_t *id,
                         struct lumi_error *error)
{
    struct lumi_capture_new_frame again = {0};
    char name[LUMI_CAPTURE_NAME + 24], first[LUMI_CAPTURE_NAME];
    int64_t position, shot, taken;
    double exposure_offset;

    LUMI_TRY(read_for_retake(capture, frame, &again, &position, &exposure_offset, error));
    LUMI_TRY(first_name(capture, frame, old_name, first, error));
    for (int n = 2;; n++) {
        snprintf(name, sizeof name, "%s.%d", first, n);
        LUMI_TRY(capture_db_int(capture, &taken, error, "SELECT count(*) FROM frames WHERE name = ?", "t", name));
        if (!taken)
            break;
    }
    if (!capture_name_ok(name, LUMI_CAPTURE_NAME))
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: the name of a retake of '%s' is too long", capture->path,
                         old_name);
    LUMI_TRY(retake_shot(capture, frame, again.camera, position, exposure_offset, &shot, error));
    again.name = name;
    again.shot = shot;
    LUMI_TRY(insert_frame(capture, &again, frame, id, error));
    LUMI_TRY(
        capture_db_run(capture, error,
                       "INSERT INTO poses(frame, source, origin, current, r00, r01, r02, r10, r11, r12, r20, r21, "
                       "r22, tx, ty, tz) SELECT ?, source, origin, 1, r00, r01, r02, r10, r11, r12, r20, r21, r22, "
                       "tx, ty, tz FROM poses WHERE frame = ? AND source = 'prior' ORDER BY id DESC LIMIT 1",
                       "ii", *id, frame));
    return capture_db_run(capture, error, "UPDATE frames SET state = 'retaken' WHERE id = ?", "i", frame);
}

int lumi_capture_retake_frame(struct lumi_capture *capture, int64_t frame, int64_t *id, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(need_state(capture, frame, 1u << LUMI_FRAME_REJECTED, LUMI_FRAME_RETAKEN, name, error));
    LUMI_TRY(capture_db_enter(capture, error));
    return capture_db_leave(capture, insert_retake(capture, frame, name, id, error), error);
}

static int insert_pose(struct lumi_capture *capture, int64_t frame, const struct lumi_pose *p, const char *source,
                       const char *origin, struct lumi_error *error)
{
    LUMI_TRY(
        capture_db_run(capture, error, "UPDATE poses SET current = 0 WHERE frame = ? AND current = 1", "i", frame));
    return capture_db_run(capture, error,
                          "INSERT INTO poses(frame, source, origin, current, r00, r01, r02, r10, r11, r12, r20, r21, "
                          "r22, tx, ty, tz) VALUES(?, ?, ?, 1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                          "ittdddddddddddd", frame, source, origin ? origin : "", p->r[0], p->r[1], p->r[2], p->r[3],
                          p->r[4], p->r[5], p->r[6], p->r[7], p->r[8], p->t.x, p->t.y, p->t.z);
}

int lumi_capture_set_pose(struct lumi_capture *capture, int64_t frame, const struct lumi_pose *pose,
                          enum lumi_pose_source source, const char *origin, struct lumi_error *error)
{
    enum lumi_frame_state state;
    char name[LUMI_CAPTURE_NAME];

    LUMI_TRY(capture_need_writable(capture, error));
    if (source < LUMI_POSE_TRUE || source > LUMI_POSE_IMPORTED)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no pose source %d", capture->path, (int)source);
    LUMI_TRY(frame_state(capture, frame, &state, name, error));
    if (!lumi_pose_valid(pose, 1e-3))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the pose of frame '%s' is not finite or its matrix is no rotation",
                         name);
    LUMI_TRY(capture_db_enter(capture, error));
    return capture_db_leave(capture, insert_pose(capture, frame, pose, source_names[source], origin, error), error);
}
