/* A capture's life: made, opened, published, closed. */
#include "proto/capture/capture.h"

#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static char *copy_path(const char *path, const char *suffix)
{
    size_t length = strlen(path), extra = strlen(suffix);

    while (length > 1 && path[length - 1] == '/')
        length--;
    char *copy = lumi_alloc(length + extra + 1, 1);
    if (copy) {
        memcpy(copy, path, length);
        memcpy(copy + length, suffix, extra + 1);
    }
    return copy;
}

char *lumi_capture_join(const struct lumi_capture *capture, const char *relative)
{
    size_t size = strlen(capture->path) + strlen(relative) + 2;
    char *joined = lumi_alloc(size, 1);

    if (joined)
        snprintf(joined, size, "%s/%s", capture->path, relative);
    return joined;
}

bool lumi_capture_sealed(const struct lumi_capture *capture)
{
    return capture->sealed;
}

const char *lumi_capture_path(const struct lumi_capture *capture)
{
    return capture->path;
}

int capture_need_writable(const struct lumi_capture *capture, struct lumi_error *error)
{
    if (!capture->writable)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: %s", capture->path,
                         capture->sealed ? "the capture is sealed" : "the capture is not open for writing");
    return LUMI_OK;
}

static int allocate(const char *path, const char *suffix, struct lumi_capture **capture, struct lumi_error *error)
{
    struct lumi_capture *made = lumi_calloc(1, sizeof *made);

    *capture = NULL;
    if (made) {
        made->dir_fd = made->frames_fd = -1;
        made->path = copy_path(path, suffix);
    }
    if (!made || !made->path) {
        lumi_free(made);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    }
    *capture = made;
    return LUMI_OK;
}

static void release(struct lumi_capture *capture)
{
    capture_drop_pending(capture, false);
    capture_db_close(capture);
    if (capture->frames_fd >= 0)
        close(capture->frames_fd);
    if (capture->dir_fd >= 0)
        close(capture->dir_fd);
    lumi_free(capture->copy);
    lumi_free(capture->path);
    lumi_free(capture->final_path);
    lumi_free(capture);
}

/* The directory itself carries the writer's lock: no extra file, and it goes with the process that holds it. */
static int open_directory(struct lumi_capture *capture, bool lock, struct lumi_error *error)
{
    capture->dir_fd = open(capture->path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (capture->dir_fd < 0)
        return lumi_fail_errno(error, capture->path, "open capture");
    if (lock && flock(capture->dir_fd, LOCK_EX | LOCK_NB) < 0) {
        if (errno == EWOULDBLOCK)
            return lumi_fail(error, LUMI_ERR_BUSY, "%s: another program is writing this capture", capture->path);
        return lumi_fail_errno(error, capture->path, "lock");
    }
    return LUMI_OK;
}

/* What holds for every connection: nothing in the file is trusted. */
static int harden(struct lumi_capture *capture, struct lumi_error *error)
{
    sqlite3 *db = capture->db;

    sqlite3_extended_result_codes(db, 1);
    sqlite3_busy_timeout(db, 2000);
    sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
    sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, NULL);
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_VIEW, 0, NULL);
    sqlite3_limit(db, SQLITE_LIMIT_LENGTH, 64 << 20);
    sqlite3_limit(db, SQLITE_LIMIT_ATTACHED, 0);
    LUMI_TRY(capture_db_run(capture, error, "PRAGMA cell_size_check = ON", ""));
    LUMI_TRY(capture_db_run(capture, error, "PRAGMA foreign_keys = ON", ""));
    return LUMI_OK;
}

