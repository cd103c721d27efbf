/* The API's server: what is asked for, and life. */
#include "daemon/http/api_priv.h"

#include <signal.h>
#include <string.h>

#define BODY_MAX (1 << 20)
#define CONNECTIONS_MAX 512
#define CONNECTIONS_PEER 64
#define LISTENERS_MAX 256
#define SESSION_IDLE_NS (24 * 3600 * INT64_C(1000000000))
#define SESSION_MOST_NS (14 * 86400 * INT64_C(1000000000))

void lumi_http_options_init(struct lumi_http_options *options)
{
    memset(options, 0, sizeof *options);
    options->listen = "localhost:8470";
    options->body_max = BODY_MAX;
    options->connections_max = CONNECTIONS_MAX;
    options->connections_peer = CONNECTIONS_PEER;
    options->listeners_max = LISTENERS_MAX;
    options->session_idle_ns = SESSION_IDLE_NS;
    options->session_most_ns = SESSION_MOST_NS;
}

/* When the headers are here and nothing of the body is. */
static void on_early(SoupServer *server, SoupServerMessage *message, const char *path, GHashTable *query, void *context)
{
    struct lumi_http *http = context;
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(message);
    goffset length = soup_message_headers_get_content_length(headers);
    size_t most = length > 0 ? lumi_api_body_most(http, message) : 0;
    g_autofree char *text = NULL;

    (void)server;
    (void)path;
    (void)query;
    if (soup_message_headers_get_encoding(headers) == SOUP_ENCODING_CHUNKED)
        lumi_api_refuse_early(http, message, 411, "length", "a body must say how long it is (Content-Length)");
    else if (length > 0 && (size_t)length > most) {
        text = g_strdup_printf("a body of %" G_GOFFSET_FORMAT " bytes; %zu are the most%s", length, most,
                               most < http->options.body_max ? " before somebody is logged in" : "");
        lumi_api_refuse_early(http, message, 413, "limit", text);
    }
}

/* ---- what is asked for ---- */

static void answer_no_method(SoupServerMessage *message, const char *path)
{
    g_autoptr(GString) allowed = g_string_new(NULL);

    char part[LUMI_API_STRING_MAX + 1];
    for (int i = 0; lumi_api_routes[i].path; i++)
        if (lumi_api_path_match(lumi_api_routes[i].path, path, part))
            g_string_append_printf(allowed, "%s%s", allowed->len ? ", " : "", lumi_api_routes[i].method);
    g_autofree char *detail = g_strdup_printf("here: %s", allowed->str);
    soup_message_headers_replace(soup_server_message_get_response_headers(message), "Allow", allowed->str);
    lumi_api_send_problem(message, 405, "method", detail);
}

/* A request on its way to the engine and back. */
struct call {
    struct lumi_api_letter letter;
    struct lumi_http *http;
    const struct lumi_api_route *route;
    struct lumi_api_body body;
    struct lumi_api_answer answer;
    SoupServerMessage *message; /* the server's thread alone looks into it */
    bool gone;                  /* who asked has hung up */
};

static void on_finished(SoupServerMessage *message, void *context)
{
    (void)message;
    ((struct call *)context)->gone = true;
}

static void end_call(struct call *call)
{
    g_signal_handlers_disconnect_by_data(call->message, call);
    g_object_unref(call->message);
    g_free(call->answer.text);
    lumi_api_body_clear(&call->body);
    g_free(call);
}

/* In the server's thread. */
static void come_back(struct lumi_api_letter *letter, bool dropped)
{
    struct call *call = (struct call *)letter;

    if (!dropped && !call->gone) {
        soup_server_message_unpause(call->message); /* first: who serves may want it to wait */
        if (call->route->serve && !call->answer.status)
            call->route->serve(call->http, call->message, &call->body);
        else
            lumi_api_send(call->message, &call->answer);
    }
    end_call(call);
}

