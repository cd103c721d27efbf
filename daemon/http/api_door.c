/* The door: every request passes it before anything is looked at.
 *
 * A service on localhost is within reach of every page that a browser on this computer shows. So, where neither a token
 * is shown nor TLS stands between: the Host header must name this computer (a foreign name that was made to lead to
 * 127.0.0.1 does not), and always: a request that says it comes from another origin is refused, and a body must be JSON
 * by its type, which no form can send.
 *
 * While there is no user this computer is answered, and who shows the token. From the first user on everything but the
 * login and the page's files wants a session, the token, or what lumid leaves for `lumi` on its own computer. */
#include "daemon/http/api_door.h"

#include "proto/base/memory.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define TICK_MS 1000
#define COOKIE "lumid"
#define COOKIE_TLS "__Host-lumid" /* RFC 6265bis, 4.1.3.2: no other host, and nothing without TLS, can have set it */

/* ---- time ---- */

int64_t lumi_api_now(const struct lumi_http *http)
{
    return http->options.now_ns(http->options.context);
}

int64_t lumi_api_unix_us(const struct lumi_http *http)
{
    return http->options.unix_us ? http->options.unix_us(http->options.context) : lumi_api_now(http) / 1000;
}

int64_t lumi_api_unix_us_at(const struct lumi_http *http, int64_t at_ns)
{
    return lumi_api_unix_us(http) + (at_ns - lumi_api_now(http)) / 1000;
}

/* ---- who it is ---- */

static const char visitor_name[] = "lumi-visitor";

const struct lumi_api_visitor *lumi_api_visitor(SoupServerMessage *message)
{
    static const struct lumi_api_visitor nobody;
    const struct lumi_api_visitor *found = g_object_get_data(G_OBJECT(message), visitor_name);

    return found ? found : &nobody;
}

static void say_where(SoupServerMessage *message, struct lumi_api_visitor *who)
{
    GSocketAddress *address = soup_server_message_get_remote_address(message);

    if (!address || !G_IS_INET_SOCKET_ADDRESS(address))
        return;
    GInetAddress *inet = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address));
    g_autofree char *text = g_inet_address_to_string(inet);
    who->here = g_inet_address_get_is_loopback(inet);
    g_strlcpy(who->address, g_str_has_prefix(text, "::ffff:") ? text + 7 : text, sizeof who->address);
    who->here |= g_str_has_prefix(who->address, "127.");
}

static void be(struct lumi_api_visitor *who, enum lumi_api_via via, enum lumi_api_role role, const char *name)
{
    who->via = via;
    who->role = role;
    g_strlcpy(who->name, name, sizeof who->name);
    snprintf(who->key, sizeof who->key, "%s%s", name, via == LUMI_API_TOKEN ? who->address : "");
}

/* By a token that is right. */
static bool by_token(struct lumi_http *http, const char *given, struct lumi_api_visitor *who)
{
    const char *local = http->door->local;

    if (given && http->options.token && lumi_api_token_matches(given, http->options.token))
        be(who, LUMI_API_TOKEN, LUMI_API_OPERATE, "token");
    else if (given && who->here && local[0] && lumi_api_token_matches(given, local))
        be(who, LUMI_API_LOCAL, LUMI_API_OPERATE, "this computer");
    else
        return false;
    who->token = true;
    return true;
}

static void by_session(struct lumi_http *http, SoupServerMessage *message, struct lumi_api_visitor *who)
{
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(message);
    const char *cookies = soup_message_headers_get_list(headers, "Cookie");
    char secret[LUMI_SECRET_TEXT];

    if (!cookies || !lumi_session_cookie(cookies, who->tls ? COOKIE_TLS : COOKIE, secret))
        return;
    const struct lumi_session *session = lumi_sessions_find(http->door->sessions, lumi_api_now(http), secret);
    if (!session)
        return;
    be(who, session->via == LUMI_VIA_PAIR ? LUMI_API_PAIR : LUMI_API_PASSWORD,
       session->role == LUMI_ROLE_OPERATE ? LUMI_API_OPERATE : LUMI_API_WATCH, session->name);
    g_strlcpy(who->key, session->id, sizeof who->key);
    g_strlcpy(who->secret, secret, sizeof who->secret);
}

#define STRANGERS_BODY 4096 /* a login is no longer */

size_t lumi_api_body_most(struct lumi_http *http, SoupServerMessage *message)
{
    const char *given = soup_message_headers_get_one(soup_server_message_get_request_headers(message), "Authorization");
    struct lumi_api_visitor who = {.tls = lumi_api_is_tls(http, message)};
    const bool users = http->door->users.count > 0;

    say_where(message, &who);
    if (by_token(http, given, &who) || (!users && who.here))
        return http->options.body_max;
    if (users)
        by_session(http, message, &who);
    return who.role == LUMI_API_ANYBODY ? MIN(http->options.body_max, STRANGERS_BODY) : http->options.body_max;
}

