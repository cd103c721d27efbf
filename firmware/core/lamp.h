/* The lamp that cameras see in a video sweep: a code at every turn mark, by which frames are found.
 *
 * A code is a start bit (on), 12 bits of number, most significant first, each sent as on-off (1) or off-on (0)
 * (Manchester, so that it needs no exact frame rate), and a CRC-4 of the number sent the same way; then the lamp is
 * off. */
#ifndef LUMI_FIRMWARE_CORE_LAMP_H
#define LUMI_FIRMWARE_CORE_LAMP_H

#include "firmware/board/board.h"

struct lamp {
    const struct board *board;
    uint64_t next, bit_ticks;
    uint32_t bits;
    int left;
};
void lamp_init(struct lamp *lamp, const struct board *board);
/* Begins to send `number` (12 bits) at tick `at`. */
void lamp_send(struct lamp *lamp, unsigned number, uint64_t at, double bit_seconds);
void lamp_off(struct lamp *lamp);
void lamp_poll(struct lamp *lamp);
uint64_t lamp_next_poll(const struct lamp *lamp);
#define LAMP_HALF_BITS (1 + 2 * (12 + 4))
/* The code's half bits, first in bit 0. For decoders too. */
uint64_t lamp_code(unsigned number);

#endif
