/* The lamp's code and when its half bits are due. */
#include "firmware/core/lamp.h"

/* CRC-4-ITU (ITU-T G.704, 2.3.3.5): x⁴ + x + 1, most significant bit first. */
static unsigned crc4(unsigned number)
{
    unsigned rest = number << 4;

    for (int bit = 15; bit >= 4; bit--)
        if (rest >> bit & 1)
            rest ^= 0x13u << (bit - 4);
    return rest & 0xf;
}

uint64_t lamp_code(unsigned number)
{
    unsigned word = (number & 0xfff) << 4 | crc4(number & 0xfff);
    uint64_t code = 1;

    for (int i = 0; i < 16; i++) {
        uint64_t pair = word >> (15 - i) & 1 ? 1 : 2; /* on-off, off-on */
        code |= pair << (1 + 2 * i);
    }
    return code;
}

void lamp_init(struct lamp *lamp, const struct board *board)
{
    *lamp = (struct lamp){.board = board};
}

void lamp_send(struct lamp *lamp, unsigned number, uint64_t at, double bit_seconds)
{
    lamp->bits = lamp_code(number);
    lamp->left = LAMP_HALF_BITS;
    lamp->half_ticks = (uint64_t)(bit_seconds / 2 * BOARD_TICK_HZ);
    lamp->next = at;
}

void lamp_off(struct lamp *lamp)
{
    lamp->left = 0;
    lamp->next = 0;
    lamp->board->output(lamp->board->port, BOARD_OUT_LAMP, false);
}

/* next = 0: nothing is due. The last half bit is followed by one edge more, which switches the lamp off. */
void lamp_poll(struct lamp *lamp)
{
    if (lamp->next == 0 || lamp->board->now(lamp->board->port) < lamp->next)
        return;
    if (lamp->left == 0) {
        lamp_off(lamp);
        return;
    }
    lamp->board->output(lamp->board->port, BOARD_OUT_LAMP, lamp->bits & 1);
    lamp->bits >>= 1;
    lamp->left--;
    lamp->next += lamp->half_ticks;
}

uint64_t lamp_next_poll(const struct lamp *lamp)
{
    return lamp->next == 0 ? BOARD_NEVER : lamp->next;
}
