/* proto/wire: messages become bytes and back; texts end, fit and are printable. */
#include "proto/wire/frame.h"
#include "proto/wire/message.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void clean(const char *text, size_t size, const char *expected)
{
    char field[64];

    memset(field, 0x5a, sizeof field);
    memcpy(field, text, size);
    lumi_wire_clean_text(field, size);
    assert_string_equal(field, expected);
    for (size_t i = size; i < sizeof field; i++)
        assert_int_equal(field[i], 0x5a);
}

static void texts_are_made_one_line_of_good_utf8(void **state)
{
    (void)state;
    clean("plain", 6, "plain");
    clean("Gr\xc3\xb6\xc3\x9f- \xe2\x82\xac \xf0\x9f\x93\xb7", 17, "Gr\xc3\xb6\xc3\x9f- \xe2\x82\xac \xf0\x9f\x93\xb7");
    clean("a\tb\r\n\x7f", 7, "a?b???");
    clean("\x1b[31m", 6, "?[31m");
    clean("\xc2\x85\xc2\xa0", 5, "??\xc2\xa0");          /* a control character of two bytes; one that is none */
    clean("\xc0\xaf\xe0\x80\xaf", 6, "?????");           /* longer than need be */
    clean("\xed\xa0\x80\xf4\x90\x80\x80", 8, "???????"); /* half of a pair; beyond the last character */
    clean("\xe2\x82", 3, "??");                          /* ends in the middle */
    clean("\xe2\x82\xac", 3, "??");                      /* cut by its field */
    clean("abcd", 4, "abc");                             /* without an end */
    clean("\xff\xfe\x80", 4, "???");
    clean("", 1, "");
}

static void texts_are_copied_cut_between_characters(void **state)
{
    char field[8];

    (void)state;
    lumi_wire_copy_text(field, sizeof field, "seven..");
    assert_string_equal(field, "seven..");
    lumi_wire_copy_text(field, sizeof field, "eight...");
    assert_string_equal(field, "eight..");
    lumi_wire_copy_text(field, sizeof field, "h\xc3\xb6her\xc3\xb6");
    assert_string_equal(field, "h\xc3\xb6her");
    lumi_wire_copy_text(field, sizeof field, "ab");
    assert_memory_equal(field, "ab\0\0\0\0\0", sizeof field);
}

static void every_result_and_state_has_a_name(void **state)
{
    (void)state;
    assert_string_equal(lumi_wire_result_name(lumi_wire_Result_DONE), "done");
    assert_string_equal(lumi_wire_result_name(lumi_wire_Result_OUT_OF_ORDER), "out of order");
    assert_null(lumi_wire_result_name((lumi_wire_Result)7));
    assert_null(lumi_wire_result_name((lumi_wire_Result)-1));
    assert_string_equal(lumi_wire_state_name(lumi_wire_State_TESTING), "testing");
    assert_string_equal(lumi_wire_state_name(lumi_wire_State_STOPPED_LOST), "stopped lost");
    assert_null(lumi_wire_state_name((lumi_wire_State)99));
}

static void the_longest_messages_fit_a_frame(void **state)
{
    uint8_t data[LUMI_WIRE_PAYLOAD_MAX];
    lumi_wire_BoardFrame board = {.which_body = lumi_wire_BoardFrame_reply_tag};
    lumi_wire_HostFrame host = {.which_body = lumi_wire_HostFrame_request_tag}, back;
    lumi_wire_Reply *reply = &board.body.reply;

    (void)state;
    reply->token = reply->number = UINT32_MAX;
    reply->result = lumi_wire_Result_FAILED;
    memset(reply->text, 'x', sizeof reply->text - 1);
    reply->which_payload = lumi_wire_Reply_profile_tag;
    reply->payload.profile.offset = reply->payload.profile.size = reply->payload.profile.crc = UINT32_MAX;
    reply->payload.profile.data.size = 256;
    assert_in_range(lumi_wire_encode_board(&board, data, sizeof data), 430, LUMI_WIRE_PAYLOAD_MAX);
    host.body.request.token = host.body.request.number = UINT32_MAX;
    host.body.request.which_command = lumi_wire_Request_write_profile_tag;
    host.body.request.command.write_profile.offset = UINT32_MAX;
    host.body.request.command.write_profile.data.size = 256;
    size_t size = lumi_wire_encode_host(&host, data, sizeof data);
    assert_in_range(size, 256, LUMI_WIRE_PAYLOAD_MAX);
    assert_true(lumi_wire_decode_host(data, size, &back));
    assert_memory_equal(&back, &host, sizeof host);
    assert_int_equal(lumi_wire_encode_host(&host, data, size - 1), 0); /* no room */
    for (size_t cut = 1; cut < size; cut++)
        assert_false(lumi_wire_decode_host(data, cut, &back));
}

