/* Nothing is said to the board to be stored before its rows are in the database: looked up there, by another
 * connection, at the moment it is said. */
#include "capture_world.h"

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>

struct world_ack {
    sqlite3 *db;
    sqlite3_stmt *waiting;
    uint32_t boot, number;
    bool said;
};

static void close_database(struct world_ack *ack)
{
    sqlite3_finalize(ack->waiting);
    sqlite3_close(ack->db);
    ack->waiting = NULL;
    ack->db = NULL;
}

static bool open_database(struct world *w, struct world_ack *ack)
{
    const struct lumi_engine_status *status = world_status(w);
    char path[1200];

    if (!status->capture[0])
        return false;
    snprintf(path, sizeof path, "%s/data/capture.db", status->capture);
    if (sqlite3_open_v2(path, &ack->db, SQLITE_OPEN_READONLY, NULL) != SQLITE_OK ||
        sqlite3_prepare_v2(ack->db,
                           "SELECT count(*) FROM frames JOIN shots ON shots.id = frames.shot "
                           "WHERE frames.retake_of IS NULL AND frames.state = 'planned' AND shots.plan_shot = ?",
                           -1, &ack->waiting, NULL) != SQLITE_OK) {
        world_wrong(w, "%s: %s", path, sqlite3_errmsg(ack->db));
        close_database(ack);
        return false;
    }
    return true;
}

void world_ack_check(struct world *w, const lumi_wire_Event *event)
{
    struct world_ack *ack = w->ack ? w->ack : (w->ack = calloc(1, sizeof *ack));
    bool again = ack->said && ack->boot == event->boot && (int32_t)(event->number - ack->number) <= 0;

    ack->said = true;
    ack->boot = event->boot;
    ack->number = event->number;
    if (again || event->which_kind != lumi_wire_Event_shot_tag || event->kind.shot.lost || w->killed_inside ||
        !open_database(w, ack))
        return;
    sqlite3_bind_int64(ack->waiting, 1, event->kind.shot.number);
    if (sqlite3_step(ack->waiting) == SQLITE_ROW && sqlite3_column_int(ack->waiting, 0) > 0)
        world_wrong(w, "the board was told that shot %u is stored while %d of its frames are not even triggered",
                    (unsigned)event->kind.shot.number, sqlite3_column_int(ack->waiting, 0));
    close_database(ack); /* it would be in the way of sealing */
}

void world_ack_close(struct world *w)
{
    free(w->ack);
    w->ack = NULL;
}
