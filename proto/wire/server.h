/* The board's end of the link: sessions, requests executed exactly once, replies repeated, events sent until they are
 * acknowledged. One server talks over several links (serial and USB) at once. Freestanding; time is an argument.
 *
 * 1. A request is executed if its token is a live session's and its number is the last one's plus one. The last one's
 *    reply is kept and sent again when its request comes again; anything else is answered NO_SESSION or OUT_OF_ORDER.
 * 2. Up to LUMI_WIRE_SESSIONS hosts are remembered; the one that was silent longest goes when another says Hello.
 * 3. A Hello never changes a session that is there, so that late or doubled ones do no harm. A session belongs to no
 *    link: its host may go on over another.
 * 4. Tokens are mixed of boot, host, a count and the time: a request of an earlier boot or session fits none.
 * 5. Events go to the link whose host last sent a heartbeat that is no observer's, and only while it goes on doing so.
 *    A heartbeat of any other host than before, or over another link, begins again with the oldest event. */
#ifndef LUMI_PROTO_WIRE_SERVER_H
#define LUMI_PROTO_WIRE_SERVER_H

#include "proto/wire/events.h"
#include "proto/wire/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WIRE_SESSIONS 4
#define LUMI_WIRE_LINKS 2
#define LUMI_WIRE_EVENT_RESEND_NS 500000000u /* events that are not acknowledged are sent again after this */
#define LUMI_WIRE_SILENCE_NS 3000000000u     /* a host without a heartbeat for this gets no more events */

struct lumi_wire_session {
    uint64_t host;        /* 0: none */
    uint32_t token, last; /* number of the last request that was executed */
    uint64_t heard_ns;
    int reply_link;                       /* the reply waits to be sent over this link; −1: it does not */
    uint16_t reply_size;                  /* 0: nothing executed yet */
    uint8_t reply[LUMI_WIRE_PAYLOAD_MAX]; /* encoded */
};

/* One link: bytes that come in, and answers that wait for room, the latest of each kind. They go before events, so that
 * a link that is full of events keeps nobody out. */
struct lumi_wire_server_link {
    struct lumi_wire_deframer deframer;
    bool welcome, pulse, answer;
    lumi_wire_Hello hello;
    lumi_wire_Heartbeat beat;
    uint64_t beat_ns; /* when it came */
    uint32_t answer_token, answer_number;
    lumi_wire_Result answer_result;
};

/* The board behind it. */
struct lumi_wire_server_ops {
    /* Executes one request; fills result, text, payload (`reply` comes zeroed: result DONE). Not called for commands of
     * later versions, malformed ones and numbers that are not finite: those are answered UNSUPPORTED and BAD. May call
     * lumi_wire_server_event, nothing else of the server's. */
    void (*execute)(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply);
    /* All but events_next and events_lost, which the server fills in, in the status of a reply too. */
    void (*status)(void *context, lumi_wire_Status *status);
    void (*emergency_stop)(void *context);
    /* Of a live session that takes events: of a host in charge, not of an observer. */
    void (*heartbeat)(void *context);
    /* Takes bytes for link `link`, all or none: false when it has no room now. */
    bool (*send)(void *context, int link, const uint8_t *frame, size_t size);
};

struct lumi_wire_server {
    const struct lumi_wire_server_ops *ops;
    void *context;
    lumi_wire_Welcome identity;
    struct lumi_wire_session sessions[LUMI_WIRE_SESSIONS];
    struct lumi_wire_server_link links[LUMI_WIRE_LINKS];
    struct lumi_wire_events events;
    uint32_t tokens;           /* given out so far */
    int event_link;            /* where events go; −1: nowhere */
    uint32_t event_token;      /* of the session that takes them */
    uint64_t event_heard_ns;   /* its last heartbeat */
    uint64_t event_resend_ns;  /* when what is sent and not acknowledged goes again */
    uint32_t repeated, unread; /* requests that came again; frames whose payload is no message */
    union {
        lumi_wire_HostFrame in;
        lumi_wire_BoardFrame out;
    } scratch[2];
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX], frame[LUMI_WIRE_FRAME_MAX];
};

/* `identity`: board, unique_id, firmware, and boot, which must differ after every restart; version_min and version_max
 * where they are not this program's (0). */
void lumi_wire_server_init(struct lumi_wire_server *server, const struct lumi_wire_server_ops *ops, void *context,
                           const lumi_wire_Welcome *identity);
void lumi_wire_server_receive(struct lumi_wire_server *server, int link, const uint8_t *data, size_t size,
                              uint64_t now_ns);
/* Sends what answers, replies and events wait and the links take. */
void lumi_wire_server_poll(struct lumi_wire_server *server, uint64_t now_ns);
/* When poll has something to do though nothing else happens: now_ns while something waits for room on a link;
 * UINT64_MAX: never. */
uint64_t lumi_wire_server_next_poll(const struct lumi_wire_server *server, uint64_t now_ns);
/* Gives the event its number and keeps it; poll sends it. Texts are made printable. */
void lumi_wire_server_event(struct lumi_wire_server *server, lumi_wire_Event *event);

#ifdef __cplusplus
}
#endif
#endif
