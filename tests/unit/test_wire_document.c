/* docs/rig-wire.md says what the code does: its worked example, byte for byte, and its tables. */
#include "proto/base/bytes.h"
#include "proto/mechanism/rig.h"
#include "proto/mechanism/sweep_plan.h"
#include "proto/wire/client.h"
#include "proto/wire/server.h"
#include "proto/wire/transport.h"
#include "wire_examples.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static char page[65536];

static int read_page(void **state)
{
    FILE *file = fopen(LUMI_SOURCE_DIR "/docs/rig-wire.md", "rb");

    (void)state;
    if (!file)
        return -1;
    page[fread(page, 1, sizeof page - 1, file)] = 0;
    fclose(file);
    return strlen(page) + 1 < sizeof page ? 0 : -1;
}

/* The bytes after the next "      NAME " from `from`, and after it the lines that only go on with it. */
static size_t bytes_of(const char *from, const char *name, uint8_t *bytes, size_t most)
{
    char label[32];
    size_t size = 0;
    int length = 0;

    snprintf(label, sizeof label, "\n      %-8s", name);
    const char *at = strstr(from, label);
    assert_non_null(at);
    at += strlen(label);
    for (;;) {
        unsigned value;
        if (sscanf(at, "%2x%n", &value, &length) != 1)
            break;
        assert_true(size < most);
        bytes[size++] = (uint8_t)value;
        at += length;
        size_t gap = strspn(at, " \n");
        if (memchr(at, '\n', gap) && gap < 10) /* the next label stands at 6 */
            break;
        at += gap;
    }
    return size;
}

static void example(const char *name, const uint8_t *payload, size_t size)
{
    uint8_t bytes[LUMI_WIRE_FRAME_MAX], frame[LUMI_WIRE_FRAME_MAX];
    uint32_t crc = lumi_crc32c(0, payload, size);
    char heading[64];

    snprintf(heading, sizeof heading, "\n    %s\n", name);
    const char *here = strstr(page, heading);
    assert_non_null(here);
    assert_int_equal(bytes_of(here, "payload", bytes, sizeof bytes), size);
    assert_memory_equal(bytes, payload, size);
    assert_int_equal(bytes_of(here, "crc", bytes, sizeof bytes), 4);
    for (int i = 0; i < 4; i++)
        assert_int_equal(bytes[i], (uint8_t)(crc >> 8 * i));
    size_t length = lumi_wire_frame(payload, size, frame);
    assert_int_equal(bytes_of(here, "frame", bytes, sizeof bytes), length);
    assert_memory_equal(bytes, frame, length);
}

static void host_example(const char *name, const lumi_wire_HostFrame *message)
{
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];

    example(name, payload, lumi_wire_encode_host(message, payload, sizeof payload));
}

static void board_example(const char *name, const lumi_wire_BoardFrame *message)
{
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];

    example(name, payload, lumi_wire_encode_board(message, payload, sizeof payload));
}

static void the_worked_example_is_what_the_code_sends(void **state)
{
    (void)state;
    host_example("hello", &example_hello);
    board_example("welcome", &example_welcome);
    host_example("request", &example_request);
    board_example("reply", &example_reply);
    host_example("heartbeat", &example_heartbeat);
    board_example("event", &example_event);
}

static void demand(const char *format, ...)
{
    char text[256];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!strstr(page, text))
        fail_msg("docs/rig-wire.md does not say '%s'", text);
}

static void the_tables_have_every_result_state_and_fault(void **state)
{
    (void)state;
    for (unsigned i = 0; i < _lumi_wire_Result_ARRAYSIZE; i++)
        demand("\n| %u | %s |", i, lumi_wire_result_name((lumi_wire_Result)i));
    for (unsigned i = 0; i < _lumi_wire_State_ARRAYSIZE; i++)
        demand("| %u | %s", i, lumi_wire_state_name((lumi_wire_State)i));
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        demand("\n| %d | `%s` |", i, lumi_rig_fault_names[i]);
}

static void the_tables_have_every_command_and_event(void **state)
{
    static const char *const commands[] = {"GetStatus",  "Home",        "Jog",          "TestTriggers",  "LoadPlan",
                                           "StartSweep", "Pause",       "Stop",         "Clear",         "ReadShots",
                                           "MarkShots",  "ReadProfile", "WriteProfile", "CommitProfile", "EnterLoader",
                                           "FireHere",   "SetOutput",   "ReadPlan"};
    static const char *const events[] = {"Started", "StateChanged", "Shot",       "Feedback", "TurnMark",
                                         "Fault",   "Homed",        "SweepEnded", "Note"};

    (void)state;
    assert_int_equal(lumi_wire_Request_get_status_tag, 3);
    assert_int_equal(lumi_wire_Request_read_plan_tag, 20);
    assert_int_equal(lumi_wire_Event_started_tag, 3);
    assert_int_equal(lumi_wire_Event_note_tag, 11);
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        demand("\n| %zu | %s |", i + 3, commands[i]);
    for (size_t i = 0; i < sizeof events / sizeof events[0]; i++)
        demand("\n| %zu | %s |", i + 3, events[i]);
}

