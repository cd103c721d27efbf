/* Reading: frames with all that belongs to them. Trusts nothing in the database. */
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/capture/capture_priv.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A row of `frames` takes at least so many bytes in the file. A damaged database whose pages point at each other can
 * claim more rows than it has room for; this many are read at most. */
#define FRAME_BYTES_MIN 48

static int interrupt(void *context)
{
    int64_t *left = context;

    return --*left < 0;
}

#define FRAME_COLUMNS                                                                                                  \
    "f.id, f.camera, f.lens, s.position, f.shot, f.name, f.original, c.name, f.state, f.file, f.sha256, f.bytes, "     \
    "l.width, l.height, l.model, l.fx, l.fy, l.cx, l.cy, l.k1, l.k2, l.k3, l.k4, l.p1, l.p2, l.source_model, "         \
    "q.source, q.r00, q.r01, q.r02, q.r10, q.r11, q.r12, q.r20, q.r21, q.r22, q.tx, q.ty, q.tz, f.grid_row, "          \
    "f.grid_column, p.number, p.turn, s.number, p.step, p.turn_angle, p.drop_angle, s.exposure_offset, "               \
    "f.exposure_s, f.iso, f.sharpness, f.trigger_time_us, f.camera_time_us, f.exposed_time_us, "                       \
    "ifnull(s.plan_shot, -1), ifnull(s.sweep, -1), f.retake_of, f.reason, j.blur_pixels, j.clipped, j.dark, j.mean, "  \
    "j.exposure_stops, j.shift_pixels, j.moved "
#define FRAME_TABLES                                                                                                   \
    "FROM frames f JOIN shots s ON s.id = f.shot JOIN positions p ON p.id = s.position JOIN cameras c ON c.id = "      \
    "f.camera JOIN lenses l ON l.id = f.lens LEFT JOIN poses q ON q.frame = f.id AND q.current = 1 "                   \
    "LEFT JOIN judgements j ON j.frame = f.id "
#define FRAME_ORDER "ORDER BY p.number, s.number, f.camera, f.id"

static int read_lens(sqlite3_stmt *row, int column, struct lumi_lens *lens)
{
    const char *model = (const char *)sqlite3_column_text(row, column + 2);
    double *values[] = {&lens->fx, &lens->fy, &lens->cx, &lens->cy, &lens->k1,
                        &lens->k2, &lens->k3, &lens->k4, &lens->p1, &lens->p2};

    memset(lens, 0, sizeof *lens);
    lens->width = sqlite3_column_int(row, column);
    lens->height = sqlite3_column_int(row, column + 1);
    lens->model = model && !strcmp(model, "fisheye") ? LUMI_LENS_FISHEYE : LUMI_LENS_BROWN;
    for (int i = 0; i < 10; i++)
        *values[i] = sqlite3_column_double(row, column + 3 + i);
    return lumi_lens_valid(lens) ? LUMI_OK : LUMI_ERR_FORMAT;
}

static int choice(sqlite3_stmt *row, int column, int first, int last, const char *(*name)(int))
{
    const char *text = (const char *)sqlite3_column_text(row, column);

    for (int i = first; text && i <= last; i++)
        if (!strcmp(text, name(i)))
            return i;
    return -1;
}

static const char *state_name(int state)
{
    return lumi_frame_state_name((enum lumi_frame_state)state);
}

static const char *source_name(int source)
{
    return lumi_pose_source_name((enum lumi_pose_source)source);
}

static int64_t time_of(sqlite3_stmt *row, int column)
{
    return sqlite3_column_type(row, column) == SQLITE_NULL ? LUMI_NO_TIME : sqlite3_column_int64(row, column);
}

static bool hex_ok(const char *text)
{
    return strlen(text) == 64 && strspn(text, "0123456789abcdef") == 64;
}

