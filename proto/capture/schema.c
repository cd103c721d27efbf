/* The database's schema, version 2, and how older versions become newer ones. docs/capture-format.md explains it. */
#include "proto/capture/capture_priv.h"

#include <stdio.h>
#include <string.h>

/* What version 2 added. */
#define DEVICES                                                                                                        \
    "CREATE TABLE devices(camera INTEGER PRIMARY KEY REFERENCES cameras(id), vendor TEXT NOT NULL, "                   \
    "model TEXT NOT NULL, serial TEXT NOT NULL, firmware TEXT NOT NULL, address TEXT NOT NULL) STRICT"
#define SWEEPS                                                                                                         \
    "CREATE TABLE sweeps(number INTEGER PRIMARY KEY, began_us INTEGER, ended_us INTEGER, outcome TEXT NOT NULL) "      \
    "STRICT"
#define CLOCKS                                                                                                         \
    "CREATE TABLE clocks(sweep INTEGER NOT NULL REFERENCES sweeps(number), camera INTEGER NOT NULL REFERENCES "        \
    "cameras(id), frames INTEGER NOT NULL, offset_s REAL, drift_ppm REAL, residual_s REAL, worst_s REAL, "             \
    "PRIMARY KEY(sweep, camera)) STRICT"
#define JUDGEMENTS                                                                                                     \
    "CREATE TABLE judgements(frame INTEGER PRIMARY KEY REFERENCES frames(id), blur_pixels REAL, clipped REAL, "        \
    "dark REAL, mean REAL, exposure_stops REAL, shift_pixels REAL, moved REAL) STRICT"
#define INCIDENTS                                                                                                      \
    "CREATE TABLE incidents(id INTEGER PRIMARY KEY, time_us INTEGER, kind TEXT NOT NULL, camera INTEGER REFERENCES "   \
    "cameras(id), frame INTEGER REFERENCES frames(id), text TEXT NOT NULL) STRICT"
#define FRAMES_ADVANCE                                                                                                 \
    "CREATE TRIGGER frames_advance BEFORE UPDATE OF state ON frames WHEN NOT ("                                        \
    "OLD.state = 'planned' AND NEW.state IN ('triggered', 'received') OR "                                             \
    "OLD.state = 'triggered' AND NEW.state IN ('received', 'rejected') OR "                                            \
    "OLD.state = 'received' AND NEW.state IN ('accepted', 'rejected') OR "                                             \
    "OLD.state = 'accepted' AND NEW.state = 'rejected' OR "                                                            \
    "OLD.state = 'rejected' AND (NEW.state IN ('accepted', 'retaken') OR NEW.state = 'received' AND OLD.file IS "      \
    "NULL)) BEGIN SELECT RAISE(ABORT, 'a frame cannot go that way'); END"

/* Kept word for word by SQLite in sqlite_schema, which is how capture_schema_check knows a capture's database from
 * anything else: an extra view or trigger in a database from a stranger would be code that runs here. */
