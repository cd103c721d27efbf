/* daemon/http: the door. Whoever is not logged in gets nothing but the login and the page's files, from every route
 * there is; roles; what other sites' pages try; guesses; phones; what ends a session. */
#include "daemon/access/users.h"
#include "daemon/http/api_priv.h"
#include "tests/unit/api_fixture.h"

#include <sys/stat.h>

#define SECOND INT64_C(1000000000)
#define PASSWORD "a good password"

static char operator_hash[LUMI_PASSWORD_HASH], watcher_hash[LUMI_PASSWORD_HASH];

struct rig {
    struct fixture fixture; /* first: it is what the fixture's functions are given */
    char folder[64];
};

/* ---- the rig, its users ---- */

static void write_users(const struct rig *rig, bool anna, bool willi)
{
    struct lumi_users users = {0};
    struct lumi_user first = {.name = "anna", .role = LUMI_ROLE_OPERATE}, second = {.name = "willi"};
    g_autofree char *path = g_build_filename(rig->folder, "users", NULL);
    struct lumi_error error;

    second.role = LUMI_ROLE_WATCH;
    strcpy(first.hash, operator_hash);
    strcpy(second.hash, watcher_hash);
    if ((anna && lumi_users_add(&users, &first, &error) != LUMI_OK) ||
        (willi && lumi_users_add(&users, &second, &error) != LUMI_OK) ||
        lumi_users_save(path, &users, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static int set_up_with(void **state, bool users)
{
    struct rig *rig = calloc(1, sizeof *rig);

    fixture_time = 1000 * SECOND;
    fixture_options(&rig->fixture);
    strcpy(rig->folder, "/tmp/lumi-access-XXXXXX");
    assert_non_null(mkdtemp(rig->folder));
    rig->fixture.options.access = rig->folder;
    rig->fixture.options.secure = "127.0.0.1:0";
    rig->fixture.options.host_name = "rig";
    rig->fixture.options.token = "the-token-of-the-rig";
    if (users)
        write_users(rig, true, true);
    fixture_start(&rig->fixture);
    *state = rig;
    return 0;
}

static int set_up(void **state)
{
    return set_up_with(state, true);
}

static int set_up_empty(void **state)
{
    return set_up_with(state, false);
}

static int tear_down(void **state)
{
    static const char *const files[] = {"users", "sessions", "rig.pem", "rig.crt", "local.token"};
    struct rig *rig = *state;
    char folder[64];

    strcpy(folder, rig->folder);
    fixture_tear_down(state);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        g_autofree char *path = g_build_filename(folder, files[i], NULL);
        unlink(path);
    }
    return rmdir(folder);
}

static int set_up_hashes(void **state)
{
    struct lumi_error error;

    (void)state;
    return lumi_password_hash(PASSWORD, operator_hash, &error) || lumi_password_hash(PASSWORD, watcher_hash, &error);
}

/* ---- asking ---- */

static void expect(struct answer answer, int status, const char *part)
{
    if (answer.status != status || (part && !strstr(answer.body, part)))
        fail_msg("%d wanted with %s, came %d: %s", status, part ? part : "anything", answer.status, answer.body);
    answer_clear(&answer);
}

/* Header lines of somebody who is logged in: the cookie alone, and with what a POST shows. */
struct login {
    char cookie[256], both[512];
};

static char *between(const char *text, const char *before, const char *after)
{
    const char *at = strstr(text, before), *end;

    if (!at || !(end = strstr(at + strlen(before), after)))
        fail_msg("no %s: %s", before, text);
    return g_strndup(at + strlen(before), (gsize)(end - at) - strlen(before));
}

static void take_login(struct answer answer, struct login *login)
{
    if (answer.status != 200)
        fail_msg("%d: %s", answer.status, answer.body);
    g_autofree char *secret = between(answer.head, "Set-Cookie: lumid=", ";");
    g_autofree char *csrf = between(answer.body, "\"csrf\":\"", "\"");
    assert_int_equal(strlen(secret), 64);
    snprintf(login->cookie, sizeof login->cookie, "Cookie: other=1; lumid=%s\r\n", secret);
    snprintf(login->both, sizeof login->both, "%sX-Lumid-Csrf: %s\r\n", login->cookie, csrf);
    answer_clear(&answer);
}

static struct answer try_login(void *state, const char *name, const char *password)
{
    g_autofree char *body = g_strdup_printf("{\"name\":\"%s\",\"password\":\"%s\"}", name, password);

    return fixture_ask(state, "POST", "/api/v1/session/login", JSON_TYPE, body);
}

static struct login log_in(void *state, const char *name)
{
    struct login login;

    take_login(try_login(state, name, PASSWORD), &login);
    return login;
}

/* The file of users is looked at every second. */
static void wait_until(void *state, const char *path, const char *head, int status)
{
    for (int i = 0; i < 400; i++) {
        struct answer answer = fixture_ask(state, "GET", path, head, NULL);
        int came = answer.status;
        answer_clear(&answer);
        if (came == status)
            return;
        for (int k = 0; k < 5; k++)
            fixture_wait();
    }
    fail_msg("%s does not come to answer %d", path, status);
}

static char *example(const struct lumi_api_route *route)
{
    g_auto(GStrv) parts = g_strsplit(route->path, "{name}", 2);

    return g_strjoinv("index.html", parts);
}

/* ---- without a session ---- */

static void without_a_session_nothing_but_the_login_is_reachable(void **state)
{
    int open = 0;

    for (int i = 0; lumi_api_routes[i].path; i++) {
        const struct lumi_api_route *route = &lumi_api_routes[i];
        bool post = !strcmp(route->method, "POST");
        g_autofree char *path = example(route);
        struct answer answer = fixture_ask(*state, route->method, path, post ? JSON_TYPE : NULL, post ? "{}" : NULL);
        if (route->role == LUMI_API_ANYBODY) {
            open++;
            assert_true(answer.status == 200 || (post && answer.status == 422));
        } else if (answer.status != 401 || !strstr(answer.body, "urn:lumid:session") ||
                   !strstr(answer.head, "WWW-Authenticate: "))
            fail_msg("%s %s answers %d to anybody: %s", route->method, path, answer.status, answer.body);
        assert_null(strstr(answer.body, "idle"));
        answer_clear(&answer);
    }
    assert_int_equal(open, 4); /* session, login, the page, its files: whoever opens another says so here */
    for (const char *const *name = lumi_api_page_files(); *name; name++) {
        g_autofree char *path = g_strconcat("/page/", *name, NULL);
        expect(fixture_ask(*state, "GET", path, NULL, NULL), 200, NULL);
    }
    assert_int_equal(engine_double.calls, 0);
    assert_int_equal(fixture_stops, 0);
}

static void what_is_not_there_is_not_told_to_strangers(void **state)
{
    static const char *const paths[] = {"/nothing",
                                        "/api/v1/nothing",
                                        "/API/v1/status",
                                        "//api/v1/status",
                                        "/api/v1/status/",
                                        "/api/v1//status",
                                        "/api/v1/./status",
                                        "/page/../api/v1/status",
                                        "/page/%2e%2e/api/v1/status",
                                        "/page/..%2fapi%2fv1%2fstatus",
                                        "/page/..%2f..%2f..%2fetc%2fpasswd",
                                        "/page/%00",
                                        "/page/index.html%00.css",
                                        "/page/.hidden",
                                        "/page//etc/passwd",
                                        "/%2fetc/passwd",
                                        "/api/v1/captures/..%2f..%2fetc",
                                        "/openapi.json"};

    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        struct answer answer = fixture_ask(*state, "GET", paths[i], NULL, NULL);
        if (answer.status != 401 && answer.status != 400 && answer.status != 404)
            fail_msg("%s: %d %s", paths[i], answer.status, answer.body);
        if (answer.status == 404) /* only of the page's files anybody may know */
            assert_true(g_str_has_prefix(paths[i], "/page/"));
        answer_clear(&answer);
    }
    expect(fixture_ask(*state, "DELETE", "/api/v1/captures", NULL, NULL), 401, NULL);
    expect(fixture_ask(*state, "OPTIONS", "/api/v1/capture/pause", "Origin: https://evil.example\r\n", NULL), 403,
           NULL);
}

static void a_cookie_that_is_none_opens_nothing(void **state)
{
    static const char *const heads[] = {
        "Cookie: lumid=\r\n",
        "Cookie: lumid=0000000000000000000000000000000000000000000000000000000000000000\r\n",
        "Cookie: __Host-lumid=0000000000000000000000000000000000000000000000000000000000000000\r\n",
        "Cookie: lumid=../../../../etc/passwd; lumid=%00\r\n",
        "Cookie: ;;;=;lumid\r\n",
        "Authorization: Bearer \r\n",
        "Authorization: Bearer 0000000000000000000000000000000000000000000000000000000000000000\r\n",
        "Authorization: Basic YW5uYTphIGdvb2QgcGFzc3dvcmQ=\r\n"};
    struct login login = log_in(*state, "anna");
    g_autofree char *cut = g_strndup(login.cookie, strlen(login.cookie) - 3);
    g_autofree char *shorter = g_strconcat(cut, "\r\n", NULL);

    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++)
        expect(fixture_ask(*state, "GET", "/api/v1/status", heads[i], NULL), 401, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", shorter, NULL), 401, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", login.cookie, NULL), 200, NULL);
}

