/* The host's end of the link: opens a session, sends one request at a time until it is answered, acknowledges events
 * and hands each on exactly once, in order, and tells when some were lost. No thread, no clock, no file: bytes and the
 * time go in, bytes come out.
 *
 * 1. A session is asked for with Hello until its Welcome comes; only the Welcome to the Hello of now counts (nonce).
 * 2. The session stays over reconnections and is found again by the host's number; a request in flight is sent again
 *    in it. Another token means that the board restarted or forgot us: what was in flight is reported lost.
 * 3. An event is handed on if it is the next one. What the board no longer keeps is counted and reported before the
 *    next event; what came before is dropped; what comes too early waits, if it is less than LUMI_WIRE_EARLY before its
 *    time, and comes again otherwise. What was handed on is acknowledged at once, or, with `holds`, when it is said to
 *    be stored: what is not, the board keeps for the next host.
 * 4. Callbacks come from receive only, and may call everything but receive. */
#ifndef LUMI_PROTO_WIRE_CLIENT_H
#define LUMI_PROTO_WIRE_CLIENT_H

#include "proto/wire/frame.h"
#include "proto/wire/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_RETRY_NS 200000000u /* a request or an emergency stop without an answer is sent again after this */
#define LUMI_WIRE_HELLO_NS 250000000u /* and a Hello */
#define LUMI_WIRE_HEARTBEAT_NS 500000000u  /* between heartbeats where no event is to be acknowledged */
#define LUMI_WIRE_ACKNOWLEDGE_NS 40000000u /* an event is acknowledged at most this late, with others */
#define LUMI_WIRE_ROOM_NS 5000000u         /* a stream that took nothing is tried again after this */
#define LUMI_WIRE_EARLY 64                 /* events that wait for one before them */
#define LUMI_WIRE_STOPS 50                 /* an emergency stop that is not confirmed is sent so often */

struct lumi_wire_client_ops {
    /* All bytes go, or none: false if the stream takes nothing now (they are sent again later). */
    bool (*send)(void *context, const uint8_t *frame, size_t size);
    /* A session is open (again). `restarted`: the board has started anew since the last one: its events begin at 0. */
    void (*welcome)(void *context, const lumi_wire_Welcome *welcome, bool restarted);
    void (*reply)(void *context, const lumi_wire_Reply *reply);
    /* The request in flight can no more be known to have been executed: the board restarted in between, or forgot us.
     * Comes after `welcome`. */
    void (*request_lost)(void *context, uint32_t number);
    void (*event)(void *context, const lumi_wire_Event *event);
    void (*events_lost)(void *context, uint32_t count); /* before the next event */
    /* Each at most once, in the order of their heartbeats. */
    void (*pulse)(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns);
};

enum lumi_wire_client_state {
    LUMI_WIRE_CLIENT_HELLO = 0, /* no session yet */
    LUMI_WIRE_CLIENT_OPEN,
    LUMI_WIRE_CLIENT_VERSION /* the board speaks no version of ours; until reconnected */
};

struct lumi_wire_client {
    const struct lumi_wire_client_ops *ops;
    void *context;
    enum lumi_wire_client_state state;
    bool observer; /* set after init: takes no events, keeps no sweep alive */
    bool holds;    /* set after init: acknowledges only what lumi_wire_client_stored has named */
    uint32_t version_min, version_max;
    uint64_t host;
    bool welcomed; /* there has been a session: `welcome` is of the last one */
    lumi_wire_Welcome welcome;
    uint32_t hello_nonce;
    uint32_t number; /* of the last request */
    bool in_flight;
    uint32_t events_next;
    uint32_t events_stored; /* acknowledged up to here, where it holds */
    bool acknowledge;       /* an event has come that is not acknowledged yet, nor said to have come again */
    uint64_t pulse_time;    /* host_time of the last pulse handed on */
    bool pulsed;
    uint32_t stop_nonce, stops_left; /* an emergency stop that waits for its confirmation; 0: none */
    uint64_t request_due_ns, heartbeat_due_ns, acknowledge_due_ns, hello_due_ns, stop_due_ns;
    uint64_t heard_ns; /* when the last message came; 0: none has */
    struct lumi_wire_deframer deframer;
    uint8_t request[LUMI_WIRE_PAYLOAD_MAX]; /* encoded, while in flight */
    size_t request_size;
    uint32_t retries, duplicates; /* requests sent again; replies and events that came again */
    uint32_t gaps, unread;        /* events that came too early; frames whose payload is no message */
    bool early_kept[LUMI_WIRE_EARLY];
    lumi_wire_Event early[LUMI_WIRE_EARLY]; /* by their number, modulo */
};

/* `host`: random, not 0; the same for as long as this client lives, over every reconnection. */
void lumi_wire_client_init(struct lumi_wire_client *client, const struct lumi_wire_client_ops *ops, void *context,
                           uint64_t host);
/* LUMI_ERR_BUSY while another is in flight or no session is open, LUMI_ERR_VERSION if there can be none, LUMI_ERR_ARG
 * for what cannot be encoded; the number and token are filled in. */
int lumi_wire_client_request(struct lumi_wire_client *client, lumi_wire_Request *request, uint64_t now_ns,
                             struct lumi_error *error);
void lumi_wire_client_receive(struct lumi_wire_client *client, const uint8_t *data, size_t size, uint64_t now_ns);
/* Sends what is due. */
void lumi_wire_client_poll(struct lumi_wire_client *client, uint64_t now_ns);
/* With `holds`: this event and all before it are stored. One of an earlier start of the board does nothing. */
void lumi_wire_client_stored(struct lumi_wire_client *client, uint32_t boot, uint32_t number, uint64_t now_ns);
/* From now on as a host in charge (true), or as one that only looks. */
void lumi_wire_client_take_charge(struct lumi_wire_client *client, bool charge, uint64_t now_ns);
/* When something is due next; UINT64_MAX: never. */
uint64_t lumi_wire_client_next_poll(const struct lumi_wire_client *client);
/* The stream was closed and opened again: the rest of a frame is dropped, the session is asked for at once, and what is
 * in flight is sent again when it is found. */
void lumi_wire_client_reconnected(struct lumi_wire_client *client, uint64_t now_ns);
/* At once and without a session, again and again until the board confirms it (stops_left is 0 then). False: the stream
 * did not take it now. */
bool lumi_wire_client_emergency_stop(struct lumi_wire_client *client, uint64_t now_ns);
/* LUMI_ERR_VERSION with both ranges in the text while the board speaks no version of ours, else LUMI_OK. */
int lumi_wire_client_version(const struct lumi_wire_client *client, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
