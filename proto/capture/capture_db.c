/* SQLite in short: prepare, bind, run, and its errors as ours. */
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static int code_of(sqlite3 *db)
{
    int extended = sqlite3_extended_errcode(db), number = sqlite3_system_errno(db);

    switch (extended & 0xff) {
    case SQLITE_FULL:
        return LUMI_ERR_NOSPACE;
    case SQLITE_NOMEM:
        return LUMI_ERR_NOMEM;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
        return LUMI_ERR_BUSY;
    case SQLITE_IOERR:
        return number == ENOSPC || number == EDQUOT ? LUMI_ERR_NOSPACE : LUMI_ERR_IO;
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
        return LUMI_ERR_IO;
    case SQLITE_CANTOPEN:
        return number == ENOENT ? LUMI_ERR_NOTFOUND : LUMI_ERR_IO;
    case SQLITE_CONSTRAINT:
        return extended == SQLITE_CONSTRAINT_UNIQUE || extended == SQLITE_CONSTRAINT_PRIMARYKEY ? LUMI_ERR_EXISTS
                                                                                                : LUMI_ERR_ARG;
    case SQLITE_MISUSE:
    case SQLITE_RANGE:
        return LUMI_ERR_INTERNAL;
    default: /* corrupt, not a database, too big, and a schema that cannot be parsed */
        return LUMI_ERR_FORMAT;
    }
}

int capture_db_fail(struct lumi_capture *capture, const char *doing, struct lumi_error *error)
{
    return lumi_fail(error, code_of(capture->db), "%s/" CAPTURE_DB ": %s: %s", capture->path, doing,
                     sqlite3_errmsg(capture->db));
}

static int bind_one(sqlite3_stmt *statement, int place, char type, va_list *args)
{
    switch (type) {
    case 'i':
        return sqlite3_bind_int64(statement, place, va_arg(*args, int64_t));
    case 'd': {
        double value = va_arg(*args, double);
        return isfinite(value) ? sqlite3_bind_double(statement, place, value) : sqlite3_bind_null(statement, place);
    }
    case 't': {
        const char *text = va_arg(*args, const char *);
        return text ? sqlite3_bind_text(statement, place, text, -1, SQLITE_TRANSIENT)
                    : sqlite3_bind_null(statement, place);
    }
    default: {
        const void *data = va_arg(*args, const void *);
        size_t size = va_arg(*args, size_t);
        return sqlite3_bind_blob64(statement, place, data, size, SQLITE_STATIC);
    }
    }
}

static int bind_all(struct lumi_capture *capture, sqlite3_stmt *statement, struct lumi_error *error, const char *types,
                    va_list *args)
{
    for (int i = 0; types[i]; i++)
        if (bind_one(statement, i + 1, types[i], args) != SQLITE_OK)
            return capture_db_fail(capture, "bind", error);
    return LUMI_OK;
}

static int prepare(struct lumi_capture *capture, sqlite3_stmt **statement, struct lumi_error *error, const char *sql,
                   const char *types, va_list *args)
{
    if (sqlite3_prepare_v2(capture->db, sql, -1, statement, NULL) != SQLITE_OK)
        return capture_db_fail(capture, "prepare", error);
    const int code = bind_all(capture, *statement, error, types, args);
    if (code != LUMI_OK) {
        sqlite3_finalize(*statement);
        *statement = NULL;
    }
    return code;
}

/* ---- Statements that are kept ---- */

/* Statements about rows; the others begin and end transactions or set something once, and must not stay. */
static bool is_kept(const char *sql)
{
    return !strncmp(sql, "SELECT", 6) || !strncmp(sql, "INSERT", 6) || !strncmp(sql, "UPDATE", 6);
}

/* Its place by its address, or the next that is free; NULL: all near it are taken. */
static struct capture_statement *place_of(struct lumi_capture *capture, const char *sql)
{
    const size_t first = ((uintptr_t)sql >> 3) * 2654435761u % CAPTURE_CACHE;

    for (size_t i = 0; i < CAPTURE_CACHE; i++) {
        struct capture_statement *place = &capture->cache[(first + i) % CAPTURE_CACHE];
        if (!place->sql || place->sql == sql)
            return place;
    }
    return NULL;
}

