/* What lies in the folder of access, and the listener with TLS.
 *
 * The file of users is looked at every second, by the door's worker: a disk that is busy with captures must not hold
 * this thread up. With the first user the listener opens, with the last it closes; its certificate is the rig's own.
 *
 * Connections are accepted here and not by libsoup, which says nothing of one before its TLS handshake is done: whoever
 * does not go on with that would be neither counted nor hung up on. The remote address that libsoup is given carries
 * the socket; lumi_api_socket finds it there. */
#include "daemon/http/api_door.h"

#include <string.h>
#include <sys/stat.h>

#define SECOND INT64_C(1000000000)
#define HANDSHAKE_MS 10000
#define FAULT_TEXT 256
#define AGAIN_MS 250
#define LOOK_AGAIN_NS (86400 * SECOND) /* at the certificate */
#define TRY_AGAIN_NS (10 * SECOND)     /* where there is none */

struct stamp {
    dev_t device;
    ino_t file;
    off_t size;
    struct timespec changed;
    bool there, unread;
};

struct lumi_api_secure {
    struct lumi_api_door *door;
    GSocketListener *listener;
    GCancellable *cancellable;
    GSource *again;
    int port;
    char host[LUMI_ADDRESS_TEXT]; /* the one address; "": all */
    bool said;                    /* that it cannot be opened */
    GTlsCertificate *certificate;
    char fingerprint[LUMI_FINGERPRINT];
    int64_t certified_ns; /* when that was tried */
    struct stamp stamp;
    GPtrArray *arrivals;                                 /* whose TLS is being agreed on */
    char users_fault[FAULT_TEXT], tls_fault[FAULT_TEXT]; /* that were told */
};

/* ---- looking, in the worker ---- */

struct look {
    struct lumi_api_job job;
    struct lumi_api_door *door;
    struct stamp stamp;
    bool changed, certify;
    struct lumi_users users;
    GTlsCertificate *certificate;
    char fingerprint[LUMI_FINGERPRINT];
    int64_t unix_s;
    struct lumi_error error, tls_error;
    int code, tls_code; /* of the users; of the certificate: neither says anything of the other */
};

static void certify(struct look *look)
{
    const struct lumi_http_options *options = &look->door->http->options;
    g_autofree char *path = g_build_filename(look->door->folder, "rig.pem", NULL);
    g_autofree char *copy = g_build_filename(look->door->folder, "rig.crt", NULL);
    g_autoptr(GError) failed = NULL;

    if (!g_tls_backend_supports_tls(g_tls_backend_get_default())) {
        look->tls_code =
            lumi_fail(&look->tls_error, LUMI_ERR_UNSUPPORTED, "no TLS on this computer: install glib-networking");
        return;
    }
    look->tls_code = lumi_certificate_ensure(path, copy, options->host_name ? options->host_name : g_get_host_name(),
                                             look->unix_s, look->fingerprint, &look->tls_error);
    if (look->tls_code != LUMI_OK)
        return;
    look->certificate = g_tls_certificate_new_from_file(path, &failed);
    if (!look->certificate)
        look->tls_code = lumi_fail(&look->tls_error, LUMI_ERR_FORMAT, "%s: %s", path, failed->message);
}

static void work(struct lumi_api_job *job)
{
    struct look *look = (struct look *)job;
    struct stamp stamp = {0};
    struct stat is;

    if (stat(look->door->users_file, &is) == 0) {
        stamp.there = true;
        stamp.device = is.st_dev;
        stamp.file = is.st_ino;
        stamp.size = is.st_size;
        stamp.changed = is.st_mtim;
    }
    look->changed = look->stamp.unread || stamp.there != look->stamp.there || stamp.device != look->stamp.device ||
                    stamp.file != look->stamp.file || stamp.size != look->stamp.size ||
                    stamp.changed.tv_sec != look->stamp.changed.tv_sec ||
                    stamp.changed.tv_nsec != look->stamp.changed.tv_nsec;
    look->stamp = stamp;
    if (look->changed)
        look->code = lumi_users_load(look->door->users_file, &look->users, &look->error);
    if (look->code == LUMI_OK && (look->certify || (look->changed && look->users.count)))
        certify(look);
}

/* ---- listening ---- */

/* A connection whose TLS is being agreed on. */
struct arrival {
    struct lumi_api_secure *secure; /* NULL: it has ended meanwhile */
    GSocketConnection *connection;
    GIOStream *stream;
    GCancellable *cancellable;
    GSource *timer;
};

static gboolean on_patience(void *context)
{
    struct arrival *arrival = context;

    lumi_api_drop(&arrival->timer);
    g_cancellable_cancel(arrival->cancellable);
    g_socket_shutdown(g_socket_connection_get_socket(arrival->connection), TRUE, TRUE, NULL);
    return G_SOURCE_REMOVE;
}

