/* The board's end of the link: sessions, requests executed exactly once, replies repeated, events sent until they are
 * acknowledged. One server talks over several links (serial and USB) at once. Freestanding; time is an argument.
 *
 * 1. A request is executed if its token is a live session's and its number is the last one's plus one. The last one's
 *    reply is kept and sent again when its request comes again; anything else is answered NO_SESSION or OUT_OF_ORDER.
 * 2. Up to LUMI_WIRE_SESSIONS hosts are remembered; the one that was silent longest goes when another says Hello.
 * 3. A Hello never changes a session that is there, so that late or doubled ones do no harm. */
#ifndef LUMI_PROTO_WIRE_SERVER_H
#define LUMI_PROTO_WIRE_SERVER_H

#include "proto/wire/events.h"
#include "proto/wire/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_SESSIONS 4
#define LUMI_WIRE_LINKS 2
#define LUMI_WIRE_EVENT_RESEND_NS 250000000u /* an event that is not acknowledged is sent again after this */

struct lumi_wire_session {
    uint64_t host;
    uint32_t token, last;
    uint64_t heard_ns;
    int link;
    uint8_t reply[LUMI_WIRE_PAYLOAD_MAX]; /* encoded */
    uint16_t reply_size;
};

/* The board behind it. */
struct lumi_wire_server_ops {
    /* Executes one request; fills result, text, payload. */
    void (*execute)(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply);
    void (*status)(void *context, lumi_wire_Status *status);
    void (*emergency_stop)(void *context);
    void (*heartbeat)(void *context); /* of a live session */
    /* Takes bytes for link `link`, all or none: false when it has no room now. */
    bool (*send)(void *context, int link, const uint8_t *frame, size_t size);
};

struct lumi_wire_server {
    const struct lumi_wire_server_ops *ops;
    void *context;
    lumi_wire_Welcome identity; /* board, unique_id, firmware, boot: filled by the owner */
    struct lumi_wire_session sessions[LUMI_WIRE_SESSIONS];
    struct lumi_wire_deframer links[LUMI_WIRE_LINKS];
    struct lumi_wire_events events;
    uint32_t tokens; /* given out so far; the next token mixes it with boot */
    int event_link;  /* where events go: the link that last sent a heartbeat; −1: nobody has */
    uint64_t events_sent_ns;
    union {
        lumi_wire_HostFrame in;
        lumi_wire_BoardFrame out;
    } scratch[2];
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX], frame[LUMI_WIRE_FRAME_MAX];
};

void lumi_wire_server_init(struct lumi_wire_server *server, const struct lumi_wire_server_ops *ops, void *context,
                           const lumi_wire_Welcome *identity);
void lumi_wire_server_receive(struct lumi_wire_server *server, int link, const uint8_t *data, size_t size,
                              uint64_t now_ns);
/* Sends what events there are and the links take. */
void lumi_wire_server_poll(struct lumi_wire_server *server, uint64_t now_ns);
void lumi_wire_server_event(struct lumi_wire_server *server, lumi_wire_Event *event);

#ifdef __cplusplus
}
#endif
#endif
