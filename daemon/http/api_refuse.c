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
    GIOStream *stream;
    GSocket *socket; /* NULL: TLS over what is no socket */
    GCancellable *cancellable;
    char *answer;
    char *block;
    guint timer;
    size_t read;
};

static void finish(struct refusal *refusal)
{
    if (refusal->timer)
        g_source_remove(refusal->timer);
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

    refusal->timer = 0;
    g_cancellable_cancel(refusal->cancellable);
    return G_SOURCE_REMOVE;
}

struct pending {
    SoupServerMessage *message;
    char *answer;
};

/* Not in the handler itself: the server is in the middle of reading from the connection there. */
static gboolean answer_now(void *context)
{
    struct pending *pending = context;
    GSocket *socket = soup_server_message_get_socket(pending->message);
    struct refusal *refusal = g_new0(struct refusal, 1);

    if (socket)
        refusal->socket = g_object_ref(socket);
    refusal->stream = soup_server_message_steal_connection(pending->message);
    refusal->answer = g_steal_pointer(&pending->answer);
    refusal->cancellable = g_cancellable_new();
    if (refusal->stream) {
        refusal->block = g_malloc(BLOCK);
        refusal->timer = g_timeout_add(LINGER_MS, on_timer, refusal);
        g_output_stream_write_all_async(g_io_stream_get_output_stream(refusal->stream), refusal->answer,
                                        strlen(refusal->answer), G_PRIORITY_DEFAULT, refusal->cancellable, on_written,
                                        refusal);
    } else { /* it is closed already */
        g_clear_object(&refusal->socket);
        g_object_unref(refusal->cancellable);
        g_free(refusal->answer);
        g_free(refusal);
    }
    g_object_unref(pending->message);
    g_free(pending);
    return G_SOURCE_REMOVE;
}

void lumi_api_refuse_early(SoupServerMessage *message, unsigned status, const char *word, const char *detail)
{
    struct pending *pending = g_new0(struct pending, 1);

    soup_message_body_set_accumulate(soup_server_message_get_request_body(message), FALSE);
    soup_server_message_pause(message);
    pending->message = g_object_ref(message);
    pending->answer = lumi_api_problem_message(status, word, detail);
    g_idle_add(answer_now, pending);
}