static const struct {
    const char *type, *name, *sql;
    int first, last; /* versions that have it; last 0: the latest */
} schema[] = {
    {"table", "meta", "CREATE TABLE meta(key TEXT NOT NULL PRIMARY KEY, value TEXT NOT NULL) STRICT", 1, 0},
    {"table", "profile", "CREATE TABLE profile(id INTEGER PRIMARY KEY CHECK(id = 1), text TEXT NOT NULL) STRICT", 1, 0},
    {"table", "plan", "CREATE TABLE plan(id INTEGER PRIMARY KEY CHECK(id = 1), text TEXT NOT NULL) STRICT", 1, 0},
    {"table", "lenses",
     "CREATE TABLE lenses(id INTEGER PRIMARY KEY, name TEXT NOT NULL, "
     "model TEXT NOT NULL CHECK(model IN ('pinhole', 'fisheye')), width INTEGER NOT NULL, height INTEGER NOT NULL, "
     "fx REAL NOT NULL, fy REAL NOT NULL, cx REAL NOT NULL, cy REAL NOT NULL, k1 REAL NOT NULL, k2 REAL NOT NULL, "
     "k3 REAL NOT NULL, k4 REAL NOT NULL, p1 REAL NOT NULL, p2 REAL NOT NULL, source_model TEXT NOT NULL) STRICT",
     1, 0},
    {"table", "lens_parameters",
     "CREATE TABLE lens_parameters(lens INTEGER NOT NULL REFERENCES lenses(id), number INTEGER NOT NULL, "
     "value REAL NOT NULL, PRIMARY KEY(lens, number)) STRICT",
     1, 0},
    {"table", "cameras",
     "CREATE TABLE cameras(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, "
     "lens INTEGER NOT NULL REFERENCES lenses(id)) STRICT",
     1, 0},
    {"table", "positions",
     "CREATE TABLE positions(id INTEGER PRIMARY KEY, number INTEGER NOT NULL UNIQUE, turn INTEGER NOT NULL, "
     "step INTEGER NOT NULL, turn_angle REAL NOT NULL, drop_angle REAL NOT NULL) STRICT",
     1, 0},
    {"table", "shots",
     "CREATE TABLE shots(id INTEGER PRIMARY KEY, position INTEGER NOT NULL REFERENCES positions(id), "
     "number INTEGER NOT NULL, exposure_offset REAL NOT NULL, UNIQUE(position, number)) STRICT",
     1, 1},
    {"table", "shots",
     "CREATE TABLE shots(id INTEGER PRIMARY KEY, position INTEGER NOT NULL REFERENCES positions(id), "
     "number INTEGER NOT NULL, exposure_offset REAL NOT NULL, plan_shot INTEGER, sweep INTEGER, "
     "UNIQUE(position, number)) STRICT",
     2, 0},
    {"table", "frames",
     "CREATE TABLE frames(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, original TEXT NOT NULL, "
     "shot INTEGER NOT NULL REFERENCES shots(id), camera INTEGER NOT NULL REFERENCES cameras(id), "
     "lens INTEGER NOT NULL REFERENCES lenses(id), grid_row INTEGER NOT NULL, grid_column INTEGER NOT NULL, "
     "state TEXT NOT NULL DEFAULT 'planned' "
     "CHECK(state IN ('planned', 'triggered', 'received', 'accepted', 'rejected', 'retaken')), "
     "trigger_time_us INTEGER, file TEXT UNIQUE, bytes INTEGER, sha256 TEXT, width INTEGER, height INTEGER, "
     "exposure_s REAL, iso REAL, camera_time_us INTEGER, sharpness REAL, reason TEXT, "
     "retake_of INTEGER REFERENCES frames(id), UNIQUE(shot, camera), "
     "CHECK(state NOT IN ('received', 'accepted') OR file IS NOT NULL), "
     "CHECK((file IS NULL) = (sha256 IS NULL) AND (file IS NULL) = (bytes IS NULL))) STRICT",
     1, 1},
    {"table", "frames",
     "CREATE TABLE frames(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, original TEXT NOT NULL, "
     "shot INTEGER NOT NULL REFERENCES shots(id), camera INTEGER NOT NULL REFERENCES cameras(id), "
     "lens INTEGER NOT NULL REFERENCES lenses(id), grid_row INTEGER NOT NULL, grid_column INTEGER NOT NULL, "
     "state TEXT NOT NULL DEFAULT 'planned' "
     "CHECK(state IN ('planned', 'triggered', 'received', 'accepted', 'rejected', 'retaken')), "
     "trigger_time_us INTEGER, file TEXT UNIQUE, bytes INTEGER, sha256 TEXT, width INTEGER, height INTEGER, "
     "exposure_s REAL, iso REAL, camera_time_us INTEGER, sharpness REAL, reason TEXT, "
     "retake_of INTEGER REFERENCES frames(id), exposed_time_us INTEGER, UNIQUE(shot, camera), "
     "CHECK(state NOT IN ('received', 'accepted') OR file IS NOT NULL), "
     "CHECK((file IS NULL) = (sha256 IS NULL) AND (file IS NULL) = (bytes IS NULL))) STRICT",
     2, 0},
    {"table", "exif", "CREATE TABLE exif(frame INTEGER PRIMARY KEY REFERENCES frames(id), data BLOB NOT NULL) STRICT",
     1, 0},
    {"table", "poses",
     "CREATE TABLE poses(id INTEGER PRIMARY KEY, frame INTEGER NOT NULL REFERENCES frames(id), "
     "source TEXT NOT NULL CHECK(source IN ('true', 'estimated', 'prior', 'imported')), origin TEXT NOT NULL, "
     "current INTEGER NOT NULL CHECK(current IN (0, 1)), r00 REAL NOT NULL, r01 REAL NOT NULL, r02 REAL NOT NULL, "
     "r10 REAL NOT NULL, r11 REAL NOT NULL, r12 REAL NOT NULL, r20 REAL NOT NULL, r21 REAL NOT NULL, "
     "r22 REAL NOT NULL, tx REAL NOT NULL, ty REAL NOT NULL, tz REAL NOT NULL) STRICT",
     1, 0},
    {"index", "poses_current", "CREATE UNIQUE INDEX poses_current ON poses(frame) WHERE current = 1", 1, 0},
    {"table", "devices", DEVICES, 2, 0},
    {"table", "sweeps", SWEEPS, 2, 0},
    {"table", "clocks", CLOCKS, 2, 0},
    {"table", "judgements", JUDGEMENTS, 2, 0},
    {"table", "incidents", INCIDENTS, 2, 0},
    {"trigger", "frames_begin",
     "CREATE TRIGGER frames_begin BEFORE INSERT ON frames WHEN NEW.state <> 'planned' "
     "BEGIN SELECT RAISE(ABORT, 'a frame begins as planned'); END",
     1, 0},
    {"trigger", "frames_advance",
     "CREATE TRIGGER frames_advance BEFORE UPDATE OF state ON frames WHEN NOT ("
     "OLD.state = 'planned' AND NEW.state IN ('triggered', 'received') OR "
     "OLD.state = 'triggered' AND NEW.state IN ('received', 'rejected') OR "
     "OLD.state = 'received' AND NEW.state IN ('accepted', 'rejected') OR "
     "OLD.state = 'accepted' AND NEW.state = 'rejected' OR "
     "OLD.state = 'rejected' AND NEW.state IN ('accepted', 'retaken')) "
     "BEGIN SELECT RAISE(ABORT, 'a frame cannot go that way'); END",
     1, 1},
    {"trigger", "frames_advance", FRAMES_ADVANCE, 2, 0},
    {"trigger", "frames_stay",
     "CREATE TRIGGER frames_stay BEFORE DELETE ON frames BEGIN SELECT RAISE(ABORT, 'frames are never deleted'); END", 1,
     0},
};
#define ENTRIES ((int)(sizeof schema / sizeof *schema))

