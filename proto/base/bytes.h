/* Reading and writing little-endian bytes without running past their end, and the checksums that guard them. */
#ifndef LUMI_PROTO_BASE_BYTES_H
#define LUMI_PROTO_BASE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A reader over bytes that stay the caller's. Past the end it returns zeros and `failed` stays set, so that a whole
 * record can be read and checked once. */
struct lumi_reader {
    const uint8_t *data;
    size_t size, at;
    bool failed;
};

void lumi_reader_init(struct lumi_reader *reader, const void *data, size_t size);
uint8_t lumi_read_u8(struct lumi_reader *reader);
uint16_t lumi_read_u16(struct lumi_reader *reader);
uint32_t lumi_read_u32(struct lumi_reader *reader);
uint64_t lumi_read_u64(struct lumi_reader *reader);
float lumi_read_f32(struct lumi_reader *reader);
double lumi_read_f64(struct lumi_reader *reader);
/* LEB128, at most 10 bytes. */
uint64_t lumi_read_varint(struct lumi_reader *reader);
/* `count` bytes in place, or NULL (and failed) if there are not so many. */
const uint8_t *lumi_read_bytes(struct lumi_reader *reader, size_t count);
size_t lumi_reader_left(const struct lumi_reader *reader);

/* A growing buffer. `failed` is set when memory could not be had; then nothing more is appended. */
struct lumi_writer {
    uint8_t *data;
    size_t size, capacity;
    bool failed;
};

void lumi_writer_init(struct lumi_writer *writer);
void lumi_writer_finish(struct lumi_writer *writer);
void lumi_write_u8(struct lumi_writer *writer, uint8_t value);
void lumi_write_u16(struct lumi_writer *writer, uint16_t value);
void lumi_write_u32(struct lumi_writer *writer, uint32_t value);
void lumi_write_u64(struct lumi_writer *writer, uint64_t value);
void lumi_write_f32(struct lumi_writer *writer, float value);
void lumi_write_f64(struct lumi_writer *writer, double value);
void lumi_write_varint(struct lumi_writer *writer, uint64_t value);
void lumi_write_bytes(struct lumi_writer *writer, const void *data, size_t count);

/* Signed numbers as unsigned, small magnitudes small (for varints): 0 -1 1 -2 2 ... → 0 1 2 3 4 ... */
static inline uint64_t lumi_zigzag(int64_t value)
{
    return ((uint64_t)value << 1) ^ (uint64_t)(value >> 63);
}
static inline int64_t lumi_unzigzag(uint64_t value)
{
    return (int64_t)(value >> 1) ^ -(int64_t)(value & 1);
}

/* CRC-32C (Castagnoli; RFC 3720, appendix B.4). `crc` is 0 to begin with, or an earlier result to go on from. */
uint32_t lumi_crc32c(uint32_t crc, const void *data, size_t size);

/* FNV-1a, 64 bit: for hash tables and seeds, not against accidents. */
uint64_t lumi_fnv1a(uint64_t hash, const void *data, size_t size);
#define LUMI_FNV1A_BASIS UINT64_C(14695981039346656037)

#ifdef __cplusplus
}
#endif
#endif