/* In the engine's. A dropped one is seen when the server's thread has ended. */
static void go_there(struct lumi_api_letter *letter, bool dropped)
{
    struct call *call = (struct call *)letter;

    if (dropped) {
        end_call(call);
        return;
    }
    call->route->call(call->http, &call->answer, &call->body);
    letter->read = come_back;
    lumi_api_post_give(call->http->to_server, letter);
}

/* Takes over the body. */
static void ask_engine(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_route *route,
                       struct lumi_api_body *body)
{
    struct call *made = g_new0(struct call, 1);

    *made = (struct call){.letter.read = go_there, .http = http, .route = route, .body = *body};
    *body = (struct lumi_api_body){0};
    made->message = g_object_ref(message);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), made);
    soup_server_message_pause(message);
    lumi_api_post_give(http->to_engine, &made->letter);
}

static int read_body(SoupServerMessage *message, const struct lumi_api_route *route, struct lumi_api_body *body,
                     struct lumi_api_answer *answer)
{
    const char *type = soup_message_headers_get_content_type(soup_server_message_get_request_headers(message), NULL);
    GBytes *bytes = soup_message_body_flatten(soup_server_message_get_request_body(message));
    struct lumi_error error;
    size_t size;
    const char *text = g_bytes_get_data(bytes, &size);
    int code = LUMI_ERR_ARG;

    if (!strcmp(route->method, "GET")) {
        const char *query = g_uri_get_query(soup_server_message_get_uri(message));
        if ((code = lumi_api_query_parse(query, route->fields, body, &error)) != LUMI_OK)
            lumi_api_problem_of(answer, code, error.text);
    } else if (size && g_strcmp0(type, "application/json"))
        lumi_api_problem(answer, 415, "type", "a body must be JSON (Content-Type: application/json)");
    else if ((code = lumi_api_body_parse(text, size, route->fields, body, &error)) != LUMI_OK)
        lumi_api_problem_of(answer, code, error.text);
    g_bytes_unref(bytes);
    return code;
}

static void call(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_route *route,
                 const char *part)
{
    struct lumi_api_body body = {0};
    struct lumi_api_answer answer = {0};

    g_strlcpy(body.part, part, sizeof body.part);
    if (route->fields && read_body(message, route, &body, &answer) != LUMI_OK)
        lumi_api_send(message, &answer);
    else if (route->call)
        ask_engine(http, message, route, &body);
    else
        route->serve(http, message, &body);
    lumi_api_body_clear(&body);
}

static void on_request(SoupServer *server, SoupServerMessage *message, const char *path, GHashTable *query,
                       void *context)
{
    struct lumi_http *http = context;
    const struct lumi_api_route *route = NULL;
    char part[LUMI_API_STRING_MAX + 1];
    bool known = false;

    (void)server;
    (void)query;
    lumi_api_harden(message);
    for (int i = 0; lumi_api_routes[i].path && !route; i++) {
        if (!lumi_api_path_match(lumi_api_routes[i].path, path, part))
            continue;
        known = true;
        if (!strcmp(lumi_api_routes[i].method, soup_server_message_get_method(message)))
            route = &lumi_api_routes[i];
    }
    /* What there is, too, is told to those only who may see it. */
    if (!lumi_api_admit(http, message, path, route ? route->role : LUMI_API_WATCH))
        return;
    if (route)
        call(http, message, route, part);
    else if (known)
        answer_no_method(message, path);
    else
        lumi_api_send_problem(message, 404, "path", "there is nothing here; /openapi.json says what there is");
}

/* ---- life ---- */

static int load_certificate(struct lumi_http *http, struct lumi_error *error)
{
    const char *certificate = http->options.certificate;
    const char *key = http->options.key ? http->options.key : certificate;
    g_autoptr(GError) failed = NULL;

    if (!certificate)
        return http->options.key ? lumi_fail(error, LUMI_ERR_ARG, "HTTP: a key without a certificate") : LUMI_OK;
    if (!g_tls_backend_supports_tls(g_tls_backend_get_default()))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "HTTP: no TLS on this computer: install glib-networking");
    g_autoptr(GTlsCertificate) loaded = g_tls_certificate_new_from_files(certificate, key, &failed);
    if (!loaded)
        return lumi_fail(error, LUMI_ERR_FORMAT, "HTTP: certificate %s, key %s: %s", certificate, key, failed->message);
    soup_server_set_tls_certificate(http->server, loaded);
    http->https = true;
    return LUMI_OK;
}

