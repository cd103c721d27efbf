/* The profile in the board's flash: the input is what the two slots hold. The first byte says whether checksums are put
 * right, so that what is behind them is reached. What is loaded must be a rig, and must be found again when it is
 * saved. */
#include "checks.h"

#include "firmware/core/profile_store.h"
#include "proto/base/bytes.h"

static uint32_t slots[BOARD_PROFILE_SLOTS][BOARD_PROFILE_SLOT_SIZE / 4];

static bool erase(void *port, int slot)
{
    (void)port;
    memset(slots[slot], 0xff, sizeof slots[slot]);
    return true;
}

static bool program(void *port, int slot, uint32_t offset, const void *data, size_t size)
{
    (void)port;
    for (size_t i = 0; i < size; i++)
        ((uint8_t *)slots[slot])[offset + i] &= ((const uint8_t *)data)[i];
    return true;
}

static const uint8_t *map(void *port, int slot)
{
    (void)port;
    return (const uint8_t *)slots[slot];
}

/* Header and data as given, with magic, size and checksum made right. */
static void mend(int slot, size_t most)
{
    uint32_t *words = slots[slot];
    size_t size = words[3] < most ? words[3] : most;

    words[0] = 0x50524c4c;
    words[1] = words[1] % 3;
    words[3] = (uint32_t)size;
    words[4] = lumi_crc32c(lumi_crc32c(0, words + 1, 12), words + 8, size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct profile_store_scratch scratch;
    static uint8_t encoded[LUMI_WIRE_PROFILE_MAX];
    const struct board board = {.flash_erase = erase, .flash_write = program, .flash_map = map};
    struct lumi_error error = {0};
    struct profile_store_copy copy;
    struct lumi_rig rig;

    if (size < 2)
        return 0;
    size_t half = (size - 1) * data[1] / 255, rest = size - 1 - half;
    const uint8_t *at = data + 1;
    for (int slot = 0; slot < 2; slot++) {
        size_t length = slot ? rest : half;
        erase(NULL, slot);
        length = length < sizeof slots[slot] ? length : sizeof slots[slot];
        memcpy(slots[slot], at, length);
        at += half;
        if ((data[0] >> slot & 1) && length > 32)
            mend(slot, length - 32);
    }
    if (checked(profile_store_load(&board, &scratch, &rig, &copy, &error), &error) != LUMI_OK)
        return 0;
    if (lumi_rig_check(&rig, NULL) != LUMI_OK || copy.size > sizeof encoded)
        abort();
    memcpy(encoded, scratch.data, copy.size);
    uint32_t crc = copy.crc, sequence = copy.sequence;
    if (sequence == UINT32_MAX - 1) /* the next would be none */
        return 0;
    if (profile_store_save(&board, encoded, copy.size, false, NULL) != LUMI_OK ||
        profile_store_load(&board, &scratch, &rig, &copy, NULL) != LUMI_OK || copy.crc != crc ||
        copy.sequence <= sequence)
        abort();
    return 0;
}