static int open_database(struct lumi_capture *capture, int flags, struct lumi_error *error)
{
    char *path = lumi_capture_join(capture, CAPTURE_DB);
    struct stat status;
    int code = LUMI_OK;

    if (!path)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
    if (!(flags & SQLITE_OPEN_CREATE) && stat(path, &status) < 0) {
        code = errno == ENOENT || errno == ENOTDIR
                   ? lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no capture (" CAPTURE_DB " is missing)", capture->path)
                   : lumi_fail_errno(error, path, "open");
    } else if (sqlite3_open_v2(path, &capture->db, flags | SQLITE_OPEN_NOMUTEX, NULL) != SQLITE_OK) {
        code = capture->db ? capture_db_fail(capture, "open", error)
                           : lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    } else {
        capture->db_bytes = flags & SQLITE_OPEN_CREATE ? 0 : (int64_t)status.st_size;
        if (fstatat(capture->dir_fd, CAPTURE_DB "-wal", &status, 0) == 0)
            capture->db_bytes += (int64_t)status.st_size;
        code = harden(capture, error);
    }
    lumi_free(path);
    return code;
}

/* The log that is kept beside the file while the capture is open makes a commit one append and one sync. */
static int journal(struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(capture_db_run(capture, error, "PRAGMA journal_mode = WAL", ""));
    /* A capture that is not published yet is removed after a crash: nothing in it needs to survive one. */
    return capture_db_run(capture, error,
                          capture->final_path ? "PRAGMA synchronous = OFF" : "PRAGMA synchronous = FULL", "");
}

static int open_frames(struct lumi_capture *capture, struct lumi_error *error)
{
    capture->frames_fd = openat(capture->dir_fd, CAPTURE_FRAMES, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (capture->frames_fd < 0)
        return lumi_fail_errno(error, capture->path, "open " CAPTURE_FRAMES);
    return LUMI_OK;
}

/* Makes capture->path with all that belongs in a new one. */
static int populate(struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(open_directory(capture, true, error));
    if (mkdirat(capture->dir_fd, "data", 0777) < 0 || mkdirat(capture->dir_fd, CAPTURE_FRAMES, 0777) < 0)
        return lumi_fail_errno(error, capture->path, "create " CAPTURE_FRAMES);
    LUMI_TRY(open_frames(capture, error));
    LUMI_TRY(open_database(capture, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, error));
    LUMI_TRY(journal(capture, error));
    LUMI_TRY(capture_schema_create(capture, error));
    capture->writable = true;
    return LUMI_OK;
}

static int sync_parent(const char *path, struct lumi_error *error)
{
    char *copy = copy_path(path, "");

    if (!copy)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    int code = capture_sync_path(dirname(copy), error);
    lumi_free(copy);
    return code;
}

/* The new capture's folder. What is named for output is no input that is missing. */
static int make_folder(const struct lumi_capture *capture, const char *path, struct lumi_error *error)
{
    if (mkdir(capture->path, 0777) == 0)
        return LUMI_OK;
    if (errno == EEXIST)
        return lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", capture->path);
    if (errno == ENOENT || errno == ENOTDIR)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: there is no folder to make it in", path);
    return lumi_fail_errno(error, capture->path, "create");
}

int lumi_capture_create_live(const char *path, struct lumi_capture **capture, struct lumi_error *error)
{
    struct lumi_capture *made;
    char *data = NULL;
    int code;

    LUMI_TRY(allocate(path, "", &made, error));
    *capture = NULL;
    code = make_folder(made, path, error);
    if (code != LUMI_OK) {
        release(made);
        return code;
    }
    LUMI_GOTO(code, fail, populate(made, error));
    data = lumi_capture_join(made, "data");
    if (!data) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
        goto fail;
    }
    LUMI_GOTO(code, fail, capture_sync_path(data, error));
    LUMI_GOTO(code, fail, capture_sync_path(made->path, error));
    LUMI_GOTO(code, fail, sync_parent(made->path, error));
    lumi_free(data);
    *capture = made;
    return LUMI_OK;

fail:
    lumi_free(data);
    capture_db_close(made);
    capture_remove_tree(made->path, NULL);
    release(made);
    return code;
}

/* A .partial that nobody holds was left by a program that died. */
static int clear_partial(struct lumi_capture *capture, struct lumi_error *error)
{
    struct stat status;

    if (lstat(capture->path, &status) < 0)
        return LUMI_OK;
    LUMI_TRY(open_directory(capture, true, error));
    LUMI_TRY(capture_remove_tree(capture->path, error));
    close(capture->dir_fd);
    capture->dir_fd = -1;
    return LUMI_OK;
}