static void the_numbers_are_those_of_the_code(void **state)
{
    (void)state;
    demand("at most %d bytes", LUMI_WIRE_PAYLOAD_MAX);
    demand("%d bytes unstuffed", LUMI_WIRE_PAYLOAD_MAX + 4);
    demand("%d,%03d baud", LUMI_WIRE_SERIAL_BAUD / 1000, LUMI_WIRE_SERIAL_BAUD % 1000);
    demand("vendor %04x, product %04x, one interface of class %02x, subclass %02x, protocol %02x", LUMI_WIRE_USB_VENDOR,
           LUMI_WIRE_USB_PRODUCT, LUMI_WIRE_USB_CLASS, LUMI_WIRE_USB_SUBCLASS, LUMI_WIRE_USB_PROTOCOL);
    demand("OUT endpoint %02x, bulk IN endpoint %02x, packets of %d bytes", LUMI_WIRE_USB_OUT, LUMI_WIRE_USB_IN,
           LUMI_WIRE_USB_PACKET);
    demand("again every %d ms until the\nWelcome", (int)(LUMI_WIRE_HELLO_NS / 1000000));
    demand("the same bytes again after %d ms", (int)(LUMI_WIRE_RETRY_NS / 1000000));
    demand("a Heartbeat every %d ms", (int)(LUMI_WIRE_HEARTBEAT_NS / 1000000));
    demand("within %d ms of an event", (int)(LUMI_WIRE_ACKNOWLEDGE_NS / 1000000));
    demand("within %d ms is sent again", (int)(LUMI_WIRE_EVENT_RESEND_NS / 1000000));
    demand("silent for %d s", (int)(LUMI_WIRE_SILENCE_NS / 1000000000));
    demand("%d KiB of them", LUMI_WIRE_EVENT_BYTES / 1024);
    demand("protocol: %d.", LUMI_WIRE_VERSION_MAX);
    assert_int_equal(LUMI_WIRE_SESSIONS, 4);
    demand("keeps four hosts");
}

static void the_words_of_plan_and_profile_have_their_numbers(void **state)
{
    (void)state;
    demand("| `Plan.mode` | %d continuous, %d start-stop, %d video |", LUMI_PLAN_CONTINUOUS, LUMI_PLAN_START_STOP,
           LUMI_PLAN_VIDEO);
    demand("| `Plan.wind` | %d plan, %d full, %d none |", LUMI_PLAN_WIND_PLAN, LUMI_PLAN_WIND_FULL,
           LUMI_PLAN_WIND_NONE);
    demand("| `String.run` | %d arc, %d straight |", LUMI_RIG_RUN_ARC, LUMI_RIG_RUN_STRAIGHT);
    demand("| `Lens.model` | %d pinhole, %d fisheye |", LUMI_LENS_BROWN, LUMI_LENS_FISHEYE);
    demand("| `Motion.drive` | %d stepper, %d external |", LUMI_RIG_DRIVE_STEPPER, LUMI_RIG_DRIVE_EXTERNAL);
    demand("| `Reaction.motor` | %d row-end, %d ramp, %d halt, %d off |", LUMI_RIG_MOTOR_ROW_END, LUMI_RIG_MOTOR_RAMP,
           LUMI_RIG_MOTOR_HALT, LUMI_RIG_MOTOR_OFF);
    demand("| `Reaction.triggers` | %d triggers-finish, %d triggers-off |", LUMI_RIG_TRIGGERS_FINISH,
           LUMI_RIG_TRIGGERS_OFF);
}

/* ---- a client written from the page alone: no nanopb, none of our framing, messages by hand ---- */

static size_t page_frame(const uint8_t *payload, size_t size, uint8_t *frame)
{
    uint8_t data[512];
    uint32_t crc = 0xffffffff;
    size_t at = 0, begin = 0;

    memcpy(data, payload, size);
    for (size_t i = 0; i < size; i++) {
        crc ^= payload[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0x82f63b78 : crc >> 1; /* 1EDC6F41 with its bits turned round */
    }
    crc = ~crc;
    for (int i = 0; i < 4; i++)
        data[size++] = (uint8_t)(crc >> 8 * i);
    data[size] = 0; /* the end counts as one */
    frame[at++] = 0;
    while (begin <= size) {
        size_t length = 0;
        while (length < 254 && data[begin + length] != 0)
            length++;
        frame[at++] = (uint8_t)(length + 1);
        memcpy(frame + at, data + begin, length);
        at += length;
        begin += length;
        if (length < 254 || begin == size) /* a zero that is not sent, or the end */
            begin++;
    }
    frame[at++] = 0;
    return at;
}

/* Of the first frame in `data`. */
static size_t page_unframe(const uint8_t *data, uint8_t *payload)
{
    size_t size = 0, at = 0;

    while (data[at] == 0)
        at++;
    while (data[at] != 0) {
        unsigned code = data[at++];
        for (unsigned i = 1; i < code; i++)
            payload[size++] = data[at++];
        if (code != 0xff && data[at] != 0)
            payload[size++] = 0;
    }
    return size - 4;
}

static struct {
    struct lumi_wire_server server;
    uint8_t sent[4096];
    size_t size;
    double turns;
} board;

static void page_execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    (void)context;
    assert_int_equal(request->which_command, lumi_wire_Request_jog_tag);
    board.turns = request->command.jog.turns;
    reply->result = lumi_wire_Result_REFUSED;
    strcpy(reply->text, "no");
}