static void before_the_first_user_this_computer_needs_no_login(void **state)
{
    expect(fixture_ask(*state, "GET", "/api/v1/session", NULL, NULL), 200,
           "{\"users\":false,\"you\":{\"id\":\"this computer\",\"name\":\"this computer\",\"role\":\"operate\",\"via\":"
           "\"local\"},\"csrf\":null,");
    expect(try_login(*state, "anna", PASSWORD), 409, "lumi user add");
    expect(fixture_ask(*state, "POST", "/api/v1/session/pair", NULL, NULL), 409, "no user yet");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", NULL, NULL), 202, NULL);
}

/* ---- roles ---- */

static void who_watches_sees_everything_and_can_stop_the_rig(void **state)
{
    struct login login = log_in(*state, "willi");

    for (int i = 0; lumi_api_routes[i].path; i++) {
        const struct lumi_api_route *route = &lumi_api_routes[i];
        g_autofree char *path = example(route);
        if (route->role != LUMI_API_OPERATE)
            continue;
        expect(fixture_ask(*state, route->method, path, login.both, NULL), 403, "urn:lumid:role");
    }
    assert_int_equal(engine_double.calls, 0);
    expect(fixture_ask(*state, "GET", "/api/v1/status", login.cookie, NULL), 200, "\"name\":\"link\"");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/emergency-stop", login.both, NULL), 202, "\"sent\":true");
    assert_int_equal(fixture_stops, 1);
    expect(fixture_ask(*state, "GET", "/api/v1/session", login.cookie, NULL), 200, "\"role\":\"watch\"");
}

