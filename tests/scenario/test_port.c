/* The port's timers on the emulated board, with a core of a few lines (port/port_exercise.c): every pulse on the pin is
 * told and every one told is on the pin, whenever it is stopped; edges and times are at their ticks. */
#include "sim/board/f405.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SAY = 0, MOVE, STOP, TRIGGERS, WHEN_FEEDBACK, WHEN_STEP, HOLD, HANG };
#define PULSES_MAX 120000

static struct {
    struct f405 *chip;
    uint64_t rises[PULSES_MAX], falls[PULSES_MAX], edges[20000];
    int rise_count, fall_count, edge_count;
    uint8_t said[24];
    size_t said_count;
    int moved;       /* times that the brake opened, the motor was switched off or a trigger rose */
    int blinks;      /* of the status light */
    int not_enabled; /* bytes sent without the line's driver */
    uint64_t seed;
} bench;

static void on_pin(void *context, int pin, enum f405_level level, uint64_t at)
{
    (void)context;
    if (level == F405_HIGH && (pin == F405_PIN('A', 6) || pin == F405_PIN('A', 7) || pin / 16 == 1))
        bench.moved++;
    if (level == F405_HIGH && pin == F405_PIN('C', 5))
        bench.blinks++;
    if (pin == F405_PIN('A', 0) && level == F405_HIGH)
        bench.rises[bench.rise_count++] = at;
    else if (pin == F405_PIN('A', 0))
        bench.falls[bench.fall_count++] = at;
    else if (pin / 16 == 1 && level == F405_HIGH && bench.edge_count < 20000)
        bench.edges[bench.edge_count++] = at;
}

static void on_byte(void *context, int usart, uint8_t byte, uint64_t at)
{
    (void)context, (void)at;
    if (usart == 2 && f405_output(bench.chip, F405_PIN('A', 1)) != F405_HIGH)
        bench.not_enabled++;
    if (usart == 2 && bench.said_count < sizeof bench.said)
        bench.said[bench.said_count++] = byte;
}

static int supply(void *context, int channel)
{
    (void)context, (void)channel;
    return 2000;
}

static unsigned any(unsigned below)
{
    bench.seed = bench.seed * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(bench.seed >> 33) % below;
}

static void run(double seconds)
{
    enum f405_stop stop = f405_run(bench.chip, f405_now(bench.chip) + (uint64_t)(seconds * F405_HZ));
    if (stop != F405_STOP_TIME)
        fail_msg("stopped: %s", f405_fault(bench.chip) ? f405_fault(bench.chip) : "?");
}

/* One command; the answer's word `word`. */
static uint32_t command(uint32_t what, uint32_t a, uint32_t b, uint32_t c, int word)
{
    const uint32_t words[4] = {what, a, b, c};
    uint32_t answer[6];

    bench.said_count = 0;
    f405_uart_in(bench.chip, 2, (const uint8_t *)words, sizeof words);
    run(0.005);
    assert_int_equal(bench.said_count, sizeof bench.said);
    memcpy(answer, bench.said, sizeof answer);
    return answer[word];
}

static uint64_t when(uint32_t what)
{
    uint64_t low = command(what, 0, 0, 0, 4);
    return low | (uint64_t)command(what, 0, 0, 0, 5) << 32;
}

static void forget(void)
{
    bench.rise_count = bench.fall_count = bench.edge_count = 0;
}

/* The one that was built with this test, or the one the environment names. */
static const char *image_path(void)
{
    const char *image = getenv("LUMI_PORT_IMAGE");
    return image ? image : LUMI_FIRMWARE "/port-exercise.bin";
}

static int boot(void **state)
{
    static const struct f405_ops ops = {.pin = on_pin, .uart_out = on_byte, .adc = supply};
    static uint8_t image[0x20000];
    FILE *file = fopen(image_path(), "rb");
    (void)state;

    if (!file)
        return 1;
    const size_t size = fread(image, 1, sizeof image, file);
    fclose(file);
    memset(&bench, 0, sizeof bench);
    bench.chip = f405_create(&ops, NULL);
    if (!bench.chip || !f405_flash_load(bench.chip, F405_FLASH, image, size))
        return 1;
    for (int i = 0; i < 12; i++)
        f405_drive(bench.chip, F405_PIN('C', i), i < 6 || i > 9 ? F405_LOW : F405_HIGH);
    f405_drive(bench.chip, F405_PIN('A', 3), F405_HIGH);
    f405_power(bench.chip, true);
    run(0.1);
    return 0;
}

