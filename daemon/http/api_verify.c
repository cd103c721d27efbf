/* Verifying captures in a thread of low priority; what it found is kept in a journal (<folder>/.lumid/verified), a line
 * for each time: name, seal, good or bad, Unix microseconds, words. What was found of another seal says nothing of the
 * capture as it is. */
#include "daemon/handover/handover_journal.h"
#include "daemon/http/api_shelf.h"
#include "proto/capture/capture.h"

#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>

#define TOLD_NS 500000000LL /* from one event of progress to the next */

/* ---- what was found ---- */

int lumi_api_shelf_remember(void *context, const char *name, const struct lumi_api_verified *verified)
{
    struct lumi_api_shelf *shelf = context;

    pthread_mutex_lock(&shelf->lock);
    g_hash_table_replace(shelf->results, g_strdup(name), g_memdup2(verified, sizeof *verified));
    pthread_mutex_unlock(&shelf->lock);
    return LUMI_OK;
}

static int take_line(void *context, const struct journal_line *line, struct lumi_error *error)
{
    struct lumi_api_verified found = {0};

    if (line->count != 5 || strlen(line->fields[1]) > 64)
        return lumi_fail(error, LUMI_ERR_FORMAT, "no line of what was verified");
    g_strlcpy(found.seal, line->fields[1], sizeof found.seal);
    found.good = !strcmp(line->fields[2], "good");
    found.unix_us = g_ascii_strtoll(line->fields[3], NULL, 10);
    g_strlcpy(found.text, line->fields[4], sizeof found.text);
    return lumi_api_shelf_remember(context, line->fields[0], &found);
}

struct journal *lumi_api_verified_open(struct lumi_api_shelf *shelf)
{
    g_autofree char *own = g_build_filename(shelf->http->options.folder, ".lumid", NULL);
    g_autofree char *path = g_build_filename(own, "verified", NULL);
    struct journal *journal = NULL;
    struct lumi_error error;

    mkdir(own, 0755);
    if (journal_open(path, take_line, shelf, &journal, &error) == LUMI_OK)
        return journal;
    g_message("what is verified is kept until lumid ends: %s", error.text);
    return NULL;
}

static void keep(struct lumi_api_shelf *shelf, const char *name, const struct lumi_api_verified *found)
{
    char time[32];
    const char *const fields[] = {name, found->seal[0] ? found->seal : "-", found->good ? "good" : "bad", time,
                                  found->text};
    struct lumi_error error;

    g_snprintf(time, sizeof time, "%" G_GINT64_FORMAT, found->unix_us);
    lumi_api_shelf_remember(shelf, name, found);
    if (shelf->journal && journal_write(shelf->journal, fields, 5, &error) != LUMI_OK)
        g_message("%s: what was found is kept until lumid ends: %s", name, error.text);
}

void lumi_api_put_verified(JsonBuilder *builder, struct lumi_api_shelf *shelf, const char *name, const char *seal)
{
    const struct lumi_api_verified *found;

    json_builder_set_member_name(builder, "verified");
    pthread_mutex_lock(&shelf->lock);
    found = g_hash_table_lookup(shelf->results, name);
    if (found && seal[0] && !strcmp(found->seal, seal)) {
        json_builder_begin_object(builder);
        lumi_api_put_time(builder, "time", found->unix_us);
        lumi_api_put_bool(builder, "good", found->good);
        lumi_api_put_text(builder, "text", found->text);
        json_builder_end_object(builder);
    } else
        json_builder_add_null_value(builder);
    pthread_mutex_unlock(&shelf->lock);
}

/* ---- telling ---- */

struct tale {
    struct lumi_api_letter letter;
    struct lumi_api_shelf *shelf;
    char *name, *data;
};

static void tell(struct lumi_api_letter *letter, bool dropped)
{
    struct tale *tale = (struct tale *)letter;

    if (!dropped)
        lumi_api_events_latest(tale->shelf->http->events, "verify", tale->name, g_steal_pointer(&tale->data));
    g_free(tale->name);
    g_free(tale->data);
    g_free(tale);
}

static char *describe(const char *name, const char *state, int64_t done, int64_t total, const char *text)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "capture", name);
    lumi_api_put_text(builder, "state", state);
    lumi_api_put_int(builder, "done", done);
    lumi_api_put_int(builder, "total", total);
    lumi_api_put_text(builder, "text", text);
    json_builder_end_object(builder);
    return lumi_api_finish(builder);
}

void lumi_api_tell_verify(struct lumi_api_shelf *shelf, const char *name, const char *state, int64_t done,
                          int64_t total, const char *text)
{
    struct tale *tale = g_new0(struct tale, 1);

    *tale = (struct tale){{.read = tell}, shelf, g_strdup(name), describe(name, state, done, total, text)};
    lumi_api_post_give(shelf->http->to_server, &tale->letter);
}

/* ---- verifying ---- */

struct verifying {
    struct lumi_api_shelf *shelf;
    const char *name;
    int64_t told_ns, total;
    char first[400];
};

static void on_problem(void *context, const char *file, const char *text)
{
    struct verifying *v = context;

    const bool payload = g_str_has_prefix(file, "data/"); /* says more than the sums that follow from it */

    if (!v->first[0] || (payload && !g_str_has_prefix(v->first, "data/")))
        g_snprintf(v->first, sizeof v->first, "%s: %s", file, text);
}

static int on_progress(void *context, int64_t done, int64_t total)
{
    struct verifying *v = context;
    const struct lumi_http_options *options = &v->shelf->http->options;
    const int64_t now = options->now_ns(options->context);

    v->total = total;
    if (now - v->told_ns >= TOLD_NS) {
        v->told_ns = now;
        lumi_api_tell_verify(v->shelf, v->name, "running", done, total, "");
    }
    return atomic_load(&v->shelf->ending);
}