static bool belongs(int entry, int version)
{
    return version >= schema[entry].first && (!schema[entry].last || version <= schema[entry].last);
}

/* SQLite puts a column that is added behind the last one, before the table's constraints: as it stands above. */
const struct capture_upgrade capture_upgrades[LUMI_CAPTURE_VERSION - 1] = {
    {"ALTER TABLE frames ADD COLUMN exposed_time_us INTEGER;"
     "ALTER TABLE shots ADD COLUMN plan_shot INTEGER;"
     "ALTER TABLE shots ADD COLUMN sweep INTEGER;" DEVICES ";" SWEEPS ";" CLOCKS ";" JUDGEMENTS ";" INCIDENTS ";"
     "DROP TRIGGER frames_advance;" FRAMES_ADVANCE},
};

int capture_schema_create(struct lumi_capture *capture, struct lumi_error *error)
{
    char pragma[96];

    LUMI_TRY(capture_db_enter(capture, error));
    int code = LUMI_OK;
    for (int i = 0; i < ENTRIES && code == LUMI_OK; i++)
        if (belongs(i, LUMI_CAPTURE_VERSION))
            code = capture_db_run(capture, error, schema[i].sql, "");
    snprintf(pragma, sizeof pragma, "PRAGMA user_version = %d", LUMI_CAPTURE_VERSION);
    if (code == LUMI_OK)
        code = capture_db_run(capture, error, pragma, "");
    snprintf(pragma, sizeof pragma, "PRAGMA application_id = %d", CAPTURE_APPLICATION_ID);
    if (code == LUMI_OK)
        code = capture_db_run(capture, error, pragma, "");
    return capture_db_leave(capture, code, error);
}