static int finish(void **state)
{
    (void)state;
    f405_destroy(bench.chip);
    return 0;
}

static void pulses_are_as_many_as_asked_even_and_as_wide_as_said(void **state)
{
    static const uint32_t moves[][3] = {
        {1, 0, 420}, {2, 840, 420}, {1000, 840, 100}, {3, 4200000, 840}, {20000, 840, 420}};
    (void)state;

    for (size_t m = 0; m < sizeof moves / sizeof *moves; m++) {
        forget();
        command(MOVE, moves[m][0], moves[m][1], moves[m][2], 0);
        run(0.02 + moves[m][0] * (double)moves[m][1] / 84e6);
        assert_int_equal(bench.rise_count, moves[m][0]);
        assert_int_equal(bench.fall_count, moves[m][0]);
        assert_int_equal(command(SAY, 0, 0, 0, 0), moves[m][0]);
        for (int i = 0; i < bench.rise_count; i++) {
            assert_int_equal(bench.falls[i] - bench.rises[i], 2 * moves[m][2]);
            if (i > 0)
                assert_int_equal(bench.rises[i] - bench.rises[i - 1], 2 * moves[m][1]);
        }
    }
}

static void an_emergency_stop_at_any_time_lets_no_pulse_rise_and_loses_none(void **state)
{
    (void)state;
    for (int i = 0; i < 100; i++) {
        forget();
        command(MOVE, 100000, 840 + any(300), 100 + any(500), 0);
        run(any(100000) * 1e-8);
        const uint32_t presses = command(SAY, 0, 0, 0, 2);
        run(any(100000) * 1e-8);
        const uint64_t pressed = f405_now(bench.chip);
        f405_drive(bench.chip, F405_PIN('C', 0), F405_HIGH);
        run(0.02);
        /* The handler is entered within a few instructions. */
        assert_true(bench.rises[bench.rise_count - 1] <= pressed + 400);
        assert_int_equal(command(SAY, 0, 0, 0, 0), bench.rise_count);
        assert_int_equal(command(SAY, 0, 0, 0, 2), presses + 1);
        assert_int_equal(bench.fall_count, bench.rise_count);
        f405_drive(bench.chip, F405_PIN('C', 0), F405_LOW);
        run(0.001);
    }
}

static void an_emergency_stop_passes_every_lock(void **state)
{
    static const uint32_t words[4] = {HOLD, 7000, 0, 0};
    (void)state;
    forget();
    command(MOVE, 100000, 8400, 420, 0);
    f405_uart_in(bench.chip, 2, (const uint8_t *)words, sizeof words);
    for (int i = 0; i < 5000 && f405_output(bench.chip, F405_PIN('A', 8)) != F405_HIGH; i++)
        run(1e-6);
    f405_clear_stats(bench.chip);
    f405_drive(bench.chip, F405_PIN('C', 0), F405_HIGH);
    run(2e-5);
    assert_int_equal(f405_output(bench.chip, F405_PIN('A', 8)), F405_HIGH); /* it is held still */
    assert_int_equal(f405_stats(bench.chip, 16 + 6)->count, 1);
    const int risen = bench.rise_count;
    run(0.02);
    assert_int_equal(bench.rise_count, risen);
    assert_int_equal(command(SAY, 0, 0, 0, 0), risen);
    f405_drive(bench.chip, F405_PIN('C', 0), F405_LOW);
    run(0.001);
}

static void a_stop_at_any_time_loses_no_pulse_either(void **state)
{
    (void)state;
    for (int i = 0; i < 100; i++) {
        forget();
        command(MOVE, 100000, 840 + any(300), 420, 0);
        run(any(100000) * 1e-8);
        command(STOP, 0, 0, 0, 0);
        const int at_stop = bench.rise_count;
        run(0.02);
        assert_int_equal(bench.rise_count, at_stop);
        assert_int_equal(bench.fall_count, bench.rise_count);
        assert_int_equal(command(SAY, 0, 0, 0, 0), bench.rise_count);
    }
}

