/* The core of the emulated board against ARM DDI0403E, by a program of its own (core/exceptions.c): who preempts whom,
 * who is next, masks, sleep, and the floating-point registers of who was interrupted. */
#include "sim/board/f405.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static char told[256];
static int count;
static uint64_t slept_until;

static void uart_out(void *context, int usart, uint8_t byte, uint64_t at)
{
    (void)context;
    (void)usart;
    if (byte == 'w')
        slept_until = at;
    if (count < 255)
        told[count++] = (char)byte;
}

static void exceptions_come_in_the_order_of_the_manual(void **state)
{
    static const struct f405_ops ops = {.uart_out = uart_out};
    static uint8_t image[4096];
    FILE *file = fopen(BOARD_CORE_IMAGE, "rb");
    assert_non_null(file);
    size_t size = fread(image, 1, sizeof image, file);
    fclose(file);
    struct f405 *chip = f405_create(&ops, NULL);
    assert_non_null(chip);
    assert_true(f405_flash_load(chip, F405_FLASH, image, size));
    f405_power(chip, true);
    assert_int_equal(f405_run(chip, F405_HZ / 100), F405_STOP_TIME);
    assert_null(f405_fault(chip));
    /* aCbd: 7 preempts 6, 8 waits. -Cad: by urgency, then by number. C-a: 6 is held off. ws: the sleep ends, then the
     * handler runs. df: the registers are as they were. */
    assert_string_equal(told, "aCbd -Cad C-a ws df.");
    assert_true(slept_until > F405_HZ / 1000 && slept_until < F405_HZ / 1000 * 1.2);
    assert_int_equal(f405_stats(chip, 16 + 8)->count, 3);
    f405_destroy(chip);
    (void)state;
}

static void what_is_not_there_stops_the_run_with_words(void **state)
{
    /* Vectors, then: ldr r0, [pc, #4]; ldr r1, [r0]; b .; the address of CAN1, which is not modelled. */
    static const uint32_t program[] = {0x20001000, 0x08000009, 0x68014801, 0x0000e7fe, 0x40006400};
    static const struct f405_ops ops;
    struct f405 *chip = f405_create(&ops, NULL);
    assert_non_null(chip);
    assert_true(f405_flash_load(chip, F405_FLASH, program, sizeof program));
    f405_power(chip, true);
    assert_int_equal(f405_run(chip, 1000), F405_STOP_FAULT);
    assert_non_null(strstr(f405_fault(chip), "0x40006400"));
    assert_non_null(strstr(f405_fault(chip), "0x08000008"));
    f405_destroy(chip);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exceptions_come_in_the_order_of_the_manual),
        cmocka_unit_test(what_is_not_there_stops_the_run_with_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
