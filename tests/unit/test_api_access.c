/* daemon/http: the door. Whoever is not logged in gets nothing but the login and the page's files, from every route
 * there is; roles; what other sites' pages try; bodies that are no login. */
#include "tests/unit/api_rig.h"

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
    g_autofree char *secret = between(cookie, "lumid=", ";");
    assert_null(strstr(answer.body, secret));
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
    };

    return cmocka_run_group_tests(tests, set_up_hashes, NULL);
}