static void times_of_feedbacks_and_steps_are_one_clock_to_the_tick(void **state)
{
    (void)state;
    uint64_t edge = f405_now(bench.chip);
    f405_drive(bench.chip, F405_PIN('C', 6), F405_LOW);
    run(0.01);
    const int64_t offset = (int64_t)(edge - 2 * when(WHEN_FEEDBACK));
    for (int i = 0; i < 8; i++) {
        if (i == 4)
            run(52); /* over the wrap of its 32 bits */
        forget();
        command(MOVE, 3 + 7 * (uint32_t)i, 1000 + 13 * (uint32_t)i, 420, 0);
        run(0.02);
        const int64_t told = (int64_t)(2 * when(WHEN_STEP)) + offset;
        assert_in_range(told - (int64_t)bench.rises[bench.rise_count - 1] + 4, 0, 8);
    }
}

static void trigger_edges_are_at_their_ticks_while_steps_are_made(void **state)
{
    int64_t least = INT64_MAX, most = INT64_MIN, plan = 0;
    (void)state;

    forget();
    command(TRIGGERS, 84000, 0, 0, 0);
    command(MOVE, 50000, 840, 420, 0);
    run(0.5);
    assert_true(bench.edge_count > 500);
    for (int i = 0; i < bench.edge_count; i++) {
        plan += i > 0 ? 2 * (28000 + 17 * (int64_t)i) : 0;
        const int64_t error = (int64_t)bench.edges[i] - plan;
        least = error < least ? error : least;
        most = error > most ? error : most;
    }
    print_message("%d trigger edges within %lld cycles of 6 ns\n", bench.edge_count, (long long)(most - least));
    /* 0.15 µs, the emulation's own grain (f405.h, 1) within it. */
    assert_true(most - least <= 25);
    /* Nearer than the interrupt's lead: each edge asks for the next, so that one that is missed ends them all. */
    for (uint32_t ahead = 0; ahead <= 300; ahead += 50) {
        command(TRIGGERS, ahead, 0, 0, 0);
        forget();
        run(0.01);
        assert_true(bench.edge_count > 0);
    }
}

static void a_wire_that_has_come_off_reads_as_what_it_is_safest_to_believe(void **state)
{
    (void)state;
    f405_drive(bench.chip, F405_PIN('C', 6), F405_HIGH);
    assert_int_equal(command(SAY, 0, 0, 0, 3) & 0xfff, 0x40); /* "reached" alone */
    const uint32_t presses = command(SAY, 0, 0, 0, 2);
    for (int i = 0; i < 12; i++)
        f405_drive(bench.chip, F405_PIN('C', i), F405_FLOATING);
    f405_drive(bench.chip, F405_PIN('A', 3), F405_FLOATING);
    run(0.001);
    /* All inputs but the last, "reached"; no feedback. */
    assert_int_equal(command(SAY, 0, 0, 0, 3) & 0xfff, 0x3f);
    assert_int_equal(command(SAY, 0, 0, 0, 2), presses + 1);
    for (int i = 0; i < 12; i++)
        f405_drive(bench.chip, F405_PIN('C', i), i < 6 || i > 9 ? F405_LOW : F405_HIGH);
    run(0.001);
}

static void the_line_s_driver_is_on_while_bytes_are_sent_and_only_then(void **state)
{
    (void)state;
    assert_int_equal(f405_output(bench.chip, F405_PIN('A', 1)), F405_LOW);
    command(SAY, 0, 0, 0, 0);
    assert_int_equal(f405_output(bench.chip, F405_PIN('A', 1)), F405_LOW);
    assert_int_equal(bench.not_enabled, 0);
}

/* What the chip does by itself must not let go of the arm, nor fire. */
static void restarted(uint32_t resets, uint32_t cause)
{
    for (int i = 0; i < 100 && f405_resets(bench.chip) == resets; i++)
        run(0.02);
    assert_int_equal(f405_resets(bench.chip), resets + 1);
    forget();
    run(0.1);
    assert_int_equal(bench.rise_count, 0);
    assert_int_equal(bench.moved, 0);
    assert_int_equal(command(SAY, 0, 0, 0, 3) >> 16, cause);
}

/* enum board_reset */
enum { PIN = 1, WATCHDOG = 3 };

static void a_start_moves_nothing_and_opens_nothing(void **state)
{
    (void)state;
    bench.moved = 0;
    command(SAY, 0, 0, 0, 0);
    const uint32_t resets = f405_resets(bench.chip);
    f405_reset_pin(bench.chip);
    restarted(resets, PIN);
}