static int listen_at(struct lumi_http *http, struct lumi_error *error)
{
    SoupServerListenOptions how = http->https ? SOUP_SERVER_LISTEN_HTTPS : 0;
    struct lumi_api_listen listen;
    g_autoptr(GError) failed = NULL;
    bool good;

    LUMI_TRY(lumi_api_listen_parse(http->options.listen, &listen, error));
    if (!listen.loopback && !http->options.token)
        return lumi_fail(error, LUMI_ERR_ARG, "listen on '%s': others can reach this address, so a token is needed",
                         http->options.listen);
    if (!strcmp(listen.host, "localhost"))
        good = soup_server_listen_local(http->server, (guint)listen.port, how, &failed);
    else if (!strcmp(listen.host, "*"))
        good = soup_server_listen_all(http->server, (guint)listen.port, how, &failed);
    else {
        g_autoptr(GSocketAddress) address = g_inet_socket_address_new_from_string(listen.host, (guint)listen.port);
        good = soup_server_listen(http->server, address, how, &failed);
    }
    if (!good)
        return lumi_fail(error,
                         g_error_matches(failed, G_IO_ERROR, G_IO_ERROR_ADDRESS_IN_USE) ? LUMI_ERR_BUSY : LUMI_ERR_IO,
                         "listen on '%s': %s", http->options.listen, failed->message);
    GSList *uris = soup_server_get_uris(http->server);
    if (uris)
        http->port = g_uri_get_port(uris->data);
    g_slist_free_full(uris, (GDestroyNotify)g_uri_unref);
    return LUMI_OK;
}

static void copy_options(struct lumi_http *http, const struct lumi_http_options *options)
{
    http->options = *options;
    http->options.listen = g_strdup(options->listen);
    http->options.token = options->token && *options->token ? g_strdup(options->token) : NULL;
    http->options.certificate = g_strdup(options->certificate);
    http->options.key = g_strdup(options->key);
    http->options.access = g_strdup(options->access);
    http->options.secure = g_strdup(options->secure);
    http->options.host_name = g_strdup(options->host_name);
    http->options.folder = g_strdup(options->folder);
    http->options.second_copy = g_strdup(options->second_copy);
    http->options.preview = g_strdup(options->preview);
}

/* ---- the thread ---- */

static void *serve(void *context)
{
    struct lumi_http *http = context;

    g_main_context_push_thread_default(http->context);
    g_main_loop_run(http->loop);
    g_main_context_pop_thread_default(http->context);
    return NULL;
}

/* Signals are for the program's own threads. */
static int start_thread(struct lumi_http *http, struct lumi_error *error)
{
    sigset_t all, before;
    int failed;

    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    failed = pthread_create(&http->thread, NULL, serve, http);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    http->running = !failed;
    return failed ? lumi_fail(error, LUMI_ERR_NOMEM, "HTTP: no thread could be started") : LUMI_OK;
}

struct last_letter {
    struct lumi_api_letter letter;
    struct lumi_http *http;
};

static void end_loop(struct lumi_api_letter *letter, bool dropped)
{
    struct lumi_http *http = ((struct last_letter *)letter)->http;

    if (!dropped)
        g_main_loop_quit(http->loop);
    g_free(letter);
}

static void end_thread(struct lumi_http *http)
{
    struct last_letter *last = g_new0(struct last_letter, 1);

    last->letter.read = end_loop;
    last->http = http;
    lumi_api_post_give(http->to_server, &last->letter);
    pthread_join(http->thread, NULL);
}

