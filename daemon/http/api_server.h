/* The API: HTTP/JSON and server-sent events over the engine, described by daemon/http/openapi.yaml, which is served as
 * well. Runs in the thread of the GLib main loop that owns the engine. Errors are problem documents (RFC 9457). */
#ifndef LUMI_DAEMON_HTTP_API_SERVER_H
#define LUMI_DAEMON_HTTP_API_SERVER_H

#include "daemon/engine/engine.h"
#include "daemon/handover/handover.h"

struct lumi_http;
struct lumi_http_options {
    const char *listen; /* "localhost:8470" by default: both loopback addresses; "ADDRESS:PORT", port 0: any */
    const char *token;  /* needed for all but loopback addresses; NULL: loopback only, and without one */
    const char *certificate, *key; /* PEM files; NULL: plain HTTP */
    size_t body_max;               /* of a request (1 MiB) */
    struct lumi_engine *engine;
    struct lumi_handover *handover; /* may be NULL */
    struct lumi_ingest *ingest;     /* may be NULL */
    int64_t (*now_ns)(void *context);
    /* Cameras that are on this host, also those no configuration names (lumi_camera_list), and boards
     * (lumi_rig_usb_list); asked in a worker thread. May be NULL. */
    int (*devices)(void *context, struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
    void *context;
};
void lumi_http_options_init(struct lumi_http_options *options);
/* LUMI_ERR_ARG: an address that is none, or not a loopback one without token. LUMI_ERR_BUSY: the port is taken. */
int lumi_http_start(const struct lumi_http_options *options, struct lumi_http **http, struct lumi_error *error);
void lumi_http_stop(struct lumi_http *http);
int lumi_http_port(const struct lumi_http *http);
/* Passed on to who listens to /api/v1/events, and kept for those who come back (Last-Event-ID). */
void lumi_http_told(struct lumi_http *http, const struct lumi_engine_told *told);

#endif