static int check_entry(struct lumi_capture *capture, sqlite3_stmt *statement, int version, bool *found,
                       struct lumi_error *error)
{
    const char *type = (const char *)sqlite3_column_text(statement, 0);
    const char *name = (const char *)sqlite3_column_text(statement, 1);
    const char *sql = (const char *)sqlite3_column_text(statement, 2);

    if (type && name && sql)
        for (int i = 0; i < ENTRIES; i++)
            if (belongs(i, version) && !strcmp(type, schema[i].type) && !strcmp(name, schema[i].name) &&
                !strcmp(sql, schema[i].sql)) {
                found[i] = true;
                return LUMI_OK;
            }
    /* Indexes that SQLite makes for UNIQUE have no text. */
    if (type && name && !sql && !strcmp(type, "index") && !strncmp(name, "sqlite_autoindex_", 17))
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its database has a %s '%s' that no capture of version %d has",
                     capture->path, type ? type : "thing", name ? name : "", version);
}

static int check_entries(struct lumi_capture *capture, int version, struct lumi_error *error)
{
    bool found[ENTRIES] = {false}, row;
    sqlite3_stmt *statement;
    int code;

    LUMI_TRY(capture_db_prepare(capture, &statement, error, "SELECT type, name, sql FROM sqlite_schema", ""));
    for (;;) {
        LUMI_GOTO(code, done, capture_db_step(capture, statement, &row, error));
        if (!row)
            break;
        LUMI_GOTO(code, done, check_entry(capture, statement, version, found, error));
    }
    for (int i = 0; i < ENTRIES; i++)
        if (belongs(i, version) && !found[i]) {
            code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: its database has no %s '%s'", capture->path, schema[i].type,
                             schema[i].name);
            goto done;
        }
done:
    sqlite3_finalize(statement);
    return code;
}

int capture_schema_check(struct lumi_capture *capture, int *version, struct lumi_error *error)
{
    int64_t value;

    *version = 0;
    LUMI_TRY(capture_db_int(capture, &value, error, "PRAGMA application_id", ""));
    if (value != CAPTURE_APPLICATION_ID)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: data/capture.db is not the database of a capture", capture->path);
    LUMI_TRY(capture_db_int(capture, &value, error, "PRAGMA user_version", ""));
    if (value > LUMI_CAPTURE_VERSION)
        return lumi_fail(error, LUMI_ERR_VERSION, "%s: a capture of version %lld, this program knows up to %d",
                         capture->path, (long long)value, LUMI_CAPTURE_VERSION);
    if (value < 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a capture of version %lld, which there never was", capture->path,
                         (long long)value);
    *version = (int)value;
    return check_entries(capture, *version, error);
}

static int upgrade_step(sqlite3 *db, const char *sql, int to, const char *path, struct lumi_error *error)
{
    char pragma[64];

    snprintf(pragma, sizeof pragma, "PRAGMA user_version = %d", to);
    if (sqlite3_exec(db, "BEGIN IMMEDIATE", NULL, NULL, NULL) == SQLITE_OK &&
        sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK &&
        sqlite3_exec(db, pragma, NULL, NULL, NULL) == SQLITE_OK &&
        sqlite3_exec(db, "COMMIT", NULL, NULL, NULL) == SQLITE_OK)
        return LUMI_OK;
    lumi_fail(error, LUMI_ERR_FORMAT, "%s: upgrade to version %d: %s", path, to, sqlite3_errmsg(db));
    sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
    return LUMI_ERR_FORMAT;
}

int capture_schema_upgrade(sqlite3 *db, const struct capture_upgrade *upgrades, int count, const char *path,
                           struct lumi_error *error)
{
    sqlite3_stmt *statement = NULL;
    int version = -1;

    if (sqlite3_prepare_v2(db, "PRAGMA user_version", -1, &statement, NULL) == SQLITE_OK &&
        sqlite3_step(statement) == SQLITE_ROW)
        version = sqlite3_column_int(statement, 0);
    sqlite3_finalize(statement);
    if (version < 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no version in its database", path);
    if (version > count + 1)
        return lumi_fail(error, LUMI_ERR_VERSION, "%s: a capture of version %d, this program knows up to %d", path,
                         version, count + 1);
    for (; version <= count; version++)
        LUMI_TRY(upgrade_step(db, upgrades[version - 1].sql, version + 1, path, error));
    return LUMI_OK;
}