/* Why a frame cannot be used, or NULL. */
static const char *frame_fault(const struct lumi_capture_frame *frame)
{
    if (!capture_name_ok(frame->name, sizeof frame->name))
        return "its name is no file name";
    if (!capture_name_ok(frame->camera_name, sizeof frame->camera_name))
        return "its camera's name is no file name";
    if (frame->file[0] && !capture_file_ok(frame->file))
        return "its file lies outside " CAPTURE_FRAMES;
    if (frame->file[0] && (!hex_ok(frame->sha256) || frame->bytes < 0))
        return "its checksum or size is malformed";
    if (!frame->file[0] && (frame->state == LUMI_FRAME_RECEIVED || frame->state == LUMI_FRAME_ACCEPTED))
        return "it is received and has no file";
    return NULL;
}

static int read_pose(sqlite3_stmt *row, int column, struct lumi_capture_frame *frame)
{
    frame->has_pose = sqlite3_column_type(row, column) != SQLITE_NULL;
    if (!frame->has_pose)
        return LUMI_OK;
    int source = choice(row, column, LUMI_POSE_TRUE, LUMI_POSE_IMPORTED, source_name);
    if (source < 0)
        return LUMI_ERR_FORMAT;
    frame->pose_source = (enum lumi_pose_source)source;
    for (int i = 0; i < 9; i++)
        frame->pose.r[i] = sqlite3_column_double(row, column + 1 + i);
    frame->pose.t = lumi_vec3(sqlite3_column_double(row, column + 10), sqlite3_column_double(row, column + 11),
                              sqlite3_column_double(row, column + 12));
    return lumi_pose_valid(&frame->pose, 1e-3) ? LUMI_OK : LUMI_ERR_FORMAT;
}

static double number_or_nan(sqlite3_stmt *row, int column)
{
    return sqlite3_column_type(row, column) == SQLITE_NULL ? (double)NAN : sqlite3_column_double(row, column);
}

/* What became of it. */
static void read_fate(sqlite3_stmt *row, int column, struct lumi_capture_frame *frame)
{
    struct lumi_capture_judgement *judgement = &frame->judgement;
    double *numbers[] = {&judgement->blur_pixels,    &judgement->clipped,      &judgement->dark, &judgement->mean,
                         &judgement->exposure_stops, &judgement->shift_pixels, &judgement->moved};

    frame->exposed_time_us = time_of(row, column);
    frame->plan_shot = sqlite3_column_int(row, column + 1);
    frame->sweep = sqlite3_column_int(row, column + 2);
    frame->retake_of = sqlite3_column_int64(row, column + 3);
    capture_db_text(row, column + 4, frame->reason, sizeof frame->reason);
    for (int i = 0; i < 7; i++)
        *numbers[i] = number_or_nan(row, column + 5 + i);
}

static int read_frame(struct lumi_capture *capture, sqlite3_stmt *row, struct lumi_capture_frame *frame,
                      struct lumi_error *error)
{
    memset(frame, 0, sizeof *frame);
    frame->id = sqlite3_column_int64(row, 0);
    frame->camera = sqlite3_column_int64(row, 1);
    frame->lens_id = sqlite3_column_int64(row, 2);
    frame->position_id = sqlite3_column_int64(row, 3);
    frame->shot_id = sqlite3_column_int64(row, 4);
    capture_db_text(row, 5, frame->name, sizeof frame->name);
    capture_db_text(row, 6, frame->original, sizeof frame->original);
    capture_db_text(row, 7, frame->camera_name, sizeof frame->camera_name);
    int state = choice(row, 8, LUMI_FRAME_PLANNED, LUMI_FRAME_RETAKEN, state_name);
    capture_db_text(row, 9, frame->file, sizeof frame->file);
    capture_db_text(row, 10, frame->sha256, sizeof frame->sha256);
    frame->bytes = sqlite3_column_int64(row, 11);
    int lens = read_lens(row, 12, &frame->lens);
    frame->width = frame->lens.width;
    frame->height = frame->lens.height;
    capture_db_text(row, 25, frame->lens_model, sizeof frame->lens_model);
    int pose = read_pose(row, 26, frame);
    frame->row = sqlite3_column_int(row, 39);
    frame->column = sqlite3_column_int(row, 40);
    frame->position = sqlite3_column_int(row, 41);
    frame->turn = sqlite3_column_int(row, 42);
    frame->shot = sqlite3_column_int(row, 43);
    frame->step = sqlite3_column_int64(row, 44);
    frame->turn_angle = sqlite3_column_double(row, 45);
    frame->drop = sqlite3_column_double(row, 46);
    frame->exposure_offset = sqlite3_column_double(row, 47);
    frame->exposure_s = sqlite3_column_double(row, 48);
    frame->iso = sqlite3_column_double(row, 49);
    frame->sharpness = sqlite3_column_double(row, 50);
    frame->trigger_time_us = time_of(row, 51);
    frame->camera_time_us = time_of(row, 52);
    read_fate(row, 53, frame);
    if (state >= 0)
        frame->state = (enum lumi_frame_state)state;