/* A bound statement, to be given to `put_back` when it has run. */
static int take(struct lumi_capture *capture, sqlite3_stmt **statement, struct lumi_error *error, const char *sql,
                const char *types, va_list *args)
{
    struct capture_statement *place = is_kept(sql) ? place_of(capture, sql) : NULL;

    *statement = NULL;
    if (!place || !place->statement)
        return prepare(capture, statement, error, sql, types, args);
    sqlite3_stmt *kept = place->statement;
    place->statement = NULL;
    const int code = bind_all(capture, kept, error, types, args);
    if (code == LUMI_OK)
        *statement = kept;
    else
        sqlite3_finalize(kept);
    return code;
}

static void put_back(struct lumi_capture *capture, const char *sql, sqlite3_stmt *statement, int code)
{
    struct capture_statement *place = code == LUMI_OK && is_kept(sql) ? place_of(capture, sql) : NULL;

    if (!place || place->statement || sqlite3_reset(statement) != SQLITE_OK) {
        sqlite3_finalize(statement);
        return;
    }
    sqlite3_clear_bindings(statement);
    place->sql = sql;
    place->statement = statement;
}

void capture_db_close(struct lumi_capture *capture)
{
    for (int i = 0; i < CAPTURE_CACHE; i++)
        sqlite3_finalize(capture->cache[i].statement);
    memset(capture->cache, 0, sizeof capture->cache);
    sqlite3_close(capture->db);
    capture->db = NULL;
}

int capture_db_prepare(struct lumi_capture *capture, sqlite3_stmt **statement, struct lumi_error *error,
                       const char *sql, const char *types, ...)
{
    va_list args;

    va_start(args, types);
    int code = prepare(capture, statement, error, sql, types, &args);
    va_end(args);
    return code;
}

int capture_db_step(struct lumi_capture *capture, sqlite3_stmt *statement, bool *row, struct lumi_error *error)
{
    int result = sqlite3_step(statement);

    *row = result == SQLITE_ROW;
    if (result == SQLITE_ROW || result == SQLITE_DONE)
        return LUMI_OK;
    if (result == SQLITE_INTERRUPT)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s/" CAPTURE_DB ": damaged: a table has no end", capture->path);
    return capture_db_fail(capture, "database", error);
}

int capture_db_run(struct lumi_capture *capture, struct lumi_error *error, const char *sql, const char *types, ...)
{
    sqlite3_stmt *statement;
    va_list args;
    bool row = true;

    va_start(args, types);
    int code = take(capture, &statement, error, sql, types, &args);
    va_end(args);
    while (code == LUMI_OK && row)
        code = capture_db_step(capture, statement, &row, error);
    put_back(capture, sql, statement, code);
    return code;
}

int capture_db_int(struct lumi_capture *capture, int64_t *value, struct lumi_error *error, const char *sql,
                   const char *types, ...)
{
    sqlite3_stmt *statement;
    va_list args;
    bool row = false;

    va_start(args, types);
    int code = take(capture, &statement, error, sql, types, &args);
    va_end(args);
    if (code == LUMI_OK)
        code = capture_db_step(capture, statement, &row, error);
    if (code == LUMI_OK && !row)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no such row", capture->path);
    if (code == LUMI_OK)
        *value = sqlite3_column_int64(statement, 0);
    put_back(capture, sql, statement, code);
    return code;
}

void capture_db_text(sqlite3_stmt *statement, int column, char *text, size_t size)
{
    const char *value = (const char *)sqlite3_column_text(statement, column);

    snprintf(text, size, "%s", value ? value : "");
}

int capture_db_enter(struct lumi_capture *capture, struct lumi_error *error)
{
    return capture_db_run(capture, error, "SAVEPOINT step", "");
}

int capture_db_leave(struct lumi_capture *capture, int code, struct lumi_error *error)
{
    if (code == LUMI_OK)
        code = capture_db_run(capture, error, "RELEASE step", "");
    if (code != LUMI_OK) {
        /* After some errors SQLite has rolled back all by itself; then these do nothing. */
        sqlite3_exec(capture->db, "ROLLBACK TO step", NULL, NULL, NULL);
        sqlite3_exec(capture->db, "RELEASE step", NULL, NULL, NULL);
    }
    return code;
}