/* Whatever changes something, now or some day, is for those who operate. */
static void every_post_but_these_is_for_who_operates(void **state)
{
    static const char *const others[] = {"/api/v1/session/login", "/api/v1/session/logout",
                                         "/api/v1/capture/emergency-stop", "/api/v1/plans/check", NULL};

    (void)state;
    for (int i = 0; lumi_api_routes[i].path; i++)
        if (strcmp(lumi_api_routes[i].method, "GET") && lumi_api_routes[i].role != LUMI_API_OPERATE &&
            !g_strv_contains(others, lumi_api_routes[i].path))
            fail_msg("%s is open to who watches", lumi_api_routes[i].path);
}

/* ---- other sites ---- */

static void a_post_shows_more_than_the_cookie(void **state)
{
    struct login login = log_in(*state, "anna"), other = log_in(*state, "willi");
    g_autofree char *wrong = g_strconcat(login.cookie, strchr(other.both, '\n') + 1, NULL);

    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", login.cookie, NULL), 403, "urn:lumid:csrf");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", wrong, NULL), 403, "urn:lumid:csrf");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/emergency-stop", login.cookie, NULL), 403, "urn:lumid:csrf");
    assert_true(engine_double.calls == 0 && fixture_stops == 0);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", login.both, NULL), 202, NULL);
}

static void other_sites_get_nothing_with_the_cookie(void **state)
{
    static const char *const heads[] = {"Origin: https://evil.example\r\n", "Origin: null\r\n",
                                        "Origin: http://localhost:1\r\n",   "Sec-Fetch-Site: cross-site\r\n",
                                        "Sec-Fetch-Site: same-site\r\n",    "Host: rig.evil.example\r\n"};
    struct login login = log_in(*state, "anna");

    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        g_autofree char *head = g_strconcat(heads[i], login.both, NULL);
        int status = g_str_has_prefix(heads[i], "Host") ? 421 : 403;
        expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", head, NULL), status, NULL);
        expect(fixture_ask(*state, "GET", "/api/v1/status", head, NULL), status, NULL);
        g_autofree char *in = g_strconcat(heads[i], JSON_TYPE, NULL);
        expect(fixture_ask(*state, "POST", "/api/v1/session/login", in,
                           "{\"name\":\"anna\",\"password\":\"" PASSWORD "\"}"),
               status, NULL);
    }
    assert_int_equal(engine_double.calls, 0);
}

