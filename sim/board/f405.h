/* An STM32F405 that runs the bytes that are flashed: Unicorn's Cortex-M4 with this folder's own models of the core's
 * exceptions and of the peripherals the firmware uses, written from RM0090 (rev. 19), DS8626 (rev. 9), PM0214 and ARM
 * DDI0403E.
 *
 * 1. Time is cycles of 168 MHz since the first power-on. An instruction takes one cycle of the core's clock (the chip
 *    takes some 1.2 on average), 12 more at exception entry and 10 at return (no lazy stacking). What hardware does by
 *    itself (timers, DMA, bytes on a line) is exact to a cycle; what an instruction does is stamped with the end of its
 *    basic block, and an interrupt begins with the next basic block.
 * 2. An access to anything that is not modelled, to a peripheral without its clock, or against the manual's rules (a
 *    PLL out of range, flash wait states, DMA into core-coupled memory) stops the run with a text: f405_fault.
 * 3. Pins are numbered port × 16 + bit, PA0 = 0. */
#ifndef LUMI_SIM_BOARD_F405_H
#define LUMI_SIM_BOARD_F405_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define F405_HZ 168000000u
#define F405_NEVER UINT64_MAX
#define F405_PIN(port, bit) (((port) - 'A') * 16 + (bit))
#define F405_PINS 144
#define F405_FLASH 0x08000000u
#define F405_FLASH_SIZE 0x100000u
#define F405_USARTS 7      /* 1 .. 6; 0 is none */
#define F405_EXCEPTIONS 98 /* 16 of the core, 82 of the chip (RM0090 table 61) */

struct f405;

enum f405_stop {
    F405_STOP_TIME = 0, /* `until` is reached */
    F405_STOP_LOADER,   /* the program counter is in the chip's own loader */
    F405_STOP_OFF,      /* no power */
    F405_STOP_FAULT     /* f405_fault says what */
};
enum f405_level { F405_LOW = 0, F405_HIGH = 1, F405_FLOATING = 2 };

/* What stands around the chip. Called in order of time; entries may be NULL. */
struct f405_ops {
    /* An output of the chip became `level` (floating: it is an input now) at cycle `at`. */
    void (*pin)(void *context, int pin, enum f405_level level, uint64_t at);
    /* When the outside changes by itself next, and that it is due. */
    uint64_t (*next)(void *context);
    void (*event)(void *context, uint64_t now);
    void (*uart_out)(void *context, int usart, uint8_t byte, uint64_t at);
    int (*adc)(void *context, int channel); /* 0 .. 4095 */
};

/* Of one exception since the last f405_clear_stats. Instructions of what interrupted it are not its own. */
struct f405_exception_stats {
    uint64_t count, instructions;
    uint32_t instructions_max;
    uint64_t latency_max; /* cycles from pending to its first instruction */
};

/* NULL: no memory, or Unicorn refuses. Created without power and with erased flash. */
struct f405 *f405_create(const struct f405_ops *ops, void *context);
void f405_destroy(struct f405 *chip);
bool f405_flash_load(struct f405 *chip, uint32_t address, const void *data, size_t size);
void f405_set_unique_id(struct f405 *chip, const uint8_t id[12]);

/* Power comes back with a power-on reset. Going, it leaves a flash operation half done: a sector's bits partly erased,
 * a word's bits partly programmed. */
void f405_power(struct f405 *chip, bool on);
/* The NRST pin, a pulse. */
void f405_reset_pin(struct f405 *chip);

/* Runs to cycle `until`, skipping the time in which the core sleeps. */
enum f405_stop f405_run(struct f405 *chip, uint64_t until);
uint64_t f405_now(const struct f405 *chip);
const char *f405_fault(const struct f405 *chip); /* NULL: none */
uint64_t f405_instructions(const struct f405 *chip);
uint32_t f405_resets(const struct f405 *chip); /* since creation, power-on included */
/* The power goes in the middle of the n-th erase or write of the flash from now; 0: not. */
void f405_cut_in_flash(struct f405 *chip, unsigned operation);
const struct f405_exception_stats *f405_stats(const struct f405 *chip, int exception);
void f405_clear_stats(struct f405 *chip);

/* The crystal breaks, or swings again. */
void f405_set_crystal(struct f405 *chip, bool works);

/* The chip's supply; 3,300 mV from its creation on. */
void f405_set_supply(struct f405 *chip, unsigned millivolts);

/* The outside drives a pin or lets go of it, now. */
void f405_drive(struct f405 *chip, int pin, enum f405_level level);
/* What the chip drives it with. */
enum f405_level f405_output(const struct f405 *chip, int pin);
/* Bytes to a USART's RX pin, one after another at its baud rate, after those before; returns how many were taken. */
size_t f405_uart_in(struct f405 *chip, int usart, const uint8_t *data, size_t size);
/* The next byte arrives with a framing error. */
void f405_uart_break(struct f405 *chip, int usart);

/* ---- the USB connector, for a host (usb_host.h): one call is one transaction on the bus ---- */
enum f405_usb_answer { F405_USB_NONE = -1, F405_USB_ACK = 0, F405_USB_NAK, F405_USB_STALL };
bool f405_usb_attached(const struct f405 *chip); /* the device pulls D+ up */
void f405_usb_vbus(struct f405 *chip, bool on);
void f405_usb_reset(struct f405 *chip, bool begin);   /* SE0 begins or ends */
void f405_usb_suspend(struct f405 *chip, bool begin); /* the bus is idle for 3 ms; activity */
void f405_usb_sof(struct f405 *chip, unsigned frame);
enum f405_usb_answer f405_usb_setup(struct f405 *chip, int address, int endpoint, const uint8_t setup[8]);
enum f405_usb_answer f405_usb_out(struct f405 *chip, int address, int endpoint, bool data1, const uint8_t *data,
                                  size_t size);
/* `data` holds at least 64 bytes; `*data1` the toggle of what came. */
enum f405_usb_answer f405_usb_in(struct f405 *chip, int address, int endpoint, uint8_t *data, size_t *size,
                                 bool *data1);

#endif