/* What is made here is of the server's thread. */
static int make_server(struct lumi_http *made, struct lumi_error *error)
{
    int code;

    g_main_context_push_thread_default(made->context);
    made->server = soup_server_new("server-header", "lumid", "raw-paths", TRUE, NULL);
    LUMI_GOTO(code, out, load_certificate(made, error));
    LUMI_GOTO(code, out, lumi_api_post_create(NULL, &made->to_engine, error));
    LUMI_GOTO(code, out, lumi_api_post_create(made->context, &made->to_server, error));
    LUMI_GOTO(code, out, lumi_api_worker_create(made->to_server, &made->worker, error));
    LUMI_GOTO(code, out, lumi_api_events_create(made, &made->events, error));
    made->live = lumi_api_live_create(made);
    made->pictures = lumi_api_pictures_create(made);
    LUMI_GOTO(code, out, lumi_api_field_create(made, &made->field, error));
    LUMI_GOTO(code, out, lumi_api_shelf_create(made, &made->shelf, error));
    made->guard = lumi_api_guard_create(made);
    soup_server_add_early_handler(made->server, NULL, on_early, made, NULL);
    soup_server_add_handler(made->server, NULL, on_request, made, NULL);
    LUMI_GOTO(code, out, lumi_api_door_create(made, &made->door, error));
    LUMI_GOTO(code, out, listen_at(made, error));
    lumi_api_guard_listeners(made->guard);
out:
    g_main_context_pop_thread_default(made->context);
    return code;
}

int lumi_http_start(const struct lumi_http_options *options, struct lumi_http **http, struct lumi_error *error)
{
    struct lumi_http *made = g_new0(struct lumi_http, 1);

    copy_options(made, options);
    made->status = g_new0(struct lumi_engine_status, 1);
    made->refusals = g_ptr_array_new();
    made->context = g_main_context_new();
    made->loop = g_main_loop_new(made->context, FALSE);
    int code = make_server(made, error);
    if (code == LUMI_OK)
        code = start_thread(made, error);
    if (code == LUMI_OK)
        *http = made;
    else
        lumi_http_stop(made);
    return code;
}

void lumi_http_stop(struct lumi_http *http)
{
    if (!http)
        return;
    lumi_api_pictures_silence(http->pictures);
    if (http->running)
        end_thread(http);
    g_main_context_push_thread_default(http->context);
    lumi_api_worker_destroy(http->worker);
    lumi_api_shelf_close(http->shelf);
    lumi_api_door_close(http->door);
    lumi_api_post_destroy(http->to_engine);
    lumi_api_post_destroy(http->to_server);
    lumi_api_live_destroy(http->live);
    lumi_api_pictures_destroy(http->pictures);
    lumi_api_shelf_destroy(http->shelf);
    lumi_api_field_destroy(http->field);
    lumi_api_events_destroy(http->events);
    lumi_api_door_destroy(http->door);
    lumi_api_guard_destroy(http->guard);
    lumi_api_refuse_finish(http);
    soup_server_disconnect(http->server);
    g_object_unref(http->server);
    while (g_main_context_iteration(http->context, FALSE))
        continue;
    g_main_context_pop_thread_default(http->context);
    g_main_loop_unref(http->loop);
    g_main_context_unref(http->context);
    g_ptr_array_unref(http->refusals);
    g_free(http->status);
    g_free((char *)http->options.listen);
    g_free((char *)http->options.token);
    g_free((char *)http->options.certificate);
    g_free((char *)http->options.key);
    g_free((char *)http->options.access);
    g_free((char *)http->options.secure);
    g_free((char *)http->options.host_name);
    g_free((char *)http->options.folder);
    g_free((char *)http->options.second_copy);
    g_free((char *)http->options.preview);
    g_free(http);
}

int lumi_http_port(const struct lumi_http *http)
{
    return http->port;
}

void lumi_http_told(struct lumi_http *http, const struct lumi_engine_told *told)
{
    if (http)
        lumi_api_events_told(http->events, told);
}

void lumi_http_processing(struct lumi_http *http, const struct lumi_process_status *status)
{
    if (http)
        lumi_api_events_processing(http->events, status);
}

void lumi_http_ingest(struct lumi_http *http, const struct lumi_ingest_status *status)
{
    if (http)
        lumi_api_events_ingest(http->events, status);
}
