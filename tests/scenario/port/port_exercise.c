/* A core of a few lines for the emulated board: it does what 16 bytes on the serial line say, so that the port can be
 * tried without the firmware around it. Commands are four words; the answer is six: pulses told, edges told, presses
 * told, the cause of the reset in bits 16 and up with the inputs and feedbacks below it, and a time. Compiled for the
 * board (firmware/stm32f405/cross), run by test_port. */
#include "firmware/core/core.h"
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/port.h"

#include <string.h>

enum { SAY = 0, MOVE, STOP, TRIGGERS, WHEN_FEEDBACK, WHEN_STEP, HOLD, HANG };

struct core {
    volatile uint32_t pulses, edges, presses;
    volatile uint64_t step_at, feedback_at;
    uint32_t count, period;
    uint64_t trigger;
    uint16_t lines;
};
static struct core core;
struct core *const the_core = &core;

uint32_t core_on_step(struct core *c, uint64_t at)
{
    c->step_at = at;
    c->pulses++;
    return c->pulses + 1 < c->count ? c->period : 0;
}

void core_on_trigger(struct core *c, uint64_t at)
{
    (void)at;
    c->edges++;
    c->lines = (uint16_t)(c->lines << 1 | c->lines >> 15);
    c->trigger += 28000 + 17 * c->edges;
    trigger_at(c->trigger, c->lines);
}

void core_on_input(struct core *c, enum board_input input, bool active, uint64_t at)
{
    (void)at;
    if (input == BOARD_IN_ESTOP && active) {
        c->presses++;
        steps_stop();
    }
}

void core_on_feedback(struct core *c, int input, bool active, uint64_t at)
{
    (void)input, (void)active;
    c->feedback_at = at;
}

static uint32_t levels(void)
{
    uint32_t all = (uint32_t)system_reset_cause() << 16;

    for (int i = 0; i < BOARD_INPUTS; i++)
        all |= (uint32_t)pin_input((enum board_input)i) << i;
    for (int i = 0; i < 4; i++)
        all |= (uint32_t)pin_feedback(i) << (8 + i);
    return all;
}

/* Holds the core's interrupts off for so many ticks; the lamp is lit meanwhile. */
static void hold(uint32_t ticks)
{
    const uint32_t before = basepri_raise(PRIORITY_CORE);
    const uint64_t begun = time_now();

    pin_output(BOARD_OUT_LAMP, true);
    while (time_now() - begun < ticks)
        ;
    pin_output(BOARD_OUT_LAMP, false);
    basepri_restore(before);
}

static void execute(struct core *c, const uint32_t command[4])
{
    uint64_t when = command[0] == WHEN_STEP ? c->step_at : c->feedback_at;
    uint32_t answer[6] = {0};

    if (command[0] == MOVE) {
        c->pulses = 0;
        c->count = command[1];
        c->period = command[2];
        steps_pulse_width(command[3]);
        steps_start(time_now() + BOARD_TICK_HZ / 1000, true, command[1] > 1 ? command[2] : 0);
    } else if (command[0] == STOP) {
        steps_stop();
    } else if (command[0] == TRIGGERS) {
        c->lines = 1;
        c->edges = 0;
        c->trigger = time_now() + command[1];
        trigger_at(c->trigger, c->lines);
    } else if (command[0] == HOLD) {
        hold(command[1]);
    }
    while (command[0] == HANG)
        ;
    answer[0] = c->pulses;
    answer[1] = c->edges;
    answer[2] = c->presses;
    answer[3] = levels();
    memcpy(answer + 4, &when, sizeof when);
    serial_write((const uint8_t *)answer, sizeof answer);
}

int main(void);
int main(void)
{
    uint32_t command[4];
    size_t got = 0;

    clock_init();
    pins_init();
    time_init();
    steps_init();
    system_init();
    serial_init();
    usb_init();
    inputs_init();
    for (;;) {
        watchdog_kick();
        got += serial_read((uint8_t *)command + got, sizeof command - got);
        if (got == sizeof command) {
            got = 0;
            execute(&core, command);
        }
        wait_for_interrupt(); /* SysTick's at the latest */
    }
}
