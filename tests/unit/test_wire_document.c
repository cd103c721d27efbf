/* docs/rig-wire.md says what the code does: its worked example, byte for byte, and its tables. */
#include "proto/base/bytes.h"
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_worked_example_is_what_the_code_sends),
        cmocka_unit_test(the_tables_have_every_result_state_and_fault),
        cmocka_unit_test(the_tables_have_every_command_and_event),
        cmocka_unit_test(the_numbers_are_those_of_the_code),
    };
    return cmocka_run_group_tests(tests, read_page, NULL);
}
