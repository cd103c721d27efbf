/* A field's bytes damaged in every way that differs by where it lies: cut and flipped in the header, in the table of
 * sections, in every section and between them; as accidents do it, and with the checksums of header, table and section
 * made right again, as somebody who means harm does it. */
#ifndef LUMI_TESTS_FIELD_DAMAGE_H
#define LUMI_TESTS_FIELD_DAMAGE_H

#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/lightfield/field_layout.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

struct damage {
    const uint8_t *data; /* of the whole file */
    size_t size;
    void (*use)(void *context, const char *name, const uint8_t *data, size_t size, bool mended);
    void *context;
};

static inline uint64_t damage_get(const uint8_t *at, int bytes)
{
    uint64_t value = 0;

    for (int i = bytes - 1; i >= 0; i--)
        value = value << 8 | at[i];
    return value;
}

static inline void damage_put32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (8 * i));
}

/* Makes all checksums right that can be found, after the file was changed. */
static inline void damage_mend(uint8_t *data, size_t size)
{
    size_t count = (size_t)damage_get(data + 12, 4), room = (size - FIELD_HEADER_SIZE) / FIELD_ENTRY_SIZE;

    count = count < room ? count : room;
    for (size_t i = 0; i < count; i++) {
        uint8_t *entry = data + FIELD_HEADER_SIZE + i * FIELD_ENTRY_SIZE;
        uint64_t offset = damage_get(entry + 8, 8), bytes = damage_get(entry + 16, 8);
        if (offset <= size && bytes <= size - offset)
            damage_put32(entry + 4, lumi_crc32c(0, data + offset, (size_t)bytes));
    }
    damage_put32(data + 32, lumi_crc32c(0, data + FIELD_HEADER_SIZE, count * FIELD_ENTRY_SIZE));
    damage_put32(data + 60, lumi_crc32c(0, data, 60));
}

/* The byte at `at` with a bit flipped, set to 255, and both again with the checksums mended. */
static inline void damage_byte(const struct damage *damage, const char *what, size_t at)
{
    static const char *const ways[] = {"flip", "full", "flip-mended", "full-mended"};
    uint8_t *copy = lumi_alloc(damage->size, 1);
    char name[128];

    for (int way = 0; copy && way < 4; way++) {
        memcpy(copy, damage->data, damage->size);
        copy[at] = way % 2 == 0 ? (uint8_t)(copy[at] ^ 1u << (at % 8)) : 255;
        if (way >= 2)
            damage_mend(copy, damage->size);
        snprintf(name, sizeof name, "%s-%zu-%s", what, at, ways[way]);
        damage->use(damage->context, name, copy, damage->size, way >= 2);
    }
    lumi_free(copy);
}

static inline void damage_cut(const struct damage *damage, const char *what, size_t size)
{
    uint8_t *copy = lumi_alloc(size + 1, 1); /* of this size, so that reading past its end shows */
    char name[128];

    if (copy && size < damage->size) {
        memcpy(copy, damage->data, size);
        snprintf(name, sizeof name, "%s-cut-%zu", what, size);
        damage->use(damage->context, name, copy, size, false);
        if (size >= FIELD_HEADER_SIZE) {
            memset(copy + 16, 0, 8);
            damage_put32(copy + 16, (uint32_t)size);
            damage_mend(copy, size);
            snprintf(name, sizeof name, "%s-cut-%zu-mended", what, size);
            damage->use(damage->context, name, copy, size, true);
        }
    }
    lumi_free(copy);
}

static inline void damage_section(const struct damage *damage, const uint8_t *entry, int steps)
{
    static const char *const names[SECTION_KINDS] = {"none",   "field",      "grids", "views", "meshes",
                                                     "coding", "references", "side",  "tiles"};
    unsigned kind = (unsigned)damage_get(entry, 2), level = (unsigned)damage_get(entry + 2, 2);
    size_t offset = (size_t)damage_get(entry + 8, 8), size = (size_t)damage_get(entry + 16, 8);
    char what[32];

    snprintf(what, sizeof what, "%s%u", kind < SECTION_KINDS ? names[kind] : "other", level);
    damage_cut(damage, what, offset);
    for (int i = 0; size > 0 && i < steps; i++) {
        size_t at = offset + (size - 1) * (size_t)i / (size_t)(steps > 1 ? steps - 1 : 1);
        damage_byte(damage, what, at);
        damage_cut(damage, what, at + 1);
    }
    if (offset + size < damage->size && (offset + size) % FIELD_ALIGNMENT != 0)
        damage_byte(damage, "between", offset + size);
}

/* Every byte of the header and of the table (only every `stride`th with a larger stride), `steps` bytes a section. */
static inline void damage_everywhere(const struct damage *damage, size_t stride, int steps)
{
    size_t count = (size_t)damage_get(damage->data + 12, 4), table = FIELD_HEADER_SIZE + count * FIELD_ENTRY_SIZE;

    for (size_t at = 0; at < FIELD_HEADER_SIZE; at += stride) {
        damage_byte(damage, "header", at);
        damage_cut(damage, "header", at);
    }
    for (size_t at = FIELD_HEADER_SIZE; at < table; at += stride) {
        damage_byte(damage, "table", at);
        damage_cut(damage, "table", at);
    }
    for (size_t i = 0; i < count; i++)
        damage_section(damage, damage->data + FIELD_HEADER_SIZE + i * FIELD_ENTRY_SIZE, steps);
    damage_cut(damage, "end", damage->size - 1);
}

#endif
