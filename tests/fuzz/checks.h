/* What the targets share: what is asked of every failure, and memory that ends. */
#ifndef LUMI_TESTS_FUZZ_CHECKS_H
#define LUMI_TESTS_FUZZ_CHECKS_H

#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/base/result.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A failure says why, in one line. Returns the code. */
static inline int checked(int code, const struct lumi_error *error)
{
    if (code != LUMI_OK && (error->code != code || !error->text[0] || strchr(error->text, '\n')))
        abort();
    return code;
}

/* Reads the input once as it is, and one input in eight again with memory that ends after as many allocations as its
 * last byte says. */
static inline void with_and_without_memory(const uint8_t *data, size_t size, void (*read)(const uint8_t *, size_t))
{
    read(data, size);
    if (size == 0 || size % 8 != 0)
        return;
    lumi_alloc_fail_after(data[size - 1] % 64);
    read(data, size);
    lumi_alloc_fail_after(-1);
}

/* The same for a format that ends with a CRC-32C of all before it; and the input with the checksum that fits it. */
static inline void with_and_without_checksum(const uint8_t *data, size_t size, void (*read)(const uint8_t *, size_t))
{
    struct lumi_writer writer;

    with_and_without_memory(data, size, read);
    lumi_writer_init(&writer);
    lumi_write_bytes(&writer, data, size);
    lumi_write_u32(&writer, lumi_crc32c(0, data, size));
    read(writer.data, writer.size);
    lumi_writer_finish(&writer);
}

#endif