/* A link elsewhere may lead to the page, which has no secrets; nothing else. */
static void a_link_may_lead_to_the_page(void **state)
{
    static const char visit[] =
        "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n";
    static const char frame[] = "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: iframe\r\n";

    expect(fixture_ask(*state, "GET", "/", visit, NULL), 200, NULL);
    expect(fixture_ask(*state, "GET", "/", frame, NULL), 403, NULL);
    expect(fixture_ask(*state, "GET", "/", "Sec-Fetch-Site: cross-site\r\n", NULL), 403, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/session", visit, NULL), 403, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", visit, NULL), 403, NULL);
}

static void the_cookie_is_for_this_site_and_no_script(void **state)
{
    struct answer answer = try_login(*state, "anna", PASSWORD);
    g_autofree char *cookie = between(answer.head, "Set-Cookie: ", "\r\n");

    assert_non_null(strstr(cookie, "; Path=/; Max-Age=1209600; HttpOnly; SameSite=Strict"));
    assert_null(strstr(cookie, "Domain"));
    assert_null(strstr(answer.body, between(cookie, "lumid=", ";")));
    answer_clear(&answer);
}

/* ---- bodies ---- */

static void a_login_that_is_malformed_is_refused(void **state)
{
    static const struct {
        const char *body;
        int status;
    } bad[] = {{"", 422},
               {"{", 400},
               {"[]", 422},
               {"null", 422},
               {"{\"name\":\"anna\"}", 422},
               {"{\"password\":\"" PASSWORD "\"}", 422},
               {"{\"name\":1,\"password\":2}", 422},
               {"{\"name\":\"anna\",\"password\":\"" PASSWORD "\",\"code\":\"ABCD-EFGH\"}", 422},
               {"{\"name\":\"anna\",\"password\":\"" PASSWORD "\",\"role\":\"operate\"}", 422},
               {"{\"name\":\"anna\\u0000x\",\"password\":\"" PASSWORD "\"}", 422},
               {"{\"code\":\"ABCD-EFGH\",\"name\":\"a b:c\"}", 422},
               {"\xff\xfe{}", 400}};
    g_autofree char *name = g_strnfill(70, 'n');
    g_autofree char *long_name = g_strdup_printf("{\"name\":\"%s\",\"password\":\"p\"}", name);
    g_autofree char *huge = g_strnfill((1 << 20) + 1, ' ');

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct answer answer = fixture_ask(*state, "POST", "/api/v1/session/login", JSON_TYPE, bad[i].body);
        if (answer.status != bad[i].status)
            fail_msg("%s: %d %s", bad[i].body, answer.status, answer.body);
        answer_clear(&answer);
    }
    expect(fixture_ask(*state, "POST", "/api/v1/session/login", JSON_TYPE, long_name), 422, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/session/login", JSON_TYPE, huge), 413, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/session/login", "Content-Type: text/plain\r\n", "{}"), 415, NULL);
    log_in(*state, "anna"); /* nothing of this was a guess */
}

/* ---- guesses ---- */

