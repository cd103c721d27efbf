/* The port as the core sees it, and the main loop. */
#include "firmware/stm32f405/port.h"
#include "firmware/core/core_state.h"
#include "firmware/stm32f405/cortex.h"

static struct core core;
struct core *const the_core = &core;

static uint64_t board_now(void *port)
{
    (void)port;
    return time_now();
}

static unsigned board_lock(void *port)
{
    (void)port;
    return basepri_raise(PRIORITY_CORE);
}

static void board_unlock(void *port, unsigned state)
{
    (void)port;
    basepri_restore(state);
}

static void board_steps_start(void *port, uint64_t at, bool forward, uint32_t first)
{
    (void)port;
    steps_start(at, forward, first);
}

static void board_steps_stop(void *port)
{
    (void)port;
    steps_stop();
}

static void board_step_pulse_width(void *port, uint32_t ticks)
{
    (void)port;
    steps_pulse_width(ticks);
}

static void board_trigger_at(void *port, uint64_t at, uint16_t lines)
{
    (void)port;
    trigger_at(at, lines);
}

static void board_trigger_cancel(void *port)
{
    (void)port;
    trigger_cancel();
}

static void board_trigger_lines(void *port, uint16_t lines)
{
    (void)port;
    trigger_lines(lines);
}

static bool board_input(void *port, enum board_input input)
{
    (void)port;
    return pin_input(input);
}

static void board_output(void *port, enum board_output output, bool active)
{
    (void)port;
    pin_output(output, active);
}

static bool board_feedback(void *port, int input)
{
    (void)port;
    return pin_feedback(input);
}

static int board_supply_mv(void *port)
{
    (void)port;
    return system_supply_mv();
}

static enum board_reset board_reset_cause(void *port)
{
    (void)port;
    return system_reset_cause();
}

static void board_watchdog_kick(void *port)
{
    (void)port;
    watchdog_kick();
}

static void board_unique_id(void *port, uint8_t id[BOARD_UNIQUE_ID])
{
    (void)port;
    system_unique_id(id);
}

static uint32_t board_boot_number(void *port)
{
    (void)port;
    return system_boot_number();
}

static size_t board_link_read(void *port, enum board_link link, uint8_t *data, size_t size)
{
    (void)port;
    return link == BOARD_LINK_SERIAL ? serial_read(data, size) : usb_read(data, size);
}

static size_t board_link_write(void *port, enum board_link link, const uint8_t *data, size_t size)
{
    (void)port;
    return link == BOARD_LINK_SERIAL ? serial_write(data, size) : usb_write(data, size);
}

/* A serial line has no sign of life of its own. */
static bool board_link_up(void *port, enum board_link link)
{
    (void)port;
    return link == BOARD_LINK_SERIAL || usb_up();
}

static bool board_flash_erase(void *port, int slot)
{
    (void)port;
    return flash_erase_slot(slot);
}

static bool board_flash_write(void *port, int slot, uint32_t offset, const void *data, size_t size)
{
    (void)port;
    return flash_write_slot(slot, offset, data, size);
}

static const uint8_t *board_flash_map(void *port, int slot)
{
    (void)port;
    return flash_slot(slot);
}

static void board_enter_loader(void *port)
{
    (void)port;
    system_enter_loader();
}

static void board_restart(void *port)
{
    (void)port;
    system_restart();
}

static const struct board board = {
    .name = BOARD_NAME,
    .now = board_now,
    .lock = board_lock,
    .unlock = board_unlock,
    .steps_start = board_steps_start,
    .steps_stop = board_steps_stop,
    .step_pulse_width = board_step_pulse_width,
    .trigger_at = board_trigger_at,
    .trigger_cancel = board_trigger_cancel,
    .trigger_lines = board_trigger_lines,
    .input = board_input,
    .output = board_output,
    .feedback = board_feedback,
    .supply_mv = board_supply_mv,
    .reset_cause = board_reset_cause,
    .watchdog_kick = board_watchdog_kick,
    .unique_id = board_unique_id,
    .boot_number = board_boot_number,
    .link_read = board_link_read,
    .link_write = board_link_write,
    .link_up = board_link_up,
    .flash_erase = board_flash_erase,
    .flash_write = board_flash_write,
    .flash_map = board_flash_map,
    .enter_loader = board_enter_loader,
    .restart = board_restart,
};

/* Sleeps when the core wants nothing within SysTick's next millisecond. Interrupts that come after the look at the
 * clock end the sleep though they are off (ARM DDI0403, section B1.5.17). */
static void sleep_until(uint64_t wanted)
{
    const uint32_t primask = irq_disable();

    if (wanted > time_now() + BOARD_TICK_HZ / 1000)
        wait_for_interrupt();
    irq_restore(primask);
}

int main(void);
int main(void)
{
    clock_init();
    pins_init();
    time_init();
    steps_init();
    system_init();
    serial_init();
    if (!ON_QEMU)
        usb_init();
    core_init(&core, &board);
    inputs_init(); /* its interrupts call the core */
    for (;;) {
        core_poll(&core);
        sleep_until(core_next_poll(&core));
    }
}
