/* Little-endian bytes and checksums. */
#include "proto/base/bytes.h"

#include "proto/base/memory.h"

#include <string.h>

void lumi_reader_init(struct lumi_reader *reader, const void *data, size_t size)
{
    *reader = (struct lumi_reader){.data = data, .size = size};
}

const uint8_t *lumi_read_bytes(struct lumi_reader *reader, size_t count)
{
    if (reader->failed || count > reader->size - reader->at) {
        reader->failed = true;
        return NULL;
    }
    const uint8_t *here = reader->data + reader->at;
    reader->at += count;
    return here;
}

size_t lumi_reader_left(const struct lumi_reader *reader)
{
    return reader->failed ? 0 : reader->size - reader->at;
}

static uint64_t read_little(struct lumi_reader *reader, unsigned count)
{
    const uint8_t *bytes = lumi_read_bytes(reader, count);
    uint64_t value = 0;

    if (bytes)
        for (unsigned i = count; i-- > 0;)
            value = value << 8 | bytes[i];
    return value;
}

uint8_t lumi_read_u8(struct lumi_reader *reader)
{
    return (uint8_t)read_little(reader, 1);
}

uint16_t lumi_read_u16(struct lumi_reader *reader)
{
    return (uint16_t)read_little(reader, 2);
}

uint32_t lumi_read_u32(struct lumi_reader *reader)
{
    return (uint32_t)read_little(reader, 4);
}

uint64_t lumi_read_u64(struct lumi_reader *reader)
{
    return read_little(reader, 8);
}

float lumi_read_f32(struct lumi_reader *reader)
{
    uint32_t bits = lumi_read_u32(reader);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

double lumi_read_f64(struct lumi_reader *reader)
{
    uint64_t bits = lumi_read_u64(reader);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

uint64_t lumi_read_varint(struct lumi_reader *reader)
{
    uint64_t value = 0;

    for (unsigned shift = 0; shift < 70; shift += 7) {
        uint8_t byte = lumi_read_u8(reader);
        if (shift == 63 && byte > 1)
            break;
        value |= (uint64_t)(byte & 0x7f) << shift;
        if (!(byte & 0x80))
            return reader->failed ? 0 : value;
    }
    reader->failed = true;
    return 0;
}

void lumi_writer_init(struct lumi_writer *writer)
{
    *writer = (struct lumi_writer){0};
}

void lumi_writer_finish(struct lumi_writer *writer)
{
    lumi_free(writer->data);
    *writer = (struct lumi_writer){0};
}

void lumi_write_bytes(struct lumi_writer *writer, const void *data, size_t count)
{
    if (writer->failed || count == 0)
        return;
    if (count > writer->capacity - writer->size) {
        size_t capacity = writer->capacity + writer->capacity / 2 + count + 64;
        uint8_t *grown = lumi_realloc(writer->data, capacity, 1);
        if (!grown) {
            writer->failed = true;
            return;
        }
        writer->data = grown;
        writer->capacity = capacity;
    }
    memcpy(writer->data + writer->size, data, count);
    writer->size += count;
}

static void write_little(struct lumi_writer *writer, uint64_t value, unsigned count)
{
    uint8_t bytes[8];

    for (unsigned i = 0; i < count; i++)
        bytes[i] = (uint8_t)(value >> (8 * i));
    lumi_write_bytes(writer, bytes, count);
}

void lumi_write_u8(struct lumi_writer *writer, uint8_t value)
{
    write_little(writer, value, 1);
}

void lumi_write_u16(struct lumi_writer *writer, uint16_t value)
{
    write_little(writer, value, 2);
}

void lumi_write_u32(struct lumi_writer *writer, uint32_t value)
{
    write_little(writer, value, 4);
}

void lumi_write_u64(struct lumi_writer *writer, uint64_t value)
{
    write_little(writer, value, 8);
}

void lumi_write_f32(struct lumi_writer *writer, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    write_little(writer, bits, 4);
}

void lumi_write_f64(struct lumi_writer *writer, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    write_little(writer, bits, 8);
}

void lumi_write_varint(struct lumi_writer *writer, uint64_t value)
{
    while (value >= 0x80) {
        lumi_write_u8(writer, (uint8_t)(value | 0x80));
        value >>= 7;
    }
    lumi_write_u8(writer, (uint8_t)value);
}

/* CRC-32C of every byte value, reflected polynomial 0x82f63b78, computed four bits at a time from this half table. */
static const uint32_t crc_half[16] = {0x00000000, 0x105ec76f, 0x20bd8ede, 0x30e349b1, 0x417b1dbc, 0x5125dad3,
                                      0x61c69362, 0x7198540d, 0x82f63b78, 0x92a8fc17, 0xa24bb5a6, 0xb21572c9,
                                      0xc38d26c4, 0xd3d3e1ab, 0xe330a81a, 0xf36e6f75};

uint32_t lumi_crc32c(uint32_t crc, const void *data, size_t size)
{
    const uint8_t *bytes = data;

    crc = ~crc;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        crc = crc >> 4 ^ crc_half[crc & 15];
        crc = crc >> 4 ^ crc_half[crc & 15];
    }
    return ~crc;
}

uint64_t lumi_fnv1a(uint64_t hash, const void *data, size_t size)
{
    const uint8_t *bytes = data;

    for (size_t i = 0; i < size; i++)
        hash = (hash ^ bytes[i]) * UINT64_C(1099511628211);
    return hash;
}
