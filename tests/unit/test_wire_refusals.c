/* proto/wire: what the ends of a link do not take from one another: other versions, commands of later ones, requests
 * that do not fit, numbers that are none, texts that are no line. */
#include "wire_bench.h"

#include <math.h>

static void a_command_of_a_later_version_is_unsupported(void **state)
{
    uint32_t token = hello(77, 0);
    uint8_t payload[] = {0x12, 12, 0x0d, 0, 0, 0, 0, 0x10, 1, 0xda, 0x0c, 2, 0x08, 5}; /* field 203 of Request */

    (void)state;
    memcpy(payload + 3, &token, 4);
    put(0, payload, sizeof payload, 1);
    lumi_wire_Reply reply = last_sent(0).body.reply;
    assert_int_equal(reply.result, lumi_wire_Result_UNSUPPORTED);
    assert_int_equal(reply.number, 1);
    assert_int_equal(board.executed, 0);
    assert_int_equal(ask(0, token, 2, 2).result, lumi_wire_Result_DONE); /* its number is used up */
}

static void a_request_that_does_not_fit_is_answered_bad(void **state)
{
    uint32_t token = hello(77, 0);
    /* WriteProfile with 300 bytes of data, 256 fit. */
    uint8_t payload[320] = {0x12, 0xbc, 0x02, 0x0d, 0, 0, 0, 0, 0x10, 1, 0x7a, 0xb2, 0x02, 0x08, 0, 0x12, 0xac, 0x02};

    (void)state;
    memcpy(payload + 4, &token, 4);
    payload[1] = (uint8_t)((15 + 300) | 0x80); /* 315 bytes of Request */
    put(0, payload, 18 + 300, 1);
    lumi_wire_Reply reply = last_sent(0).body.reply;
    assert_int_equal(reply.token, token);
    assert_int_equal(reply.number, 1);
    assert_int_equal(reply.result, lumi_wire_Result_BAD);
    assert_true(strlen(reply.text) > 0);
    assert_int_equal(board.executed, 0);
    assert_int_equal(ask(0, token, 2, 2).result, lumi_wire_Result_DONE);
}

static void numbers_that_are_not_finite_never_reach_the_board(void **state)
{
    const double odd[] = {NAN, INFINITY, -INFINITY};
    lumi_wire_HostFrame message = {.which_body = lumi_wire_HostFrame_request_tag};
    lumi_wire_Request *out = &message.body.request;

    (void)state;
    out->token = hello(77, 0);
    for (int i = 0; i < 3 * 9; i++) {
        double value = odd[i / 9];
        memset(&out->command, 0, sizeof out->command);
        out->number++;
        double *places[] = {&out->command.jog.turns,
                            &out->command.jog.speed,
                            &out->command.test_triggers.exposure,
                            &out->command.test_triggers.gap,
                            &out->command.fire_here.timeout,
                            &out->command.load_plan.plan.turn_time,
                            &out->command.load_plan.plan.settle,
                            &out->command.load_plan.plan.blur_max,
                            &out->command.load_plan.plan.exposures[8]};
        static const pb_size_t tags[] = {
            lumi_wire_Request_jog_tag,           lumi_wire_Request_jog_tag,       lumi_wire_Request_test_triggers_tag,
            lumi_wire_Request_test_triggers_tag, lumi_wire_Request_fire_here_tag, lumi_wire_Request_load_plan_tag,
            lumi_wire_Request_load_plan_tag,     lumi_wire_Request_load_plan_tag, lumi_wire_Request_load_plan_tag};
        out->which_command = tags[i % 9];
        if (out->which_command == lumi_wire_Request_load_plan_tag) {
            out->command.load_plan.has_plan = true;
            out->command.load_plan.plan.exposures_count = 9;
        }
        *places[i % 9] = value;
        put_message(0, &message, 1);
        assert_int_equal(last_sent(0).body.reply.result, lumi_wire_Result_BAD);
    }
    assert_int_equal(board.executed, 0);
}

static void what_is_no_message_is_counted_and_not_answered(void **state)
{
    static const uint8_t rubbish[][4] = {{0xff, 0xff, 0xff, 0xff}, {0x12, 0x7f, 0, 0}, {0x7a, 1, 1, 0}, {0}};

    (void)state;
    for (size_t i = 0; i < sizeof rubbish / sizeof rubbish[0]; i++)
        put(0, rubbish[i], i == 3 ? 0 : 3, 1);
    assert_int_equal(board.server.unread, 4);
    assert_int_equal(board.out[0].size, 0);
}