static const char socket_name[] = "lumi-socket";

/* One of its own, which may hold the socket: the socket keeps the one that it gives out. */
static GSocketAddress *remote_of(GSocket *socket)
{
    g_autoptr(GSocketAddress) kept = g_socket_get_remote_address(socket, NULL);
    GInetSocketAddress *inet = G_IS_INET_SOCKET_ADDRESS(kept) ? G_INET_SOCKET_ADDRESS(kept) : NULL;
    GSocketAddress *made =
        inet ? g_inet_socket_address_new(g_inet_socket_address_get_address(inet), g_inet_socket_address_get_port(inet))
             : NULL;

    if (made)
        g_object_set_data_full(G_OBJECT(made), socket_name, g_object_ref(socket), g_object_unref);
    return made;
}

static void on_agreed(GObject *object, GAsyncResult *result, void *context)
{
    struct arrival *arrival = context;
    bool good = g_tls_connection_handshake_finish(G_TLS_CONNECTION(object), result, NULL);
    GSocket *socket = g_socket_connection_get_socket(arrival->connection);
    g_autoptr(GSocketAddress) local = g_socket_get_local_address(socket, NULL);
    g_autoptr(GSocketAddress) remote = remote_of(socket);

    if (good && local && remote && arrival->secure && arrival->secure->listener)
        soup_server_accept_iostream(arrival->secure->door->http->server, arrival->stream, local, remote, NULL);
    else
        g_io_stream_close(G_IO_STREAM(arrival->connection), NULL, NULL);
    if (arrival->secure)
        g_ptr_array_remove_fast(arrival->secure->arrivals, arrival);
    lumi_api_drop(&arrival->timer);
    g_object_unref(arrival->cancellable);
    g_object_unref(arrival->stream);
    g_object_unref(arrival->connection);
    g_free(arrival);
}

static void arrive(struct lumi_api_secure *secure, GSocketConnection *connection)
{
    GIOStream *stream = g_tls_server_connection_new(G_IO_STREAM(connection), secure->certificate, NULL);
    struct arrival *made;

    if (!lumi_api_guard_take(secure->door->http->guard, g_socket_connection_get_socket(connection)) || !stream) {
        g_clear_object(&stream);
        g_io_stream_close(G_IO_STREAM(connection), NULL, NULL);
        return;
    }
    made = g_new0(struct arrival, 1);
    *made = (struct arrival){.secure = secure, .connection = g_object_ref(connection), .stream = stream};
    made->cancellable = g_cancellable_new();
    g_ptr_array_add(secure->arrivals, made);
    made->timer = lumi_api_attach(g_timeout_source_new(HANDSHAKE_MS), G_PRIORITY_DEFAULT, on_patience, made);
    g_tls_connection_handshake_async(G_TLS_CONNECTION(stream), G_PRIORITY_DEFAULT, made->cancellable, on_agreed, made);
}

static void accept_next(struct lumi_api_secure *secure);

static gboolean on_again(void *context)
{
    struct lumi_api_secure *secure = context;

    lumi_api_drop(&secure->again);
    accept_next(secure);
    return G_SOURCE_REMOVE;
}

static void on_accepted(GObject *object, GAsyncResult *result, void *context)
{
    g_autoptr(GError) failed = NULL;
    g_autoptr(GSocketConnection) connection =
        g_socket_listener_accept_finish(G_SOCKET_LISTENER(object), result, NULL, &failed);
    struct lumi_api_secure *secure = context;

    if (g_error_matches(failed, G_IO_ERROR, G_IO_ERROR_CANCELLED) || secure->listener != (void *)object)
        return;
    if (connection) {
        arrive(secure, connection);
        accept_next(secure);
    } else /* descriptors have run out: others hold them, and not for ever */
        secure->again = lumi_api_attach(g_timeout_source_new(AGAIN_MS), G_PRIORITY_DEFAULT, on_again, secure);
}

static void accept_next(struct lumi_api_secure *secure)
{
    g_socket_listener_accept_async(secure->listener, secure->cancellable, on_accepted, secure);
}

static bool bind_address(struct lumi_api_secure *secure, const char *host, int port, GError **failed)
{
    g_autoptr(GSocketAddress) address = g_inet_socket_address_new_from_string(host, (guint)port);
    g_autoptr(GSocketAddress) bound = NULL;

    if (!g_socket_listener_add_address(secure->listener, address, G_SOCKET_TYPE_STREAM, G_SOCKET_PROTOCOL_TCP, NULL,
                                       &bound, failed))
        return false;
    secure->port = g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(bound));
    return true;
}

