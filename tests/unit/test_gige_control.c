/* A simulated camera's control protocol: who may write, what is refused, when a controller is let go. */
#include "sim/gige/gige_control.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct gige_peer one = {0x7f000001, 5000}, two = {0x7f000001, 5001};
static struct gige_control control;
static uint8_t answer[GIGE_PACKET_MAX];

static void switch_on(void)
{
    const struct gige_identity identity = {"127.0.0.9", "V", "M", "1", "S9", "n", 64, 48, 125000000};

    gige_registers_finish(&control.registers);
    memset(&control, 0, sizeof control);
    assert_int_equal(gige_registers_init(&control.registers, &identity), 0);
}

static void put32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (24 - 8 * i));
}

static size_t ask(const struct gige_peer *peer, uint64_t now, unsigned command, const uint8_t *body, size_t size)
{
    uint8_t request[8 + 64] = {0x42, 1, (uint8_t)(command >> 8), (uint8_t)command, 0, (uint8_t)size, 0x12, 0x34};

    memcpy(request + 8, body, size);
    return gige_control_answer(&control, peer, now, request, 8 + size, answer);
}

static unsigned status(void)
{
    return (unsigned)answer[0] << 8 | answer[1];
}

static unsigned write_register(const struct gige_peer *peer, uint64_t now, uint32_t address, uint32_t value)
{
    uint8_t body[8];

    put32(body, address);
    put32(body + 4, value);
    assert_int_equal(ask(peer, now, 0x0082, body, 8), 12);
    assert_true(answer[6] == 0x12 && answer[7] == 0x34);
    return status();
}

static unsigned read_register(uint32_t address, uint32_t *value)
{
    uint8_t body[4];

    put32(body, address);
    const size_t size = ask(&two, 0, 0x0080, body, 4);
    if (size == 12)
        *value = (uint32_t)answer[8] << 24 | (uint32_t)answer[9] << 16 | (uint32_t)answer[10] << 8 | answer[11];
    return status();
}

static void only_the_controller_writes_and_everybody_reads(void **state)
{
    uint32_t value = 0;

    (void)state;
    switch_on();
    assert_int_equal(write_register(&one, 0, GIGE_WIDTH, 32), 0x8006); /* nobody is in control */
    assert_int_equal(write_register(&one, 0, GIGE_PRIVILEGE, 2), 0);
    assert_int_equal(write_register(&one, 0, GIGE_WIDTH, 32), 0);
    assert_int_equal(write_register(&two, 0, GIGE_WIDTH, 16), 0x8006);
    assert_int_equal(write_register(&two, 0, GIGE_PRIVILEGE, 2), 0x8006);
    assert_int_equal(read_register(GIGE_WIDTH, &value), 0);
    assert_int_equal(value, 32);
}

static void a_controller_that_is_not_heard_is_let_go_and_the_camera_stops(void **state)
{
    (void)state;
    switch_on();
    assert_int_equal(write_register(&one, 1000, GIGE_PRIVILEGE, 2), 0);
    assert_int_equal(write_register(&one, 1000, GIGE_ACQUISITION, 1), 0);
    assert_true(control.actions & GIGE_DO_START);
    assert_false(gige_control_expire(&control, 1000 + UINT64_C(2999000000)));
    assert_true(gige_control_expire(&control, 1000 + UINT64_C(3000000000)));
    assert_int_equal(gige_get(&control.registers, GIGE_ACQUISITION), 0);
    assert_int_equal(write_register(&two, 0, GIGE_PRIVILEGE, 2), 0);
}

static void what_cannot_be_is_refused_with_the_standard_s_codes(void **state)
{
    static const struct {
        uint32_t address, value;
        unsigned status;
    } writes[] = {{GIGE_WIDTH, 65, 0x8002},
                  {GIGE_WIDTH, 0, 0x8002},
                  {GIGE_PIXEL_FORMAT, 1, 0x8002},
                  {GIGE_SENSOR_WIDTH, 9, 0x8004},
                  {0x48, 0, 0x8004},
                  {0x00030000, 1, 0x8003},
                  {GIGE_OWN + 2, 1, 0x8005},
                  {GIGE_OWN + GIGE_OWN_SIZE, 1, 0x8003}};
    uint32_t value;
    uint8_t none[1] = {0};

    (void)state;
    switch_on();
    assert_int_equal(write_register(&one, 0, GIGE_PRIVILEGE, 2), 0);
    for (size_t i = 0; i < sizeof writes / sizeof writes[0]; i++)
        assert_int_equal(write_register(&one, 0, writes[i].address, writes[i].value), writes[i].status);
    assert_int_equal(read_register(0x00ffffff - 2, &value), 0x8005);
    assert_int_equal(read_register(0x0ffffffc, &value), 0x8003);
    assert_int_equal(ask(&one, 0, 0x0999, none, 0), 8);
    assert_int_equal(status(), 0x8001);
    assert_int_equal(gige_control_answer(&control, &one, 0, (const uint8_t *)"\x42\1\0\2\0\1\0\1", 8, answer), 0);
}

static void an_action_fires_only_those_with_its_keys(void **state)
{
    uint8_t body[12];

    (void)state;
    switch_on();
    assert_int_equal(write_register(&one, 0, GIGE_PRIVILEGE, 2), 0);
    assert_int_equal(write_register(&one, 0, GIGE_ACTION_DEVICE_KEY, 7), 0);
    assert_int_equal(write_register(&one, 0, GIGE_ACTION_GROUP_KEY, 8), 0);
    assert_int_equal(write_register(&one, 0, GIGE_ACTION_GROUP_MASK, 6), 0);
    put32(body, 7);
    put32(body + 4, 8);
    put32(body + 8, 4);
    ask(&two, 0, 0x0100, body, 12); /* from anybody */
    assert_true(control.actions & GIGE_DO_ACTION);
    put32(body + 8, 1);
    ask(&two, 0, 0x0100, body, 12);
    assert_false(control.actions & GIGE_DO_ACTION);
}

static int release(void **state)
{
    (void)state;
    gige_registers_finish(&control.registers);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_the_controller_writes_and_everybody_reads),
        cmocka_unit_test(a_controller_that_is_not_heard_is_let_go_and_the_camera_stops),
        cmocka_unit_test(what_cannot_be_is_refused_with_the_standard_s_codes),
        cmocka_unit_test(an_action_fires_only_those_with_its_keys),
    };

    return cmocka_run_group_tests(tests, NULL, release);
}
