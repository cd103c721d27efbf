/* A request whose body will not be read. The connection is taken from the server, answered and closed: a gigabyte that
 * is on its way costs neither memory nor the time to read it.
 *
 * Closing a socket on which bytes wait makes the kernel send a reset, which may overtake the answer; so the sending
 * side is closed first, and what comes is read and thrown away, for a moment. */
#include "daemon/http/api_priv.h"

#include <string.h>

#define LINGER_MS 2000
#define LINGER_BYTES (16 << 20)
#define BLOCK 65536

struct refusal {
    struct lumi_http *http;
    GIOStream *stream;
    GSocket *socket; /* NULL: TLS over what is no socket */
    GCancellable *cancellable;
    char *answer;
    char *block;
    GSource *timer;
    size_t read;
};

static void finish(struct refusal *refusal)
{
    lumi_api_drop(&refusal->timer);
    g_ptr_array_remove_fast(refusal->http->refusals, refusal);
    g_io_stream_close_async(refusal->stream, G_PRIORITY_DEFAULT, NULL, NULL, NULL);
    g_object_unref(refusal->stream);
    g_clear_object(&refusal->socket);
    g_object_unref(refusal->cancellable);
    g_free(refusal->answer);
    g_free(refusal->block);
    g_free(refusal);
}

static void on_read(GObject *object, GAsyncResult *result, void *context)
{
    struct refusal *refusal = context;
    gssize got = g_input_stream_read_finish(G_INPUT_STREAM(object), result, NULL);

    if (got > 0 && (refusal->read += (size_t)got) < LINGER_BYTES)
        g_input_stream_read_async(G_INPUT_STREAM(object), refusal->block, BLOCK, G_PRIORITY_LOW, refusal->cancellable,
                                  on_read, refusal);
    else
        finish(refusal);
}

static void on_written(GObject *object, GAsyncResult *result, void *context)
{
    struct refusal *refusal = context;

    if (!g_output_stream_write_all_finish(G_OUTPUT_STREAM(object), result, NULL, NULL) || !refusal->socket ||
        !g_socket_shutdown(refusal->socket, FALSE, TRUE, NULL)) {
        finish(refusal);
        return;
    }
    g_input_stream_read_async(g_io_stream_get_input_stream(refusal->stream), refusal->block, BLOCK, G_PRIORITY_LOW,
                              refusal->cancellable, on_read, refusal);
}

static gboolean on_timer(void *context)
{
    struct refusal *refusal = context;

    lumi_api_drop(&refusal->timer);
    g_cancellable_cancel(refusal->cancellable);
    return G_SOURCE_REMOVE;
}

struct pending {
    struct lumi_http *http;
    GSource *idle;
    SoupServerMessage *message;
    char *answer;
};

/* Not in the handler itself: the server is in the middle of reading from the connection there. */
static gboolean answer_now(void *context)
{
    struct pending *pending = context;
    GSocket *socket = lumi_api_socket(pending->message);
    struct refusal *refusal = g_new0(struct refusal, 1);

    refusal->http = pending->http;
    if (socket)
        refusal->socket = g_object_ref(socket);
    refusal->stream = soup_server_message_steal_connection(pending->message);
    refusal->answer = g_steal_pointer(&pending->answer);
    refusal->cancellable = g_cancellable_new();
    if (refusal->stream) {
        refusal->block = g_malloc(BLOCK);
        refusal->timer = lumi_api_attach(g_timeout_source_new(LINGER_MS), G_PRIORITY_DEFAULT, on_timer, refusal);
        g_ptr_array_add(refusal->http->refusals, refusal);
        g_output_stream_write_all_async(g_io_stream_get_output_stream(refusal->stream), refusal->answer,
                                        strlen(refusal->answer), G_PRIORITY_DEFAULT, refusal->cancellable, on_written,
                                        refusal);
    } else { /* it is closed already */
        g_clear_object(&refusal->socket);
        g_object_unref(refusal->cancellable);
        g_free(refusal->answer);
        g_free(refusal);
    }
    lumi_api_drop(&pending->idle);
    g_object_unref(pending->message);
    g_free(pending);
    return G_SOURCE_REMOVE;
}

void lumi_api_refuse_early(struct lumi_http *http, SoupServerMessage *message, unsigned status, const char *word,
                           const char *detail)
{
    struct pending *pending = g_new0(struct pending, 1);

    soup_message_body_set_accumulate(soup_server_message_get_request_body(message), FALSE);
    soup_server_message_pause(message);
    pending->http = http;
    pending->message = g_object_ref(message);
    pending->answer = lumi_api_problem_message(status, word, detail);
    pending->idle = lumi_api_attach(g_idle_source_new(), G_PRIORITY_DEFAULT_IDLE, answer_now, pending);
}

void lumi_api_refuse_finish(struct lumi_http *http)
{
    for (guint i = 0; i < http->refusals->len; i++)
        g_cancellable_cancel(((struct refusal *)http->refusals->pdata[i])->cancellable);
    while (http->refusals->len)
        g_main_context_iteration(http->context, TRUE);
}