    const char *fault = state < 0         ? "its state is unknown"
                        : lens != LUMI_OK ? "its lens is out of range"
                        : pose != LUMI_OK ? "its pose is no pose"
                                          : frame_fault(frame);
    if (fault)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: frame %lld: %s", capture->path, (long long)frame->id, fault);
    return LUMI_OK;
}

/* What a reader may do before a database counts as endless: a multiple of what a sound one of this size needs. */
static int64_t patience(const struct lumi_capture *capture)
{
    return 1000 + capture->db_bytes / 64;
}

static int read_all(struct lumi_capture *capture, sqlite3_stmt *statement, struct lumi_capture_frame **frames,
                    int *count, struct lumi_error *error)
{
    int64_t limit =
        capture->writable || capture->db_bytes == 0 ? INT32_MAX / 2 : capture->db_bytes / FRAME_BYTES_MIN + 1;
    int capacity = 0;
    bool row;

    for (;;) {
        LUMI_TRY(capture_db_step(capture, statement, &row, error));
        if (!row)
            return LUMI_OK;
        if (*count >= limit)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s/" CAPTURE_DB ": damaged: more frames than it has room for",
                             capture->path);
        if (*count == capacity) {
            capacity = capacity ? capacity * 2 : 16;
            struct lumi_capture_frame *more = lumi_realloc(*frames, (size_t)capacity, sizeof *more);
            if (!more)
                return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory for %d frames", capture->path, capacity);
            *frames = more;
        }
        LUMI_TRY(read_frame(capture, statement, &(*frames)[*count], error));
        ++*count;
    }
}

int lumi_capture_frames(struct lumi_capture *capture, enum lumi_frame_filter filter, struct lumi_capture_frame **frames,
                        int *count, struct lumi_error *error)
{
    const char *sql = filter == LUMI_FRAMES_USABLE ? "SELECT " FRAME_COLUMNS FRAME_TABLES
                                                     "WHERE f.state IN ('received', 'accepted') " FRAME_ORDER
                                                   : "SELECT " FRAME_COLUMNS FRAME_TABLES FRAME_ORDER;
    int64_t left = patience(capture);
    sqlite3_stmt *statement;

    *frames = NULL;
    *count = 0;
    if (!capture->writable)
        sqlite3_progress_handler(capture->db, 1000, interrupt, &left);
    int code = capture_db_prepare(capture, &statement, error, sql, "");
    if (code == LUMI_OK) {
        code = read_all(capture, statement, frames, count, error);
        sqlite3_finalize(statement);
    }
    sqlite3_progress_handler(capture->db, 0, NULL, NULL);
    if (code != LUMI_OK) {
        lumi_free(*frames);
        *frames = NULL;
        *count = 0;
    }
    return code;
}

static int read_parameters(struct lumi_capture *capture, int64_t id, struct lumi_capture_lens *lens,
                           struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT value FROM lens_parameters WHERE lens = ? ORDER BY number", "i", id));
    for (;;) {
        LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
        if (!row)
            break;
        if (lens->parameter_count == LUMI_CAPTURE_PARAMETERS) {
            code = lumi_fail(error, LUMI_ERR_LIMIT, "%s: lens %lld has more than %d parameters", capture->path,
                             (long long)id, LUMI_CAPTURE_PARAMETERS);
            goto done;
        }
        lens->parameters[lens->parameter_count++] = sqlite3_column_double(statement, 0);
    }
done:
    sqlite3_finalize(statement);
    return code;
}

