/* daemon/http: server-sent events: who comes back, who does not read, who is hung up on. */
#include "tests/unit/api_fixture.h"

#include <math.h>

#define FLOOD 12000 /* events, some 7 MB: more than the sockets between hold */

static void tell(struct fixture *fixture, const char *text)
{
    struct lumi_engine_told told = {.kind = LUMI_TALE_INCIDENT, .camera = -1};

    g_strlcpy(told.text, text, sizeof told.text);
    lumi_http_told(fixture->http, &told);
}

static void tell_state(struct fixture *fixture, enum lumi_engine_state state)
{
    struct lumi_engine_told told = {.kind = LUMI_TALE_STATE, .state = state, .camera = -1};

    engine_double.status.state = state;
    g_snprintf(told.text, sizeof told.text, "now %s", lumi_engine_state_name(state));
    lumi_http_told(fixture->http, &told);
}

static int listen_from(struct fixture *fixture, const char *id, const char *until, GString **got)
{
    int fd = fixture_connect(fixture);
    g_autofree char *request = g_strdup_printf("GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n%s%s%s\r\n",
                                               id ? "Last-Event-ID: " : "", id ? id : "", id ? "\r\n" : "");

    fixture_send(fd, request, strlen(request));
    *got = fixture_receive(fd, until);
    return fd;
}

static const char *next_line(const char *at)
{
    while (*at && *at != '\n')
        at++;
    return *at ? at + 1 : NULL;
}

/* Lines that begin so. */
static int count(const char *text, const char *part)
{
    size_t size = strlen(part);
    int found = 0;

    for (const char *at = text; at; at = next_line(at))
        found += !strncmp(at, part, size);
    return found;
}

/* The id of the event with this text. */
static char *id_of(const GString *got, const char *text)
{
    const char *at = strstr(got->str, text), *id = NULL, *next = got->str;

    assert_non_null(at);
    while ((next = strstr(next, "id: ")) && next < at)
        id = next, next += 4;
    assert_non_null(id);
    return g_strndup(id + 4, strcspn(id + 4, "\n"));
}

static void who_listens_is_told_what_happens_from_then_on(void **state)
{
    GString *got;
    int fd;

    tell(*state, "before");
    fd = listen_from(*state, NULL, "event: progress", &got);
    assert_null(strstr(got->str, "before"));
    assert_non_null(strstr(got->str, "Content-Type: text/event-stream"));
    g_string_free(got, TRUE);
    tell(*state, "after");
    got = fixture_receive(fd, "after");
    assert_non_null(strstr(got->str, "event: incident"));
    g_string_free(got, TRUE);
    close(fd);
}

static void what_happened_is_told_in_a_word_too(void **state)
{
    struct lumi_engine_told told = {.kind = LUMI_TALE_INCIDENT, .camera = -1, .what = "late", .text = "it came late"};
    struct fixture *fixture = *state;
    GString *got;
    int fd = listen_from(fixture, NULL, "event: progress", &got);

    g_string_free(got, TRUE);
    lumi_http_told(fixture->http, &told);
    tell(fixture, "no word for it");
    got = fixture_receive(fd, "no word for it");
    assert_non_null(strstr(got->str, "\"what\":\"late\",\"text\":\"it came late\""));
    assert_null(strstr(got->str, "\"what\":\"\""));
    g_string_free(got, TRUE);
    close(fd);
}

static void who_comes_back_gets_what_was_missed(void **state)
{
    GString *got;
    int fd = listen_from(*state, NULL, "retry", &got);

    g_string_free(got, TRUE);
    tell(*state, "first");
    got = fixture_receive(fd, "first");
    g_autofree char *id = id_of(got, "first");
    g_string_free(got, TRUE);
    close(fd);
    turn_the_loop();
    tell(*state, "second");
    tell(*state, "third");
    fd = listen_from(*state, id, "third", &got);
    assert_non_null(strstr(got->str, "second"));
    assert_null(strstr(got->str, "first"));
    g_string_free(got, TRUE);
    close(fd);
    /* An id of another start of the program, or none at all: everything that is kept. */
    static const char *const foreign[] = {"0-1", "what", "-", "ffffffffff-1", "1-99999999999999999999"};
    for (size_t i = 0; i < sizeof foreign / sizeof foreign[0]; i++) {
        fd = listen_from(*state, foreign[i], "third", &got);
        assert_non_null(strstr(got->str, "first"));
        g_string_free(got, TRUE);
        close(fd);
    }
}

static void what_was_pushed_out_is_counted(void **state)
{
    GString *got;
    int fd = listen_from(*state, "0-0", "retry", &got);

    g_string_free(got, TRUE);
    close(fd);
    turn_the_loop();
    for (int i = 0; i < 3000; i++) {
        tell(*state, i == 2999 ? "last" : "one");
        if (i % 500 == 0)
            turn_the_loop();
    }
    turn_the_loop();
    fd = listen_from(*state, "0-0", "last", &got);
    assert_int_equal(count(got->str, "event: incident"), 2048);
    g_string_free(got, TRUE);
    close(fd);
}

