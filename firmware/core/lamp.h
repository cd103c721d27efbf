/* The lamp that cameras see in a video sweep: a code at every turn mark, by which frames are found.
 *
 * A code is a start bit (on), 12 bits of number, most significant first, each sent as on-off (1) or off-on (0)
 * (Manchester, so that it needs no exact frame rate), and a CRC-4 of the number sent the same way; then the lamp is
 * off.
 *
 * The lamp is switched by the main loop: an edge comes up to a poll late (under a millisecond; a half bit lasts several
 * frames of video). Each edge is placed from the code's begin, so lateness does not add up. */
#ifndef LUMI_FIRMWARE_CORE_LAMP_H
#define LUMI_FIRMWARE_CORE_LAMP_H

#include "firmware/board/board.h"

struct lamp {
    const struct board *board;
    uint64_t next, half_ticks; /* when the next half bit begins, and how long one lasts */
    uint64_t bits;             /* half bits to come, the next in bit 0 */
    int left;
};
void lamp_init(struct lamp *lamp, const struct board *board);
/* Begins to send `number` (12 bits) at tick `at`; `bit_seconds` is one bit, two half bits. What was being sent ends. */
void lamp_send(struct lamp *lamp, unsigned number, uint64_t at, double bit_seconds);
void lamp_off(struct lamp *lamp);
void lamp_poll(struct lamp *lamp);
uint64_t lamp_next_poll(const struct lamp *lamp);
#define LAMP_HALF_BITS (1 + 2 * (12 + 4))
/* The code's half bits, first in bit 0. For decoders too. */
uint64_t lamp_code(unsigned number);

#endif
