/* Events that are kept until the host has them: a ring of encoded events, oldest pushed out and counted when it is
 * full. Freestanding; filled and read by one thread (the board's main loop). */
#ifndef LUMI_PROTO_WIRE_EVENTS_H
#define LUMI_PROTO_WIRE_EVENTS_H

#include "proto/wire/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_EVENT_BYTES 12288

struct lumi_wire_events {
    uint8_t bytes[LUMI_WIRE_EVENT_BYTES]; /* records: 16-bit length, encoded Event */
    uint32_t head, tail;                  /* places in bytes, modulo its size */
    uint32_t first, next;                 /* numbers: of the oldest kept; of the next */
    uint32_t lost;                        /* pushed out before they were acknowledged */
    uint32_t cursor, cursor_at;           /* the next to send, and where it lies */
};
void lumi_wire_events_init(struct lumi_wire_events *events);
/* Gives `event` its number and keeps it. */
void lumi_wire_events_add(struct lumi_wire_events *events, lumi_wire_Event *event);
/* The host has all before `next`. Numbers that cannot be are ignored. */
void lumi_wire_events_acknowledge(struct lumi_wire_events *events, uint32_t next);
/* The next one to send, or NULL; `*size` its length. Moves on. */
const uint8_t *lumi_wire_events_take(struct lumi_wire_events *events, size_t *size, uint8_t *copy);
/* Sends all that are kept again, from the oldest (retransmission). */
void lumi_wire_events_rewind(struct lumi_wire_events *events);

#ifdef __cplusplus
}
#endif
#endif
