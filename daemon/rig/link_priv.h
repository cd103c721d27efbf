/* What the link's two halves share: link.c (what others call), link_thread.c (the thread). */
#ifndef LUMI_DAEMON_RIG_LINK_PRIV_H
#define LUMI_DAEMON_RIG_LINK_PRIV_H

#include "daemon/rig/link.h"

#include <pthread.h>

/* A request that somebody waits for; it lies on the waiter's stack and leaves the link's lists before that goes. */
struct lumi_rig_pending {
    struct lumi_rig_pending *next;
    lumi_wire_Request request;
    lumi_wire_Reply *reply;
    bool done;
    int code; /* LUMI_OK: *reply is filled */
    struct lumi_error *error;
};

struct lumi_rig_kept_notice {
    struct lumi_rig_kept_notice *next;
    uint32_t boot;
    struct lumi_rig_notice notice;
};

#define LUMI_RIG_LINK_OUT (2 * LUMI_WIRE_FRAME_MAX)
#define LUMI_RIG_NOTICES_MAX 65536

struct lumi_rig_link {
    struct lumi_rig_link_options options;
    int wake[2]; /* pipe */
    pthread_t thread;
    pthread_mutex_t mutex; /* guards all below, up to where the thread's own begins */
    pthread_cond_t changed;
    bool closing, stop_wanted;
    struct lumi_rig_pending *queue, *in_flight;
    struct lumi_rig_kept_notice *first_notice, *last_notice;
    uint32_t notices, notices_dropped;
    bool told; /* notices have come since options.wake was last called */
    struct lumi_clock_match clock;
    struct lumi_rig_link_snapshot snapshot;
    uint32_t attempts; /* at opening */
    uint32_t boot;
    bool boot_known;
    struct lumi_wire_client client;

    /* The thread's own. */
    struct lumi_rig_stream *stream;
    bool open, opened_before;
    uint64_t now_ns, opened_ns, try_ns;
    uint64_t answered_ns; /* when there last was a session */
    uint64_t received;    /* bytes since it was opened */
    uint8_t out[LUMI_RIG_LINK_OUT];
    size_t out_size;
};

uint64_t lumi_rig_link_now(void); /* CLOCK_MONOTONIC, ns */
void *lumi_rig_link_thread(void *link);
extern const struct lumi_wire_client_ops lumi_rig_link_client_ops;
/* With the mutex held. */
void lumi_rig_link_wake(struct lumi_rig_link *link);

#endif
