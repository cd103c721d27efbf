/* The rig profile in the board's flash: two slots, so that a write cut short leaves the profile there was.
 *
 * 1. A slot is a header (docs/rig-profile.md, "On the board") and the encoded Profile message (proto/wire). The header
 *    is written last and its first word at the very end: what has no whole header is no profile.
 * 2. The slot that is not in use is erased and written; its sequence number is one higher; the highest valid one
 * counts.
 * 3. A copy is read from flash once, into the caller's buffer; checksum, decoding and lumi_rig_check go by that buffer,
 *    because cells that an erase was cut in may read differently every time.
 * 4. What a newer firmware stored is neither used nor overwritten unless that is asked for. */
#ifndef LUMI_FIRMWARE_CORE_PROFILE_STORE_H
#define LUMI_FIRMWARE_CORE_PROFILE_STORE_H

#include "firmware/board/board.h"
#include "proto/wire/message.h"

#define PROFILE_STORE_FORMAT 1

/* What load needs room for. `data` holds the encoded profile afterwards. */
struct profile_store_scratch {
    lumi_wire_Profile message;
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
};
struct profile_store_copy {
    int slot;
    uint32_t sequence, size, crc; /* crc: CRC-32C of the encoded profile, as Status and CommitProfile have it */
};

/* The newest profile that is whole: LUMI_OK; LUMI_ERR_NOTFOUND (neither slot has one), LUMI_ERR_VERSION (a newer
 * firmware wrote it), LUMI_ERR_FORMAT (it is whole, but such a rig cannot be). `rig` is only what was loaded if
 * LUMI_OK. `copy` may be NULL. */
int profile_store_load(const struct board *board, struct profile_store_scratch *scratch, struct lumi_rig *rig,
                       struct profile_store_copy *copy, struct lumi_error *error);

/* The encoded profile of a copy that was loaded, in flash. */
const uint8_t *profile_store_data(const struct board *board, const struct profile_store_copy *copy);

/* Stores `size` bytes of an encoded profile that the caller has decoded and checked. Erases and writes flash: only at
 * rest. LUMI_ERR_IO: the flash refused or reads back differently, the old profile still counts. LUMI_ERR_VERSION: a
 * newer firmware's profile is there and `replace_newer` is false. LUMI_ERR_LIMIT: bigger than a profile can be. */
int profile_store_save(const struct board *board, const uint8_t *data, size_t size, bool replace_newer,
                       struct lumi_error *error);

#endif
