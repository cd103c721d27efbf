/* The rig profile in flash. Header, little-endian words: magic, format, sequence, size, checksum (CRC-32C of format,
 * sequence, size and the data), 0xffffffff three times; then the data, to a multiple of 4 with 0xff. */
#include "firmware/core/profile_store.h"

#include "proto/base/bytes.h"

#include <assert.h>
#include <string.h>

#define MAGIC 0x50524c4cu /* "LLRP" */
#define HEADER 32u
#define DATA_MAX (BOARD_PROFILE_SLOT_SIZE - HEADER)
static_assert(LUMI_WIRE_PROFILE_MAX <= DATA_MAX, "a profile fits a slot");
#define WORD_OF(bytes, index) word_at((bytes) + 4 * (index))

enum { MAGIC_WORD, FORMAT_WORD, SEQUENCE_WORD, SIZE_WORD, CHECKSUM_WORD };

static uint32_t word_at(const uint8_t *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static void set_word(uint8_t *header, int index, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        header[4 * index + i] = (uint8_t)(value >> (8 * i));
}

/* Over the header's fields and data that lies in flash or in memory. */
static uint32_t checksum(const uint8_t *header, const uint8_t *data, size_t size)
{
    return lumi_crc32c(lumi_crc32c(0, header + 4 * FORMAT_WORD, 4 * (CHECKSUM_WORD - FORMAT_WORD)), data, size);
}

/* Whether the slot holds a whole copy; `header` is what was read of it. With `data` (LUMI_WIRE_PROFILE_MAX bytes) its
 * data goes there. A copy of this format that is bigger than any profile is none, whatever its checksum, and the last
 * sequence is none that one could be written after. */
static bool read_slot(const struct board *board, int slot, uint8_t header[HEADER], uint8_t *data)
{
    const uint8_t *flash = board->flash_map(board->port, slot);

    memcpy(header, flash, HEADER);
    uint32_t size = WORD_OF(header, SIZE_WORD);
    uint32_t most = WORD_OF(header, FORMAT_WORD) > PROFILE_STORE_FORMAT ? DATA_MAX : LUMI_WIRE_PROFILE_MAX;
    if (WORD_OF(header, MAGIC_WORD) != MAGIC || WORD_OF(header, SEQUENCE_WORD) == UINT32_MAX || size == 0 ||
        size > most)
        return false;
    if (data) {
        if (size > LUMI_WIRE_PROFILE_MAX)
            return false;
        memcpy(data, flash + HEADER, size);
    }
    return checksum(header, data ? data : flash + HEADER, size) == WORD_OF(header, CHECKSUM_WORD);
}

/* The slot with the newest whole copy, and its header; −1: none. */
static int newest(const struct board *board, uint8_t header[HEADER])
{
    uint8_t found[HEADER];
    int best = -1;

    for (int slot = 0; slot < BOARD_PROFILE_SLOTS; slot++)
        if (read_slot(board, slot, found, NULL) &&
            (best < 0 || WORD_OF(found, SEQUENCE_WORD) > WORD_OF(header, SEQUENCE_WORD))) {
            memcpy(header, found, HEADER);
            best = slot;
        }
    return best;
}

int profile_store_load(const struct board *board, struct profile_store_scratch *scratch, struct lumi_rig *rig,
                       struct profile_store_copy *copy, struct lumi_error *error)
{
    uint8_t header[HEADER];
    int slot = newest(board, header);

    if (slot < 0)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "no profile is stored");
    if (WORD_OF(header, FORMAT_WORD) > PROFILE_STORE_FORMAT)
        return lumi_fail(error, LUMI_ERR_VERSION, "the stored profile is of format %u, this firmware knows %d",
                         (unsigned)WORD_OF(header, FORMAT_WORD), PROFILE_STORE_FORMAT);
    /* Once more, into memory: a copy that reads differently now is as good as none, and the other one counts. */
    if (!read_slot(board, slot, header, scratch->data)) {
        slot = (slot + 1) % BOARD_PROFILE_SLOTS;
        if (!read_slot(board, slot, header, scratch->data) || WORD_OF(header, FORMAT_WORD) > PROFILE_STORE_FORMAT)
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "no profile is stored");
    }
    uint32_t size = WORD_OF(header, SIZE_WORD);
    LUMI_TRY(lumi_wire_decode_profile(scratch->data, size, &scratch->message, rig, error));
    LUMI_TRY(lumi_rig_check(rig, error));
    if (copy) {
        copy->slot = slot;
        copy->sequence = WORD_OF(header, SEQUENCE_WORD);
        copy->size = size;
        copy->crc = lumi_crc32c(0, scratch->data, size);
    }
    return LUMI_OK;
}

const uint8_t *profile_store_data(const struct board *board, const struct profile_store_copy *copy)
{
    return board->flash_map(board->port, copy->slot) + HEADER;
}

/* Data in whole words; what is beyond its end stays erased. */
static bool write_data(const struct board *board, int slot, const uint8_t *data, size_t size)
{
    size_t whole = size & ~(size_t)3;
    uint8_t last[4] = {0xff, 0xff, 0xff, 0xff};

    if (whole && !board->flash_write(board->port, slot, HEADER, data, whole))
        return false;
    memcpy(last, data + whole, size - whole);
    return whole == size || board->flash_write(board->port, slot, HEADER + (uint32_t)whole, last, 4);
}

int profile_store_save(const struct board *board, const uint8_t *data, size_t size, bool replace_newer,
                       struct lumi_error *error)
{
    uint8_t header[HEADER], back[HEADER];
    uint32_t sequence = 1;
    int slot = 0, used;

    if (size == 0 || size > LUMI_WIRE_PROFILE_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "a profile of %u bytes, at most %u are kept", (unsigned)size,
                         (unsigned)LUMI_WIRE_PROFILE_MAX);
    used = newest(board, header);
    if (used >= 0) {
        if (WORD_OF(header, FORMAT_WORD) > PROFILE_STORE_FORMAT && !replace_newer)
            return lumi_fail(error, LUMI_ERR_VERSION,
                             "the stored profile is of format %u, which a newer firmware wrote",
                             (unsigned)WORD_OF(header, FORMAT_WORD));
        sequence = WORD_OF(header, SEQUENCE_WORD) + 1;
        slot = (used + 1) % BOARD_PROFILE_SLOTS;
        /* If the power went while its first word was written, that word may hold by luck. Writing the same bits once
         * more makes it firm, before the only other copy is erased. */
        board->flash_write(board->port, used, 0, header, 4);
    }
    memset(header, 0xff, sizeof header);
    set_word(header, MAGIC_WORD, MAGIC);
    set_word(header, FORMAT_WORD, PROFILE_STORE_FORMAT);
    set_word(header, SEQUENCE_WORD, sequence);
    set_word(header, SIZE_WORD, (uint32_t)size);
    set_word(header, CHECKSUM_WORD, checksum(header, data, size));
    if (!board->flash_erase(board->port, slot) || !write_data(board, slot, data, size) ||
        !board->flash_write(board->port, slot, 4, header + 4, 4 * CHECKSUM_WORD) ||
        !board->flash_write(board->port, slot, 0, header, 4))
        return lumi_fail(error, LUMI_ERR_IO, "the flash did not take the profile");
    const uint8_t *flash = board->flash_map(board->port, slot);
    if (!read_slot(board, slot, back, NULL) || memcmp(back, header, HEADER) != 0 ||
        memcmp(flash + HEADER, data, size) != 0)
        return lumi_fail(error, LUMI_ERR_IO, "the profile reads back from flash differently");
    return LUMI_OK;
}
