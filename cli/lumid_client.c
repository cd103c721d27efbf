/* lumid, as the commands reach it. */
#include "cli/lumid_client.h"

#include "cli/access_files.h"

#include <errno.h>
#include <libsoup/soup.h>
#include <string.h>

#define DEFAULT_ADDRESS "localhost:8470"
#define ANSWER_SECONDS 30

char *cli_lumid_address, *cli_lumid_token_file, *cli_lumid_ca;

struct cli_lumid {
    SoupSession *session, *stream; /* the stream's has no end to its waits */
    char *url, *token;
    char *local; /* the file that this computer's lumid left its token in; NULL: there is none, or another was given */
};

struct settings {
    char *address, *token, *token_file, *ca;
    char *here; /* where this computer's lumid listens */
};

/* ---- where it is ---- */

static void take_default(char **value, char *found)
{
    if (!*value && found && *found)
        *value = g_steal_pointer(&found);
    g_free(found);
}

static void read_user_config(struct settings *settings)
{
    g_autofree char *path = g_build_filename(g_get_user_config_dir(), "lumisphere", "lumi.conf", NULL);
    g_autoptr(GKeyFile) file = g_key_file_new();

    if (!g_key_file_load_from_file(file, path, G_KEY_FILE_NONE, NULL))
        return;
    take_default(&settings->address, g_key_file_get_string(file, "lumid", "address", NULL));
    take_default(&settings->token_file, g_key_file_get_string(file, "lumid", "token_file", NULL));
    take_default(&settings->ca, g_key_file_get_string(file, "lumid", "ca", NULL));
}

/* What this computer's lumid is told to listen on: "*" and 0.0.0.0 are reached at localhost. Its token file only where
 * it can be read: on this computer none is needed. */
static void read_system_config(struct settings *settings)
{
    g_autoptr(GKeyFile) file = g_key_file_new();
    g_autofree char *listen = NULL, *certificate = NULL;

    if (!g_key_file_load_from_file(file, CLI_SYSTEM_CONFIG, G_KEY_FILE_NONE, NULL))
        return;
    listen = g_key_file_get_string(file, "http", "listen", NULL);
    certificate = g_key_file_get_string(file, "http", "certificate", NULL);
    if (listen && *listen) {
        const char *port = strrchr(listen, ':');
        bool all =
            g_str_has_prefix(listen, "*:") || g_str_has_prefix(listen, "0.0.0.0:") || g_str_has_prefix(listen, "[::]:");
        settings->here = g_strdup_printf("%s://%s%s", certificate && *certificate ? "https" : "http",
                                         all ? "localhost" : listen, all && port ? port : "");
    }
    if (settings->address)
        return;
    settings->address = g_strdup(settings->here);
    if (certificate && *certificate && !settings->ca)
        settings->ca = g_steal_pointer(&certificate);
}

static void gather(struct settings *settings)
{
    settings->address = g_strdup(cli_lumid_address);
    settings->token_file = g_strdup(cli_lumid_token_file);
    settings->ca = g_strdup(cli_lumid_ca);
    settings->token = settings->token_file ? NULL : g_strdup(g_getenv("LUMID_TOKEN"));
    take_default(&settings->address, g_strdup(g_getenv("LUMID_ADDRESS")));
    take_default(&settings->ca, g_strdup(g_getenv("LUMID_CA")));
    read_user_config(settings);
    read_system_config(settings);
}

/* "rig", "rig:8471", "https://rig:8471/" → "https://rig:8471" */
static int make_url(const char *address, char **url, struct lumi_error *error)
{
    bool scheme = strstr(address, "://") != NULL;
    g_autofree char *whole = g_strconcat(scheme ? "" : "http://", address, NULL);
    g_autoptr(GUri) uri = g_uri_parse(whole, G_URI_FLAGS_NONE, NULL);

    if (!uri || !g_uri_get_host(uri) || !*g_uri_get_host(uri) ||
        (strcmp(g_uri_get_scheme(uri), "http") && strcmp(g_uri_get_scheme(uri), "https")) ||
        strlen(g_uri_get_path(uri)) > 1)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "lumid at '%s': HOST, HOST:PORT, http://HOST:PORT or https://HOST:PORT wanted", address);
    g_autofree char *host =
        strchr(g_uri_get_host(uri), ':') ? g_strdup_printf("[%s]", g_uri_get_host(uri)) : g_strdup(g_uri_get_host(uri));
    *url = g_strdup_printf("%s://%s:%d", g_uri_get_scheme(uri), host,
                           g_uri_get_port(uri) > 0 ? g_uri_get_port(uri) : 8470);
    return LUMI_OK;
}

