/* Connections are bounded, all of them and those of one peer, and none may sit there for ever: descriptors are shared
 * with cameras, links and the store, which must not go without because somebody opens connections and says nothing.
 *
 * 1. libsoup (3.2 to 3.6) says "request-started" when it has accepted a connection, before anything is read, and again
 *    with the first byte of every further request; so a connection is known from its first moment on, and its socket
 *    can be shut down then and at any time: libsoup sees the end of the stream, or a write that fails, and lets go.
 * 2. A connection is over when its GSocket is: a weak reference tells; libsoup 3.2 keeps the objects of all that were
 *    plain, for ever, so one that is closed is over too.
 * 3. libsoup takes its listening socket out of the main loop for good when accepting fails once, which it does when
 *    the program has run out of descriptors. The listening sockets are therefore watched at a lower priority: that
 *    watch is called only where libsoup has left a connection waiting, and makes it listen again. */
#include "daemon/http/api_priv.h"

#include <fcntl.h>
#include <glib-unix.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define REQUEST_NS (30 * SECOND) /* until a request is here, whole; and between two */
#define ANSWER_NS (120 * SECOND) /* until its answer has been taken */
#define TICK_MS 500
#define AGAIN_MS 250

struct connection {
    struct lumi_api_guard *guard;
    GSocket *socket; /* not a reference */
    guint8 peer[16];
    gsize peer_size; /* 0: unknown */
    bool here;       /* this computer */
    bool tls;
    bool known;      /* somebody who may was let in on it */
    bool ended;      /* it is shut down, and on its way out */
    uint64_t number; /* in the order they came */
    bool waiting;    /* for a request: nothing is being answered */
    int64_t until_ns;
};

struct watch {
    struct lumi_api_guard *guard;
    GSocket *socket;
    GSource *source, *timer;
};

struct lumi_api_guard {
    struct lumi_http *http;
    GHashTable *connections; /* GSocket → struct connection */
    GPtrArray *watches;
    GSource *tick;
    uint64_t count; /* that have come so far */
};

static int64_t now(const struct lumi_api_guard *guard)
{
    return guard->http->options.now_ns(guard->http->options.context);
}

/* ---- connections ---- */

/* An IPv6 peer is a network of 64 bits: whoever has one has all its addresses. */
static size_t peer_of(GSocketAddress *address, unsigned char peer[16], bool *here)
{
    static const guint8 mapped[12] = {[10] = 0xff, [11] = 0xff};

    if (!address || !G_IS_INET_SOCKET_ADDRESS(address))
        return 0;
    GInetAddress *inet = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address));
    const guint8 *bytes = g_inet_address_to_bytes(inet);
    gsize size = g_inet_address_get_native_size(inet);
    *here = g_inet_address_get_is_loopback(inet);
    if (size == 16 && !memcmp(bytes, mapped, sizeof mapped)) {
        bytes += 12;
        size = 4;
        *here = bytes[0] == 127;
    } else if (size == 16 && !*here)
        size = 8;
    memcpy(peer, bytes, size);
    return size;
}

static void identify(struct connection *connection)
{
    g_autoptr(GSocketAddress) address = g_socket_get_remote_address(connection->socket, NULL);

    connection->peer_size = peer_of(address, connection->peer, &connection->here);
}

size_t lumi_api_guard_peer(SoupServerMessage *message, unsigned char peer[16], bool *here)
{
    *here = false;
    return peer_of(soup_server_message_get_remote_address(message), peer, here);
}

static bool is_same_peer(const struct connection *a, const struct connection *b)
{
    return a->peer_size && a->peer_size == b->peer_size && !memcmp(a->peer, b->peer, a->peer_size);
}

/* libsoup 3.2 looks at a connection that waits for its next request only when something is read of it: of those that
 * the peer has closed it keeps the descriptor. */