/* ---- whether it may ---- */

static bool turn_away(SoupServerMessage *message, unsigned status, const char *word, const char *detail)
{
    if (status == 401)
        soup_message_headers_replace(soup_server_message_get_response_headers(message), "WWW-Authenticate",
                                     "Bearer realm=\"lumid\"");
    lumi_api_send_problem(message, status, word, detail);
    return false;
}

/* False: it is answered already. */
static bool is_known(struct lumi_http *http, SoupServerMessage *message, struct lumi_api_visitor *who)
{
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(message);
    const char *given = soup_message_headers_get_one(headers, "Authorization");
    bool users = http->door->users.count > 0;

    if (by_token(http, given, who))
        return true;
    /* Another's token is looked at where there is one of our own, or everybody must be somebody. */
    if (given && (http->options.token || users))
        return turn_away(message, 401, "token", "the token is wrong");
    if (users ? !who->tls && !who->here : !who->here || (http->options.token && http->options.token_everywhere))
        return turn_away(message, 401, "token", "a token is needed (Authorization: Bearer TOKEN)");
    if (!(users && who->tls) && !lumi_api_host_is_local(soup_message_headers_get_one(headers, "Host")))
        return turn_away(message, 421, "host", "without a token only localhost, 127.0.0.1 and [::1] are answered to");
    if (users)
        by_session(http, message, who);
    else
        be(who, LUMI_API_LOCAL, LUMI_API_OPERATE, "this computer");
    return true;
}

/* A link on another page may lead to ours: what it gets is a file that anybody has, and the browser sends no cookie. */
static bool is_visit(SoupMessageHeaders *headers, const char *method, const char *path)
{
    return !strcmp(method, "GET") && !g_str_has_prefix(path, "/api/") &&
           !g_strcmp0(soup_message_headers_get_one(headers, "Sec-Fetch-Mode"), "navigate") &&
           !g_strcmp0(soup_message_headers_get_one(headers, "Sec-Fetch-Dest"), "document");
}

static bool is_own_page(SoupServerMessage *message, const struct lumi_api_visitor *who, const char *path,
                        enum lumi_api_role role)
{
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(message);
    const char *origin = soup_message_headers_get_one(headers, "Origin");
    const char *site = soup_message_headers_get_one(headers, "Sec-Fetch-Site");
    const char *host = soup_message_headers_get_one(headers, "Host");

    if (origin && !lumi_api_origin_is_own(origin, who->tls ? "https" : "http", host))
        return false;
    return !site || !strcmp(site, "same-origin") || !strcmp(site, "none") ||
           (role == LUMI_API_ANYBODY && is_visit(headers, soup_server_message_get_method(message), path));
}

static bool shows_csrf(SoupServerMessage *message, const struct lumi_api_visitor *who)
{
    const char *given = soup_message_headers_get_one(soup_server_message_get_request_headers(message), "X-Lumid-Csrf");
    char wanted[LUMI_SECRET_TEXT];

    lumi_session_csrf(who->secret, wanted);
    return given && lumi_secret_equal(given, wanted);
}

bool lumi_api_admit(struct lumi_http *http, SoupServerMessage *message, const char *path, enum lumi_api_role role)
{
    const char *method = soup_server_message_get_method(message);
    struct lumi_api_visitor *who = g_new0(struct lumi_api_visitor, 1);

    g_object_set_data_full(G_OBJECT(message), visitor_name, who, g_free);
    who->tls = lumi_api_is_tls(http, message);
    say_where(message, who);
    if (!is_known(http, message, who))
        return false;
    if (!is_own_page(message, who, path, role))
        return turn_away(message, 403, "origin", "requests of other sites' pages are not answered");
    if (role > LUMI_API_ANYBODY && who->role == LUMI_API_ANYBODY)
        return turn_away(message, 401, "session", "nobody is logged in here, or the session ran out: log in");
    if (role > who->role)
        return turn_away(message, 403, "role", "who watches may not do this; it wants the role operate");
    if (role > LUMI_API_ANYBODY && who->secret[0] && strcmp(method, "GET") && !shows_csrf(message, who))
        return turn_away(message, 403, "csrf", "the request does not show the session's token (X-Lumid-Csrf)");
    lumi_api_people_seen(http->door, who);
    if (who->role != LUMI_API_ANYBODY)
        lumi_api_guard_known(http->guard, message);
    return true;
}

