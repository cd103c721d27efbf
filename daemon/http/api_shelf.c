/* Captures on the shelf: life, who is at one. */
#include "daemon/http/api_shelf.h"
#include "daemon/handover/handover_journal.h"

#include <string.h>
#include <sys/stat.h>

int lumi_api_shelf_create(struct lumi_http *http, struct lumi_api_shelf **shelf, struct lumi_error *error)
{
    struct lumi_api_shelf *made = g_new0(struct lumi_api_shelf, 1);
    int code = LUMI_OK;

    *shelf = made;
    made->http = http;
    pthread_mutex_init(&made->lock, NULL);
    made->results = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, g_free);
    made->busy = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);
    made->downloads = g_ptr_array_new();
    if (!http->options.folder)
        return LUMI_OK;
    LUMI_TRY(lumi_api_worker_create(http->to_server, &made->slow, error));
    LUMI_TRY(lumi_api_worker_create(http->to_server, &made->carrier, error));
    made->journal = lumi_api_verified_open(made);
    lumi_api_shelf_tidy(made);
    return code;
}

void lumi_api_shelf_close(struct lumi_api_shelf *shelf)
{
    if (!shelf)
        return;
    atomic_store(&shelf->ending, true);
    lumi_api_worker_destroy(shelf->slow);
    lumi_api_worker_destroy(shelf->carrier);
    shelf->slow = shelf->carrier = NULL;
}

void lumi_api_shelf_destroy(struct lumi_api_shelf *shelf)
{
    if (!shelf)
        return;
    lumi_api_bundles_end(shelf);
    journal_close(shelf->journal);
    g_hash_table_unref(shelf->results);
    g_hash_table_unref(shelf->busy);
    g_ptr_array_unref(shelf->downloads);
    pthread_mutex_destroy(&shelf->lock);
    g_free(shelf);
}

/* ---- who is at one ---- */

bool lumi_api_shelf_take(struct lumi_api_shelf *shelf, SoupServerMessage *message, const char *name, const char *what)
{
    const char *already = g_hash_table_lookup(shelf->busy, name);

    if (already) {
        g_autofree char *text = g_strdup_printf("%s is being %s: wait until that is done", name, already);
        lumi_api_send_problem(message, 409, "busy", text);
        return false;
    }
    g_hash_table_insert(shelf->busy, g_strdup(name), (char *)what);
    return true;
}

void lumi_api_shelf_give_back(struct lumi_api_shelf *shelf, const char *name)
{
    g_hash_table_remove(shelf->busy, name);
}

/* ---- what is asked of the engine first ---- */

static bool is_called(const char *path, const char *name)
{
    const char *slash = strrchr(path, '/');

    return !strcmp(slash ? slash + 1 : path, name);
}

static bool under_way(struct lumi_http *http, const char *name, char **text)
{
    const struct lumi_engine_status *status = http->status;

    lumi_engine_status(http->options.engine, http->status);
    if (!is_called(status->capture, name) || status->state == LUMI_ENGINE_IDLE || status->state == LUMI_ENGINE_RED ||
        status->state == LUMI_ENGINE_DONE || status->state == LUMI_ENGINE_FAILED)
        return false;
    *text = g_strdup_printf("%s is under way (%s)", name, lumi_engine_state_name(status->state));
    return true;
}

#define LIST_MAX 256

static bool processed(struct lumi_http *http, const char *name, char **text)
{
    g_autofree struct lumi_process_status *list = g_new0(struct lumi_process_status, LIST_MAX);
    const int count = http->options.handover ? lumi_handover_list(http->options.handover, list, LIST_MAX) : 0;

    for (int i = 0; i < count && i < LIST_MAX; i++)
        if (is_called(list[i].capture, name) &&
            (list[i].state == LUMI_PROCESS_RUNNING || list[i].state == LUMI_PROCESS_WAITING)) {
            *text = g_strdup_printf("%s is being processed, or waits for it", name);
            return true;
        }
    return false;
}

static bool taken_in(struct lumi_http *http, const char *name, char **text)
{
    g_autofree struct lumi_ingest_status *list = g_new0(struct lumi_ingest_status, LIST_MAX);
    const int count = http->options.ingest ? lumi_ingest_list(http->options.ingest, list, LIST_MAX) : 0;

    for (int i = 0; i < count && i < LIST_MAX; i++)
        if (is_called(list[i].capture, name) &&
            (list[i].state == LUMI_INGEST_COPYING || list[i].state == LUMI_INGEST_VERIFYING)) {
            *text = g_strdup_printf("%s is being taken in", name);
            return true;
        }
    return false;
}

void lumi_api_see_verify(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autofree char *text = NULL;

    if (under_way(http, body->values[0].string, &text))
        lumi_api_problem(answer, 409, "busy", text);
}

void lumi_api_see_delete(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    const char *name = body->values[0].string;
    g_autofree char *text = NULL;

    if (under_way(http, name, &text) || processed(http, name, &text) || taken_in(http, name, &text))
        lumi_api_problem(answer, 409, "busy", text);
}
