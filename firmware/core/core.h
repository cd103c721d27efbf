/* The firmware: everything the rig's board does, knowing no register. One `struct core` is one board; a port (or a
 * simulation, which may run many) supplies a `struct board` and calls the entries below.
 *
 * 1. No heap, no stdio, no clock but the board's.
 * 2. core_poll is the main loop's body: it handles links, plans motion ahead, works the state machine off. A call takes
 *    well under a millisecond, except where flash is erased.
 * 3. The core_on_ entries come from interrupts. They only move numbers between queues and the board. */
#ifndef LUMI_FIRMWARE_CORE_CORE_H
#define LUMI_FIRMWARE_CORE_CORE_H

#include "firmware/board/board.h"

struct core; /* opaque; statically allocated: see core_size, or `core_state.h` within firmware */

size_t core_size(void);
void core_init(struct core *core, const struct board *board);
void core_poll(struct core *core);
/* The latest tick at which core_poll wants to be called again though nothing else happens; BOARD_NEVER: no hurry. What
 * sleeping and virtual time go by. */
uint64_t core_next_poll(const struct core *core);

/* From interrupts. */
/* Pulse k has risen at tick `at`: returns the ticks from pulse k + 1 to pulse k + 2, or 0. */
uint32_t core_on_step(struct core *core, uint64_t at);
/* The pending trigger pattern is out since tick `at`. */
void core_on_trigger(struct core *core, uint64_t at);
void core_on_input(struct core *core, enum board_input input, bool active, uint64_t at);
void core_on_feedback(struct core *core, int input, bool active, uint64_t at);

#endif