int lumi_capture_create(const char *path, struct lumi_capture **capture, struct lumi_error *error)
{
    struct lumi_capture *made;
    struct stat status;
    int code;

    LUMI_TRY(allocate(path, ".partial", &made, error));
    *capture = NULL;
    made->final_path = copy_path(path, "");
    if (!made->final_path) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
        goto fail;
    }
    if (lstat(made->final_path, &status) == 0) {
        code = lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", made->final_path);
        goto fail;
    }
    LUMI_GOTO(code, fail, clear_partial(made, error));
    LUMI_GOTO(code, fail, make_folder(made, path, error));
    code = populate(made, error);
    if (code != LUMI_OK) {
        lumi_capture_close(made);
        return code;
    }
    *capture = made;
    return LUMI_OK;

fail:
    release(made);
    return code;
}

/* An older version is read through an upgraded copy in memory: reading changes no file. */
static int upgrade_copy(struct lumi_capture *capture, struct lumi_error *error)
{
    sqlite3 *copy = NULL;
    int code = LUMI_OK;

    if (sqlite3_open(":memory:", &copy) != SQLITE_OK) {
        sqlite3_close(copy);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
    }
    sqlite3_backup *backup = sqlite3_backup_init(copy, "main", capture->db, "main");
    if (!backup || sqlite3_backup_step(backup, -1) != SQLITE_DONE)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: copy for upgrade: %s", capture->path, sqlite3_errmsg(copy));
    sqlite3_backup_finish(backup);
    if (code != LUMI_OK) {
        sqlite3_close(copy);
        return code;
    }
    capture_db_close(capture);
    capture->db = copy;
    return harden(capture, error);
}

static int check_version(struct lumi_capture *capture, enum lumi_capture_mode mode, struct lumi_error *error)
{
    int version;

    LUMI_TRY(capture_schema_check(capture, &version, error));
    if (version == LUMI_CAPTURE_VERSION)
        return LUMI_OK;
    if (mode == LUMI_CAPTURE_READ)
        LUMI_TRY(upgrade_copy(capture, error));
    LUMI_TRY(capture_schema_upgrade(capture->db, capture_upgrades, LUMI_CAPTURE_VERSION - 1, capture->path, error));
    return capture_schema_check(capture, &version, error);
}

static int open_for_writing(struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(open_directory(capture, true, error));
    LUMI_TRY(open_database(capture, SQLITE_OPEN_READWRITE, error));
    LUMI_TRY(check_version(capture, LUMI_CAPTURE_READ, error)); /* nothing is unsealed for what cannot be opened */
    capture_db_close(capture);
    LUMI_TRY(open_frames(capture, error));
    LUMI_TRY(capture_unseal(capture, error));
    LUMI_TRY(open_database(capture, SQLITE_OPEN_READWRITE, error));
    LUMI_TRY(journal(capture, error));
    LUMI_TRY(check_version(capture, LUMI_CAPTURE_WRITE, error));
    LUMI_TRY(capture_reconcile(capture, error));
    capture->writable = true;
    return LUMI_OK;
}

static int open_for_reading(struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(open_directory(capture, false, error));
    capture->sealed = faccessat(capture->dir_fd, CAPTURE_SEAL, F_OK, 0) == 0;
    LUMI_TRY(open_database(capture, SQLITE_OPEN_READONLY, error));
    return check_version(capture, LUMI_CAPTURE_READ, error);
}

int lumi_capture_open(const char *path, enum lumi_capture_mode mode, struct lumi_capture **capture,
                      struct lumi_error *error)
{
    struct lumi_capture *made;

    LUMI_TRY(allocate(path, "", &made, error));
    *capture = NULL;
    int code = mode == LUMI_CAPTURE_WRITE ? open_for_writing(made, error) : open_for_reading(made, error);
    if (code != LUMI_OK)
        release(made);
    else
        *capture = made;
    return code;
}

int lumi_capture_open_memory(const void *data, size_t size, const char *name, struct lumi_capture **capture,
                             struct lumi_error *error)
{
    struct lumi_capture *made;
    int code;

