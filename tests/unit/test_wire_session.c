/* proto/wire: sessions, requests executed once and answered, whatever is lost, doubled or late; restarts; two links. */
#include "wire_bench.h"

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
    lumi_wire_client_poll(&host.client, 150 * PAIR_MS);
    pair_carry(&host, &board, 0, 150 * PAIR_MS);
    assert_int_equal(board.executed, 0); /* too early */
    lumi_wire_client_poll(&host.client, 202 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 203 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    pair_lose(&host.out);
    pair_lose(&board.out[0]); /* the reply */
    lumi_wire_client_poll(&host.client, 402 * PAIR_MS);
    pair_carry(&host, &board, 0, 403 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    assert_int_equal(host.replies, 1);
    assert_int_equal(host.client.retries, 2);
    assert_int_equal(board.server.repeated, 1);
}

static void numbers_count_without_gaps_and_nothing_else_is_executed(void **state)
{
    uint32_t token = hello(77, 0);

    (void)state;
    assert_int_equal(ask(0, token, 0, 1).result, lumi_wire_Result_OUT_OF_ORDER); /* nothing to repeat yet */
    assert_int_equal(ask(0, token, 2, 1).result, lumi_wire_Result_OUT_OF_ORDER);
    assert_int_equal(ask(0, token, 1, 1).result, lumi_wire_Result_DONE);
    assert_int_equal(ask(0, token, 1, 1).result, lumi_wire_Result_DONE);
    assert_int_equal(ask(0, token, 2, 1).result, lumi_wire_Result_DONE);
    assert_int_equal(ask(0, token, 1, 1).result, lumi_wire_Result_OUT_OF_ORDER);
    assert_int_equal(ask(0, token, 4, 1).result, lumi_wire_Result_OUT_OF_ORDER);
    assert_int_equal(ask(0, token + 1, 3, 1).result, lumi_wire_Result_NO_SESSION);
    assert_int_equal(ask(0, 0, 3, 1).result, lumi_wire_Result_NO_SESSION);
    assert_int_equal(board.executed, 2);
}

static void numbers_wrap(void **state)
{
    (void)state;
    board.server.sessions[0].last = host.client.number = UINT32_MAX - 2;
    for (int i = 1; i <= 6; i++) {
        assert_int_equal(request(&host, (uint64_t)i * 10 * PAIR_MS), LUMI_OK);
        pair_carry(&host, &board, 0, (uint64_t)i * 10 * PAIR_MS);
        assert_int_equal(host.replies, i);
        assert_int_equal(board.executed, i);
    }
    assert_int_equal(host.client.number, 3);
}

static void late_and_doubled_hellos_change_nothing(void **state)
{
    uint32_t token = hello(77, 0);

    (void)state;
    assert_true(token != 0);
    assert_int_equal(ask(0, token, 1, 1).result, lumi_wire_Result_DONE);
    for (uint64_t i = 0; i < 10; i++)
        assert_int_equal(hello(77, i), token);
    assert_int_equal(ask(0, token, 1, 11).result, lumi_wire_Result_DONE);
    assert_int_equal(board.executed, 1);
    assert_int_equal(ask(0, token, 2, 12).result, lumi_wire_Result_DONE);
    assert_int_equal(board.executed, 2);
    assert_int_equal(hello(77, 13), token);
}

static void a_late_welcome_is_not_taken(void **state)
{
    struct pair_queue old;

    (void)state;
    lumi_wire_client_poll(&host.client, PAIR_MS);
    pair_lose(&host.out);
    lumi_wire_client_poll(&host.client, 300 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 300 * PAIR_MS);
    pair_lose(&host.out);
    old = board.out[0];
    pair_board_start(&board, 0xb008); /* restarts, and the host connects anew */
    lumi_wire_client_reconnected(&host.client, 301 * PAIR_MS);
    lumi_wire_client_receive(&host.client, old.data, old.size, 302 * PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_HELLO);
    pair_carry(&host, &board, 0, 303 * PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_OPEN);
    assert_int_equal(host.client.welcome.boot, 0xb008);
    lumi_wire_client_receive(&host.client, old.data, old.size, 304 * PAIR_MS);
    assert_int_equal(host.client.welcome.boot, 0xb008);
    assert_int_equal(host.welcomes, 1);
}

static void a_request_in_flight_survives_a_reconnection(void **state)
{
    uint32_t token = host.client.welcome.token;

    (void)state;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    host.out.size -= 3; /* cut off while it was sent */
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 3 * PAIR_MS);
    pair_lose(&host.out);
    assert_int_equal(board.executed, 0);
    lumi_wire_client_reconnected(&host.client, 10 * PAIR_MS);
    pair_carry(&host, &board, 0, 11 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    assert_int_equal(host.replies, 1);
    assert_int_equal(host.requests_lost, 0);
    assert_int_equal(host.restarts, 0);
    assert_int_equal(host.client.welcome.token, token);
}

static void a_reply_that_overtakes_the_welcome_counts(void **state)
{
    struct pair_queue welcome;

    (void)state;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    pair_lose(&host.out);
    lumi_wire_client_reconnected(&host.client, 10 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 11 * PAIR_MS);
    pair_lose(&host.out);
    welcome = board.out[0]; /* made before the request was executed */
    pair_lose(&board.out[0]);
    put(0, host.client.request, host.client.request_size, 12 * PAIR_MS); /* the first copy was only late */
    lumi_wire_client_receive(&host.client, board.out[0].data, board.out[0].size, 13 * PAIR_MS);
    pair_lose(&board.out[0]);
    lumi_wire_client_receive(&host.client, welcome.data, welcome.size, 14 * PAIR_MS);
    assert_int_equal(host.replies, 1);
    assert_int_equal(request(&host, 15 * PAIR_MS), LUMI_OK);
    pair_carry(&host, &board, 0, 16 * PAIR_MS);
    assert_int_equal(board.executed, 2);
    assert_int_equal(host.replies, 2);
}

static void a_session_goes_on_over_the_other_link(void **state)
{
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_note_tag};

    (void)state;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 3 * PAIR_MS);
    pair_lose(&host.out);
    pair_lose(&board.out[0]); /* the cable is pulled before the reply comes */
    lumi_wire_client_reconnected(&host.client, 5 * PAIR_MS);
    pair_carry(&host, &board, 1, 6 * PAIR_MS);
    assert_int_equal(board.executed, 1);
    assert_int_equal(host.replies, 1);
    lumi_wire_server_event(&board.server, &event);
    pair_carry(&host, &board, 1, 7 * PAIR_MS);
    assert_int_equal(host.events, 1);
    assert_int_equal(board.out[0].size, 0);
}

