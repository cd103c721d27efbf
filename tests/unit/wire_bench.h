/* One board and one host for the tests of a program, and messages put on the board's link by hand. */
#ifndef LUMI_TESTS_UNIT_WIRE_BENCH_H
#define LUMI_TESTS_UNIT_WIRE_BENCH_H

#include "wire_pair.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static struct pair_board board;
static struct pair_host host;

static inline int start(void **state)
{
    (void)state;
    pair_board_start(&board, 0xb007);
    pair_host_start(&host, 0x1234);
    return 0;
}

static inline int open_session(void **state)
{
    start(state);
    lumi_wire_client_poll(&host.client, PAIR_MS);
    pair_carry(&host, &board, 0, PAIR_MS);
    return host.client.state == LUMI_WIRE_CLIENT_OPEN ? 0 : -1;
}

#define FRESH(test) cmocka_unit_test_setup(test, start)
#define OPEN(test) cmocka_unit_test_setup(test, open_session)

static inline int request(struct pair_host *from, uint64_t now_ns)
{
    lumi_wire_Request message = {.which_command = lumi_wire_Request_jog_tag};

    message.command.jog.turns = 0.25;
    return lumi_wire_client_request(&from->client, &message, now_ns, NULL);
}

/* The payload goes to the board as it is, in a frame. */
static inline void put(int link, const void *payload, size_t size, uint64_t now_ns)
{
    uint8_t frame[LUMI_WIRE_FRAME_MAX];

    lumi_wire_server_receive(&board.server, link, frame, lumi_wire_frame(payload, size, frame), now_ns);
}

static inline void put_message(int link, const lumi_wire_HostFrame *message, uint64_t now_ns)
{
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];
    size_t size = lumi_wire_encode_host(message, payload, sizeof payload);

    assert_true(size > 0);
    put(link, payload, size, now_ns);
}

/* The last message that the board sent over `link`; the queue is then empty. */
static inline lumi_wire_BoardFrame last_sent(int link)
{
    struct lumi_wire_deframer deframer;
    lumi_wire_BoardFrame message = {0};

    lumi_wire_deframer_init(&deframer);
    for (size_t i = 0; i < board.out[link].size; i++)
        if (lumi_wire_deframe(&deframer, board.out[link].data[i]))
            assert_true(lumi_wire_decode_board(deframer.data, deframer.size, &message));
    board.out[link].size = 0;
    return message;
}

static inline void say_hello(uint64_t number, uint64_t now_ns)
{
    lumi_wire_HostFrame message = {.which_body = lumi_wire_HostFrame_hello_tag};

    message.body.hello = (lumi_wire_Hello){.version_min = 1, .version_max = 1, .host = number, .nonce = 9};
    put_message(0, &message, now_ns);
}

static inline uint32_t hello(uint64_t number, uint64_t now_ns)
{
    say_hello(number, now_ns);
    lumi_wire_BoardFrame answer = last_sent(0);
    assert_int_equal(answer.which_body, lumi_wire_BoardFrame_welcome_tag);
    assert_int_equal(answer.body.welcome.host, number);
    assert_int_equal(answer.body.welcome.nonce, 9);
    return answer.body.welcome.token;
}

static inline lumi_wire_Reply ask(int link, uint32_t token, uint32_t number, uint64_t now_ns)
{
    lumi_wire_HostFrame message = {.which_body = lumi_wire_HostFrame_request_tag};

    message.body.request.token = token;
    message.body.request.number = number;
    message.body.request.which_command = lumi_wire_Request_pause_tag;
    put_message(link, &message, now_ns);
    lumi_wire_BoardFrame answer = last_sent(link);
    assert_int_equal(answer.which_body, lumi_wire_BoardFrame_reply_tag);
    assert_int_equal(answer.body.reply.token, token);
    assert_int_equal(answer.body.reply.number, number);
    return answer.body.reply;
}

#endif