    LUMI_TRY(allocate(name, "", &made, error));
    *capture = NULL;
    made->db_bytes = (int64_t)size;
    if (sqlite3_open_v2(":memory:", &made->db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, NULL) != SQLITE_OK ||
        sqlite3_deserialize(made->db, "main", (unsigned char *)data, (sqlite3_int64)size, (sqlite3_int64)size,
                            SQLITE_DESERIALIZE_READONLY) != SQLITE_OK) {
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: cannot be read from memory", name);
        goto fail;
    }
    LUMI_GOTO(code, fail, harden(made, error));
    LUMI_GOTO(code, fail, check_version(made, LUMI_CAPTURE_READ, error));
    *capture = made;
    return LUMI_OK;
fail:
    release(made);
    return code;
}

int lumi_capture_begin(struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(capture_need_writable(capture, error));
    if (capture->in_batch)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: a batch has begun already", capture->path);
    LUMI_TRY(capture_db_run(capture, error, "BEGIN IMMEDIATE", ""));
    capture->in_batch = true;
    return LUMI_OK;
}

int lumi_capture_commit(struct lumi_capture *capture, struct lumi_error *error)
{
    if (!capture->in_batch)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no batch has begun", capture->path);
    if (!capture->final_path)
        LUMI_TRY(capture_sync_pending(capture, error));
    LUMI_TRY(capture_db_run(capture, error, "COMMIT", ""));
    capture->in_batch = false;
    if (!capture->final_path)
        capture_drop_pending(capture, false);
    return LUMI_OK;
}

void lumi_capture_rollback(struct lumi_capture *capture, bool again)
{
    if (!capture->in_batch)
        return;
    sqlite3_exec(capture->db, "ROLLBACK", NULL, NULL, NULL);
    if (again)
        capture_give_back(capture);
    capture_drop_pending(capture, true);
    capture->in_batch = false;
}

/* Undoing rows alone would leave a file without one: files of a step that fails are undone by who stored them. */
int lumi_capture_guard(struct lumi_capture *capture, struct lumi_error *error)
{
    return capture_db_run(capture, error, "SAVEPOINT guard", "");
}

int lumi_capture_guarded(struct lumi_capture *capture, int code, struct lumi_error *error)
{
    if (code == LUMI_OK)
        return capture_db_run(capture, error, "RELEASE guard", "");
    sqlite3_exec(capture->db, "ROLLBACK TO guard", NULL, NULL, NULL);
    sqlite3_exec(capture->db, "RELEASE guard", NULL, NULL, NULL);
    return code;
}

bool lumi_capture_in_batch(const struct lumi_capture *capture)
{
    return capture->in_batch && !sqlite3_get_autocommit(capture->db);
}

int lumi_capture_publish(struct lumi_capture *capture, const char *date, struct lumi_error *error)
{
    if (!capture->final_path)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: is published already", capture->path);
    LUMI_TRY(capture_need_writable(capture, error));
    LUMI_TRY(capture_sync_pending(capture, error));
    LUMI_TRY(lumi_capture_seal(capture, date, error));
    char *data = lumi_capture_join(capture, "data");
    if (!data)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", capture->path);
    int code = capture_sync_path(data, error);
    lumi_free(data);
    LUMI_TRY(code);
    if (rename(capture->path, capture->final_path) < 0)
        return errno == EEXIST || errno == ENOTEMPTY || errno == ENOTDIR
                   ? lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", capture->final_path)
                   : lumi_fail_errno(error, capture->final_path, "rename");
    lumi_free(capture->path);
    capture->path = capture->final_path;
    capture->final_path = NULL;
    return sync_parent(capture->path, error);
}

void lumi_capture_close(struct lumi_capture *capture)
{
    if (!capture)
        return;
    lumi_capture_rollback(capture, false);
    if (capture->final_path) {
        capture_db_close(capture);
        capture_remove_tree(capture->path, NULL);
    }
    release(capture);
}

void lumi_capture_discard(struct lumi_capture *capture)
{
    lumi_capture_rollback(capture, false);
    capture_db_close(capture);
    capture_remove_tree(capture->path, NULL);
    release(capture);
}