/* "*" is IPv6 with IPv4 in it, or IPv4 where there is nothing else. */
static bool bind_all(struct lumi_api_secure *secure, const struct lumi_api_listen *listen, GError **failed)
{
    if (!strcmp(listen->host, "localhost"))
        return bind_address(secure, "127.0.0.1", listen->port, failed);
    if (strcmp(listen->host, "*"))
        return bind_address(secure, listen->host, listen->port, failed);
    if (bind_address(secure, "::", listen->port, NULL))
        return true;
    return bind_address(secure, "0.0.0.0", listen->port, failed);
}

static void open_listener(struct lumi_api_secure *secure)
{
    const char *wanted = secure->door->http->options.secure;
    struct lumi_api_listen listen;
    g_autoptr(GError) failed = NULL;

    if (secure->listener || !secure->certificate || !wanted || !*wanted ||
        lumi_api_listen_parse(wanted, &listen, NULL) != LUMI_OK)
        return;
    secure->listener = g_socket_listener_new();
    if (!bind_all(secure, &listen, &failed)) {
        if (!secure->said)
            g_warning("HTTP: listen on '%s': %s", wanted, failed->message);
        secure->said = true;
        g_clear_object(&secure->listener);
        return;
    }
    g_strlcpy(secure->host, strcmp(listen.host, "*") ? listen.host : "", sizeof secure->host);
    secure->said = false;
    secure->cancellable = g_cancellable_new();
    accept_next(secure);
    g_message("HTTP: others are answered on port %d, certificate %s", secure->port, secure->fingerprint);
}

static void close_listener(struct lumi_api_secure *secure)
{
    if (!secure->listener)
        return;
    lumi_api_drop(&secure->again);
    g_cancellable_cancel(secure->cancellable);
    g_socket_listener_close(secure->listener);
    g_clear_object(&secure->cancellable);
    g_clear_object(&secure->listener);
}

/* ---- what has been found ---- */

/* Told once, however often it is met; NULL: it is gone. */
static void complain(char told[FAULT_TEXT], const char *text)
{
    if (text && strncmp(told, text, FAULT_TEXT - 1))
        g_warning("HTTP: %s", text);
    g_strlcpy(told, text ? text : "", FAULT_TEXT);
}

/* Who was a user stays one while the file cannot be read, which must not open the door; it is read again until it can:
 * that it may be read now need not show in its stamp. Who is a user does not hang on there being a certificate. */
static void take(struct lumi_api_door *door, struct look *look)
{
    struct lumi_api_secure *secure = door->secure;

    complain(secure->users_fault, look->code != LUMI_OK ? look->error.text : NULL);
    if (look->certificate || look->tls_code != LUMI_OK) {
        complain(secure->tls_fault, look->tls_code != LUMI_OK ? look->tls_error.text : NULL);
        secure->certified_ns = lumi_api_now(door->http);
    }
    secure->stamp = look->code == LUMI_OK ? look->stamp : (struct stamp){.unread = true};
    if (look->code == LUMI_OK && look->changed) {
        door->users = look->users;
        lumi_sessions_sweep(door->sessions, lumi_api_now(door->http), &door->users);
        lumi_pairing_sweep(&door->pairing, lumi_api_now(door->http), &door->users);
        lumi_api_door_swept(door);
    }
    if (look->certificate) {
        g_set_object(&secure->certificate, look->certificate);
        g_strlcpy(secure->fingerprint, look->fingerprint, sizeof secure->fingerprint);
    }
    if (door->users.count)
        open_listener(secure);
    else if (secure->listener) {
        close_listener(secure);
        g_message("HTTP: this computer alone is answered: there is no user");
    }
}

static void looked(struct lumi_api_letter *letter, bool dropped)
{
    struct look *look = (struct look *)letter;

    if (!dropped) {
        look->door->looking = false;
        take(look->door, look);
    }
    g_clear_object(&look->certificate);
    g_free(look);
}

static struct look *make_look(struct lumi_api_door *door)
{
    struct look *made = g_new0(struct look, 1);
    const struct lumi_api_secure *secure = door->secure;

    made->job.work = work;
    made->job.letter.read = looked;
    made->door = door;
    made->stamp = secure->stamp;
    made->unix_s = lumi_api_unix_us(door->http) / 1000000;
    made->certify =
        door->users.count && (!secure->certified_ns || lumi_api_now(door->http) - secure->certified_ns >
                                                           (secure->certificate ? LOOK_AGAIN_NS : TRY_AGAIN_NS));
    return made;
}

/* ---- the sessions' file ---- */

struct save {
    struct lumi_api_job job;
    struct lumi_api_door *door;
    char *text;
};

static int write_sessions(const struct lumi_api_door *door, const char *text, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(door->folder, "sessions", NULL);

    return lumi_secret_write(path, text, 0600, error);
}

static void work_save(struct lumi_api_job *job)
{
    struct save *save = (struct save *)job;
    struct lumi_error error;

    if (write_sessions(save->door, save->text, &error) != LUMI_OK)
        g_warning("HTTP: %s", error.text);
}

