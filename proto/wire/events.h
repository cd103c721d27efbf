/* Events that are kept until the host has them: a ring of encoded events, oldest pushed out and counted when it is
 * full. Freestanding; filled and read by one thread (the board's main loop).
 *
 * 1. The events first … next − 1 are kept, at head, one after the other; first <= cursor <= next (modulo 2^32: numbers
 *    wrap, and less than half of them are ever kept).
 * 2. A number is given once. An event leaves by being acknowledged, or pushed out, and then it is counted in `lost`. */
#ifndef LUMI_PROTO_WIRE_EVENTS_H
#define LUMI_PROTO_WIRE_EVENTS_H

#include "proto/wire/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_EVENT_BYTES 8192
#define LUMI_WIRE_EVENT_MAX lumi_wire_Event_size /* bytes of one */

struct lumi_wire_events {
    uint8_t bytes[LUMI_WIRE_EVENT_BYTES]; /* records: 16-bit length, encoded Event */
    uint32_t head, used;                  /* place of the oldest; how many bytes from there */
    uint32_t first, next;                 /* numbers: of the oldest kept; of the next */
    uint32_t lost;                        /* pushed out before they were acknowledged */
    uint32_t cursor, cursor_at;           /* the next to send, and how far from head it lies */
};
void lumi_wire_events_init(struct lumi_wire_events *events);
/* Gives `event` its number and keeps it. False: it cannot be encoded, and nothing happened. */
bool lumi_wire_events_add(struct lumi_wire_events *events, lumi_wire_Event *event);
/* The host has all before `next`: true if that set any free. Numbers that cannot be are ignored. */
bool lumi_wire_events_acknowledge(struct lumi_wire_events *events, uint32_t next);
/* The next one to send into `copy` (LUMI_WIRE_EVENT_MAX bytes); returns its length, or 0 if there is none. */
size_t lumi_wire_events_peek(const struct lumi_wire_events *events, uint8_t *copy);
/* It has been sent. */
void lumi_wire_events_advance(struct lumi_wire_events *events);
/* Sends all that are kept again, from the oldest (retransmission). */
void lumi_wire_events_rewind(struct lumi_wire_events *events);

#ifdef __cplusplus
}
#endif
#endif
