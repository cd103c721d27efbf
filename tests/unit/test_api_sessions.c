/* daemon/http: guesses, phones, what ends a session, other ways in, who is there. */
#include "tests/unit/api_rig.h"

#include <sys/stat.h>

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
