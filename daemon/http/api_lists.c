/* Answers that have to be looked for on disks and buses: in the worker, so that the server goes on. */
#include "daemon/http/api_lookup.h"
#include "daemon/http/api_report.h"
#include "proto/base/memory.h"

#include <string.h>

#define CAMERAS_MAX 64
#define BOARDS_MAX 8

static void work(struct lumi_api_job *job)
{
    struct lumi_api_lookup *lookup = (struct lumi_api_lookup *)job;

    lookup->look(lookup);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    (void)message;
    ((struct lumi_api_lookup *)context)->gone = true;
}

static void send_bytes(struct lumi_api_lookup *lookup)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(lookup->message);

    soup_message_headers_replace(headers, "Content-Type", lookup->type);
    soup_message_headers_replace(headers, "Cache-Control", "no-cache");
    soup_server_message_set_status(lookup->message, 200, NULL);
    soup_message_body_append(soup_server_message_get_response_body(lookup->message), SOUP_MEMORY_COPY, lookup->data,
                             lookup->size);
}

static void answer(struct lumi_api_lookup *lookup)
{
    struct lumi_api_answer answer = {0};

    if (lookup->code == LUMI_OK && lookup->data) {
        send_bytes(lookup);
        return;
    }
    if (lookup->code != LUMI_OK)
        lumi_api_problem_of(&answer, lookup->code, lookup->error.text);
    else
        lumi_api_answer(&answer, 200, "application/json", g_steal_pointer(&lookup->text));
    lumi_api_send(lookup->message, &answer);
}

static void done(struct lumi_api_letter *letter, bool dropped)
{
    struct lumi_api_lookup *lookup = (struct lumi_api_lookup *)letter;

    g_signal_handlers_disconnect_by_data(lookup->message, lookup);
    if (!lookup->gone && !dropped) {
        answer(lookup);
        soup_server_message_unpause(lookup->message);
    }
    g_object_unref(lookup->message);
    g_free(lookup->text);
    lumi_free(lookup->data);
    g_free(lookup);
}

void lumi_api_look_up(struct lumi_http *http, SoupServerMessage *message, void (*look)(struct lumi_api_lookup *lookup),
                      const char *name)
{
    struct lumi_api_lookup *lookup = g_new0(struct lumi_api_lookup, 1);

    lookup->job.work = work;
    lookup->job.letter.read = done;
    lookup->http = http;
    lookup->look = look;
    lookup->message = g_object_ref(message);
    g_strlcpy(lookup->name, name, sizeof lookup->name);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), lookup);
    if (lumi_api_worker_give(http->worker, &lookup->job)) {
        soup_server_message_pause(message);
        return;
    }
    done(&lookup->job.letter, true);
    lumi_api_send_problem(message, 503, "busy", "too many such questions wait for an answer already");
}

/* ---- devices ---- */

static void put_boards(JsonBuilder *builder)
{
    struct lumi_rig_usb_board boards[BOARDS_MAX];
    struct lumi_error error;
    int count = lumi_rig_usb_list(boards, BOARDS_MAX, &error);

    lumi_api_put_array(builder, "boards");
    for (int i = 0; i < count && i < BOARDS_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_board(builder, &boards[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_text(builder, "boards_error", count < 0 ? error.text : "");
}

static void look_for_devices(struct lumi_api_lookup *lookup)
{
    g_autofree struct lumi_camera_identity *cameras = g_new0(struct lumi_camera_identity, CAMERAS_MAX);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_error error = {0};
    int count = 0;

    if (lookup->http->options.devices)
        count = lookup->http->options.devices(lookup->http->options.context, cameras, CAMERAS_MAX, &error);
    json_builder_begin_object(builder);
    lumi_api_put_array(builder, "cameras");
    for (int i = 0; i < count && i < CAMERAS_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_identity(builder, &cameras[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_text(builder, "cameras_error", count < 0 ? error.text : "");
    put_boards(builder);
    json_builder_end_object(builder);
    lookup->text = lumi_api_finish(builder);
}

void lumi_api_serve_devices(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    (void)body;
    lumi_api_look_up(http, message, look_for_devices, "");
}
