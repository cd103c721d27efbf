/* Logs in over TLS and holds event streams open, reading what comes: hold_streams URL NAME PASSWORD ADDRESSES EACH
 * FILE. ADDRESSES addresses of this computer (127.0.0.2 and on) log in, and open EACH streams. FILE appears when all
 * are open; at SIGTERM it says how many still are, how many shots they were told of at least, and the exit status is 0
 * if that is all of them. */
#include <glib-unix.h>
#include <json-glib/json-glib.h>
#include <libsoup/soup.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct stream {
    SoupMessage *message;
    GInputStream *input;
    char block[4096 + 1];
    char tail[16]; /* of what came before: a line may be cut */
    int shots;
    bool open;
};

static GMainLoop *loop;
static struct stream *streams;
static int wanted, opened, failed;
static const char *file;

static gboolean trust(SoupMessage *message, GTlsCertificate *certificate, GTlsCertificateFlags flags, void *context)
{
    (void)message;
    (void)certificate;
    (void)flags;
    (void)context;
    return TRUE;
}

static void give_up(const char *what, const char *why)
{
    fprintf(stderr, "hold_streams: %s: %s\n", what, why);
    exit(1);
}

static SoupSession *log_in(const char *url, const char *name, const char *password, int number)
{
    g_autofree char *from = g_strdup_printf("127.0.0.%d", number + 2);
    g_autoptr(GInetAddress) address = g_inet_address_new_from_string(from);
    g_autoptr(GSocketAddress) local = g_inet_socket_address_new(address, 0);
    SoupSession *session = soup_session_new_with_options("local-address", local, "max-conns", 256, "max-conns-per-host",
                                                         256, "timeout", 0, NULL);
    g_autofree char *path = g_strconcat(url, "/api/v1/session/login", NULL);
    g_autofree char *body = g_strdup_printf("{\"name\":\"%s\",\"password\":\"%s\"}", name, password);
    g_autoptr(GBytes) bytes = g_bytes_new(body, strlen(body));
    g_autoptr(SoupMessage) message = soup_message_new("POST", path);
    g_autoptr(GError) error = NULL;

    soup_session_add_feature_by_type(session, SOUP_TYPE_COOKIE_JAR);
    soup_message_set_request_body_from_bytes(message, "application/json", bytes);
    g_signal_connect(message, "accept-certificate", G_CALLBACK(trust), NULL);
    g_autoptr(GBytes) answer = soup_session_send_and_read(session, message, NULL, &error);
    if (!answer || soup_message_get_status(message) != 200)
        give_up("login", error ? error->message : soup_message_get_reason_phrase(message));
    return session;
}

static void read_on(struct stream *stream);

static void on_read(GObject *object, GAsyncResult *result, void *context)
{
    struct stream *stream = context;
    gssize size = g_input_stream_read_finish(G_INPUT_STREAM(object), result, NULL);

    if (size <= 0) {
        stream->open = false;
        return;
    }
    stream->block[size] = '\0';
    g_autofree char *text = g_strconcat(stream->tail, stream->block, NULL);
    size_t length = strlen(text), kept = MIN(length, strlen("event: shot") - 1);
    for (const char *at = text; (at = strstr(at, "event: shot")); at++)
        stream->shots++;
    g_strlcpy(stream->tail, text + length - kept, sizeof stream->tail);
    read_on(stream);
}

static void read_on(struct stream *stream)
{
    g_input_stream_read_async(stream->input, stream->block, sizeof stream->block - 1, G_PRIORITY_DEFAULT, NULL, on_read,
                              stream);
}

static void on_answer(GObject *object, GAsyncResult *result, void *context)
{
    struct stream *stream = context;
    g_autoptr(GError) error = NULL;

    stream->input = soup_session_send_finish(SOUP_SESSION(object), result, &error);
    if (!stream->input || soup_message_get_status(stream->message) != 200) {
        fprintf(stderr, "hold_streams: %s\n", error ? error->message : soup_message_get_reason_phrase(stream->message));
        failed++;
    } else {
        stream->open = true;
        opened++;
        read_on(stream);
    }
    if (failed)
        exit(1);
    if (opened == wanted && !g_file_set_contents(file, "open\n", -1, NULL))
        exit(1);
}

static gboolean on_end(void *context)
{
    int open = 0, least = INT32_MAX;

    (void)context;
    for (int i = 0; i < wanted; i++) {
        open += streams[i].open;
        least = MIN(least, streams[i].shots);
    }
    g_autofree char *text = g_strdup_printf("%d of %d open, %d shots at least\n", open, wanted, least);
    g_file_set_contents(file, text, -1, NULL);
    failed = open != wanted;
    g_main_loop_quit(loop);
    return G_SOURCE_REMOVE;
}

int main(int argc, char **argv)
{
    if (argc != 7)
        return 2;
    const int addresses = atoi(argv[4]), each = atoi(argv[5]);
    g_autofree char *path = g_strconcat(argv[1], "/api/v1/events", NULL);
    SoupSession *sessions[16] = {NULL};

    file = argv[6];
    wanted = addresses * each;
    streams = g_new0(struct stream, wanted);
    loop = g_main_loop_new(NULL, FALSE);
    g_unix_signal_add(SIGTERM, on_end, NULL);
    for (int i = 0; i < addresses && i < 16; i++)
        sessions[i] = log_in(argv[1], argv[2], argv[3], i);
    for (int i = 0; i < wanted; i++) {
        streams[i].message = soup_message_new("GET", path);
        g_signal_connect(streams[i].message, "accept-certificate", G_CALLBACK(trust), NULL);
        soup_session_send_async(sessions[i % addresses], streams[i].message, G_PRIORITY_DEFAULT, NULL, on_answer,
                                &streams[i]);
    }
    g_main_loop_run(loop);
    return failed ? 1 : 0;
}