static void a_main_loop_that_hangs_is_ended_by_the_watchdog(void **state)
{
    static const uint32_t words[4] = {HANG, 0, 0, 0};
    (void)state;
    bench.moved = 0;
    const uint32_t resets = f405_resets(bench.chip);
    f405_uart_in(bench.chip, 2, (const uint8_t *)words, sizeof words);
    restarted(resets, WATCHDOG);
}

/* 5 µs are less than a period; 25 µs hold back more than one pulse's interrupt. */
static void a_pulse_that_was_missed_stops_all_of_them(void **state)
{
    static const uint32_t words[4] = {HOLD, 2100, 0, 0};
    (void)state;
    bench.moved = 0;
    forget();
    const uint32_t resets = f405_resets(bench.chip);
    command(MOVE, 20000, 840, 420, 0);
    command(HOLD, 420, 0, 0, 0);
    run(0.3);
    assert_int_equal(bench.rise_count, 20000);
    assert_int_equal(command(SAY, 0, 0, 0, 0), 20000);
    command(MOVE, 100000, 840, 420, 0);
    f405_uart_in(bench.chip, 2, (const uint8_t *)words, sizeof words);
    run(0.01);
    const int risen = bench.rise_count;
    run(0.01);
    assert_int_equal(bench.rise_count, risen);
    restarted(resets, WATCHDOG);
}

static void a_supply_that_sinks_stops_all_pulses_before_the_flash_fails(void **state)
{
    (void)state;
    bench.moved = 0;
    forget();
    const uint32_t resets = f405_resets(bench.chip);
    command(MOVE, 100000, 840, 420, 0);
    f405_set_supply(bench.chip, 2850);
    run(0.01);
    const int running = bench.rise_count;
    f405_set_supply(bench.chip, 2750);
    run(0.0001);
    const int risen = bench.rise_count;
    run(0.01);
    assert_true(running > 500);
    assert_int_equal(bench.rise_count, risen);
    f405_set_supply(bench.chip, 3300);
    restarted(resets, WATCHDOG);
}

static void a_crystal_that_breaks_ends_the_steps_and_the_light_says_so(void **state)
{
    (void)state;
    bench.moved = 0;
    forget();
    const uint32_t resets = f405_resets(bench.chip);
    command(MOVE, 100000, 840, 420, 0);
    f405_set_crystal(bench.chip, false);
    run(0.001);
    const int risen = bench.rise_count;
    run(1.5);
    assert_int_equal(bench.rise_count, risen);
    assert_int_equal(f405_resets(bench.chip), resets + 1); /* and stays there: no watchdog runs */
    const int blinks = bench.blinks;
    run(1);
    assert_in_range(bench.blinks - blinks, 2, 50);
    assert_int_equal(bench.moved, 0);
    f405_set_crystal(bench.chip, true);
    f405_reset_pin(bench.chip);
    restarted(resets + 1, WATCHDOG); /* what has ended the last run is not forgotten */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pulses_are_as_many_as_asked_even_and_as_wide_as_said),
        cmocka_unit_test(an_emergency_stop_at_any_time_lets_no_pulse_rise_and_loses_none),
        cmocka_unit_test(an_emergency_stop_passes_every_lock),
        cmocka_unit_test(a_stop_at_any_time_loses_no_pulse_either),
        cmocka_unit_test(times_of_feedbacks_and_steps_are_one_clock_to_the_tick),
        cmocka_unit_test(a_wire_that_has_come_off_reads_as_what_it_is_safest_to_believe),
        cmocka_unit_test(the_line_s_driver_is_on_while_bytes_are_sent_and_only_then),
        cmocka_unit_test(a_start_moves_nothing_and_opens_nothing),
        cmocka_unit_test(a_main_loop_that_hangs_is_ended_by_the_watchdog),
        cmocka_unit_test(a_pulse_that_was_missed_stops_all_of_them),
        cmocka_unit_test(a_supply_that_sinks_stops_all_pulses_before_the_flash_fails),
        cmocka_unit_test(a_crystal_that_breaks_ends_the_steps_and_the_light_says_so),
        /* It leaves triggers under way. */
        cmocka_unit_test(trigger_edges_are_at_their_ticks_while_steps_are_made),
    };
    FILE *image = fopen(image_path(), "rb");
    if (!image) {
        puts("skipped: the firmware is not built here");
        return 77;
    }
    fclose(image);
    return cmocka_run_group_tests_name("port", tests, boot, finish);
}
