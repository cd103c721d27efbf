/* A server over the engine's double, and a client that is a bare socket in the engine's thread: no waiting but for
 * bytes. */
#ifndef LUMI_TESTS_UNIT_API_FIXTURE_H
#define LUMI_TESTS_UNIT_API_FIXTURE_H

#include "daemon/http/api_server.h"
#include "tests/unit/engine_double.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <errno.h>
#include <fcntl.h>
#include <json-glib/json-glib.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static _Atomic int64_t fixture_time;
static _Atomic int fixture_stops; /* that have gone to the board */

static int64_t fixture_now(void *context)
{
    (void)context;
    return fixture_time;
}

static inline bool fixture_stop(void *context)
{
    (void)context;
    fixture_stops++;
    return true;
}

struct fixture {
    struct lumi_http_options options;
    struct lumi_http *http;
};

static inline void fixture_options(struct fixture *fixture)
{
    engine_double_reset();
    lumi_http_options_init(&fixture->options);
    fixture->options.listen = "127.0.0.1:0";
    fixture->options.engine = engine_double_engine();
    fixture->options.handover = engine_double_handover();
    fixture->options.ingest = engine_double_ingest();
    fixture->options.now_ns = fixture_now;
    fixture->options.emergency_stop = fixture_stop;
    fixture_stops = 0;
}

static inline void fixture_start(struct fixture *fixture)
{
    struct lumi_error error;
    int code = lumi_http_start(&fixture->options, &fixture->http, &error);

    if (code != LUMI_OK)
        fail_msg("%s", error.text);
}

static inline void turn_the_loop(void)
{
    while (g_main_context_iteration(NULL, FALSE))
        continue;
}

/* As CMocka's set-up and tear-down. */
static inline int fixture_set_up(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);

    fixture_time = 0;
    fixture_options(fixture);
    fixture_start(fixture);
    *state = fixture;
    return 0;
}

static inline int fixture_tear_down(void **state)
{
    struct fixture *fixture = *state;

    lumi_http_stop(fixture->http);
    turn_the_loop();
    free(fixture);
    return 0;
}

static inline int fixture_connect(const struct fixture *fixture)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)lumi_http_port(fixture->http))};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &(int){65536}, sizeof(int)); /* so that a server waits for who is slow */
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    fcntl(fd, F_SETFL, O_NONBLOCK);
    return fd;
}

/* A turn of the main loop that waits for something to happen, but not for ever. */
static inline gboolean fixture_tick(void *context)
{
    (void)context;
    return G_SOURCE_CONTINUE;
}

static inline void fixture_wait(void)
{
    guint tick = g_timeout_add(5, fixture_tick, NULL);

    g_main_context_iteration(NULL, TRUE);
    g_source_remove(tick);
}

static inline void fixture_send(int fd, const char *text, size_t size)
{
    for (int idle = 0; size && idle < 4000;) {
        ssize_t sent = send(fd, text, size, MSG_NOSIGNAL);
        if (sent > 0) {
            text += sent;
            size -= (size_t)sent;
        } else if (errno == EAGAIN) {
            fixture_wait();
            idle++;
        } else
            return; /* the other side has closed: its answer is read next */
    }
}

/* What comes until the other side closes, or until `until` has been seen. */
static inline GString *fixture_receive(int fd, const char *until)
{
    GString *got = g_string_new(NULL);
    char block[65536];

    for (int idle = 0; idle < 4000;) {
        size_t seen = until && got->len > strlen(until) ? got->len - strlen(until) : 0;
        ssize_t size = recv(fd, block, sizeof block, 0);
        if (size > 0)
            g_string_append_len(got, block, size);
        else if (size == 0 || errno != EAGAIN)
            return got;
        if (until && size > 0 && strstr(got->str + seen, until))
            return got;
        if (size < 0) {
            fixture_wait();
            idle++;
        }
    }
    fail_msg("no answer; so far: %s", got->str);
    return got;
}

struct answer {
    int status;
    char *head, *body;
};

static inline void answer_clear(struct answer *answer)
{
    g_free(answer->head);
    g_free(answer->body);
    memset(answer, 0, sizeof *answer);
}

static inline struct answer answer_of(GString *got)
{
    struct answer answer = {0};
    const char *end = strstr(got->str, "\r\n\r\n");

    assert_non_null(end);
    assert_int_equal(sscanf(got->str, "HTTP/1.1 %d", &answer.status), 1);
    answer.head = g_strndup(got->str, (gsize)(end + 2 - got->str));
    answer.body = g_strdup(end + 4);
    g_string_free(got, TRUE);
    return answer;
}

/* `head`: lines that end with \r\n, in place of the Host line where they begin with one. */
static inline struct answer fixture_ask(const struct fixture *fixture, const char *method, const char *path,
                                        const char *head, const char *body)
{
    int fd = fixture_connect(fixture);
    g_autofree char *text =
        g_strdup_printf("%s %s HTTP/1.1\r\n%s%sConnection: close\r\nContent-Length: %zu\r\n\r\n%s", method, path,
                        head && g_str_has_prefix(head, "Host:") ? "" : "Host: localhost\r\n", head ? head : "",
                        body ? strlen(body) : 0, body ? body : "");
    struct answer answer;

    fixture_send(fd, text, strlen(text));
    answer = answer_of(fixture_receive(fd, NULL));
    close(fd);
    return answer;
}

/* The server has done all that was given to it before: connections are accepted and letters read in their order. */
static inline void fixture_settle(const struct fixture *fixture)
{
    struct answer answer = fixture_ask(fixture, "GET", "/api/v1/capture", NULL, NULL);

    assert_int_equal(answer.status, 200);
    answer_clear(&answer);
}

#define JSON_TYPE "Content-Type: application/json\r\n"

#endif
