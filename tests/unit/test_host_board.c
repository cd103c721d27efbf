/* The board in virtual time: pulses with a preloaded period, triggers, watchdog, resets, flash and power cuts. */
#include "firmware/host/host_board.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

struct bench {
    struct host_board *board;
    const struct board *port;
    uint64_t steps[16], triggers[16], out_steps[16];
    uint32_t periods[16];
    int step_count, period_count, trigger_count, out_count, resets, polls;
    uint16_t lines;
    bool outputs[BOARD_OUTPUTS];
    bool kick, forward;
};

static void out_step(void *context, uint64_t at, bool forward)
{
    struct bench *bench = context;

    bench->out_steps[bench->out_count++ % 16] = at;
    bench->forward = forward;
}

static void out_lines(void *context, uint64_t at, uint16_t lines)
{
    struct bench *bench = context;

    (void)at;
    bench->lines = lines;
}

static void out_output(void *context, uint64_t at, enum board_output output, bool active)
{
    struct bench *bench = context;

    (void)at;
    bench->outputs[output] = active;
}

static void on_reset(void *context)
{
    struct bench *bench = context;

    bench->resets++;
}

static void on_poll(void *context)
{
    struct bench *bench = context;

    bench->polls++;
    if (bench->kick)
        bench->port->watchdog_kick(bench->port->port);
}

static uint32_t on_step(void *context, uint64_t at)
{
    struct bench *bench = context;
    int k = bench->step_count++;

    bench->steps[k % 16] = at;
    return k < bench->period_count ? bench->periods[k] : 0;
}

static void on_trigger(void *context, uint64_t at)
{
    struct bench *bench = context;

    bench->triggers[bench->trigger_count++ % 16] = at;
}

static void bench_init(struct bench *bench)
{
    const struct host_board_wires wires = {
        .context = bench, .step = out_step, .trigger_lines = out_lines, .output = out_output};
    const struct host_board_handlers handlers = {
        .context = bench, .reset = on_reset, .poll = on_poll, .on_step = on_step, .on_trigger = on_trigger};

    memset(bench, 0, sizeof *bench);
    bench->kick = true;
    bench->board = host_board_create(&wires);
    assert_non_null(bench->board);
    bench->port = host_board_port(bench->board);
    host_board_attach(bench->board, &handlers);
}

static void pulses_come_at_their_preloaded_periods(void **state)
{
    struct bench bench;

    (void)state;
    bench_init(&bench);
    bench.periods[0] = 300;
    bench.periods[1] = 400;
    bench.period_count = 2;
    bench.port->steps_start(bench.board, 1000, true, 200);
    host_board_run(bench.board, 1000000);
    /* Pulse 1 after `first`, 2 after what pulse 0 returned, 3 after what pulse 1 returned; pulse 2 said: 3 is the last.
     */
    assert_int_equal(bench.step_count, 4);
    assert_int_equal(bench.steps[0], 1000);
    assert_int_equal(bench.steps[1], 1200);
    assert_int_equal(bench.steps[2], 1500);
    assert_int_equal(bench.steps[3], 1900);
    assert_memory_equal(bench.steps, bench.out_steps, 4 * sizeof bench.steps[0]);
    assert_true(bench.forward);

    bench.step_count = bench.period_count = 0;
    bench.port->steps_start(bench.board, 2000000, false, 0);
    host_board_run(bench.board, 3000000);
    assert_int_equal(bench.step_count, 1);
    assert_false(bench.forward);
    host_board_destroy(bench.board);
}

static void a_stopped_train_gives_not_one_pulse_more(void **state)
{
    struct bench bench;

    (void)state;
    bench_init(&bench);
    for (int k = 0; k < 10; k++)
        bench.periods[k] = 1000;
    bench.period_count = 10;
    bench.port->steps_start(bench.board, 1000, true, 1000);
    host_board_run(bench.board, 3500);
    bench.port->steps_stop(bench.board);
    host_board_run(bench.board, 100000);
    assert_int_equal(bench.out_count, 3);
    host_board_destroy(bench.board);
}

static void a_trigger_is_out_at_its_tick_or_at_once(void **state)
{
    struct bench bench;

    (void)state;
    bench_init(&bench);
    bench.port->trigger_at(bench.board, 12345, 0x8001);
    host_board_run(bench.board, 12344);
    assert_int_equal(bench.lines, 0);
    host_board_run(bench.board, 12345);
    assert_int_equal(bench.lines, 0x8001);
    assert_int_equal(bench.triggers[0], 12345);
    bench.port->trigger_at(bench.board, 5, 0);
    assert_int_equal(host_board_next(bench.board), 12345);
    host_board_run(bench.board, 12345);
    assert_int_equal(bench.lines, 0);
    assert_int_equal(bench.triggers[1], 12345);
    bench.port->trigger_at(bench.board, 20000, 1);
    bench.port->trigger_cancel(bench.board);
    host_board_run(bench.board, 30000);
    assert_int_equal(bench.trigger_count, 2);
    host_board_destroy(bench.board);
}