static void a_request_that_does_not_fit_still_tells_its_number(void **state)
{
    const uint8_t good[] = {0x12, 9, 0x10, 0x81, 0x01, 0x7f, 0x0d, 4, 3, 2, 1};
    const uint8_t skipped[] = {0x12, 11, 0x1a, 2, 9, 9, 0x0d, 4, 3, 2, 1, 0x10, 5};
    uint32_t token = 0, number = 0;

    (void)state;
    assert_true(lumi_wire_decode_request_head(skipped, sizeof skipped, &token, &number));
    assert_int_equal(token, 0x01020304);
    assert_int_equal(number, 5);
    assert_false(lumi_wire_decode_request_head(good, sizeof good, &token, &number)); /* a tag of an unknown kind */
    assert_false(lumi_wire_decode_request_head(skipped, 12, &token, &number));
    assert_false(lumi_wire_decode_request_head((const uint8_t *)"\x0a\x02\x10\x01", 4, &token, &number)); /* a Hello */
    assert_false(lumi_wire_decode_request_head(NULL, 0, &token, &number));
}

static void texts_that_come_in_are_made_printable(void **state)
{
    lumi_wire_BoardFrame out = {0}, in;
    uint8_t data[LUMI_WIRE_PAYLOAD_MAX];
    struct {
        pb_size_t kind;
        char *written;
        const char *read;
    } events[] = {
        {lumi_wire_Event_fault_tag, out.body.event.kind.fault.text, in.body.event.kind.fault.text},
        {lumi_wire_Event_homed_tag, out.body.event.kind.homed.text, in.body.event.kind.homed.text},
        {lumi_wire_Event_note_tag, out.body.event.kind.note.text, in.body.event.kind.note.text},
    };

    (void)state;
    for (size_t i = 0; i < sizeof events / sizeof events[0]; i++) {
        memset(&out, 0, sizeof out);
        out.which_body = lumi_wire_BoardFrame_event_tag;
        out.body.event.which_kind = events[i].kind;
        strcpy(events[i].written, "\x1b\xff.");
        assert_true(lumi_wire_decode_board(data, lumi_wire_encode_board(&out, data, sizeof data), &in));
        assert_string_equal(events[i].read, "??.");
    }
    memset(&out, 0, sizeof out);
    out.which_body = lumi_wire_BoardFrame_welcome_tag;
    strcpy(out.body.welcome.board, "\a");
    strcpy(out.body.welcome.firmware, "1\n");
    assert_true(lumi_wire_decode_board(data, lumi_wire_encode_board(&out, data, sizeof data), &in));
    assert_string_equal(in.body.welcome.board, "?");
    assert_string_equal(in.body.welcome.firmware, "1?");
    memset(&out, 0, sizeof out);
    out.which_body = lumi_wire_BoardFrame_reply_tag;
    out.body.reply.which_payload = lumi_wire_Reply_plan_tag;
    strcpy(out.body.reply.payload.plan.name, "\v");
    assert_true(lumi_wire_decode_board(data, lumi_wire_encode_board(&out, data, sizeof data), &in));
    assert_string_equal(in.body.reply.payload.plan.name, "?");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texts_are_made_one_line_of_good_utf8),
        cmocka_unit_test(texts_are_copied_cut_between_characters),
        cmocka_unit_test(every_result_and_state_has_a_name),
        cmocka_unit_test(the_longest_messages_fit_a_frame),
        cmocka_unit_test(a_request_that_does_not_fit_still_tells_its_number),
        cmocka_unit_test(texts_that_come_in_are_made_printable),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
