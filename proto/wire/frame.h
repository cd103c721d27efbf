/* Frames over any stream of bytes: payload, CRC-32C (little-endian) of it, the whole COBS-encoded (Cheshire and Baker
 * 1999), a zero byte before and after. Freestanding. */
#ifndef LUMI_PROTO_WIRE_FRAME_H
#define LUMI_PROTO_WIRE_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_PAYLOAD_MAX 480 /* of one frame */
/* Bytes on the line for a payload of n: CRC, COBS overhead, two delimiters. */
#define LUMI_WIRE_FRAME_SIZE(n) ((n) + 4 + ((n) + 4) / 254 + 1 + 2)
#define LUMI_WIRE_FRAME_MAX LUMI_WIRE_FRAME_SIZE(LUMI_WIRE_PAYLOAD_MAX)

/* Writes the frame of `payload` (at most LUMI_WIRE_PAYLOAD_MAX bytes) into `frame` (LUMI_WIRE_FRAME_SIZE bytes);
 * returns its length. */
size_t lumi_wire_frame(const void *payload, size_t size, uint8_t *frame);

/* Takes frames out of a stream that may hold anything. */
struct lumi_wire_deframer {
    uint8_t data[LUMI_WIRE_PAYLOAD_MAX + 4];
    size_t size;
    uint8_t code, left;      /* of the COBS block in progress */
    bool bad;                /* until the next delimiter */
    uint32_t frames, errors; /* good ones; those dropped for COBS, length or CRC */
};
void lumi_wire_deframer_init(struct lumi_wire_deframer *deframer);
/* One byte. True: a whole payload stands in data[0 .. size) until the next byte. */
bool lumi_wire_deframe(struct lumi_wire_deframer *deframer, uint8_t byte);

#ifdef __cplusplus
}
#endif
#endif
