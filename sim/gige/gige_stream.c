/* GVSP (GigE Vision 2.0, chapters 23 to 25), without extended ids. */
#include "sim/gige/gige_stream.h"

#include <string.h>

enum { LEADER = 1, TRAILER = 2, PAYLOAD = 3 };
#define TYPE_IMAGE 0x0001
#define TYPE_CHUNKS 0x4000 /* beside it: chunk data follow the picture */
#define STATUS_UNAVAILABLE 0x800c

static void put16(uint8_t *at, unsigned value)
{
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)value;
}

static void put32(uint8_t *at, uint32_t value)
{
    put16(at, value >> 16);
    put16(at + 2, value & 0xffff);
}

static void header(uint8_t *packet, unsigned status, uint16_t block, unsigned kind, uint32_t number)
{
    put16(packet, status);
    put16(packet + 2, block);
    put32(packet + 4, (uint32_t)kind << 24 | (number & 0xffffff));
}

static size_t room(const struct gige_block *block)
{
    return block->packet_size - GIGE_STREAM_OVERHEAD;
}

uint32_t gige_stream_packets(const struct gige_block *block)
{
    return (uint32_t)((block->size + room(block) - 1) / room(block)) + 2;
}

static unsigned payload_type(const struct gige_block *block)
{
    return TYPE_IMAGE | (block->chunks ? TYPE_CHUNKS : 0);
}

static size_t leader(const struct gige_block *block, uint8_t *packet)
{
    uint8_t *at = packet + GIGE_STREAM_HEADER;

    header(packet, 0, block->id, LEADER, 0);
    memset(at, 0, 36);
    put16(at + 2, payload_type(block));
    put32(at + 4, (uint32_t)(block->timestamp >> 32));
    put32(at + 8, (uint32_t)block->timestamp);
    put32(at + 12, block->format);
    put32(at + 16, (uint32_t)block->width);
    put32(at + 20, (uint32_t)block->height);
    return GIGE_STREAM_HEADER + 36;
}

static size_t trailer(const struct gige_block *block, uint32_t number, uint8_t *packet)
{
    header(packet, 0, block->id, TRAILER, number);
    put32(packet + GIGE_STREAM_HEADER, payload_type(block));
    put32(packet + GIGE_STREAM_HEADER + 4, (uint32_t)block->height);
    return GIGE_STREAM_HEADER + 8;
}

size_t gige_stream_packet(const struct gige_block *block, uint32_t number, uint8_t *packet)
{
    const uint32_t count = gige_stream_packets(block);

    if (number == 0)
        return leader(block, packet);
    if (number == count - 1)
        return trailer(block, number, packet);
    if (number >= count)
        return gige_stream_refusal(block->id, number, packet);
    const size_t at = (size_t)(number - 1) * room(block);
    const size_t size = block->size - at < room(block) ? block->size - at : room(block);
    header(packet, 0, block->id, PAYLOAD, number);
    memcpy(packet + GIGE_STREAM_HEADER, block->data + at, size);
    return GIGE_STREAM_HEADER + size;
}

size_t gige_stream_refusal(uint16_t block, uint32_t number, uint8_t *packet)
{
    header(packet, STATUS_UNAVAILABLE, block, PAYLOAD, number);
    return GIGE_STREAM_HEADER;
}
