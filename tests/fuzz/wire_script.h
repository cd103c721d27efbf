/* An input to one end of a link, read as a script: records of a kind, a length and so many bytes. What is left when it
 * ends is not read. */
#ifndef LUMI_TESTS_FUZZ_WIRE_SCRIPT_H
#define LUMI_TESTS_FUZZ_WIRE_SCRIPT_H

#include "proto/wire/frame.h"

#include <string.h>

struct script {
    const uint8_t *data;
    size_t size;
};

struct record {
    uint8_t kind, argument;
    const uint8_t *data;
    size_t size; /* at most LUMI_WIRE_PAYLOAD_MAX */
};

static inline bool script_next(struct script *script, struct record *record)
{
    if (script->size < 3)
        return false;
    record->kind = script->data[0] & 0x0f;
    record->argument = script->data[0] >> 4;
    record->size = script->data[1] | (size_t)(script->data[2] & 1) << 8;
    if (record->size > LUMI_WIRE_PAYLOAD_MAX)
        record->size = LUMI_WIRE_PAYLOAD_MAX;
    script->data += 3;
    script->size -= 3;
    if (record->size > script->size)
        record->size = script->size;
    record->data = script->data;
    script->data += record->size;
    script->size -= record->size;
    return true;
}

/* The first bytes of a record as a number. */
static inline uint64_t record_number(const struct record *record)
{
    uint64_t value = 0;

    memcpy(&value, record->data, record->size < sizeof value ? record->size : sizeof value);
    return value;
}

#endif
