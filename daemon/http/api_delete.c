/* Throwing a capture away: who does must have typed its name, or know the seal that a verified copy of it has
 * elsewhere, or have a second copy on the other disk, which is verified first. */
#include "daemon/http/api_shelf.h"
#include "proto/capture/capture.h"

#include <string.h>
#include <unistd.h>

enum { DELETE_CAPTURE, DELETE_SEAL, DELETE_WORD, DELETE_COPY };
const struct lumi_api_field lumi_api_delete_fields[] = {
    {.name = "capture", .type = LUMI_API_STRING, .required = true, .max = LUMI_API_STRING_MAX},
    {.name = "seal", .type = LUMI_API_STRING, .max = 64},
    {.name = "word", .type = LUMI_API_STRING, .max = LUMI_API_STRING_MAX},
    {.name = "copy", .type = LUMI_API_BOOL},
    {0},
};

/* ---- what is left, at leisure ---- */

static bool is_ending(void *context)
{
    return atomic_load(&((struct lumi_api_shelf *)context)->ending);
}

struct tidy_job {
    struct lumi_api_job job;
    struct lumi_api_shelf *shelf;
};

static void tidy(struct lumi_api_job *job)
{
    struct lumi_api_shelf *shelf = ((struct tidy_job *)job)->shelf;
    struct lumi_error error;

    if (lumi_shelf_empty(shelf->http->options.folder, is_ending, shelf, &error) != LUMI_OK && !is_ending(shelf))
        g_message("what was deleted is not removed yet: %s", error.text);
}

static void tidied(struct lumi_api_letter *letter, bool dropped)
{
    (void)dropped;
    g_free(letter);
}

void lumi_api_shelf_tidy(struct lumi_api_shelf *shelf)
{
    struct tidy_job *asked = g_new0(struct tidy_job, 1);

    asked->job.work = tidy;
    asked->job.letter.read = tidied;
    asked->shelf = shelf;
    if (!lumi_api_worker_give(shelf->slow, &asked->job)) /* the next one, or the next start, removes it */
        g_free(asked);
}

/* ---- taking it away ---- */

struct delete_job {
    struct lumi_api_job job;
    struct lumi_api_shelf *shelf;
    SoupServerMessage *message;
    bool gone; /* who asked has hung up */
    char *name, *seal;
    const char *copy; /* folder of the second copies: look there */
    int code;
    struct lumi_error error;
};

static int same_seal(const char *given, const char *path, struct lumi_error *error)
{
    char seal[65];

    LUMI_TRY(lumi_capture_seal_of(path, seal, error));
    if (!seal[0])
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "%s is not sealed: no copy elsewhere can be told to be the same",
                         path);
    if (g_ascii_strcasecmp(seal, given))
        return lumi_fail(
            error, LUMI_ERR_CHECKSUM,
            "this is not the seal of the capture as it is here: what was verified elsewhere is another one");
    return LUMI_OK;
}

static int look_at_copy(struct delete_job *asked, const char *path, struct lumi_error *error)
{
    char copy[LUMI_SHELF_PATH], seal[65];
    struct lumi_api_verified found;

    LUMI_TRY(lumi_shelf_find(asked->copy, asked->name, copy, error));
    LUMI_TRY(lumi_capture_seal_of(copy, seal, error));
    LUMI_TRY(same_seal(seal, path, error));
    LUMI_TRY(lumi_api_shelf_verify(asked->shelf, asked->name, copy, &found, error));
    return found.good ? LUMI_OK : lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %.300s", copy, found.text);
}