static int read_token(const char *path, char **token, struct lumi_error *error)
{
    g_autoptr(GError) failed = NULL;

    if (!g_file_get_contents(path, token, NULL, &failed))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "token: %s", failed->message);
    (*token)[strcspn(*token, "\r\n")] = '\0';
    g_strstrip(*token);
    return LUMI_OK;
}

/* What this computer's lumid leaves for those who may use it: nobody else's is shown it. */
static void take_local_token(const struct settings *settings, struct cli_lumid *lumid)
{
    g_autofree char *url = NULL, *path = NULL;
    struct lumi_error error;

    if (make_url(settings->here ? settings->here : DEFAULT_ADDRESS, &url, &error) != LUMI_OK ||
        strcmp(url, lumid->url) != 0)
        return;
    path = cli_access_path("local.token");
    if (read_token(path, &lumid->token, &error) != LUMI_OK && !g_file_test(path, G_FILE_TEST_IS_REGULAR))
        return;
    lumid->local = g_steal_pointer(&path);
}

static int make_sessions(struct cli_lumid *lumid, const char *ca, struct lumi_error *error)
{
    g_autoptr(GTlsDatabase) database = NULL;
    g_autoptr(GError) failed = NULL;

    if (ca) {
        g_autofree char *path = g_canonicalize_filename(ca, NULL);
        database = g_tls_file_database_new(path, &failed);
        if (!database)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no certificates: %s", ca, failed->message);
    }
    lumid->session = soup_session_new_with_options("timeout", ANSWER_SECONDS, "user-agent", "lumi", NULL);
    lumid->stream = soup_session_new_with_options("timeout", 0, "user-agent", "lumi", NULL);
    if (database) {
        soup_session_set_tls_database(lumid->session, database);
        soup_session_set_tls_database(lumid->stream, database);
    }
    return LUMI_OK;
}

int cli_lumid_open(struct cli_lumid **lumid, struct lumi_error *error)
{
    struct cli_lumid *made = g_new0(struct cli_lumid, 1);
    struct settings settings = {0};
    int code;

    gather(&settings);
    LUMI_GOTO(code, out, make_url(settings.address ? settings.address : DEFAULT_ADDRESS, &made->url, error));
    made->token = g_strdup(settings.token);
    if (!made->token && settings.token_file)
        LUMI_GOTO(code, out, read_token(settings.token_file, &made->token, error));
    if (!made->token)
        take_local_token(&settings, made);
    LUMI_GOTO(code, out, make_sessions(made, g_str_has_prefix(made->url, "https") ? settings.ca : NULL, error));
    *lumid = g_steal_pointer(&made);
out:
    cli_lumid_close(made);
    g_free(settings.address);
    g_free(settings.token);
    g_free(settings.token_file);
    g_free(settings.ca);
    g_free(settings.here);
    return code;
}

void cli_lumid_close(struct cli_lumid *lumid)
{
    if (!lumid)
        return;
    g_clear_object(&lumid->session);
    g_clear_object(&lumid->stream);
    g_free(lumid->url);
    g_free(lumid->token);
    g_free(lumid->local);
    g_free(lumid);
}

const char *cli_lumid_url(const struct cli_lumid *lumid)
{
    return lumid->url;
}

/* ---- questions and answers ---- */

static SoupMessage *make_message(const struct cli_lumid *lumid, const char *method, const char *path)
{
    g_autofree char *url = g_strconcat(lumid->url, path, NULL);
    SoupMessage *message = soup_message_new(method, url);

    if (message && lumid->token) {
        g_autofree char *bearer = g_strconcat("Bearer ", lumid->token, NULL);
        soup_message_headers_replace(soup_message_get_request_headers(message), "Authorization", bearer);
    }
    return message;
}

static int no_answer(const struct cli_lumid *lumid, const GError *failed, struct lumi_error *error)
{
    if (g_error_matches(failed, G_IO_ERROR, G_IO_ERROR_CONNECTION_REFUSED))
        return lumi_fail(error, LUMI_ERR_IO, "no lumid at %s: is it running? (systemctl status lumid)", lumid->url);
    if (failed->domain == G_TLS_ERROR)
        return lumi_fail(error, LUMI_ERR_IO, "%s: %s (--ca names the certificate to trust)", lumid->url,
                         failed->message);
    return lumi_fail(error, LUMI_ERR_IO, "no answer from lumid at %s: %s", lumid->url, failed->message);
}

static int nobody(const struct cli_lumid *lumid, struct lumi_error *error)
{
    if (lumid->local)
        return lumi_fail(error, LUMI_ERR_ARG, "%s cannot be read: be root, or in the group of that file", lumid->local);
    return lumi_fail(error, LUMI_ERR_ARG,
                     "lumid at %s: a token is needed: --token-file names the file that it is in (on its own computer "
                     "local.token in the folder [http] access)",
                     lumid->url);
}