static void a_restart_of_the_board_is_told_and_what_was_in_flight_reported_lost(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 5; i++) {
        assert_int_equal(request(&host, 10 * (i + 1) * PAIR_MS), LUMI_OK);
        pair_carry(&host, &board, 0, 10 * (i + 1) * PAIR_MS);
    }
    assert_int_equal(request(&host, 100 * PAIR_MS), LUMI_OK);
    pair_lose(&host.out);
    pair_board_start(&board, 0xb008);
    pair_run(&host, &board, 0, 101 * PAIR_MS, 400 * PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_OPEN);
    assert_int_equal(host.restarts, 1);
    assert_int_equal(host.requests_lost, 1);
    assert_int_equal(host.replies, 5);
    assert_int_equal(board.executed, 0);
    assert_int_equal(request(&host, 500 * PAIR_MS), LUMI_OK);
    assert_int_equal(host.client.number, 1);
    pair_carry(&host, &board, 0, 501 * PAIR_MS);
    assert_int_equal(host.replies, 6);
}

static void a_restart_is_noticed_by_a_heartbeat_too(void **state)
{
    (void)state;
    pair_board_start(&board, 0xb008);
    pair_run(&host, &board, 0, 2 * PAIR_MS, 600 * PAIR_MS);
    assert_int_equal(host.restarts, 1);
    assert_int_equal(host.requests_lost, 0);
}

static void four_hosts_are_remembered_and_the_most_silent_goes(void **state)
{
    uint32_t token[5];

    (void)state;
    for (uint32_t i = 0; i < 4; i++) {
        token[i] = hello(100 + i, i);
        assert_int_equal(ask(0, token[i], 1, 10 + i).result, lumi_wire_Result_DONE);
        for (uint32_t k = 0; k < i; k++)
            assert_true(token[k] != token[i]);
    }
    assert_int_equal(ask(0, token[0], 2, 20).result, lumi_wire_Result_DONE); /* now host 101 is the most silent */
    token[4] = hello(104, 30);
    assert_int_equal(ask(0, token[1], 2, 40).result, lumi_wire_Result_NO_SESSION);
    for (uint32_t i = 0; i < 5; i++)
        if (i != 1)
            assert_int_equal(ask(0, token[i], i == 0 ? 3 : i == 4 ? 1 : 2, 50 + i).result, lumi_wire_Result_DONE);
    assert_true(hello(101, 60) != token[1]); /* it begins anew */
    assert_int_equal(ask(0, token[0], 4, 61).result, lumi_wire_Result_NO_SESSION);
}

static void a_forgotten_host_says_hello_and_learns_what_it_lost(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < LUMI_WIRE_SESSIONS; i++)
        hello(100 + i, (10 + i) * PAIR_MS);
    assert_int_equal(request(&host, 20 * PAIR_MS), LUMI_OK);
    pair_run(&host, &board, 0, 20 * PAIR_MS, 200 * PAIR_MS);
    assert_int_equal(host.welcomes, 2);
    assert_int_equal(host.restarts, 0);
    assert_int_equal(host.requests_lost, 1);
    assert_int_equal(board.executed, 0);
}