int lumi_api_shelf_verify(struct lumi_api_shelf *shelf, const char *name, const char *path,
                          struct lumi_api_verified *found, struct lumi_error *error)
{
    const struct lumi_http_options *options = &shelf->http->options;
    struct verifying v = {.shelf = shelf, .name = name, .told_ns = options->now_ns(options->context)};
    struct lumi_verify_result result;

    setpriority(PRIO_PROCESS, 0, 19); /* of this thread: captures go first */
    memset(found, 0, sizeof *found);
    LUMI_TRY(lumi_capture_verify(path, on_problem, on_progress, &v, &result, error));
    LUMI_TRY(lumi_capture_seal_of(path, found->seal, error));
    found->good = !result.problems;
    found->unix_us = options->unix_us ? options->unix_us(options->context) : options->now_ns(options->context) / 1000;
    if (result.problems)
        g_snprintf(found->text, sizeof found->text, "%d problem%s in %d files: %s", result.problems,
                   result.problems == 1 ? "" : "s", result.files, v.first);
    else
        g_snprintf(found->text, sizeof found->text, "whole, %s: %d files, %" G_GINT64_FORMAT " bytes",
                   result.sealed ? "sealed" : "open", result.files, result.bytes);
    for (char *at = found->text; *at; at++) /* it becomes a field of a line */
        *at = (unsigned char)*at < 32 || *at == 127 ? '?' : *at;
    return LUMI_OK;
}

struct verify_job {
    struct lumi_api_job job;
    struct lumi_api_shelf *shelf;
    SoupServerMessage *message; /* until it is answered */
    bool gone;                  /* who asked has hung up */
    char *name, path[LUMI_SHELF_PATH];
    int code;
    struct lumi_error error;
};

static void work(struct lumi_api_job *job)
{
    struct verify_job *asked = (struct verify_job *)job;
    struct lumi_api_verified found;
    struct lumi_error error;
    struct lumi_api_shelf *shelf = asked->shelf;

    if (lumi_api_shelf_verify(shelf, asked->name, asked->path, &found, &error) == LUMI_OK) {
        keep(shelf, asked->name, &found);
        lumi_api_tell_verify(shelf, asked->name, found.good ? "good" : "bad", 1, 1, found.text);
    } else if (!atomic_load(&shelf->ending))
        lumi_api_tell_verify(shelf, asked->name, "bad", 0, 1, error.text);
}

static void done(struct lumi_api_letter *letter, bool dropped)
{
    struct verify_job *asked = (struct verify_job *)letter;

    if (!dropped)
        lumi_api_shelf_give_back(asked->shelf, asked->name);
    g_free(asked->name);
    g_free(asked);
}

const struct lumi_api_field lumi_api_verify_fields[] = {
    {.name = "capture", .type = LUMI_API_STRING, .required = true, .max = LUMI_API_STRING_MAX},
    {0},
};

static void on_finished(SoupServerMessage *message, void *context)
{
    (void)message;
    ((struct verify_job *)context)->gone = true;
}

/* In the carrier: the server's thread waits for no disk. */
static void look(struct lumi_api_job *job)
{
    struct verify_job *asked = (struct verify_job *)job;

    asked->code = lumi_shelf_find(asked->shelf->http->options.folder, asked->name, asked->path, &asked->error);
}

/* What is given to the worker here until this thread reads its letter. */
static void begin(struct verify_job *asked, struct lumi_api_answer *answer)
{
    char *told;

    asked->job.work = work;
    asked->job.letter.read = done;
    if (asked->code != LUMI_OK)
        lumi_api_problem_of(answer, asked->code, asked->error.text);
    else if (!lumi_api_worker_give(asked->shelf->slow, &asked->job))
        lumi_api_problem(answer, 503, "busy", "too many captures wait to be verified already");
    else {
        told = describe(asked->name, "running", 0, 0, "");
        lumi_api_events_latest(asked->shelf->http->events, "verify", asked->name, g_strdup(told));
        lumi_api_answer(answer, 202, "application/json", told);
        return;
    }
    done(&asked->job.letter, false);
}

static void looked(struct lumi_api_letter *letter, bool dropped)
{
    struct verify_job *asked = (struct verify_job *)letter;
    SoupServerMessage *message = asked->message;
    const bool gone = asked->gone;
    struct lumi_api_answer answer = {0};

    g_signal_handlers_disconnect_by_data(message, asked);
    if (dropped)
        done(letter, true);
    else
        begin(asked, &answer);
    if (!dropped && !gone) {
        lumi_api_send(message, &answer);
        soup_server_message_unpause(message);
    }
    g_free(answer.text);
    g_object_unref(message);
}

void lumi_api_serve_verify(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    struct lumi_api_shelf *shelf = http->shelf;
    const char *name = body->values[0].string;

    if (!http->options.folder) {
        lumi_api_send_problem(message, 404, "notfound", "there are no captures here");
        return;
    }
    if (!lumi_api_shelf_take(shelf, message, name, "verified"))
        return;
    struct verify_job *asked = g_new0(struct verify_job, 1);
    asked->job.work = look;
    asked->job.letter.read = looked;
    asked->shelf = shelf;
    asked->message = g_object_ref(message);
    asked->name = g_strdup(name);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), asked);
    soup_server_message_pause(message);
    if (lumi_api_worker_give(shelf->carrier, &asked->job))
        return;
    asked->code = lumi_fail(&asked->error, LUMI_ERR_BUSY, "too much is done with captures already");
    looked(&asked->job.letter, false);
}
