/* The link to a rig's board: a thread that owns the stream and the protocol's client (proto/wire/client.h), opens the
 * stream, says Hello, sends heartbeats every half second, matches the clocks, and opens it again when it goes away. All
 * functions may be called from any thread; every wait has an end.
 *
 * 1. Requests go one after another in the order they were made. One that was in flight when the stream went away is
 * sent again when it is back, and the board executes it once; one that nobody can know about (the board has restarted)
 * is reported lost, never repeated.
 * 2. What the board tells comes as notices, each exactly once and in order; they wait in memory until they are taken.
 */
#ifndef LUMI_DAEMON_RIG_LINK_H
#define LUMI_DAEMON_RIG_LINK_H

#include "daemon/rig/clock_match.h"
#include "daemon/rig/stream.h"
#include "proto/wire/client.h"

struct lumi_rig_link;

enum lumi_rig_link_state {
    LUMI_RIG_LINK_CLOSED = 0, /* the stream is not there; it is tried again and again */
    LUMI_RIG_LINK_SILENT,     /* open; nobody has answered yet */
    LUMI_RIG_LINK_FOREIGN,    /* open; what answers is no board of ours */
    LUMI_RIG_LINK_VERSION,    /* a board that speaks no version of ours */
    LUMI_RIG_LINK_OPEN        /* a session */
};

struct lumi_rig_link_options {
    uint64_t host;   /* the client's number, not 0; 0 takes a random one */
    bool observer;   /* takes no events from whoever is in charge, and keeps no sweep alive; see take_charge */
    bool holds;      /* events are acknowledged when lumi_rig_link_stored names them, not when they have come */
    double patience; /* s without a word from the board before a session counts as silent (2) */
    /* Called in the link's thread when notices have come, for a main loop that wants waking; must not call the link. */
    void (*wake)(void *context);
    void *context;
};
void lumi_rig_link_options_init(struct lumi_rig_link_options *options);

/* Starts the thread; LUMI_ERR_ARG for an address that is none (stream.h lists them). Whether anybody is there is known
 * later: lumi_rig_link_wait. */
int lumi_rig_link_open(const char *address, const struct lumi_rig_link_options *options, struct lumi_rig_link **link,
                       struct lumi_error *error);
/* The same over a stream of one's own, which it takes over. */
int lumi_rig_link_open_stream(struct lumi_rig_stream *stream, const struct lumi_rig_link_options *options,
                              struct lumi_rig_link **link, struct lumi_error *error);
/* Ends the thread; requests that wait fail. NULL is fine. */
void lumi_rig_link_close(struct lumi_rig_link *link);

/* Waits for a session. Otherwise says why there is none: LUMI_ERR_NOTFOUND, LUMI_ERR_BUSY (somebody else's),
 * LUMI_ERR_IO (refused, silent), LUMI_ERR_UNSUPPORTED (something else answers), LUMI_ERR_VERSION. `eager`: a stream
 * that cannot be opened, and a board of another version, end it at once. */
int lumi_rig_link_wait(struct lumi_rig_link *link, double seconds, bool eager, struct lumi_error *error);

/* Sends `request` (its command filled in) and waits for the reply. LUMI_ERR_IO: no answer in that time, no session, or
 * lost with a restart of the board; then it may or may not have been executed, and the text says so. A reply that
 * refuses is a reply: see lumi_rig_link_command. */
int lumi_rig_link_request(struct lumi_rig_link *link, const lumi_wire_Request *request, double seconds,
                          lumi_wire_Reply *reply, struct lumi_error *error);
/* The same, where only DONE is good: LUMI_ERR_BUSY where the board refuses in its present state, LUMI_ERR_FORMAT for
 * what cannot be, LUMI_ERR_UNSUPPORTED, LUMI_ERR_IO; with the board's own words. `reply` may be NULL. */
int lumi_rig_link_command(struct lumi_rig_link *link, const lumi_wire_Request *request, double seconds,
                          lumi_wire_Reply *reply, struct lumi_error *error);
/* At once, without waiting for anything before it, and again until the board confirms it (snapshot: stop_pending).
 * False: no stream is open; it goes out when one is. */
bool lumi_rig_link_emergency_stop(struct lumi_rig_link *link);

enum lumi_rig_notice_kind {
    LUMI_RIG_NOTICE_EVENT = 0,
    LUMI_RIG_NOTICE_EVENTS_LOST, /* `count` events were pushed out on the board before they could be sent */
    LUMI_RIG_NOTICE_CONNECTED,   /* a session; `restarted`: the board has started since the last one */
    LUMI_RIG_NOTICE_DISCONNECTED /* the stream is gone; `text` */
};
struct lumi_rig_notice {
    enum lumi_rig_notice_kind kind;
    uint64_t host_ns; /* CLOCK_MONOTONIC: of an event when it happened, as the clocks are matched (0: they are not yet);
                         otherwise when it was noticed */
    uint32_t count;
    bool restarted;
    lumi_wire_Event event;
    char text[256];
};
/* With options.observer: becomes the host in charge, to whom events go, from the oldest that the board keeps; or only
 * looks again. */
void lumi_rig_link_take_charge(struct lumi_rig_link *link, bool charge);
/* With options.holds: this event and those before it need no longer be kept by the board. */
void lumi_rig_link_stored(struct lumi_rig_link *link, const lumi_wire_Event *event);
/* The next notice. Waits at most so many seconds (0: not at all); false: there is none. */
bool lumi_rig_link_notice(struct lumi_rig_link *link, double seconds, struct lumi_rig_notice *notice);

struct lumi_rig_link_snapshot {
    enum lumi_rig_link_state state;
    int code; /* why there is no session */
    char text[1024];
    char name[LUMI_RIG_STREAM_NAME]; /* of the stream */
    lumi_wire_Welcome welcome;       /* of the last session */
    bool stop_pending;               /* an emergency stop that the board has not confirmed */
    bool status_known;
    lumi_wire_Status status; /* of the last heartbeat */
    uint64_t status_ns;      /* CLOCK_MONOTONIC when it came; of the board's clock: */
    uint64_t status_board_ns;
    bool clock_matched, clock_drift_known; /* the drift and the residual want some seconds */
    int64_t clock_offset_ns;               /* board less host, now */
    double clock_drift_ppm, clock_residual_ns, round_trip_ns;
    uint32_t reconnections, restarts, retries, duplicates, damaged; /* since it was opened */
    uint32_t requests_lost;
};
void lumi_rig_link_snapshot(struct lumi_rig_link *link, struct lumi_rig_link_snapshot *snapshot);
uint64_t lumi_rig_link_to_host(struct lumi_rig_link *link, uint64_t board_ns);

#endif
