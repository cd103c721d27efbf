/* A switch whose contacts bounce: which edges are real, where, and when.
 *
 * A change counts once the contacts have been quiet for DEBOUNCE_TICKS; it is dated to the first contact, which is
 * where the mark is, however long they bounced afterwards. A pulse shorter than that is no change: a mark must be under
 * its switch for longer. Edges are told from interrupts, debounce_poll is called with these held off. */
#ifndef LUMI_FIRMWARE_CORE_DEBOUNCE_H
#define LUMI_FIRMWARE_CORE_DEBOUNCE_H

#include "firmware/board/board.h"

#define DEBOUNCE_TICKS (BOARD_TICK_HZ / 200) /* 5 ms */

struct debounce_edge {
    bool active;
    int64_t position; /* steps, at the first contact */
    uint64_t at;      /* tick of it */
};

struct debounce {
    bool settled; /* what the switch says once it is quiet: ask this */
    bool level;   /* what it said last */
    bool bouncing;
    struct debounce_edge first;
    uint64_t latest;
};

void debounce_init(struct debounce *debounce, bool active);
/* The switch says `active` since tick `at`, at `position`. The same again is nothing. */
void debounce_input(struct debounce *debounce, bool active, int64_t position, uint64_t at);
/* True: `settled` has changed, by `edge`. */
bool debounce_poll(struct debounce *debounce, uint64_t now, struct debounce_edge *edge);

#endif