/* Somebody who listens and takes nothing of a flood. */
static int listen_and_sleep(struct fixture *fixture)
{
    GString *got;
    int fd = listen_from(fixture, NULL, "event: progress", &got);
    g_autofree char *long_text = g_strnfill(500, 'x');

    g_string_free(got, TRUE);
    for (int i = 0; i < FLOOD; i++) {
        tell(fixture, long_text);
        if (i % 100 == 0)
            turn_the_loop();
    }
    return fd;
}

static void who_sleeps_costs_nothing_and_is_told_what_it_missed(void **state)
{
    struct fixture *fixture = *state;
    GString *got;
    int fd = listen_and_sleep(fixture);

    tell(fixture, "last");
    fixture_settle(fixture);
    /* What the socket's buffers held comes first, then the gap, then the newest 2048. */
    got = fixture_receive(fd, "last");
    assert_int_equal(count(got->str, "event: gap"), 1);
    assert_true(count(got->str, "event: incident") < FLOOD + 1);
    assert_true(count(got->str, "event: incident") >= 2048);
    long lost = strtol(strstr(got->str, "{\"lost\":") + 8, NULL, 10);
    assert_int_equal(count(got->str, "event: incident") + lost, FLOOD + 1);
    g_string_free(got, TRUE);
    close(fd);
}

static void start_for(struct fixture *fixture, int listeners)
{
    lumi_http_stop(fixture->http);
    fixture->options.listeners_max = listeners;
    fixture_start(fixture);
}

/* Asks until somebody's place has become free: that is noticed every half second. `seconds` go by before each time. */
static int listen_when_there_is_room(struct fixture *fixture, int seconds)
{
    GString *got;

    for (int i = 0; i < 4000; i++) {
        fixture_time += seconds * 1000000000LL;
        int fd = listen_from(fixture, NULL, "\r\n\r\n", &got);
        bool taken = strstr(got->str, "HTTP/1.1 200");

        g_string_free(got, TRUE);
        if (taken)
            return fd;
        close(fd);
        fixture_wait();
    }
    fail_msg("no place becomes free");
    return -1;
}

static void who_takes_nothing_for_a_minute_is_hung_up_on(void **state)
{
    struct fixture *fixture = *state;
    int fd;

    start_for(fixture, 1);
    fd = listen_and_sleep(fixture);
    fixture_settle(fixture);
    /* The server may still be filling the socket: a minute counts from the last that it took. */
    close(listen_when_there_is_room(fixture, 61));
    g_string_free(fixture_receive(fd, NULL), TRUE); /* ends, because it was closed */
    close(fd);
}

static void too_many_listeners_are_refused(void **state)
{
    struct fixture *fixture = *state;
    int fds[33];
    GString *got;

    start_for(fixture, 32);
    for (int i = 0; i < 32; i++) {
        fds[i] = listen_from(*state, NULL, "retry", &got);
        g_string_free(got, TRUE);
    }
    fds[32] = listen_from(*state, NULL, "already\"}", &got);
    assert_non_null(strstr(got->str, "503"));
    g_string_free(got, TRUE);
    for (int i = 0; i < 33; i++)
        close(fds[i]);
    fds[0] = listen_when_there_is_room(fixture, 0); /* places are free again */
    close(fds[0]);
}

static void two_quick_changes_of_state_are_both_shown(void **state)
{
    struct fixture *fixture = *state;
    GString *got;
    int fd = listen_from(fixture, NULL, "event: progress", &got);

    g_string_free(got, TRUE);
    tell_state(fixture, LUMI_ENGINE_HOMING); /* the main loop does not come round between the two */
    tell_state(fixture, LUMI_ENGINE_ARMING);
    got = fixture_receive(fd, "now arming");
    assert_non_null(strstr(got->str, "\"state\":\"homing\",\"text\":\"now homing\""));
    assert_non_null(strstr(got->str, "\"state\":\"arming\",\"text\":\"now arming\""));
    g_string_free(got, TRUE);
    close(fd);
}

static void progress_comes_when_something_has_changed(void **state)
{
    GString *got;
    int fd = listen_from(*state, NULL, "event: progress", &got);

    g_string_free(got, TRUE);
    engine_double.status.fired = 7;
    got = fixture_receive(fd, "\"fired\":7");
    assert_int_equal(count(got->str, "event: progress"), 1);
    g_string_free(got, TRUE);
    close(fd);
}

static void the_server_ends_while_somebody_listens(void **state)
{
    struct fixture *fixture = *state;
    GString *got;
    int fd = listen_from(fixture, NULL, "retry", &got);

    g_string_free(got, TRUE);
    lumi_http_stop(fixture->http);
    fixture->http = NULL;
    got = fixture_receive(fd, NULL);
    g_string_free(got, TRUE);
    close(fd);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, fixture_set_up, fixture_tear_down)
    const struct CMUnitTest tests[] = {
        CASE(who_listens_is_told_what_happens_from_then_on),
        CASE(what_happened_is_told_in_a_word_too),
        CASE(who_comes_back_gets_what_was_missed),
        CASE(what_was_pushed_out_is_counted),
        CASE(who_sleeps_costs_nothing_and_is_told_what_it_missed),
        CASE(who_takes_nothing_for_a_minute_is_hung_up_on),
        CASE(too_many_listeners_are_refused),
        CASE(two_quick_changes_of_state_are_both_shown),
        CASE(progress_comes_when_something_has_changed),
        CASE(the_server_ends_while_somebody_listens),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