static void a_reply_waits_for_room(void **state)
{
    (void)state;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    board.out[0].full = true;
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 2 * PAIR_MS);
    pair_lose(&host.out);
    assert_int_equal(lumi_wire_server_next_poll(&board.server, 3 * PAIR_MS), 3 * PAIR_MS);
    lumi_wire_server_poll(&board.server, 3 * PAIR_MS);
    board.out[0].full = false;
    pair_carry(&host, &board, 0, 4 * PAIR_MS);
    assert_int_equal(host.replies, 1);
    assert_int_equal(host.client.retries, 0);
    assert_int_equal(lumi_wire_server_next_poll(&board.server, 5 * PAIR_MS), UINT64_MAX);
}

static void a_request_waits_for_room(void **state)
{
    (void)state;
    host.out.full = true;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    assert_int_equal(lumi_wire_client_next_poll(&host.client), 2 * PAIR_MS + LUMI_WIRE_ROOM_NS);
    host.out.full = false;
    lumi_wire_client_poll(&host.client, 7 * PAIR_MS);
    pair_carry(&host, &board, 0, 7 * PAIR_MS);
    assert_int_equal(host.replies, 1);
}

static void an_emergency_stop_needs_no_session_and_is_sent_until_it_is_confirmed(void **state)
{
    (void)state;
    assert_true(lumi_wire_client_emergency_stop(&host.client, PAIR_MS));
    pair_lose(&host.out);
    for (uint64_t now = 2; now < 350; now++) {
        lumi_wire_client_poll(&host.client, now * PAIR_MS);
        if (now < 330)
            pair_lose(&host.out);
    }
    assert_true(host.client.stops_left > 0);
    lumi_wire_client_poll(&host.client, 450 * PAIR_MS);
    pair_carry(&host, &board, 1, 450 * PAIR_MS);
    assert_int_equal(board.stops, 1);
    assert_int_equal(host.client.stops_left, 0);
    assert_int_equal(host.replies, 0);
    pair_run(&host, &board, 1, 460 * PAIR_MS, 900 * PAIR_MS);
    assert_int_equal(board.stops, 1);

    /* The confirmation of an earlier one does not count for a later. */
    lumi_wire_client_emergency_stop(&host.client, 1000 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 1000 * PAIR_MS);
    pair_lose(&host.out);
    lumi_wire_client_emergency_stop(&host.client, 1001 * PAIR_MS);
    pair_lose(&host.out);
    lumi_wire_client_receive(&host.client, board.out[0].data, board.out[0].size, 1002 * PAIR_MS);
    assert_true(host.client.stops_left > 0);
}

static void heartbeats_are_answered_with_times_and_status(void **state)
{
    (void)state;
    pair_run(&host, &board, 0, 500 * PAIR_MS, 2600 * PAIR_MS);
    assert_in_range(host.pulses, 4, 6);
    assert_in_range(board.heartbeats, 4, 6);
    assert_int_equal(host.pulse.received_ns, host.pulse.sent_ns);
    assert_int_equal(host.pulse.host_time, host.pulse.received_ns); /* no time passes on this line */
    assert_true(host.pulse.status.step == -12345678901);
}

static void a_doubled_or_late_pulse_is_not_handed_on(void **state)
{
    struct pair_queue first;
    int pulses = host.pulses;

    (void)state;
    lumi_wire_client_poll(&host.client, 1000 * PAIR_MS);
    lumi_wire_server_receive(&board.server, 0, host.out.data, host.out.size, 1000 * PAIR_MS);
    pair_lose(&host.out);
    first = board.out[0];
    pair_lose(&board.out[0]);
    lumi_wire_client_poll(&host.client, 1600 * PAIR_MS);
    pair_carry(&host, &board, 0, 1600 * PAIR_MS);
    assert_int_equal(host.pulses, pulses + 1);
    lumi_wire_client_receive(&host.client, first.data, first.size, 1700 * PAIR_MS);
    assert_int_equal(host.pulses, pulses + 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        FRESH(a_session_opens_and_a_request_is_answered),
        OPEN(a_lost_request_is_sent_again_and_a_lost_reply_repeated),
        FRESH(numbers_count_without_gaps_and_nothing_else_is_executed),
        OPEN(numbers_wrap),
        FRESH(late_and_doubled_hellos_change_nothing),
        FRESH(a_late_welcome_is_not_taken),
        OPEN(a_request_in_flight_survives_a_reconnection),
        OPEN(a_reply_that_overtakes_the_welcome_counts),
        OPEN(a_session_goes_on_over_the_other_link),
        OPEN(a_restart_of_the_board_is_told_and_what_was_in_flight_reported_lost),
        OPEN(a_restart_is_noticed_by_a_heartbeat_too),
        FRESH(four_hosts_are_remembered_and_the_most_silent_goes),
        OPEN(a_forgotten_host_says_hello_and_learns_what_it_lost),
        OPEN(a_reply_waits_for_room),
        OPEN(a_request_waits_for_room),
        FRESH(an_emergency_stop_needs_no_session_and_is_sent_until_it_is_confirmed),
        OPEN(heartbeats_are_answered_with_times_and_status),
        OPEN(a_doubled_or_late_pulse_is_not_handed_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