void lumi_api_set_cookie(SoupServerMessage *message, const char *secret, int64_t seconds, bool tls)
{
    g_autofree char *text = g_strdup_printf("%s=%s; Path=/; Max-Age=%" G_GINT64_FORMAT "; HttpOnly; SameSite=Strict%s",
                                            tls ? COOKIE_TLS : COOKIE, secret, seconds, tls ? "; Secure" : "");

    soup_message_headers_replace(soup_server_message_get_response_headers(message), "Set-Cookie", text);
}

/* ---- life ---- */

static gboolean on_tick(void *context)
{
    struct lumi_api_door *door = context;
    int64_t now = lumi_api_now(door->http);
    uint64_t before = lumi_sessions_version(door->sessions);

    lumi_api_people_tick(door);
    lumi_sessions_sweep(door->sessions, now, &door->users);
    lumi_pairing_sweep(&door->pairing, now, &door->users);
    if (lumi_sessions_version(door->sessions) != before)
        lumi_api_door_swept(door);
    lumi_api_secure_tick(door);
    return G_SOURCE_CONTINUE;
}

/* For `lumi` on this computer: whoever may read the file may operate. */
static int leave_local_token(struct lumi_api_door *door, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(door->folder, "local.token", NULL);
    g_autofree char *text = NULL;

    lumi_secret_make(door->local);
    text = g_strconcat(door->local, "\n", NULL);
    return lumi_secret_write(path, text, 0640, error);
}

static void read_sessions(struct lumi_api_door *door)
{
    g_autofree char *path = g_build_filename(door->folder, "sessions", NULL);
    struct lumi_error why = {0};
    char *text = NULL;
    size_t size = 0;
    int code = lumi_secret_read(path, LUMI_SESSIONS_FILE, &text, &size, &why);

    if (code == LUMI_ERR_NOTFOUND)
        return;
    if (code == LUMI_OK)
        code = lumi_sessions_parse(door->sessions, text, size, lumi_api_now(door->http),
                                   lumi_api_unix_us(door->http) / 1000000, &why);
    if (code != LUMI_OK)
        g_warning("%s: %s: everybody has to log in again", path, why.text);
    lumi_free(text);
    lumi_sessions_sweep(door->sessions, lumi_api_now(door->http), &door->users);
    door->saved = lumi_sessions_version(door->sessions);
}

static int read_folder(struct lumi_api_door *door, struct lumi_error *error)
{
    struct lumi_error why = {0};

    door->users_file = g_build_filename(door->folder, "users", NULL);
    LUMI_TRY(lumi_users_load(door->users_file, &door->users, error));
    if (lumi_secret_folder(door->folder, &why) != LUMI_OK || leave_local_token(door, &why) != LUMI_OK) {
        door->local[0] = '\0'; /* nothing is kept there then, and who is logged in stays so until lumid ends */
        if (door->users.count)
            return lumi_fail(error, why.code, "%s", why.text);
        g_info("%s", why.text);
    }
    read_sessions(door);
    return LUMI_OK;
}

int lumi_api_door_create(struct lumi_http *http, struct lumi_api_door **door, struct lumi_error *error)
{
    struct lumi_api_door *made = *door = g_new0(struct lumi_api_door, 1);

    made->http = http;
    made->people = made->told = 1; /* who comes has seen none */
    made->folder = g_strdup(http->options.access);
    made->parties = g_ptr_array_new_with_free_func(g_free);
    made->streams = g_ptr_array_new();
    made->attempts = lumi_attempts_create();
    made->sessions = lumi_sessions_create(http->options.session_idle_ns, http->options.session_most_ns);
    LUMI_TRY(lumi_api_worker_create(http->to_server, &made->worker, error));
    if (made->folder)
        LUMI_TRY(read_folder(made, error));
    LUMI_TRY(lumi_api_secure_create(made, error));
    made->tick = lumi_api_attach(g_timeout_source_new(TICK_MS), G_PRIORITY_DEFAULT, on_tick, made);
    return LUMI_OK;
}

/* Before the letters that are under way are dropped. */
void lumi_api_door_close(struct lumi_api_door *door)
{
    if (!door)
        return;
    lumi_api_drop(&door->tick);
    lumi_api_worker_destroy(door->worker);
    door->worker = NULL;
}

void lumi_api_door_destroy(struct lumi_api_door *door)
{
    if (!door)
        return;
    lumi_api_people_finish(door);
    lumi_api_secure_destroy(door);
    if (door->local[0]) {
        g_autofree char *path = g_build_filename(door->folder, "local.token", NULL);
        unlink(path);
    }
    lumi_sessions_destroy(door->sessions);
    lumi_attempts_destroy(door->attempts);
    g_ptr_array_unref(door->parties);
    g_ptr_array_unref(door->streams);
    g_free(door->folder);
    g_free(door->users_file);
    g_free(door);
}