static void versions_are_negotiated_and_what_does_not_fit_is_refused_with_both_ranges(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    board.server.identity.version_max = 7; /* a newer board that still speaks ours */
    lumi_wire_client_poll(&host.client, PAIR_MS);
    pair_carry(&host, &board, 0, PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_OPEN);
    assert_int_equal(host.client.welcome.version, 1);
    assert_int_equal(lumi_wire_client_version(&host.client, &error), LUMI_OK);
    assert_int_equal(request(&host, PAIR_MS), LUMI_OK);

    board.server.identity.version_min = 2; /* one that does not, in the middle of a request */
    lumi_wire_client_reconnected(&host.client, 2 * PAIR_MS);
    pair_lose(&host.out);
    lumi_wire_client_reconnected(&host.client, 3 * PAIR_MS);
    pair_carry(&host, &board, 0, 3 * PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_VERSION);
    assert_int_equal(host.requests_lost, 1);
    assert_int_equal(lumi_wire_client_next_poll(&host.client), UINT64_MAX);
    assert_int_equal(lumi_wire_client_version(&host.client, &error), LUMI_ERR_VERSION);
    assert_non_null(strstr(error.text, "2 to 7"));
    assert_non_null(strstr(error.text, "1 to 1"));
    assert_non_null(strstr(error.text, "update this program"));
    assert_int_equal(request(&host, 4 * PAIR_MS), LUMI_ERR_VERSION);

    host.client.version_min = host.client.version_max = 9; /* now the firmware is too old */
    lumi_wire_client_reconnected(&host.client, 5 * PAIR_MS);
    pair_carry(&host, &board, 0, 5 * PAIR_MS);
    assert_int_equal(lumi_wire_client_version(&host.client, &error), LUMI_ERR_VERSION);
    assert_non_null(strstr(error.text, "2 to 7"));
    assert_non_null(strstr(error.text, "9 to 9"));
    assert_non_null(strstr(error.text, "flash"));

    pair_board_start(&board, 0xb009); /* flashed */
    board.server.identity.version_min = 8;
    board.server.identity.version_max = 12;
    lumi_wire_client_reconnected(&host.client, 6 * PAIR_MS);
    pair_carry(&host, &board, 0, 6 * PAIR_MS);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_OPEN);
    assert_int_equal(host.client.welcome.version, 9);
    assert_int_equal(host.restarts, 1);
}

static void a_welcome_of_another_version_than_asked_for_is_refused(void **state)
{
    (void)state;
    host.client.version_max = 3;
    board.server.identity.version_min = 5;
    board.server.identity.version_max = 9;
    lumi_wire_client_poll(&host.client, 0);
    pair_carry(&host, &board, 0, 0);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_VERSION);
    assert_int_equal(board.server.sessions[0].host, 0); /* and no session was opened */
}

static void an_emergency_stop_works_though_no_version_fits(void **state)
{
    (void)state;
    board.server.identity.version_min = board.server.identity.version_max = 5;
    lumi_wire_client_poll(&host.client, 0);
    pair_carry(&host, &board, 0, 0);
    assert_int_equal(host.client.state, LUMI_WIRE_CLIENT_VERSION);
    assert_true(lumi_wire_client_emergency_stop(&host.client, PAIR_MS));
    pair_carry(&host, &board, 0, PAIR_MS);
    assert_int_equal(board.stops, 1);
    assert_int_equal(host.client.stops_left, 0);
}

static void texts_of_the_board_are_one_printable_line(void **state)
{
    (void)state;
    strcpy(board.answer.text, "a\nb\x1b[2J\xc3(\xf0\x9f\x98\x80\xe2\x82");
    board.answer.result = lumi_wire_Result_FAILED;
    assert_int_equal(request(&host, 2 * PAIR_MS), LUMI_OK);
    pair_carry(&host, &board, 0, 2 * PAIR_MS);
    assert_string_equal(host.reply.text, "a?b?[2J?(\xf0\x9f\x98\x80??");
}

static void a_hello_without_a_host_is_ignored(void **state)
{
    lumi_wire_HostFrame message = {.which_body = lumi_wire_HostFrame_hello_tag};

    (void)state;
    message.body.hello.version_max = 1;
    put_message(0, &message, 0);
    assert_int_equal(board.out[0].size, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        FRESH(a_command_of_a_later_version_is_unsupported),
        FRESH(a_request_that_does_not_fit_is_answered_bad),
        FRESH(numbers_that_are_not_finite_never_reach_the_board),
        FRESH(what_is_no_message_is_counted_and_not_answered),
        FRESH(versions_are_negotiated_and_what_does_not_fit_is_refused_with_both_ranges),
        FRESH(a_welcome_of_another_version_than_asked_for_is_refused),
        FRESH(an_emergency_stop_works_though_no_version_fits),
        OPEN(texts_of_the_board_are_one_printable_line),
        FRESH(a_hello_without_a_host_is_ignored),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
