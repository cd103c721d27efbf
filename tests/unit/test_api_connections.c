/* daemon/http: connections: how many there may be, how long one may say nothing, and that listening goes on when the
 * program has run out of descriptors. */
#include "tests/unit/api_fixture.h"

#include <sys/resource.h>

#define SECOND 1000000000LL
#define ALL 8
#define PEER 5

static int set_up(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);

    fixture_time = 0;
    fixture_options(fixture);
    fixture->options.connections_max = ALL;
    fixture->options.connections_peer = PEER;
    fixture_start(fixture);
    *state = fixture;
    return 0;
}

/* As one of 127.0.0.N. */
static int connect_as(const struct fixture *fixture, int n)
{
    struct sockaddr_in address = {.sin_family = AF_INET};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK + (uint32_t)n - 1);
    assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof address), 0);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons((uint16_t)lumi_http_port(fixture->http));
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    fcntl(fd, F_SETFL, O_NONBLOCK);
    turn_the_loop();
    return fd;
}

static void ask_on(int fd, const char *path)
{
    g_autofree char *text = g_strdup_printf("GET %s HTTP/1.1\r\nHost: localhost\r\n\r\n", path);

    fixture_send(fd, text, strlen(text));
}

static void expect_answer(int fd, int status)
{
    g_autofree char *wanted = g_strdup_printf("HTTP/1.1 %d ", status);
    GString *got = fixture_receive(fd, "}");

    if (!g_str_has_prefix(got->str, wanted))
        fail_msg("%d wanted, came: %s", status, got->str);
    g_string_free(got, TRUE);
}

static void expect_refusal(int fd)
{
    struct answer answer = answer_of(fixture_receive(fd, NULL)); /* and the connection is closed */

    assert_int_equal(answer.status, 503);
    assert_non_null(strstr(answer.head, "Content-Type: application/problem+json\r\n"));
    assert_non_null(strstr(answer.body, "\"type\":\"urn:lumid:limit\""));
    answer_clear(&answer);
}

/* Closed by the server, which said nothing more. */
static void expect_end(int fd)
{
    GString *got = fixture_receive(fd, NULL);

    assert_int_equal(got->len, 0);
    g_string_free(got, TRUE);
}

static void close_all(int *fds, int count)
{
    for (int i = 0; i < count; i++)
        close(fds[i]);
}

static void one_peer_has_a_share_of_the_connections(void **state)
{
    int fds[PEER + 2];

    for (int i = 0; i <= PEER; i++)
        fds[i] = connect_as(*state, 2);
    expect_refusal(fds[PEER]);
    ask_on(fds[0], "/api/v1/capture"); /* those that are there are served */
    expect_answer(fds[0], 200);
    fds[PEER + 1] = connect_as(*state, 3); /* and so are others */
    ask_on(fds[PEER + 1], "/api/v1/capture");
    expect_answer(fds[PEER + 1], 200);
    close_all(fds, PEER + 2);
}

static void all_connections_are_bounded_and_a_closed_one_makes_room(void **state)
{
    int fds[ALL + 1], again;

    for (int i = 0; i < ALL; i++) {
        fds[i] = connect_as(*state, 2 + i);
        ask_on(fds[i], "/api/v1/capture");
        expect_answer(fds[i], 200);
    }
    fds[ALL] = connect_as(*state, 2 + ALL);
    expect_refusal(fds[ALL]);
    close(fds[3]);
    turn_the_loop();
    again = connect_as(*state, 2);
    ask_on(again, "/api/v1/capture");
    expect_answer(again, 200);
    close(again);
    for (int i = 0; i <= ALL; i++)
        if (i != 3)
            close(fds[i]);
}

