/* Flash of two slots for tests: programming clears bits, a power cut leaves a word or a slot half done, with cells that
 * read differently every time. */
#ifndef LUMI_TESTS_UNIT_FLASH_MODEL_H
#define LUMI_TESTS_UNIT_FLASH_MODEL_H

#include "firmware/board/board.h"

#include <string.h>

#define FLASH_MODEL_WORDS (BOARD_PROFILE_SLOT_SIZE / 4)

struct flash_model {
    uint32_t cells[BOARD_PROFILE_SLOTS][FLASH_MODEL_WORDS];
    uint32_t unstable[BOARD_PROFILE_SLOTS][FLASH_MODEL_WORDS]; /* bits that read as anything */
    uint32_t view[BOARD_PROFILE_SLOTS][FLASH_MODEL_WORDS];     /* what the last flash_map read */
    long until_cut; /* words and erases until the power goes; −1: it stays */
    long done;      /* words and erases since `done` was cleared */
    bool powered, refuses;
    int worn; /* word of every slot that takes nothing; −1: none */
    uint32_t seed;
};

static uint32_t flash_model_random(struct flash_model *flash)
{
    uint32_t x = flash->seed; /* xorshift, Marsaglia 2003 */

    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return flash->seed = x;
}

/* Cells that an operation has reached when the power goes: none of a word's, nearly all, or anything between. */
static uint32_t flash_model_reached(struct flash_model *flash)
{
    uint32_t reached = 0;

    for (uint32_t n = flash_model_random(flash) % 8; n > 0; n--)
        reached |= flash_model_random(flash);
    return reached;
}

/* Whether this operation is the one in which the power goes. */
static bool flash_model_cut(struct flash_model *flash)
{
    flash->done++;
    if (flash->until_cut < 0 || flash->until_cut-- > 0)
        return false;
    flash->powered = false;
    return true;
}

static bool flash_model_erase(void *port, int slot)
{
    struct flash_model *flash = port;

    if (!flash->powered || flash->refuses)
        return false;
    bool cut = flash_model_cut(flash);
    for (int i = 0; i < FLASH_MODEL_WORDS; i++) {
        uint32_t reached = cut ? flash_model_reached(flash) : UINT32_MAX;
        flash->unstable[slot][i] = cut ? ~reached & flash_model_random(flash) : 0;
        flash->cells[slot][i] |= reached;
    }
    return !cut;
}

static bool flash_model_write(void *port, int slot, uint32_t offset, const void *data, size_t size)
{
    struct flash_model *flash = port;
    const uint8_t *bytes = data;

    for (size_t at = 0; at < size; at += 4) {
        uint32_t word, *cell = &flash->cells[slot][(offset + at) / 4];
        if (!flash->powered || flash->refuses)
            return false;
        memcpy(&word, bytes + at, 4);
        bool cut = flash_model_cut(flash);
        uint32_t reached = cut ? flash_model_reached(flash) : UINT32_MAX;
        uint32_t *unstable = &flash->unstable[slot][(offset + at) / 4];
        /* A cell that is being programmed when the power goes may end up between the two. */
        if (cut)
            *unstable |= ~word & *cell & ~reached & flash_model_random(flash);
        else
            *unstable &= word;
        if ((int)((offset + at) / 4) != flash->worn)
            *cell &= word | ~reached;
    }
    return flash->powered;
}

static const uint8_t *flash_model_map(void *port, int slot)
{
    struct flash_model *flash = port;

    for (int i = 0; i < FLASH_MODEL_WORDS; i++) {
        flash->view[slot][i] = flash->cells[slot][i];
        if (flash->unstable[slot][i])
            flash->view[slot][i] ^= flash_model_random(flash) & flash->unstable[slot][i];
    }
    return (const uint8_t *)flash->view[slot];
}

/* Erased, powered; `board` has its flash and nothing else. */
static void flash_model_init(struct flash_model *flash, struct board *board, uint32_t seed)
{
    memset(flash, 0, sizeof *flash);
    memset(flash->cells, 0xff, sizeof flash->cells);
    flash->until_cut = -1;
    flash->powered = true;
    flash->worn = -1;
    flash->seed = seed * 2654435761u | 1;
    memset(board, 0, sizeof *board);
    board->port = flash;
    board->flash_erase = flash_model_erase;
    board->flash_write = flash_model_write;
    board->flash_map = flash_model_map;
}

#endif
