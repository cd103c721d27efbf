/* The API: HTTP/JSON and server-sent events over the engine, described by daemon/http/openapi.json, which is served as
 * well (/openapi.json; docs/api.md). Errors are problem documents (RFC 9457).
 *
 * The server has a thread of its own; the engine is asked in that of the default GLib main loop, which owns it and
 * calls everything below. So an emergency stop is heard and answered whatever holds the main loop up. */
#ifndef LUMI_DAEMON_HTTP_API_SERVER_H
#define LUMI_DAEMON_HTTP_API_SERVER_H

#include "daemon/engine/engine.h"
#include "daemon/handover/handover.h"
#include "daemon/preview/camera_pictures.h"
#include "daemon/preview/preview_field.h"

struct lumi_http;
struct lumi_http_options {
    const char *listen;    /* "localhost:8470" by default: both loopback addresses; "ADDRESS:PORT", port 0: any */
    const char *token;     /* asked of all but this computer; NULL: loopback addresses only */
    bool token_everywhere; /* asked of this computer too, which others may share */
    const char *certificate, *key; /* PEM files; NULL: plain HTTP. Both in one file where key is NULL */
    const char *access;    /* folder of users, sessions and the rig's certificate (docs/access.md); NULL: no users */
    const char *secure;    /* as listen: open while there are users, with that certificate; NULL, "": never */
    const char *host_name; /* for the certificate; NULL: this computer's */
    int64_t session_idle_ns, session_most_ns; /* without use (24 hours); in all (14 days) */
    const char *folder;                       /* where captures are kept, for /api/v1/captures; may be NULL */
    const char *second_copy;                  /* folder of the second copies; NULL: there are none */
    const char *preview;                      /* the command that draws the light field so far; NULL: none */
    size_t body_max;                          /* of a request (1 MiB) */
    int connections_max;                      /* of which connections_peer are kept for this computer (512) */
    int connections_peer;                     /* of one address, or IPv6 network of 64 bits (64) */
    int listeners_max;                        /* to the events (256) */
    struct lumi_engine *engine;
    struct lumi_handover *handover;    /* may be NULL */
    bool processes;                    /* the hand-over has a command to start */
    struct lumi_ingest *ingest;        /* may be NULL */
    struct lumi_pictures *pictures;    /* of the engine's cameras, in their order; may be NULL. Outlives the server */
    int64_t (*now_ns)(void *context);  /* in either thread */
    int64_t (*unix_us)(void *context); /* likewise, the time of day; NULL: as now_ns, for tests */
    /* Straight to the board, in the server's thread; the engine is told later. False: the board is away, it is stopped
     * when it comes back. Never NULL. */
    bool (*emergency_stop)(void *context);
    /* Cameras that are on this host, also those no configuration names (lumi_camera_list), and boards
     * (lumi_rig_usb_list); asked in a worker thread. Returns how many there are. May be NULL: none. */
    int (*devices)(void *context, struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
    void *context;
};
void lumi_http_options_init(struct lumi_http_options *options);
/* LUMI_ERR_ARG: an address that is none, or not a loopback one without token. LUMI_ERR_BUSY: the port is taken.
 * LUMI_ERR_FORMAT: certificate or key cannot be used. Strings are copied. */
int lumi_http_start(const struct lumi_http_options *options, struct lumi_http **http, struct lumi_error *error);
void lumi_http_stop(struct lumi_http *http);
int lumi_http_port(const struct lumi_http *http);
/* Passed on to who listens to /api/v1/events, and kept for those who come back (Last-Event-ID). They may be called by
 * what the engine and the hand-over call: nobody is asked anything before the main loop comes round. NULL is fine. */
void lumi_http_told(struct lumi_http *http, const struct lumi_engine_told *told);
void lumi_http_processing(struct lumi_http *http, const struct lumi_process_status *status);
void lumi_http_ingest(struct lumi_http *http, const struct lumi_ingest_status *status);

#endif
