/* The port of the firmware for a PC in virtual time: a board whose clock, timers, pins, links and flash are numbers in
 * memory. The core (or a test of one part of it) runs on it unchanged; what its pins are wired to is the caller's.
 *
 * 1. Nothing happens by itself: host_board_run takes the board from now to a tick and does, in order of time, every
 * step pulse, trigger edge, watchdog reset and main-loop poll that is due on the way. host_board_next says when the
 * first of them is.
 * 2. Interrupt entries run between two polls, never inside one. Time stands still during a poll, but for flash: erasing
 *    and writing take as long as the chip takes, and everything that falls due meanwhile is late.
 * 3. A reset loses everything but the flash: outputs go inactive, links are emptied, the firmware starts anew. Without
 *    power nothing runs at all. What cuts the power inside a flash operation leaves the slot torn. */
#ifndef LUMI_FIRMWARE_HOST_BOARD_H
#define LUMI_FIRMWARE_HOST_BOARD_H

#include "firmware/board/board.h"

struct host_board;

/* What the pins are wired to; NULL entries are not connected (outputs go nowhere, inputs are inactive). Called at the
 * tick at which it happens, in order of time. */
struct host_board_wires {
    void *context;
    void (*step)(void *context, uint64_t at, bool forward);
    void (*trigger_lines)(void *context, uint64_t at, uint16_t lines);
    void (*output)(void *context, uint64_t at, enum board_output output, bool active);
    bool (*input)(void *context, enum board_input input);
    bool (*feedback)(void *context, int input);
    int (*supply_mv)(void *context); /* not connected: 24 V */
};

/* The firmware: the core (host_board_attach_core), or the part of it that a test is about. NULL entries are left out.
 */
struct host_board_handlers {
    void *context;
    void (*reset)(void *context); /* the firmware starts: at creation, and after every reset */
    void (*poll)(void *context);
    uint64_t (*next_poll)(void *context);
    uint32_t (*on_step)(void *context, uint64_t at);
    void (*on_trigger)(void *context, uint64_t at);
    void (*on_input)(void *context, enum board_input input, bool active, uint64_t at);
    void (*on_feedback)(void *context, int input, bool active, uint64_t at);
};

struct host_board *host_board_create(const struct host_board_wires *wires);
void host_board_destroy(struct host_board *board);
/* The port, to give to the code under test. It stays the board's. */
const struct board *host_board_port(struct host_board *board);
/* Sets the firmware and starts it (its reset handler runs). */
void host_board_attach(struct host_board *board, const struct host_board_handlers *handlers);
/* The whole core; it is allocated here and goes with the board. False: no memory. */
struct core;
bool host_board_attach_core(struct host_board *board);
struct core *host_board_core(struct host_board *board);

/* Main loop: how long after an interrupt or a due poll it comes round (latency), and the longest pause between two
 * polls. Both in ticks; 20 µs and 50 ms unless set. */
void host_board_set_loop(struct host_board *board, uint32_t latency, uint32_t longest);
/* The chip's identity: 12 bytes made of a number. */
void host_board_set_unique_id(struct host_board *board, uint32_t number);

uint64_t host_board_now(const struct host_board *board);
uint64_t host_board_next(struct host_board *board);
/* Runs to tick `to` and stands there. */
void host_board_run(struct host_board *board, uint64_t to);

/* Edges of the inputs, at ticks that are not before the last thing told. */
void host_board_input(struct host_board *board, enum board_input input, bool active, uint64_t at);
void host_board_feedback(struct host_board *board, int input, bool active, uint64_t at);

/* Links, seen from the far end: bytes towards the board (returns how many fit), bytes from it. */
size_t host_board_link_push(struct host_board *board, enum board_link link, const uint8_t *data, size_t size);
size_t host_board_link_pull(struct host_board *board, enum board_link link, uint8_t *data, size_t size);
void host_board_link_set_up(struct host_board *board, enum board_link link, bool up);

/* Resets, power, and the main loop hanging (interrupts go on; the watchdog bites after its time). */
void host_board_reset(struct host_board *board, enum board_reset cause);
void host_board_power(struct host_board *board, bool on);
bool host_board_powered(const struct host_board *board);
void host_board_hang(struct host_board *board, uint64_t until);
#define HOST_BOARD_WATCHDOG_TICKS (2ull * BOARD_TICK_HZ)

/* Flash. `cut`: the power goes when so many more bytes are written (an erase counts as its slot's size); the board is
 * then without power until host_board_power. UINT64_MAX: no cut. */
void host_board_cut_in_flash(struct host_board *board, uint64_t bytes);

struct host_board_counts {
    uint64_t steps, triggers, polls;
    uint32_t resets, loader; /* loader: times the firmware went to it */
    uint32_t late_triggers;  /* asked for when their tick had passed */
    uint32_t overrun;        /* bytes a link dropped because nobody took them */
    uint32_t flash_faults;   /* writes over bytes that were not erased */
};
const struct host_board_counts *host_board_counts(const struct host_board *board);

#endif