static bool has_left(const struct connection *connection)
{
    char byte;

    return connection->waiting && recv(g_socket_get_fd(connection->socket), &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

/* Others leave one peer's share to this computer: its operator gets through whatever they do. */
enum { MANY = 1, MANY_OF_PEER };
static int is_one_too_many(const struct connection *made)
{
    const struct lumi_http_options *options = &made->guard->http->options;
    int all = 0, others = 0, peer = 0;
    GHashTableIter at;
    gpointer value;

    g_hash_table_iter_init(&at, made->guard->connections);
    while (g_hash_table_iter_next(&at, NULL, &value)) {
        const struct connection *connection = value;
        if (connection->ended || g_socket_is_closed(connection->socket) || has_left(connection))
            continue;
        all++;
        others += !connection->here;
        peer += is_same_peer(connection, made);
    }
    if (peer > options->connections_peer)
        return MANY_OF_PEER;
    return all > options->connections_max ||
                   (!made->here && others > options->connections_max - options->connections_peer)
               ? MANY
               : 0;
}

/* Of those on which nobody has been let in yet the one that has been here longest. */
static struct connection *oldest_stranger(const struct connection *made)
{
    struct connection *oldest = NULL;
    GHashTableIter at;
    gpointer value;

    g_hash_table_iter_init(&at, made->guard->connections);
    while (g_hash_table_iter_next(&at, NULL, &value)) {
        struct connection *connection = value;
        if (connection != made && !connection->known && !connection->ended && connection->waiting &&
            (made->here || !connection->here) && (!oldest || connection->number < oldest->number))
            oldest = connection;
    }
    return oldest;
}

static void end(struct connection *connection)
{
    g_socket_shutdown(connection->socket, TRUE, TRUE, NULL);
    connection->ended = true;
    connection->until_ns = INT64_MAX;
}

/* False: there is none to be had. Who says nothing, or nothing that lets them in, gives way to whoever comes: the next
 * may be the operator's phone. */
static bool make_room(const struct connection *made, int many)
{
    struct connection *stranger = many == MANY ? oldest_stranger(made) : NULL;

    if (stranger)
        end(stranger);
    return stranger != NULL;
}

static void refuse(struct connection *connection)
{
    g_autofree char *answer = lumi_api_problem_message(503, "limit", "too many connections are open already");

    if (!connection->tls)
        g_socket_send_with_blocking(connection->socket, answer, strlen(answer), FALSE, NULL, NULL);
    end(connection);
}

static void on_gone(void *context, GObject *socket)
{
    struct lumi_api_guard *guard = context;

    g_hash_table_remove(guard->connections, socket);
}

static gboolean on_tick(void *context)
{
    struct lumi_api_guard *guard = context;
    int64_t time = now(guard);
    GHashTableIter at;
    gpointer value;

    if (!g_hash_table_size(guard->connections)) {
        lumi_api_drop(&guard->tick);
        return G_SOURCE_REMOVE;
    }
    g_hash_table_iter_init(&at, guard->connections);
    while (g_hash_table_iter_next(&at, NULL, &value)) {
        struct connection *connection = value;
        if (g_socket_is_closed(connection->socket)) {
            g_object_weak_unref(G_OBJECT(connection->socket), on_gone, guard);
            g_hash_table_iter_remove(&at);
        } else if (time > connection->until_ns || (connection->until_ns != INT64_MAX && has_left(connection)))
            end(connection);
    }
    return G_SOURCE_CONTINUE;
}

static void set_limit(struct lumi_api_guard *guard, SoupServerMessage *message, int64_t until_ns, bool waiting)
{
    GSocket *socket = lumi_api_socket(message);
    struct connection *connection = socket ? g_hash_table_lookup(guard->connections, socket) : NULL;

    if (connection) {
        connection->until_ns = until_ns;
        connection->waiting = waiting;
    }
}

static bool keep(struct lumi_api_guard *guard, GSocket *socket, bool tls)
{
    struct connection *made = g_new0(struct connection, 1);

    *made = (struct connection){.guard = guard, .socket = socket, .waiting = true, .tls = tls};
    made->number = ++guard->count;
    made->until_ns = now(guard) + REQUEST_NS;
    identify(made);
    g_hash_table_insert(guard->connections, socket, made);
    g_object_weak_ref(G_OBJECT(socket), on_gone, guard);
    int many = is_one_too_many(made);
    bool good = !many || make_room(made, many);
    if (!good)
        refuse(made);
    if (!guard->tick)
        guard->tick = lumi_api_attach(g_timeout_source_new(TICK_MS), G_PRIORITY_DEFAULT, on_tick, guard);
    return good;
}

static void on_started(SoupServer *server, SoupServerMessage *message, void *context)
{
    struct lumi_api_guard *guard = context;
    GSocket *socket = lumi_api_socket(message);

    (void)server;
    if (!socket)
        return;
    if (g_hash_table_contains(guard->connections, socket)) {
        set_limit(guard, message, now(guard) + REQUEST_NS, true);
        return;
    }
    keep(guard, socket, guard->http->https);
}

bool lumi_api_guard_take(struct lumi_api_guard *guard, GSocket *socket)
{
    return keep(guard, socket, true);
}

static void on_read(SoupServer *server, SoupServerMessage *message, void *context)
{
    struct lumi_api_guard *guard = context;

    (void)server;
    set_limit(guard, message, now(guard) + ANSWER_NS, false);
}

static void on_finished(SoupServer *server, SoupServerMessage *message, void *context)
{
    struct lumi_api_guard *guard = context;

    (void)server;
    set_limit(guard, message, now(guard) + REQUEST_NS, true);
}

void lumi_api_guard_known(struct lumi_api_guard *guard, SoupServerMessage *message)
{
    GSocket *socket = lumi_api_socket(message);
    struct connection *connection = socket ? g_hash_table_lookup(guard->connections, socket) : NULL;

    if (connection)
        connection->known = true;
}

void lumi_api_guard_spare(struct lumi_api_guard *guard, SoupServerMessage *message)
{
    set_limit(guard, message, INT64_MAX, false);
    lumi_api_people_stream(guard->http, message);
}

/* ---- listening goes on ---- */

static void look(struct watch *watch);

static gboolean listen_again(void *context)
{
    struct watch *watching = context;
    struct lumi_http *http = watching->guard->http;
    int spare = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0); /* is there a descriptor again? */

    if (spare < 0)
        return G_SOURCE_CONTINUE;
    close(spare);
    lumi_api_drop(&watching->timer);
    if (!soup_server_listen_socket(http->server, watching->socket, http->https ? SOUP_SERVER_LISTEN_HTTPS : 0, NULL))
        g_warning("HTTP: nobody is listened to any more");
    look(watching);
    return G_SOURCE_REMOVE;
}

static gboolean on_waiting(gint fd, GIOCondition condition, void *context)
{
    struct watch *watching = context;

    (void)fd;
    (void)condition;
    lumi_api_drop(&watching->source);
    watching->timer = lumi_api_attach(g_timeout_source_new(AGAIN_MS), G_PRIORITY_DEFAULT, listen_again, watching);
    return G_SOURCE_REMOVE;
}

static void look(struct watch *watch)
{
    watch->source = lumi_api_attach(g_unix_fd_source_new(g_socket_get_fd(watch->socket), G_IO_IN), G_PRIORITY_LOW,
                                    G_SOURCE_FUNC(on_waiting), watch);
}

static void free_watch(void *data)
{
    struct watch *watch = data;

    lumi_api_drop(&watch->source);
    lumi_api_drop(&watch->timer);
    g_object_unref(watch->socket);
    g_free(watch);
}

void lumi_api_guard_listeners(struct lumi_api_guard *guard)
{
    GSList *sockets = soup_server_get_listeners(guard->http->server);

    for (GSList *at = sockets; at; at = at->next) {
        struct watch *made = g_new0(struct watch, 1);
        *made = (struct watch){.guard = guard, .socket = g_object_ref(at->data)};
        g_ptr_array_add(guard->watches, made);
        look(made);
    }
    g_slist_free(sockets);
}

/* ---- life ---- */

struct lumi_api_guard *lumi_api_guard_create(struct lumi_http *http)
{
    struct lumi_api_guard *guard = g_new0(struct lumi_api_guard, 1);

    guard->http = http;
    guard->connections = g_hash_table_new_full(NULL, NULL, NULL, g_free);
    guard->watches = g_ptr_array_new_with_free_func(free_watch);
    g_signal_connect(http->server, "request-started", G_CALLBACK(on_started), guard);
    g_signal_connect(http->server, "request-read", G_CALLBACK(on_read), guard);
    g_signal_connect(http->server, "request-finished", G_CALLBACK(on_finished), guard);
    return guard;
}

void lumi_api_guard_destroy(struct lumi_api_guard *guard)
{
    GHashTableIter at;
    gpointer key;

    if (!guard)
        return;
    g_signal_handlers_disconnect_by_data(guard->http->server, guard);
    lumi_api_drop(&guard->tick);
    g_ptr_array_unref(guard->watches);
    g_hash_table_iter_init(&at, guard->connections);
    while (g_hash_table_iter_next(&at, &key, NULL))
        g_object_weak_unref(key, on_gone, guard);
    g_hash_table_unref(guard->connections);
    g_free(guard);
}