static void work(struct lumi_api_job *job)
{
    struct delete_job *asked = (struct delete_job *)job;
    const char *folder = asked->shelf->http->options.folder;
    char path[LUMI_SHELF_PATH];

    asked->code = lumi_shelf_find(folder, asked->name, path, &asked->error);
    if (asked->code == LUMI_OK && asked->seal)
        asked->code = same_seal(asked->seal, path, &asked->error);
    if (asked->code == LUMI_OK && asked->copy)
        asked->code = look_at_copy(asked, path, &asked->error);
    if (asked->code == LUMI_OK)
        asked->code = lumi_shelf_take_away(folder, asked->name, &asked->error);
    if (asked->code == LUMI_OK) {
        g_autofree char *picture = g_strdup_printf("%s/.lumid/thumbnails/%s.jpg", folder, asked->name);
        unlink(picture);
    }
}

static char *describe(const char *name)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "capture", name);
    json_builder_end_object(builder);
    return lumi_api_finish(builder);
}

static void answer(struct delete_job *asked)
{
    struct lumi_api_answer answer = {0};

    if (asked->code == LUMI_OK)
        lumi_api_answer(&answer, 202, "application/json", describe(asked->name));
    else
        lumi_api_problem_of(&answer, asked->code, asked->error.text);
    lumi_api_send(asked->message, &answer);
    soup_server_message_unpause(asked->message);
}

static void done(struct lumi_api_letter *letter, bool dropped)
{
    struct delete_job *asked = (struct delete_job *)letter;

    g_signal_handlers_disconnect_by_data(asked->message, asked);
    if (!dropped) {
        lumi_api_shelf_give_back(asked->shelf, asked->name);
        if (asked->copy && asked->code != LUMI_OK)
            lumi_api_tell_verify(asked->shelf, asked->name, "bad", 0, 1, asked->error.text);
        if (asked->code == LUMI_OK) {
            lumi_api_events_latest(asked->shelf->http->events, "deleted", asked->name, describe(asked->name));
            lumi_api_shelf_tidy(asked->shelf);
        }
        if (!asked->gone)
            answer(asked);
    }
    g_object_unref(asked->message);
    g_free(asked->name);
    g_free(asked->seal);
    g_free(asked);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    (void)message;
    ((struct delete_job *)context)->gone = true;
}

static const char *refusal(const struct lumi_http *http, const struct lumi_api_body *body)
{
    const struct lumi_api_value *values = body->values;

    if (values[DELETE_WORD].string && strcmp(values[DELETE_WORD].string, values[DELETE_CAPTURE].string))
        return "the word is not the name of the capture";
    if (values[DELETE_COPY].boolean && !http->options.second_copy)
        return "no second copy is configured ([capture] second_copy)";
    if (!values[DELETE_WORD].string && !values[DELETE_SEAL].string && !values[DELETE_COPY].boolean)
        return "to delete it give 'seal', which lumi verify prints of a copy elsewhere, or 'word', the capture's name";
    return NULL;
}

void lumi_api_serve_delete(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const struct lumi_api_value *values = body->values;
    struct lumi_api_shelf *shelf = http->shelf;
    const char *refused = refusal(http, body), *name = values[DELETE_CAPTURE].string;

    if (!http->options.folder) {
        lumi_api_send_problem(message, 404, "notfound", "there are no captures here");
        return;
    }
    if (refused) {
        lumi_api_send_problem(message, 422, "format", refused);
        return;
    }
    if (!lumi_api_shelf_take(shelf, message, name, "deleted"))
        return;
    struct delete_job *asked = g_new0(struct delete_job, 1);
    asked->job.work = work;
    asked->job.letter.read = done;
    asked->shelf = shelf;
    asked->message = g_object_ref(message);
    asked->name = g_strdup(name);
    asked->seal = g_strdup(values[DELETE_SEAL].string);
    asked->copy = values[DELETE_COPY].boolean ? http->options.second_copy : NULL;
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), asked);
    soup_server_message_pause(message);
    if (lumi_api_worker_give(asked->copy ? shelf->slow : shelf->carrier, &asked->job))
        return;
    asked->code = lumi_fail(&asked->error, LUMI_ERR_BUSY, "too much is done with captures already");
    asked->copy = NULL;
    done(&asked->job.letter, false);
}