static int ask(struct cli_lumid *lumid, SoupMessage *message, JsonNode **root, char **text, struct lumi_error *error)
{
    g_autoptr(GError) failed = NULL;
    g_autoptr(GBytes) bytes = soup_session_send_and_read(lumid->session, message, NULL, &failed);
    unsigned status = soup_message_get_status(message);
    JsonNode *node;
    int code = LUMI_OK;

    if (!bytes)
        return no_answer(lumid, failed, error);
    node = cli_answer_parse(g_bytes_get_data(bytes, NULL), (gssize)g_bytes_get_size(bytes));
    if (status == 401 && !lumid->token)
        code = nobody(lumid, error);
    else if (status < 200 || status > 299 || !node)
        code = cli_answer_problem(lumid->url, status, node, error);
    else if (text)
        *text = g_strndup(g_bytes_get_data(bytes, NULL), g_bytes_get_size(bytes));
    if (code == LUMI_OK && root)
        *root = node;
    else if (node)
        json_node_unref(node);
    return code;
}

int cli_lumid_get(struct cli_lumid *lumid, const char *path, JsonNode **root, char **text, struct lumi_error *error)
{
    g_autoptr(SoupMessage) message = make_message(lumid, "GET", path);

    return ask(lumid, message, root, text, error);
}

int cli_lumid_post(struct cli_lumid *lumid, const char *path, JsonBuilder *body, JsonNode **root, char **text,
                   struct lumi_error *error)
{
    g_autoptr(SoupMessage) message = make_message(lumid, "POST", path);

    if (body) {
        JsonNode *node = json_builder_get_root(body);
        char *json = json_to_string(node, FALSE);
        g_autoptr(GBytes) bytes = g_bytes_new_take(json, strlen(json));
        json_node_unref(node);
        soup_message_set_request_body_from_bytes(message, "application/json", bytes);
    }
    return ask(lumid, message, root, text, error);
}

/* ---- events ---- */

/* Until it breaks or enough is read. *talked: events came. */
static int listen_once(struct cli_lumid *lumid, struct cli_event_reader *reading, bool *talked,
                       struct lumi_error *error)
{
    g_autoptr(SoupMessage) message = make_message(lumid, "GET", "/api/v1/events");
    g_autoptr(GError) failed = NULL;
    unsigned status;

    *talked = false;
    if (reading->id)
        soup_message_headers_replace(soup_message_get_request_headers(message), "Last-Event-ID", reading->id);
    g_autoptr(GInputStream) stream = soup_session_send(lumid->stream, message, NULL, &failed);
    if (!stream)
        return no_answer(lumid, failed, error);
    g_autoptr(GDataInputStream) lines = g_data_input_stream_new(stream);
    status = soup_message_get_status(message);
    if (status != 200) {
        char text[4096];
        gsize size = 0;
        g_input_stream_read_all(G_INPUT_STREAM(lines), text, sizeof text, &size, NULL, NULL);
        JsonNode *root = cli_answer_parse(text, (gssize)size);
        int code =
            status == 401 && !lumid->token ? nobody(lumid, error) : cli_answer_problem(lumid->url, status, root, error);
        if (root)
            json_node_unref(root);
        return code;
    }
    while (reading->more) {
        g_autofree char *line = g_data_input_stream_read_line(lines, NULL, NULL, &failed);
        if (!line)
            return lumi_fail(error, LUMI_ERR_IO, "lumid at %s has hung up%s%s", lumid->url, failed ? ": " : "",
                             failed ? failed->message : "");
        *talked = true;
        cli_event_line(reading, line);
    }
    return LUMI_OK;
}

int cli_lumid_events(struct cli_lumid *lumid, double patience, cli_lumid_event_fn event, void *context,
                     struct lumi_error *error)
{
    struct cli_event_reader reading = {.event = event, .context = context, .data = g_string_new(NULL), .more = true};
    int64_t since = g_get_monotonic_time();
    bool ever = false;
    int code;

    for (;;) {
        bool talked;
        code = listen_once(lumid, &reading, &talked, error);
        if (talked) {
            since = g_get_monotonic_time();
            ever = true;
        }
        if (code != LUMI_ERR_IO || !ever || (double)(g_get_monotonic_time() - since) > patience * 1e6)
            break;
        cli_event_begin(&reading);
        g_usleep(500000);
    }
    g_free(reading.id);
    g_string_free(reading.data, TRUE);
    return code;
}