int lumi_capture_lens(struct lumi_capture *capture, int64_t id, struct lumi_capture_lens *lens,
                      struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    memset(lens, 0, sizeof *lens);
    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT name, source_model, width, height, model, fx, fy, cx, cy, k1, k2, k3, k4, p1, "
                                "p2 FROM lenses WHERE id = ?",
                                "i", id));
    LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
    if (!row) {
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no lens %lld", capture->path, (long long)id);
        goto done;
    }
    capture_db_text(statement, 0, lens->name, sizeof lens->name);
    capture_db_text(statement, 1, lens->model, sizeof lens->model);
    if (read_lens(statement, 2, &lens->lens) != LUMI_OK) {
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: lens %lld is out of range", capture->path, (long long)id);
        goto done;
    }
    code = read_parameters(capture, id, lens, error);
done:
    sqlite3_finalize(statement);
    return code;
}

int lumi_capture_exif(struct lumi_capture *capture, int64_t frame, void **data, size_t *size, struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;

    *data = NULL;
    *size = 0;
    LUMI_TRY(capture_db_prepare(capture, &statement, error, "SELECT data FROM exif WHERE frame = ?", "i", frame));
    int code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && row) {
        const void *blob = sqlite3_column_blob(statement, 0);
        size_t bytes = (size_t)sqlite3_column_bytes(statement, 0);
        if (blob && bytes) {
            *data = lumi_alloc(bytes, 1);
            if (*data) {
                memcpy(*data, blob, bytes);
                *size = bytes;
            } else {
                code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
            }
        }
    }
    sqlite3_finalize(statement);
    return code;
}

static int count_rows(struct lumi_capture *capture, const char *sql, int *count, struct lumi_error *error)
{
    int64_t value = 0;

    LUMI_TRY(capture_db_int(capture, &value, error, sql, ""));
    *count = (int)value;
    return LUMI_OK;
}

static int count_frames(struct lumi_capture *capture, struct lumi_capture_info *info, struct lumi_error *error)
{
    sqlite3_stmt *statement;
    bool row;
    int code;

    LUMI_TRY(capture_db_prepare(capture, &statement, error,
                                "SELECT state, count(*), ifnull(total(bytes), 0) FROM frames GROUP BY state", ""));
    for (;;) {
        LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
        if (!row)
            break;
        int state = choice(statement, 0, LUMI_FRAME_PLANNED, LUMI_FRAME_RETAKEN, state_name);
        int count = sqlite3_column_int(statement, 1);
        if (state >= 0)
            info->in_state[state] += count;
        info->frames += count;
        info->frame_bytes += sqlite3_column_int64(statement, 2);
    }
done:
    sqlite3_finalize(statement);
    return code;
}

static int read_info(struct lumi_capture *capture, struct lumi_capture_info *info, struct lumi_error *error)
{
    int64_t pages, page_size;

    info->version = LUMI_CAPTURE_VERSION;
    info->sealed = capture->sealed;
    LUMI_TRY(count_rows(capture, "SELECT count(*) FROM cameras", &info->cameras, error));
    LUMI_TRY(count_rows(capture, "SELECT count(*) FROM lenses", &info->lenses, error));
    LUMI_TRY(count_rows(capture, "SELECT count(*) FROM positions", &info->positions, error));
    LUMI_TRY(count_rows(capture, "SELECT count(*) FROM shots", &info->shots, error));
    LUMI_TRY(count_rows(capture, "SELECT count(*) FROM poses WHERE current = 1", &info->with_pose, error));
    LUMI_TRY(count_frames(capture, info, error));
    LUMI_TRY(capture_db_int(capture, &pages, error, "PRAGMA page_count", ""));
    LUMI_TRY(capture_db_int(capture, &page_size, error, "PRAGMA page_size", ""));
    info->database_bytes = pages * page_size;
    return LUMI_OK;
}

int lumi_capture_info(struct lumi_capture *capture, struct lumi_capture_info *info, struct lumi_error *error)
{
    int64_t left = patience(capture);

    memset(info, 0, sizeof *info);
    if (!capture->writable)
        sqlite3_progress_handler(capture->db, 1000, interrupt, &left);
    int code = read_info(capture, info, error);
    sqlite3_progress_handler(capture->db, 0, NULL, NULL);
    return code;
}