static void who_never_was_let_in_gives_way_to_who_comes(void **state)
{
    int fds[ALL + 3];

    for (int i = 0; i < ALL; i++)
        fds[i] = connect_as(*state, 2 + i);
    for (int i = 1; i < ALL; i++) { /* the first has asked nothing; the second what nobody may */
        fixture_send(fds[i], i == 1 ? "GET /api/v1/capture HTTP/1.1\r\nHost: evil.example\r\n\r\n" : "",
                     i == 1 ? strlen("GET /api/v1/capture HTTP/1.1\r\nHost: evil.example\r\n\r\n") : 0);
        if (i > 1)
            ask_on(fds[i], "/api/v1/capture");
        expect_answer(fds[i], i == 1 ? 421 : 200);
    }
    for (int i = ALL; i < ALL + 2; i++) {
        fds[i] = connect_as(*state, 2 + i);
        ask_on(fds[i], "/api/v1/capture");
        expect_answer(fds[i], 200);
        expect_end(fds[i - ALL]);
    }
    fds[ALL + 2] = connect_as(*state, 2 + ALL + 2);
    expect_refusal(fds[ALL + 2]);
    for (int i = 0; i < ALL + 3; i++)
        close(fds[i]);
}

static void who_was_answered_and_has_left_makes_room(void **state)
{
    for (int i = 0; i < 4 * PEER; i++) { /* a script that asks often, a connection each time */
        int fd = connect_as(*state, 2);
        ask_on(fd, "/api/v1/capture");
        expect_answer(fd, 200);
        close(fd);
    }
}

static void who_says_nothing_is_hung_up_on(void **state)
{
    static const char part[] = "GET /api/v1/capture HTTP/1.1\r\nHost: loc";
    int idle = connect_as(*state, 2), slow = connect_as(*state, 2), kept = connect_as(*state, 2), late;

    fixture_send(slow, part, strlen(part));
    fixture_settle(*state);
    fixture_time += 20 * SECOND;
    ask_on(kept, "/api/v1/capture");
    expect_answer(kept, 200);
    fixture_send(slow, "a", 1); /* a byte now and then does not help */
    late = connect_as(*state, 2);
    fixture_settle(*state);
    fixture_time += 20 * SECOND;
    expect_end(idle);
    g_string_free(fixture_receive(slow, NULL), TRUE); /* ends */
    ask_on(kept, "/api/v1/capture");
    expect_answer(kept, 200);
    ask_on(late, "/api/v1/capture");
    expect_answer(late, 200);
    fixture_time += 31 * SECOND; /* between two requests it is the same */
    expect_end(kept);
    expect_end(late);
    close_all((int[]){idle, slow, kept, late}, 4);
}

static void who_listens_to_events_may_be_silent(void **state)
{
    struct fixture *fixture = *state;
    struct lumi_engine_told told = {.kind = LUMI_TALE_INCIDENT, .camera = -1, .text = "an hour later"};
    int listener = connect_as(fixture, 2), idle = connect_as(fixture, 2);

    ask_on(listener, "/api/v1/events");
    g_string_free(fixture_receive(listener, "event: progress"), TRUE);
    fixture_settle(fixture);
    fixture_time += 3600 * SECOND;
    expect_end(idle); /* what was to be looked at has been looked at */
    lumi_http_told(fixture->http, &told);
    g_string_free(fixture_receive(listener, "an hour later"), TRUE);
    close_all((int[]){listener, idle}, 2);
}

/* Accepting fails, and libsoup does not try again. */
static void listening_goes_on_after_the_descriptors_had_run_out(void **state)
{
    struct fixture *fixture = *state;
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)lumi_http_port(fixture->http))};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    struct rlimit old, none;

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &old), 0);
    none = old;
    int lowest = fcntl(fd, F_DUPFD, 0);
    close(lowest);
    none.rlim_cur = (rlim_t)lowest;
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &none), 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    fcntl(fd, F_SETFL, O_NONBLOCK);
    for (int i = 0; i < 20; i++)
        fixture_wait();
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &old), 0);
    ask_on(fd, "/api/v1/capture");
    expect_answer(fd, 200);
    close(fd);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, fixture_tear_down)
    const struct CMUnitTest tests[] = {
        CASE(one_peer_has_a_share_of_the_connections),
        CASE(all_connections_are_bounded_and_a_closed_one_makes_room),
        CASE(who_never_was_let_in_gives_way_to_who_comes),
        CASE(who_was_answered_and_has_left_makes_room),
        CASE(who_says_nothing_is_hung_up_on),
        CASE(who_listens_to_events_may_be_silent),
        CASE(listening_goes_on_after_the_descriptors_had_run_out),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