static void saved(struct lumi_api_letter *letter, bool dropped)
{
    struct save *save = (struct save *)letter;

    if (!dropped)
        save->door->saving = false;
    g_free(save->text);
    g_free(save);
}

static char *print_sessions(const struct lumi_api_door *door)
{
    return lumi_sessions_print(door->sessions, lumi_api_now(door->http), lumi_api_unix_us(door->http) / 1000000);
}

void lumi_api_secure_tick(struct lumi_api_door *door)
{
    struct look *look;
    struct save *save;

    if (!door->folder)
        return;
    if (!door->looking) {
        look = make_look(door);
        door->looking = lumi_api_worker_give(door->worker, &look->job);
        if (!door->looking)
            g_free(look);
    }
    if (!door->saving && door->local[0] && lumi_sessions_version(door->sessions) != door->saved) {
        save = g_new0(struct save, 1);
        *save = (struct save){.job = {.work = work_save, .letter.read = saved}, .door = door};
        save->text = print_sessions(door);
        door->saved = lumi_sessions_version(door->sessions);
        door->saving = lumi_api_worker_give(door->worker, &save->job);
        if (!door->saving) {
            door->saved--;
            saved(&save->job.letter, true);
        }
    }
}

/* ---- as it is told ---- */

static int where(const struct lumi_api_secure *secure, char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT])
{
    if (!secure->listener)
        return 0;
    if (!secure->host[0])
        return lumi_addresses(address);
    g_strlcpy(address[0], secure->host, LUMI_ADDRESS_TEXT);
    return 1;
}

static char *make_url(const struct lumi_api_secure *secure, const char *address)
{
    return g_strdup_printf(strchr(address, ':') ? "https://[%s]:%d/" : "https://%s:%d/", address, secure->port);
}

char *lumi_api_secure_url(const struct lumi_api_door *door)
{
    char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT];

    return where(door->secure, address) > 0 ? make_url(door->secure, address[0]) : NULL;
}

const char *lumi_api_secure_fingerprint(const struct lumi_api_door *door)
{
    return door->secure->fingerprint;
}

void lumi_api_secure_put(const struct lumi_api_door *door, JsonBuilder *builder)
{
    char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT];
    int count = where(door->secure, address);

    lumi_api_put_object(builder, "secure");
    lumi_api_put_bool(builder, "listening", door->secure->listener != NULL);
    lumi_api_put_array(builder, "urls");
    for (int i = 0; i < count; i++) {
        g_autofree char *url = make_url(door->secure, address[i]);
        json_builder_add_string_value(builder, url);
    }
    json_builder_end_array(builder);
    lumi_api_put_text(builder, "fingerprint", door->secure->fingerprint);
    json_builder_end_object(builder);
}

/* ---- sockets ---- */

GSocket *lumi_api_socket(SoupServerMessage *message)
{
    GSocketAddress *remote = soup_server_message_get_remote_address(message);
    GSocket *own = remote ? g_object_get_data(G_OBJECT(remote), socket_name) : NULL;

    return own ? own : soup_server_message_get_socket(message);
}

bool lumi_api_is_tls(const struct lumi_http *http, SoupServerMessage *message)
{
    GSocketAddress *remote = soup_server_message_get_remote_address(message);

    return http->https || (remote && g_object_get_data(G_OBJECT(remote), socket_name));
}

/* ---- life ---- */

int lumi_api_secure_create(struct lumi_api_door *door, struct lumi_error *error)
{
    const char *wanted = door->http->options.secure;
    struct lumi_api_listen listen;
    struct look *look;

    door->secure = g_new0(struct lumi_api_secure, 1);
    door->secure->door = door;
    door->secure->arrivals = g_ptr_array_new();
    if (wanted && *wanted)
        LUMI_TRY(lumi_api_listen_parse(wanted, &listen, error));
    if (!door->folder)
        return LUMI_OK;
    look = make_look(door);
    work(&look->job);
    looked(&look->job.letter, false);
    return LUMI_OK;
}

void lumi_api_secure_destroy(struct lumi_api_door *door)
{
    struct lumi_api_secure *secure = door->secure;

    if (!secure)
        return;
    if (door->local[0] && (door->users.count || lumi_sessions_version(door->sessions))) {
        g_autofree char *text = print_sessions(door);
        write_sessions(door, text, NULL);
    }
    close_listener(secure);
    for (guint i = 0; i < secure->arrivals->len; i++) {
        struct arrival *arrival = secure->arrivals->pdata[i];
        arrival->secure = NULL;
        lumi_api_drop(&arrival->timer);
        g_cancellable_cancel(arrival->cancellable);
    }
    g_ptr_array_unref(secure->arrivals);
    g_clear_object(&secure->certificate);
    g_free(secure);
}