static void page_status(void *context, lumi_wire_Status *status)
{
    (void)context;
    (void)status;
}

static void page_nothing(void *context)
{
    (void)context;
}

static bool page_send(void *context, int link, const uint8_t *frame, size_t size)
{
    (void)context;
    (void)link;
    memcpy(board.sent, frame, size);
    board.size = size;
    return true;
}

/* Puts a payload on the line; the payload that comes back. */
static size_t exchange(const uint8_t *payload, size_t size, uint8_t *answer)
{
    uint8_t frame[600];

    board.size = 0;
    lumi_wire_server_receive(&board.server, 0, frame, page_frame(payload, size, frame), 1);
    assert_true(board.size > 0);
    return page_unframe(board.sent, answer);
}

static void a_client_written_from_the_page_is_understood(void **state)
{
    static const struct lumi_wire_server_ops ops = {.execute = page_execute,
                                                    .status = page_status,
                                                    .emergency_stop = page_nothing,
                                                    .heartbeat = page_nothing,
                                                    .send = page_send};
    const lumi_wire_Welcome identity = {.boot = 1, .board = "page"};
    uint8_t hello[] = {0x0a, 19, 8, 1, 16, 1, 0x19, 1, 2, 3, 4, 5, 6, 7, 8, 0x25, 9, 0, 0, 0};
    uint8_t jog[] = {0x12, 18, 0x0d, 0, 0, 0, 0, 0x10, 1, 0x2a, 9, 9, 0, 0, 0, 0, 0, 0, 0xe8, 0xbf}; /* −0.75 */
    uint8_t answer[600];

    (void)state;
    hello[1] = sizeof hello - 2;
    lumi_wire_server_init(&board.server, &ops, NULL, &identity);
    size_t size = exchange(hello, sizeof hello, answer);
    /* Welcome: version 1, the host, the token. */
    const uint8_t begin[] = {8, 1, 0x11, 1, 2, 3, 4, 5, 6, 7, 8, 0x1d};
    assert_true(size > 18);
    assert_int_equal(answer[0], 0x0a);
    assert_memory_equal(answer + 2, begin, sizeof begin);
    memcpy(jog + 3, answer + 14, 4);
    size = exchange(jog, sizeof jog, answer);
    const uint8_t reply[] = {0x12, 13, 0x0d, jog[3], jog[4], jog[5], jog[6], 0x10, 1, 0x18, 1, 0x22, 2, 'n', 'o'};
    assert_true(board.turns == -0.75);
    assert_int_equal(size, sizeof reply);
    assert_memory_equal(answer, reply, sizeof reply);
}

static void framing_by_the_page_is_ours_byte_for_byte(void **state)
{
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX], ours[LUMI_WIRE_FRAME_MAX], theirs[600], back[600];
    uint32_t random = 1;

    (void)state;
    for (size_t size = 0; size <= LUMI_WIRE_PAYLOAD_MAX; size++)
        for (uint32_t zeros = 0; zeros < 3; zeros++) {
            for (size_t i = 0; i < size; i++) {
                random = random * 1664525 + 1013904223;
                payload[i] = zeros == 0 || random >> 24 > 10 * zeros ? (uint8_t)(random >> 16 | 1) : 0;
            }
            size_t length = lumi_wire_frame(payload, size, ours);
            assert_int_equal(page_frame(payload, size, theirs), length);
            assert_memory_equal(theirs, ours, length);
            assert_int_equal(page_unframe(ours, back), size);
            assert_memory_equal(back, payload, size);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_worked_example_is_what_the_code_sends),
        cmocka_unit_test(the_tables_have_every_result_state_and_fault),
        cmocka_unit_test(the_tables_have_every_command_and_event),
        cmocka_unit_test(the_numbers_are_those_of_the_code),
        cmocka_unit_test(the_words_of_plan_and_profile_have_their_numbers),
        cmocka_unit_test(framing_by_the_page_is_ours_byte_for_byte),
        cmocka_unit_test(a_client_written_from_the_page_is_understood),
    };
    return cmocka_run_group_tests(tests, read_page, NULL);
}
