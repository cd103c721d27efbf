/* The emulated board in its rig: the chip with the bytes that are flashed, the mechanics on its pins (as
 * firmware/stm32f405/pins.h and docs/rig-board.md have them), and both links. Every edge on the step and trigger pins
 * is kept with its time.
 *
 * Times are cycles of 168 MHz (f405.h), two of which are one tick of the board's port. */
#ifndef LUMI_SIM_BOARD_F405_MACHINE_H
#define LUMI_SIM_BOARD_F405_MACHINE_H

#include "sim/board/f405.h"
#include "sim/board/usb_host.h"
#include "sim/rig/mechanics.h"

struct f405_machine;

struct f405_machine_edge {
    uint64_t at;
    uint16_t lines; /* the trigger lines from then on; of a step: 1 forward, 0 backward */
};

/* NULL: no memory, or Unicorn refuses. The power is off. */
struct f405_machine *f405_machine_create(const struct lumi_rig *truth, const struct sim_mechanics_options *options);
void f405_machine_destroy(struct f405_machine *machine);
/* Flashes a .bin; LUMI_ERR_IO and so on where it cannot be read. */
int f405_machine_flash(struct f405_machine *machine, const char *path, struct lumi_error *error);

/* These stay the machine's. */
struct f405 *f405_machine_chip(struct f405_machine *machine);
struct sim_mechanics *f405_machine_mechanics(struct f405_machine *machine);
struct usb_host *f405_machine_usb(struct f405_machine *machine);

/* Runs `seconds`; how it stopped. */
enum f405_stop f405_machine_run(struct f405_machine *machine, double seconds);
enum f405_stop f405_machine_run_to(struct f405_machine *machine, uint64_t cycle);
uint64_t f405_machine_now(const struct f405_machine *machine);
void f405_machine_power(struct f405_machine *machine, bool on);
/* The power goes when the flash has been busy for the n-th time from now, in the middle of that operation. */
void f405_machine_power_cut_in_flash(struct f405_machine *machine, unsigned operation);

/* Bytes of the serial link: what the board has sent since, to the board. */
size_t f405_machine_serial_read(struct f405_machine *machine, uint8_t *data, size_t size);
size_t f405_machine_serial_write(struct f405_machine *machine, const uint8_t *data, size_t size);

/* Rising edges of the step pin, changes of the trigger lines, in order; and forgetting them. */
const struct f405_machine_edge *f405_machine_steps(const struct f405_machine *machine, int *count);
const struct f405_machine_edge *f405_machine_triggers(const struct f405_machine *machine, int *count);
void f405_machine_forget_edges(struct f405_machine *machine);

#endif
