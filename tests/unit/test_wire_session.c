/* proto/wire: sessions, requests executed once and answered, whatever is lost, doubled or late; restarts; two links. */
#include "wire_pair.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static struct pair_board board;
static struct pair_host host;

static int start(void **state)
{
    (void)state;
    pair_board_start(&board, 0xb007);
    pair_host_start(&host, 0x1234);
    return 0;
}

static int open_session(void **state)
{
    start(state);
    lumi_wire_client_poll(&host.client, PAIR_MS);
    pair_carry(&host, &board, 0, PAIR_MS);
    return host.client.state == LUMI_WIRE_CLIENT_OPEN ? 0 : -1;
}

static int request(struct pair_host *from, uint64_t now_ns)
{
    lumi_wire_Request message = {.which_command = lumi_wire_Request_jog_tag};

    message.command.jog.turns = 0.25;
    return lumi_wire_client_request(&from->client, &message, now_ns, NULL);
}

static void a_session_opens_and_a_request_is_answered(void **state)
{
    (void)state;
    assert_int_equal(request(&host, 0), LUMI_ERR_BUSY);
    lumi_wire_client_poll(&host.client, PAIR_MS);
    pair_carry(&host, &board, 0, PAIR_MS);
    assert_int_equal(host.welcomes, 1);
    assert_int_equal(host.restarts, 0);
    assert_string_equal(host.client.welcome.board, "host");
    board.answer.result = lumi_wire_Result_REFUSED;
    strcpy(board.answer.text, "not now");
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_ERR_BUSY);
    pair_carry(&host, &board, 0, 3 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    assert_true(board.last.command.jog.turns == 0.25);
    assert_int_equal(host.replies, 1);
    assert_int_equal(host.reply.result, lumi_wire_Result_REFUSED);
    assert_string_equal(host.reply.text, "not now");
    assert_int_equal(request(&host, 4 * PAIR_MS), LUMI_OK);
}

static void a_lost_request_is_sent_again_and_a_lost_reply_repeated(void **state)
{
    (void)state;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    pair_lose(&host.out);
    lumi_wire_client_poll(&host.client, 50 * PAIR_MS);
    pair_carry(&host, &board, 0, 50 * PAIR_MS);
    assert_int_equal(board.executed, 0); /* too early */
    lumi_wire_client_poll(&host.client, 102 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 103 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    pair_lose(&host.out);
    pair_lose(&board.out[0]); /* the reply */
    lumi_wire_client_poll(&host.client, 202 * PAIR_MS);
    pair_carry(&host, &board, 0, 203 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    assert_int_equal(host.replies, 1);
    assert_int_equal(host.client.retries, 2);
    assert_int_equal(board.server.repeated, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_session_opens_and_a_request_is_answered, start),
        cmocka_unit_test_setup(a_lost_request_is_sent_again_and_a_lost_reply_repeated, open_session),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