static void wrong_passwords_are_limited(void **state)
{
    struct login before = log_in(*state, "anna");

    for (int i = 0; i < 5; i++)
        expect(try_login(*state, i % 2 ? "anna" : "nobody", "wrong password"), 401, "urn:lumid:login");
    struct answer answer = try_login(*state, "anna", PASSWORD);
    assert_non_null(strstr(answer.head, "Retry-After: 1\r\n"));
    expect(answer, 429, "urn:lumid:limit");
    expect(fixture_ask(*state, "POST", "/api/v1/session/login", JSON_TYPE, "{\"code\":\"ABCD-EFGH\"}"), 429, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", before.cookie, NULL), 200, NULL); /* who is in stays in */
    fixture_time += SECOND;
    expect(try_login(*state, "anna", "wrong password"), 401, NULL);
    fixture_time += SECOND;
    expect(try_login(*state, "anna", PASSWORD), 429, NULL); /* twice as long now */
    fixture_time += SECOND;
    log_in(*state, "anna");
    expect(try_login(*state, "anna", "wrong password"), 401, NULL); /* and all is forgotten */
}

static void passwords_hold_up_no_stop(void **state)
{
    static const char wrong[] = "{\"name\":\"anna\",\"password\":\"wrong password\"}";
    struct login login = log_in(*state, "willi");
    int waiting[5];
    char byte;

    for (int i = 0; i < 5; i++) {
        g_autofree char *text = g_strdup_printf("POST /api/v1/session/login HTTP/1.1\r\nHost: localhost\r\n" JSON_TYPE
                                                "Content-Length: %zu\r\n\r\n%s",
                                                strlen(wrong), wrong);
        waiting[i] = fixture_connect(*state);
        fixture_send(waiting[i], text, strlen(text));
    }
    expect(fixture_ask(*state, "POST", "/api/v1/capture/emergency-stop", login.both, NULL), 202, NULL);
    assert_int_equal(recv(waiting[4], &byte, 1, 0), -1); /* nobody has answered that yet */
    for (int i = 0; i < 5; i++) {
        g_string_free(fixture_receive(waiting[i], "urn:lumid:login"), TRUE);
        close(waiting[i]);
    }
}

/* ---- phones ---- */

static char *make_code(void *state, const struct login *login, const char *body)
{
    g_autofree char *head = g_strconcat(login->both, JSON_TYPE, NULL);
    struct answer answer = fixture_ask(state, "POST", "/api/v1/session/pair", head, body);

    if (answer.status != 200)
        fail_msg("%d: %s", answer.status, answer.body);
    char *code = between(answer.body, "\"code\":\"", "\"");
    g_autofree char *url = between(answer.body, "\"url\":\"", "\"");
    assert_non_null(strstr(answer.body, "\"qr\":\"<svg "));
    assert_true(g_str_has_prefix(url, "https://127.0.0.1:"));
    assert_string_equal(strstr(url, "#code=") + 6, code);
    answer_clear(&answer);
    return code;
}

static struct answer use_code(void *state, const char *code)
{
    g_autofree char *body = g_strdup_printf("{\"code\":\"%s\"}", code);

    return fixture_ask(state, "POST", "/api/v1/session/login", JSON_TYPE, body);
}

static void a_code_lets_one_phone_in_once(void **state)
{
    struct login login = log_in(*state, "anna"), phone;
    g_autofree char *code = make_code(*state, &login, "{\"role\":\"watch\"}");

    take_login(use_code(*state, code), &phone);
    expect(use_code(*state, code), 401, "urn:lumid:login");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", phone.both, NULL), 403, "urn:lumid:role");
    expect(fixture_ask(*state, "POST", "/api/v1/session/pair", phone.both, NULL), 403, "urn:lumid:role");
    expect(fixture_ask(*state, "GET", "/api/v1/session", phone.cookie, NULL), 200, "\"via\":\"pair\"");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/emergency-stop", phone.both, NULL), 202, NULL);
}

static void a_code_runs_out(void **state)
{
    struct login login = log_in(*state, "anna"), phone;
    g_autofree char *code = make_code(*state, &login, "{}");
    g_autofree char *typed = g_ascii_strdown(code, -1);

    fixture_time += 299 * SECOND;
    typed[4] = ' ';
    take_login(use_code(*state, typed), &phone); /* as people type it */
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", phone.both, NULL), 202, NULL);
    g_free(code);
    code = make_code(*state, &login, "{}");
    fixture_time += 300 * SECOND;
    expect(use_code(*state, code), 401, NULL);
    expect(use_code(*state, "ABCD-EFG1"), 401, NULL);
}

/* ---- the end ---- */

static void a_session_runs_out(void **state)
{
    struct login idle = log_in(*state, "anna"), busy = log_in(*state, "anna");

    for (int day = 0; day < 13; day++) {
        fixture_time += 23 * 3600 * SECOND;
        expect(fixture_ask(*state, "GET", "/api/v1/status", busy.cookie, NULL), 200, NULL);
    }
    expect(fixture_ask(*state, "GET", "/api/v1/status", idle.cookie, NULL), 401, "urn:lumid:session");
    fixture_time += 23 * 3600 * SECOND;
    expect(fixture_ask(*state, "GET", "/api/v1/status", busy.cookie, NULL), 200, NULL);
    fixture_time += 23 * 3600 * SECOND; /* used or not: two weeks */
    expect(fixture_ask(*state, "GET", "/api/v1/status", busy.cookie, NULL), 401, "urn:lumid:session");
    expect(fixture_ask(*state, "GET", "/api/v1/session", busy.cookie, NULL), 200, "\"you\":null,\"csrf\":null");
}

static int listen_to_events(void *state, const struct login *login)
{
    g_autofree char *text = g_strdup_printf("GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n%s\r\n", login->cookie);
    int fd = fixture_connect(state);

    fixture_send(fd, text, strlen(text));
    g_string_free(fixture_receive(fd, "event: people"), TRUE);
    return fd;
}

static void who_logs_out_is_out(void **state)
{
    struct login login = log_in(*state, "anna"), other = log_in(*state, "anna");
    int stream = listen_to_events(*state, &login);
    struct answer answer = fixture_ask(*state, "POST", "/api/v1/session/logout", login.both, NULL);

    assert_non_null(strstr(answer.head, "Set-Cookie: lumid=; Path=/; Max-Age=0;"));
    expect(answer, 200, "\"you\":null");
    expect(fixture_ask(*state, "GET", "/api/v1/status", login.cookie, NULL), 401, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", other.cookie, NULL), 200, NULL);
    g_string_free(fixture_receive(stream, NULL), TRUE); /* ends */
    close(stream);
}

static void who_is_no_user_any_more_is_out_at_once(void **state)
{
    struct login anna = log_in(*state, "anna"), willi = log_in(*state, "willi"), phone;
    g_autofree char *code = make_code(*state, &anna, "{}");
    int stream;

    take_login(use_code(*state, code), &phone);
    stream = listen_to_events(*state, &phone);
    write_users(*state, false, true);
    wait_until(*state, "/api/v1/status", anna.cookie, 401);
    expect(fixture_ask(*state, "GET", "/api/v1/status", phone.cookie, NULL), 401, NULL); /* she had let it in */
    g_string_free(fixture_receive(stream, NULL), TRUE);
    close(stream);
    expect(fixture_ask(*state, "GET", "/api/v1/status", willi.cookie, NULL), 200, NULL);
}

static void another_password_ends_what_began_with_the_last(void **state)
{
    struct login anna = log_in(*state, "anna");
    char before[LUMI_PASSWORD_HASH];
    struct lumi_error error;

    strcpy(before, operator_hash);
    assert_int_equal(lumi_password_hash("another password", operator_hash, &error), LUMI_OK);
    write_users(*state, true, true);
    wait_until(*state, "/api/v1/status", anna.cookie, 401);
    expect(try_login(*state, "anna", PASSWORD), 401, NULL);
    expect(try_login(*state, "anna", "another password"), 200, NULL);
    strcpy(operator_hash, before);
}

static void a_file_of_users_that_is_broken_opens_nothing(void **state)
{
    struct rig *rig = *state;
    g_autofree char *path = g_build_filename(rig->folder, "users", NULL);
    struct login anna = log_in(*state, "anna");
    FILE *file = fopen(path, "w");

    fputs("anna:operate\n", file);
    fclose(file);
    for (int i = 0; i < 450; i++) /* it has been looked at */
        fixture_wait();
    expect(fixture_ask(*state, "GET", "/api/v1/status", NULL, NULL), 401, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", anna.cookie, NULL), 200, NULL);
}

static void sessions_outlast_lumid_and_hashes_alone_are_kept(void **state)
{
    struct rig *rig = *state;
    struct login anna = log_in(*state, "anna");
    g_autofree char *path = g_build_filename(rig->folder, "sessions", NULL);
    g_autofree char *secret = between(anna.cookie, "lumid=", "\r");
    g_autofree char *text = NULL;
    struct stat is;

    lumi_http_stop(rig->fixture.http);
    assert_true(g_file_get_contents(path, &text, NULL, NULL));
    assert_null(strstr(text, secret));
    assert_int_equal(stat(path, &is), 0);
    assert_int_equal(is.st_mode & 0777, 0600);
    fixture_start(&rig->fixture);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", anna.both, NULL), 202, NULL);
}

/* ---- other ways in ---- */

static void what_lumid_leaves_for_its_own_computer_lets_lumi_in(void **state)
{
    struct rig *rig = *state;
    g_autofree char *path = g_build_filename(rig->folder, "local.token", NULL);
    g_autofree char *first = NULL, *second = NULL;
    struct stat is;

    assert_true(g_file_get_contents(path, &first, NULL, NULL));
    g_autofree char *head = g_strdup_printf("Authorization: Bearer %.64s\r\n", first);
    assert_int_equal(stat(path, &is), 0);
    assert_int_equal(is.st_mode & 0777, 0640);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", head, NULL), 202, NULL);
    lumi_http_stop(rig->fixture.http);
    assert_int_equal(stat(path, &is), -1);
    fixture_start(&rig->fixture);
    assert_true(g_file_get_contents(path, &second, NULL, NULL));
    assert_string_not_equal(first, second);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", head, NULL), 401, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Authorization: Bearer the-token-of-the-rig\r\n", NULL),
           202, NULL); /* and so does the token of old */
}

/* ---- who is there ---- */

static void people_see_each_other_and_may_send_one_away(void **state)
{
    struct login anna = log_in(*state, "anna"), willi = log_in(*state, "willi");
    int stream = listen_to_events(*state, &willi);
    struct answer answer = fixture_ask(*state, "GET", "/api/v1/session/people", anna.cookie, NULL);

    assert_non_null(strstr(answer.body, "\"name\":\"anna\",\"role\":\"operate\",\"address\":\"127.0.0.1\""));
    assert_non_null(strstr(answer.body, "\"streams\":0,\"you\":true}"));
    assert_non_null(strstr(answer.body, "\"streams\":1,\"you\":false}"));
    g_autofree char *before = between(answer.body, "", "\",\"name\":\"willi\"");
    const char *id = strrchr(before, '"') + 1;
    g_autofree char *body = g_strdup_printf("{\"id\":\"%s\"}", id);
    g_autofree char *head = g_strconcat(anna.both, JSON_TYPE, NULL);
    g_autofree char *by_willi = g_strconcat(willi.both, JSON_TYPE, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/session/revoke", by_willi, body), 403, NULL);
    answer_clear(&answer);
    answer = fixture_ask(*state, "POST", "/api/v1/session/revoke", head, body);
    assert_null(strstr(answer.body, "willi"));
    expect(answer, 200, "anna");
    expect(fixture_ask(*state, "POST", "/api/v1/session/revoke", head, body), 404, NULL);
    g_string_free(fixture_receive(stream, NULL), TRUE);
    close(stream);
    expect(fixture_ask(*state, "GET", "/api/v1/status", willi.cookie, NULL), 401, NULL);
}

static void who_comes_is_told_to_who_listens(void **state)
{
    struct login anna = log_in(*state, "anna");
    int stream = listen_to_events(*state, &anna);

    log_in(*state, "willi");
    g_string_free(fixture_receive(stream, "willi"), TRUE);
    close(stream);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(without_a_session_nothing_but_the_login_is_reachable),
        CASE(what_is_not_there_is_not_told_to_strangers),
        CASE(a_cookie_that_is_none_opens_nothing),
        cmocka_unit_test_setup_teardown(before_the_first_user_this_computer_needs_no_login, set_up_empty, tear_down),
        CASE(who_watches_sees_everything_and_can_stop_the_rig),
        CASE(every_post_but_these_is_for_who_operates),
        CASE(a_post_shows_more_than_the_cookie),
        CASE(other_sites_get_nothing_with_the_cookie),
        CASE(a_link_may_lead_to_the_page),
        CASE(the_cookie_is_for_this_site_and_no_script),
        CASE(a_login_that_is_malformed_is_refused),
        CASE(wrong_passwords_are_limited),
        CASE(passwords_hold_up_no_stop),
        CASE(a_code_lets_one_phone_in_once),
        CASE(a_code_runs_out),
        CASE(a_session_runs_out),
        CASE(who_logs_out_is_out),
        CASE(who_is_no_user_any_more_is_out_at_once),
        CASE(another_password_ends_what_began_with_the_last),
        CASE(a_file_of_users_that_is_broken_opens_nothing),
        CASE(sessions_outlast_lumid_and_hashes_alone_are_kept),
        CASE(what_lumid_leaves_for_its_own_computer_lets_lumi_in),
        CASE(people_see_each_other_and_may_send_one_away),
        CASE(who_comes_is_told_to_who_listens),
    };

    return cmocka_run_group_tests(tests, set_up_hashes, NULL);
}