static void the_watchdog_bites_what_does_not_kick_it(void **state)
{
    struct bench bench;

    (void)state;
    bench_init(&bench);
    host_board_run(bench.board, 5 * HOST_BOARD_WATCHDOG_TICKS);
    assert_int_equal(bench.resets, 1);
    bench.port->output(bench.board, BOARD_OUT_ENABLE, true);
    bench.port->steps_start(bench.board, host_board_now(bench.board) + 100, true, 0);
    host_board_hang(bench.board, 20 * HOST_BOARD_WATCHDOG_TICKS);
    host_board_run(bench.board, 7 * HOST_BOARD_WATCHDOG_TICKS);
    assert_int_equal(bench.out_count, 1); /* interrupts go on while the main loop hangs */
    assert_int_equal(bench.resets, 2);
    assert_false(bench.outputs[BOARD_OUT_ENABLE]);
    assert_int_equal(bench.port->reset_cause(bench.board), BOARD_RESET_WATCHDOG);
    host_board_destroy(bench.board);
}

static void flash_is_kept_over_a_reset_and_torn_by_a_power_cut(void **state)
{
    struct bench bench;
    uint8_t data[64];

    (void)state;
    bench_init(&bench);
    memset(data, 0x3c, sizeof data);
    assert_true(bench.port->flash_erase(bench.board, 0));
    assert_true(bench.port->flash_write(bench.board, 0, 128, data, sizeof data));
    host_board_reset(bench.board, BOARD_RESET_PIN);
    assert_memory_equal(bench.port->flash_map(bench.board, 0) + 128, data, sizeof data);
    assert_int_equal(bench.port->flash_map(bench.board, 0)[127], 0xff);

    host_board_cut_in_flash(bench.board, 20);
    assert_false(bench.port->flash_write(bench.board, 1, 0, data, sizeof data));
    assert_false(host_board_powered(bench.board));
    assert_false(bench.port->flash_write(bench.board, 1, 32, data, 32));
    host_board_power(bench.board, true);
    assert_int_equal(bench.resets, 3);
    assert_int_equal(bench.port->reset_cause(bench.board), BOARD_RESET_POWER);
    assert_memory_equal(bench.port->flash_map(bench.board, 1), data, 20);
    assert_int_equal(bench.port->flash_map(bench.board, 1)[21], 0xff);
    assert_int_equal(bench.port->flash_map(bench.board, 1)[40], 0xff);
    host_board_destroy(bench.board);
}

static void links_carry_bytes_both_ways_until_they_are_full(void **state)
{
    struct bench bench;
    uint8_t data[16384] = {1, 2, 3}, back[16];

    (void)state;
    bench_init(&bench);
    assert_int_equal(host_board_link_push(bench.board, BOARD_LINK_USB, data, 3), 3);
    assert_int_equal(bench.port->link_read(bench.board, BOARD_LINK_USB, back, 2), 2);
    assert_int_equal(bench.port->link_read(bench.board, BOARD_LINK_USB, back + 2, 9), 1);
    assert_memory_equal(back, data, 3);
    assert_int_equal(bench.port->link_read(bench.board, BOARD_LINK_SERIAL, back, 9), 0);
    assert_int_equal(bench.port->link_write(bench.board, BOARD_LINK_SERIAL, data, 5), 5);
    assert_int_equal(host_board_link_pull(bench.board, BOARD_LINK_SERIAL, back, sizeof back), 5);
    assert_memory_equal(back, data, 5);
    assert_in_range(host_board_link_push(bench.board, BOARD_LINK_USB, data, sizeof data), 1024, sizeof data - 1);
    host_board_destroy(bench.board);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pulses_come_at_their_preloaded_periods),
        cmocka_unit_test(a_stopped_train_gives_not_one_pulse_more),
        cmocka_unit_test(a_trigger_is_out_at_its_tick_or_at_once),
        cmocka_unit_test(the_watchdog_bites_what_does_not_kick_it),
        cmocka_unit_test(flash_is_kept_over_a_reset_and_torn_by_a_power_cut),
        cmocka_unit_test(links_carry_bytes_both_ways_until_they_are_full),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
