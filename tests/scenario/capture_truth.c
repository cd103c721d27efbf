/* The capture in the end, against what the world knows. */
#include "capture_operator.h"

#include <glib.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct row {
    int64_t id, retake_of;
    char name[LUMI_CAPTURE_NAME], state[16], file[LUMI_CAPTURE_PATH], reason[512];
    int camera, shot; /* of the rig; of the plan, that of the first of its chain */
    bool replaced;
};

static void problem(void *context, const char *file, const char *text)
{
    world_wrong(context, "verify: %s: %s", file, text);
}

static int camera_of(const struct world *w, const char *name)
{
    for (int i = 0; i < w->rig.camera_count; i++)
        if (name && !strcmp(w->rig.cameras[i].name, name))
            return i;
    return -1;
}

static void copy(char *to, size_t size, const unsigned char *from)
{
    snprintf(to, size, "%s", from ? (const char *)from : "");
}

static GArray *read_rows(struct world *w, const char *path)
{
    g_autofree char *file = g_strdup_printf("%s/data/capture.db", path);
    GArray *rows = g_array_new(FALSE, TRUE, sizeof(struct row));
    sqlite3_stmt *q = NULL;
    sqlite3 *db = NULL;

    if (sqlite3_open_v2(file, &db, SQLITE_OPEN_READONLY, NULL) != SQLITE_OK ||
        sqlite3_prepare_v2(
            db,
            "SELECT f.id, f.retake_of, f.name, f.state, f.file, f.reason, c.name, s.plan_shot "
            "FROM frames f JOIN shots s ON s.id = f.shot JOIN cameras c ON c.id = f.camera ORDER BY f.id",
            -1, &q, NULL) != SQLITE_OK)
        world_wrong(w, "%s: %s", file, sqlite3_errmsg(db));
    while (q && sqlite3_step(q) == SQLITE_ROW) {
        struct row row = {.id = sqlite3_column_int64(q, 0), .retake_of = sqlite3_column_int64(q, 1)};
        copy(row.name, sizeof row.name, sqlite3_column_text(q, 2));
        copy(row.state, sizeof row.state, sqlite3_column_text(q, 3));
        copy(row.file, sizeof row.file, sqlite3_column_text(q, 4));
        copy(row.reason, sizeof row.reason, sqlite3_column_text(q, 5));
        row.camera = camera_of(w, (const char *)sqlite3_column_text(q, 6));
        row.shot = sqlite3_column_int(q, 7);
        for (guint i = 0; row.retake_of && i < rows->len; i++) {
            struct row *old = &g_array_index(rows, struct row, i);
            if (old->id == row.retake_of) {
                old->replaced = true;
                row.shot = old->shot;
            }
        }
        g_array_append_val(rows, row);
    }
    sqlite3_finalize(q);
    sqlite3_close(db);
    return rows;
}

/* The file is of this camera and this shot, and no other row has the same exposure. */
static bool judge_file(struct world *w, const char *path, const struct row *row, GHashTable *seen,
                       struct world_truth *truth)
{
    g_autofree char *file = g_build_filename(path, row->file, NULL), *data = NULL;
    gsize size;

    if (!g_file_get_contents(file, &data, &size, NULL))
        return world_wrong(w, "%s (%s) has no file %s", row->name, row->state, file);
    if (!world_truth_find(data, size, truth))
        return world_wrong(w, "%s: %s holds no frame of ours", row->name, row->file);
    if (truth->camera != row->camera || truth->shot != row->shot)
        return world_wrong(w, "%s should be camera %d, shot %d, and holds camera %d, shot %d (exposure %d%s)",
                           row->name, row->camera, row->shot, truth->camera, truth->shot, truth->record,
                           truth->flaws & WORLD_SPURIOUS ? ", spurious" : "");
    if (!g_hash_table_add(seen, GINT_TO_POINTER(truth->record)))
        return world_wrong(w, "%s: exposure %d is stored twice", row->name, truth->record);
    return true;
}

static bool judge_row(struct world *w, const char *path, const struct row *row, bool complete, GHashTable *seen,
                      struct capture_account *a)
{
    struct world_truth truth = {0};
    bool accepted = !strcmp(row->state, "accepted"), received = !strcmp(row->state, "received");

    a->rows++;
    a->retaken += row->replaced;
    if (row->file[0] && !judge_file(w, path, row, seen, &truth))
        return false;
    a->stored += row->file[0] != 0;
    if (row->replaced) {
        if (strcmp(row->state, "retaken") != 0)
            return world_wrong(w, "%s is replaced, and %s", row->name, row->state);
        return true;
    }
    a->accepted += accepted || received;
    if (accepted && truth.flaws) {
        a->flawed++;
        return world_wrong(w, "%s was accepted with flaws %u", row->name, truth.flaws);
    }
    if (accepted || (received && !w->config.judging))
        return true;
    a->rejected += !strcmp(row->state, "rejected") && row->file[0];
    a->missing += !row->file[0];
    if (complete)
        return world_wrong(w, "the capture is called complete, and %s is %s (%s)", row->name, row->state, row->reason);
    if (!row->reason[0])
        return world_wrong(w, "%s is %s, and no reason is given", row->name, row->state);
    return true;
}

/* Each camera of each shot has one row that is not replaced. */
static bool judge_plan(struct world *w, const GArray *rows)
{
    uint32_t cameras = lumi_plan_cameras(&w->plan, &w->rig);
    int shots = lumi_plan_shots(&w->plan);
    g_autofree uint8_t *count = g_new0(uint8_t, (gsize)shots * LUMI_RIG_CAMERAS);

    for (guint i = 0; i < rows->len; i++) {
        const struct row *row = &g_array_index(rows, struct row, i);
        if (row->camera < 0 || row->shot < 0 || row->shot >= shots)
            return world_wrong(w, "%s is of no planned frame", row->name);
        count[row->shot * LUMI_RIG_CAMERAS + row->camera] += !row->replaced;
    }
    for (int i = 0; i < shots * LUMI_RIG_CAMERAS; i++)
        if (count[i] != (cameras >> i % LUMI_RIG_CAMERAS & 1))
            return world_wrong(w, "shot %d of camera %d has %d rows", i / LUMI_RIG_CAMERAS, i % LUMI_RIG_CAMERAS,
                               count[i]);
    return true;
}

bool capture_truth_judge(struct world *w, const char *path, bool complete, struct capture_account *account)
{
    g_autoptr(GHashTable) seen = g_hash_table_new(NULL, NULL);
    struct lumi_verify_result result = {0};
    struct lumi_error error = {0};

    memset(account, 0, sizeof *account);
    if (lumi_capture_verify(path, problem, NULL, w, &result, &error) != LUMI_OK)
        return world_wrong(w, "%s: %s", path, error.text);
    if (result.problems || !result.sealed)
        return world_wrong(w, "%s: %d problems, %ssealed", path, result.problems, result.sealed ? "" : "not ");
    g_autoptr(GArray) rows = read_rows(w, path);
    bool good = judge_plan(w, rows);
    for (guint i = 0; good && i < rows->len; i++)
        good = judge_row(w, path, &g_array_index(rows, struct row, i), complete, seen, account);
    return good && !w->why[0];
}
