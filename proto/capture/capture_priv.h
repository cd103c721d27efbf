/* What the files of this folder share. */
#ifndef LUMI_PROTO_CAPTURE_CAPTURE_PRIV_H
#define LUMI_PROTO_CAPTURE_CAPTURE_PRIV_H

#include "proto/capture/capture.h"

#include <nettle/sha2.h>
#include <sqlite3.h>

#define CAPTURE_APPLICATION_ID 0x4c554d43 /* "LUMC" */
#define CAPTURE_DB "data/capture.db"
#define CAPTURE_FRAMES "data/frames"
#define CAPTURE_SEAL "tagmanifest-sha256.txt" /* written last, removed first: its presence means sealed */

struct capture_pending {
    char *name;                        /* in data/frames */
    bool synced;                       /* by who wrote it */
    char temporary[LUMI_CAPTURE_NAME]; /* its name before; "" none */
};

#define CAPTURE_CACHE 64
struct capture_statement {
    const char *sql; /* the very literal it was made of */
    sqlite3_stmt *statement;
};

struct lumi_capture {
    char *path;       /* directory in use */
    char *final_path; /* where publish puts it; NULL unless staged */
    sqlite3 *db;
    int dir_fd;    /* of the directory, locked by a writer; −1 for a capture in memory */
    int frames_fd; /* of data/frames; writers only */
    bool writable, sealed, in_batch;
    int64_t db_bytes;                              /* bounds what a damaged database can make a reader do */
    struct capture_pending *pending;               /* files stored in this batch */
    struct capture_statement cache[CAPTURE_CACHE]; /* compiled once, for what is run for every frame */
    int pending_count, pending_capacity;
    void *copy; /* the database's bytes, for lumi_capture_open_copy */
};

/* ---- capture_db.c: SQLite ---- */

/* The code and the text for SQLite's latest error on this capture. */
int capture_db_fail(struct lumi_capture *capture, const char *doing, struct lumi_error *error);
/* Prepares and binds: one letter of `types` a parameter: i int64_t, d double (not finite: NULL), t text (NULL: NULL),
 * b blob (const void *, size_t). */
int capture_db_prepare(struct lumi_capture *capture, sqlite3_stmt **statement, struct lumi_error *error,
                       const char *sql, const char *types, ...);
/* Prepares, binds, runs a statement without rows. `sql`, here and below, is kept compiled by its address: a literal,
 * not a buffer. */
int capture_db_run(struct lumi_capture *capture, struct lumi_error *error, const char *sql, const char *types, ...);
/* First column of the first row; LUMI_ERR_NOTFOUND without text if there is no row. */
int capture_db_int(struct lumi_capture *capture, int64_t *value, struct lumi_error *error, const char *sql,
                   const char *types, ...);
/* Closes the database, if it is open. */
void capture_db_close(struct lumi_capture *capture);
/* One step; LUMI_OK with *row telling whether there is a row. */
int capture_db_step(struct lumi_capture *capture, sqlite3_stmt *statement, bool *row, struct lumi_error *error);
/* Text of a column cut to size, never NULL. */
void capture_db_text(sqlite3_stmt *statement, int column, char *text, size_t size);

/* A group of statements that is kept whole or not at all; nests. `code` 0 keeps; returns code or the failure to keep.
 */
int capture_db_enter(struct lumi_capture *capture, struct lumi_error *error);
int capture_db_leave(struct lumi_capture *capture, int code, struct lumi_error *error);

/* ---- schema.c ---- */

struct capture_upgrade {
    const char *sql; /* from version i + 1 to i + 2 */
};
/* Brings a database to version `count` + 1, one version at a time, each in a transaction. */
int capture_schema_upgrade(sqlite3 *db, const struct capture_upgrade *upgrades, int count, const char *path,
                           struct lumi_error *error);
/* An empty database becomes version LUMI_CAPTURE_VERSION. */
int capture_schema_create(struct lumi_capture *capture, struct lumi_error *error);
/* Whether this is a capture's database of this version with the very schema it should have; *version in any case. */
int capture_schema_check(struct lumi_capture *capture, int *version, struct lumi_error *error);
extern const struct capture_upgrade capture_upgrades[];

/* ---- capture.c ---- */

/* Reads a database that lies in memory (for tests and fuzzing); `name` stands for the path. */
int lumi_capture_open_memory(const void *data, size_t size, const char *name, struct lumi_capture **capture,
                             struct lumi_error *error);
/* Brings a database in memory (of lumi_alloc; it may be moved) up to the last commit of its log. What of the log is not
 * whole is left out. LUMI_ERR_NOMEM, LUMI_ERR_LIMIT. */
int capture_apply_log(uint8_t **data, size_t *size, const uint8_t *log, size_t log_size);
/* LUMI_ERR_ARG unless the capture may be written. */
int capture_need_writable(const struct lumi_capture *capture, struct lumi_error *error);

/* ---- capture_files.c ---- */

bool capture_name_ok(const char *name, size_t size);
/* data/frames/<safe name> */
bool capture_file_ok(const char *file);
int capture_sync_pending(struct lumi_capture *capture, struct lumi_error *error);
/* Forgets what was stored in this batch; removes the files if `remove`. */
void capture_drop_pending(struct lumi_capture *capture, bool remove);
/* What others wrote gets its temporary name back. */
void capture_give_back(struct lumi_capture *capture);
/* Mends what a crash left behind. */
int capture_reconcile(struct lumi_capture *capture, struct lumi_error *error);
/* Creates `name` under the directory with these bytes: temporary file, fsync, rename, fsync of the directory. */
int capture_write_file(struct lumi_capture *capture, const char *name, const void *data, size_t size,
                       struct lumi_error *error);
int capture_sync_path(const char *path, struct lumi_error *error);
int capture_remove_tree(const char *path, struct lumi_error *error);
/* SHA-256 in hexadecimal. */
void capture_digest_hex(struct sha256_ctx *context, char hex[65]);

/* ---- capture_bag.c ---- */

int capture_unseal(struct lumi_capture *capture, struct lumi_error *error);
/* SHA-256 of a file below the directory, in hexadecimal; `progress` is told of each piece, non-zero cancels. */
int capture_hash_file(int dir_fd, const char *name, char hex[65], int (*progress)(void *context, int64_t bytes),
                      void *context, struct lumi_error *error);

#endif
