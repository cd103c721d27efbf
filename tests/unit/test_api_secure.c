/* daemon/http: the listener with TLS: when it is open, whom it answers, and who does not finish what they begin. */
#include "daemon/access/certificate.h"
#include "daemon/access/users.h"
#include "tests/unit/api_fixture.h"

#include <gio/gio.h>
#include <sys/stat.h>

#define SECOND INT64_C(1000000000)
#define PASSWORD "a good password"

static char hash[LUMI_PASSWORD_HASH];
static char folder[64];

static void write_users(bool some)
{
    struct lumi_users users = {.count = some};
    g_autofree char *path = g_build_filename(folder, "users", NULL);
    struct lumi_error error;

    strcpy(users.user[0].name, "anna");
    strcpy(users.user[0].hash, hash);
    users.user[0].role = LUMI_ROLE_OPERATE;
    if (lumi_users_save(path, &users, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static int set_up(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);
    struct lumi_error error;

    if (!hash[0])
        assert_int_equal(lumi_password_hash(PASSWORD, hash, &error), LUMI_OK);
    fixture_time = 0;
    fixture_options(fixture);
    strcpy(folder, "/tmp/lumi-secure-XXXXXX");
    assert_non_null(mkdtemp(folder));
    fixture->options.access = folder;
    fixture->options.secure = "127.0.0.1:0";
    fixture->options.host_name = "rig";
    fixture->options.connections_max = 8;
    fixture->options.connections_peer = 5;
    write_users(true);
    fixture_start(fixture);
    *state = fixture;
    return 0;
}

static int tear_down(void **state)
{
    static const char *const files[] = {"users", "sessions", "rig.pem", "rig.crt"};

    fixture_tear_down(state);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        g_autofree char *path = g_build_filename(folder, files[i], NULL);
        unlink(path);
    }
    return rmdir(folder);
}

static char *between(const char *text, const char *before, const char *after)
{
    const char *at = strstr(text, before), *end;

    if (!at || !(end = strstr(at + strlen(before), after)))
        fail_msg("no %s: %s", before, text);
    return g_strndup(at + strlen(before), (gsize)(end - at) - strlen(before));
}

/* By the token that lumid leaves for its own computer. 0: it does not listen. */
static int secure_port(void *state)
{
    g_autofree char *path = g_build_filename(folder, "local.token", NULL);
    g_autofree char *token = NULL;
    int port = 0;

    assert_true(g_file_get_contents(path, &token, NULL, NULL));
    g_autofree char *head = g_strdup_printf("Authorization: Bearer %.64s\r\n", token);
    struct answer answer = fixture_ask(state, "GET", "/api/v1/session", head, NULL);
    const char *url = strstr(answer.body, "https://127.0.0.1:");
    if (url)
        sscanf(url, "https://127.0.0.1:%d/", &port);
    answer_clear(&answer);
    return port;
}

/* ---- a client; the server is in a thread of its own, and none of what is asked here asks the engine ---- */

static gboolean on_certificate(GTlsConnection *connection, GTlsCertificate *certificate, GTlsCertificateFlags flags,
                               void *context)
{
    char *fingerprint = context;
    g_autofree char *text = NULL;

    (void)connection;
    (void)flags;
    g_object_get(certificate, "certificate-pem", &text, NULL);
    if (fingerprint)
        lumi_certificate_fingerprint(text, strlen(text), fingerprint, NULL);
    return TRUE;
}

static GIOStream *connect_to(int port, char *fingerprint)
{
    g_autoptr(GSocketClient) client = g_socket_client_new();
    g_autoptr(GError) error = NULL;
    GSocketConnection *plain = g_socket_client_connect_to_host(client, "127.0.0.1", (guint16)port, NULL, &error);

    if (!plain)
        return NULL;
    GIOStream *stream = g_tls_client_connection_new(G_IO_STREAM(plain), NULL, &error);
    g_object_unref(plain);
    g_signal_connect(stream, "accept-certificate", G_CALLBACK(on_certificate), fingerprint);
    if (!g_tls_connection_handshake(G_TLS_CONNECTION(stream), NULL, &error))
        g_clear_object(&stream);
    return stream;
}

static GString *receive(GIOStream *stream, const char *until)
{
    GString *got = g_string_new(NULL);
    char block[4096];
    gssize size;

    while ((size = g_input_stream_read(g_io_stream_get_input_stream(stream), block, sizeof block, NULL, NULL)) > 0) {
        g_string_append_len(got, block, size);
        if (until && strstr(got->str, until))
            break;
    }
    return got;
}

static void say(GIOStream *stream, const char *method, const char *path, const char *head, const char *body)
{
    g_autofree char *text = g_strdup_printf("%s %s HTTP/1.1\r\nHost: rig.local:8471\r\n%sContent-Length: %zu\r\n\r\n%s",
                                            method, path, head ? head : "", body ? strlen(body) : 0, body ? body : "");

    g_output_stream_write_all(g_io_stream_get_output_stream(stream), text, strlen(text), NULL, NULL, NULL);
}

static struct answer ask(int port, const char *method, const char *path, const char *head, const char *body)
{
    g_autoptr(GIOStream) stream = connect_to(port, NULL);
    g_autofree char *closing = g_strconcat("Connection: close\r\n", head, NULL);

    assert_non_null(stream);
    say(stream, method, path, closing, body);
    return answer_of(receive(stream, NULL));
}

static void expect(struct answer answer, int status, const char *part)
{
    if (answer.status != status || (part && !strstr(answer.body, part)))
        fail_msg("%d wanted with %s, came %d: %s", status, part ? part : "anything", answer.status, answer.body);
    answer_clear(&answer);
}

struct login {
    char *secret, *csrf;
};

static struct login log_in(int port)
{
    struct answer answer =
        ask(port, "POST", "/api/v1/session/login", JSON_TYPE, "{\"name\":\"anna\",\"password\":\"" PASSWORD "\"}");
    struct login login;

    if (answer.status != 200)
        fail_msg("%d: %s", answer.status, answer.body);
    assert_non_null(strstr(answer.head, "; Path=/; Max-Age=1209600; HttpOnly; SameSite=Strict; Secure\r\n"));
    login.secret = between(answer.head, "Set-Cookie: __Host-lumid=", ";");
    login.csrf = between(answer.body, "\"csrf\":\"", "\"");
    answer_clear(&answer);
    return login;
}

static void forget(struct login *login)
{
    g_free(login->secret);
    g_free(login->csrf);
}

/* ---- the tests ---- */

static void others_are_answered_from_the_first_user_to_the_last(void **state)
{
    char first[LUMI_FINGERPRINT], again[LUMI_FINGERPRINT];
    int port = secure_port(*state);
    GIOStream *stream = connect_to(port, first);

    assert_non_null(stream);
    g_object_unref(stream);
    write_users(false);
    for (int i = 0; i < 2000 && secure_port(*state); i++)
        fixture_wait();
    assert_null(connect_to(port, NULL));
    write_users(true);
    for (int i = 0; i < 2000 && !(port = secure_port(*state)); i++)
        fixture_wait();
    stream = connect_to(port, again);
    assert_non_null(stream);
    g_object_unref(stream);
    assert_string_equal(first, again); /* phones know it by this */
}

/* A full disk, a folder that went away: whoever was made a user must be one, and who is none stays outside. */
static void there_are_users_even_where_no_certificate_can_be_made(void **state)
{
    g_autofree char *path = g_build_filename(folder, "rig.pem", NULL);
    int status = 0;

    write_users(false);
    for (int i = 0; i < 2000 && secure_port(*state); i++)
        fixture_wait();
    assert_int_equal(unlink(path), 0);
    assert_int_equal(mkdir(path, 0700), 0); /* no file can take its place */
    write_users(true);
    for (int i = 0; i < 2000 && status != 401; i++) {
        struct answer answer = fixture_ask(*state, "GET", "/api/v1/session/people", NULL, NULL);
        status = answer.status;
        answer_clear(&answer);
        fixture_wait();
    }
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(status, 401);
}

static void over_tls_nobody_is_let_in_without_a_session(void **state)
{
    static const char *const closed[] = {"/api/v1/status", "/api/v1/events", "/metrics", "/openapi.json", "/nothing"};
    int port = secure_port(*state);

    for (size_t i = 0; i < sizeof closed / sizeof closed[0]; i++)
        expect(ask(port, "GET", closed[i], NULL, NULL), 401, "urn:lumid:session");
    expect(ask(port, "POST", "/api/v1/capture/emergency-stop", NULL, NULL), 401, NULL);
    expect(ask(port, "GET", "/", NULL, NULL), 200, NULL);
    expect(ask(port, "GET", "/api/v1/session", NULL, NULL), 200, "{\"users\":true,\"you\":null");
    assert_int_equal(fixture_stops, 0);
}

static void over_tls_the_cookie_is_this_hosts_alone(void **state)
{
    int port = secure_port(*state);
    struct login login = log_in(port);
    g_autofree char *own = g_strdup_printf("Cookie: __Host-lumid=%s\r\nX-Lumid-Csrf: %s\r\n", login.secret, login.csrf);
    g_autofree char *plain = g_strdup_printf("Cookie: lumid=%s\r\nX-Lumid-Csrf: %s\r\n", login.secret, login.csrf);
    g_autofree char *from_http = g_strconcat("Origin: http://rig.local:8471\r\n", own, NULL);
    g_autofree char *from_https = g_strconcat("Origin: https://rig.local:8471\r\n", own, NULL);

    expect(ask(port, "POST", "/api/v1/capture/emergency-stop", plain, NULL), 401, NULL);
    expect(ask(port, "POST", "/api/v1/capture/emergency-stop", from_http, NULL), 403, "urn:lumid:origin");
    assert_int_equal(fixture_stops, 0);
    expect(ask(port, "POST", "/api/v1/capture/emergency-stop", own, NULL), 202, NULL);
    expect(ask(port, "POST", "/api/v1/capture/emergency-stop", from_https, NULL), 202, NULL);
    assert_int_equal(fixture_stops, 2);
    forget(&login);
}

static void a_body_that_is_too_large_is_refused_over_tls_as_well(void **state)
{
    g_autofree char *huge = g_strnfill((1 << 20) + 1, ' ');

    expect(ask(secure_port(*state), "POST", "/api/v1/session/login", JSON_TYPE, huge), 413, NULL);
}

static void who_is_not_logged_in_has_no_room_for_more_than_a_login(void **state)
{
    int port = secure_port(*state);
    struct login login = log_in(port);
    g_autofree char *head =
        g_strdup_printf(JSON_TYPE "Cookie: __Host-lumid=%s\r\nX-Lumid-Csrf: %s\r\n", login.secret, login.csrf);
    g_autofree char *large = g_strnfill(5000, ' ');

    expect(ask(port, "POST", "/api/v1/session/revoke", JSON_TYPE, large), 413, "before somebody is logged in");
    expect(ask(port, "POST", "/api/v1/session/revoke", head, large), 400, NULL); /* it was read */
    forget(&login);
}

static void a_stream_over_tls_ends_with_its_session(void **state)
{
    int port = secure_port(*state);
    struct login login = log_in(port);
    g_autofree char *head =
        g_strdup_printf("Cookie: __Host-lumid=%s\r\nX-Lumid-Csrf: %s\r\n", login.secret, login.csrf);
    g_autoptr(GIOStream) stream = connect_to(port, NULL);

    say(stream, "GET", "/api/v1/events", head, NULL);
    for (int i = 0; i < 200; i++) /* the engine is asked before the first event */
        fixture_wait();
    g_string_free(receive(stream, "event: people"), TRUE);
    expect(ask(port, "GET", "/api/v1/session/people", head, NULL), 200, "\"streams\":1,\"you\":true");
    expect(ask(port, "POST", "/api/v1/session/logout", head, NULL), 200, NULL);
    g_string_free(receive(stream, NULL), TRUE); /* ends */
    forget(&login);
}

static int connect_plainly(int port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    return fd;
}

static void who_begins_tls_and_does_not_go_on_is_hung_up_on(void **state)
{
    int port = secure_port(*state), silent = connect_plainly(port), half = connect_plainly(port);
    static const char hello[] = {0x16, 0x03, 0x01, 0x02, 0x00, 0x01, 0x00, 0x01};
    static const char http[] = "GET /api/v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n";
    int wrong = connect_plainly(port);
    char byte[256];

    assert_int_equal(send(half, hello, sizeof hello, MSG_NOSIGNAL), sizeof hello);
    assert_int_equal(send(wrong, http, strlen(http), MSG_NOSIGNAL), strlen(http));
    ssize_t got = recv(wrong, byte, sizeof byte, 0); /* an alert at most */
    assert_true(got < 64 && (got <= 0 || byte[0] == 0x15));
    expect(ask(port, "GET", "/api/v1/session", NULL, NULL), 200, NULL); /* they hold nobody up */
    fixture_time += 31 * SECOND;
    while ((got = recv(silent, byte, sizeof byte, 0)) > 0)
        continue;
    while ((got = recv(half, byte, sizeof byte, 0)) > 0)
        continue;
    close(silent);
    close(half);
    close(wrong);
}

static void connections_that_wait_for_tls_are_counted(void **state)
{
    int port = secure_port(*state), fds[6];
    char byte;

    for (int i = 0; i < 6; i++)
        fds[i] = connect_plainly(port);
    assert_true(recv(fds[5], &byte, 1, 0) <= 0); /* the share of one address is used up */
    for (int i = 0; i < 6; i++)
        close(fds[i]);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(others_are_answered_from_the_first_user_to_the_last),
        CASE(there_are_users_even_where_no_certificate_can_be_made),
        CASE(over_tls_nobody_is_let_in_without_a_session),
        CASE(over_tls_the_cookie_is_this_hosts_alone),
        CASE(a_body_that_is_too_large_is_refused_over_tls_as_well),
        CASE(who_is_not_logged_in_has_no_room_for_more_than_a_login),
        CASE(a_stream_over_tls_ends_with_its_session),
        CASE(who_begins_tls_and_does_not_go_on_is_hung_up_on),
        CASE(connections_that_wait_for_tls_are_counted),
    };

    if (!g_tls_backend_supports_tls(g_tls_backend_get_default()))
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
