/* The host's end of the link: opens a session, sends one request at a time until it is answered, acknowledges events
 * and hands each on exactly once, in order, and tells when some were lost. No thread, no clock, no file: bytes and the
 * time go in, bytes come out. */
#ifndef LUMI_PROTO_WIRE_CLIENT_H
#define LUMI_PROTO_WIRE_CLIENT_H

#include "proto/wire/frame.h"
#include "proto/wire/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_RETRY_NS 100000000u /* a request without an answer is sent again after this */
#define LUMI_WIRE_HEARTBEAT_NS 500000000u

struct lumi_wire_client_ops {
    /* All bytes go, or none: false if the stream takes nothing now (they are sent again later). */
    bool (*send)(void *context, const uint8_t *frame, size_t size);
    void (*welcome)(void *context, const lumi_wire_Welcome *welcome, bool restarted);
    void (*reply)(void *context, const lumi_wire_Reply *reply);
    /* The request in flight can no more be known to have been executed: the board restarted in between, or forgot us.
     */
    void (*request_lost)(void *context, uint32_t number);
    void (*event)(void *context, const lumi_wire_Event *event);
    void (*events_lost)(void *context, uint32_t count); /* before the next event */
    void (*pulse)(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns);
};

enum lumi_wire_client_state {
    LUMI_WIRE_CLIENT_HELLO = 0, /* no session yet */
    LUMI_WIRE_CLIENT_OPEN,
    LUMI_WIRE_CLIENT_VERSION /* the board speaks no version of ours */
};

struct lumi_wire_client {
    const struct lumi_wire_client_ops *ops;
    void *context;
    enum lumi_wire_client_state state;
    uint64_t host;
    lumi_wire_Welcome welcome;
    uint32_t number; /* of the last request */
    bool in_flight;
    uint32_t events_next;
    uint64_t sent_ns, heartbeat_ns, hello_ns;
    struct lumi_wire_deframer deframer;
    uint8_t request[LUMI_WIRE_PAYLOAD_MAX]; /* encoded, while in flight */
    size_t request_size;
    uint32_t retries, duplicates; /* counters for `lumi rig status` */
};

/* `host`: random, not 0; the same for as long as this client lives, over every reconnection. */
void lumi_wire_client_init(struct lumi_wire_client *client, const struct lumi_wire_client_ops *ops, void *context,
                           uint64_t host);
/* LUMI_ERR_BUSY while another is in flight or no session is open; the number and token are filled in. */
int lumi_wire_client_request(struct lumi_wire_client *client, lumi_wire_Request *request, uint64_t now_ns,
                             struct lumi_error *error);
void lumi_wire_client_receive(struct lumi_wire_client *client, const uint8_t *data, size_t size, uint64_t now_ns);
/* Sends what is due. */
void lumi_wire_client_poll(struct lumi_wire_client *client, uint64_t now_ns);
uint64_t lumi_wire_client_next_poll(const struct lumi_wire_client *client);
/* The stream was closed and opened again: the rest of a frame is dropped, what is in flight is sent again at once. */
void lumi_wire_client_reconnected(struct lumi_wire_client *client, uint64_t now_ns);
/* At once and without a session. */
bool lumi_wire_client_emergency_stop(struct lumi_wire_client *client);

#ifdef __cplusplus
}
#endif
#endif
