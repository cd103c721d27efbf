/* COBS frames with a checksum. Cheshire and Baker, "Consistent Overhead Byte Stuffing", 1999. */
#include "proto/wire/frame.h"

#include "proto/base/bytes.h"

#include <assert.h>

#define CRC_SIZE 4
#define BLOCK_MAX 0xff /* code of a block of 254 bytes that no zero follows */

/* The frame so far: `code` is where the length of the open block will stand. */
struct stuffing {
    uint8_t *frame;
    size_t code, at;
};

static void open_block(struct stuffing *out)
{
    out->code = out->at++;
}

static void close_block(struct stuffing *out)
{
    out->frame[out->code] = (uint8_t)(out->at - out->code);
}

static void stuff(struct stuffing *out, const uint8_t *data, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        /* A full block is closed only when something follows, so that none is empty at the end. */
        if (out->at - out->code == BLOCK_MAX) {
            close_block(out);
            open_block(out);
        }
        if (data[i] != 0) {
            out->frame[out->at++] = data[i];
        } else {
            close_block(out);
            open_block(out);
        }
    }
}

size_t lumi_wire_frame(const void *payload, size_t size, uint8_t *frame)
{
    struct stuffing out = {.frame = frame};
    uint32_t crc = lumi_crc32c(0, payload, size);
    const uint8_t tail[CRC_SIZE] = {(uint8_t)crc, (uint8_t)(crc >> 8), (uint8_t)(crc >> 16), (uint8_t)(crc >> 24)};

    assert(size <= LUMI_WIRE_PAYLOAD_MAX);
    frame[out.at++] = 0;
    open_block(&out);
    stuff(&out, payload, size);
    stuff(&out, tail, CRC_SIZE);
    close_block(&out);
    frame[out.at++] = 0;
    return out.at;
}

void lumi_wire_deframer_init(struct lumi_wire_deframer *deframer)
{
    *deframer = (struct lumi_wire_deframer){0};
}

static void keep(struct lumi_wire_deframer *deframer, uint8_t byte)
{
    if (deframer->size < sizeof deframer->data)
        deframer->data[deframer->size++] = byte;
    else
        deframer->bad = true;
}

/* At a delimiter: whether what stands before it is a whole frame; its payload is then data[0 .. size). */
static bool finish(struct lumi_wire_deframer *deframer)
{
    bool whole = !deframer->bad && deframer->left == 0 && deframer->size >= CRC_SIZE;

    if (whole) {
        const uint8_t *tail = deframer->data + deframer->size - CRC_SIZE;
        uint32_t crc = tail[0] | (uint32_t)tail[1] << 8 | (uint32_t)tail[2] << 16 | (uint32_t)tail[3] << 24;

        deframer->size -= CRC_SIZE;
        whole = lumi_crc32c(0, deframer->data, deframer->size) == crc;
    }
    if (whole)
        deframer->frames++;
    else
        deframer->errors++;
    deframer->code = 0;
    deframer->left = 0;
    deframer->bad = false;
    return whole;
}

bool lumi_wire_deframe(struct lumi_wire_deframer *deframer, uint8_t byte)
{
    if (byte == 0)
        return deframer->code != 0 && finish(deframer); /* between frames there may be any number of delimiters */
    if (deframer->left > 0) {
        deframer->left--;
        keep(deframer, byte);
        return false;
    }
    if (deframer->code == 0)
        deframer->size = 0;
    else if (deframer->code != BLOCK_MAX)
        keep(deframer, 0);
    deframer->code = byte;
    deframer->left = (uint8_t)(byte - 1);
    return false;
}
