/* What the files of the service share. */
#ifndef LUMI_DAEMON_LUMID_SERVICE_PRIV_H
#define LUMI_DAEMON_LUMID_SERVICE_PRIV_H

#include "daemon/handover/handover.h"
#include "daemon/http/api_server.h"
#include "daemon/lumid/service.h"
#include "daemon/lumid/tasks.h"
#include "daemon/rig/drive.h"

#include <glib.h>
#include <stdatomic.h>

struct lumi_service {
    const struct lumi_config *config;
    struct lumi_inbox *inbox;
    GMainLoop *loop;
    GSource *pump;
    struct lumi_engine *engine;
    struct lumi_engine_status *status; /* for looking at now and then */
    struct lumi_http *http;
    struct lumi_handover *handover;
    struct lumi_ingest *ingest;
    struct lumi_pictures *pictures;
    uint32_t looked; /* a bit a camera: it is asked for pictures while nothing is under way */
    int64_t look_ns;
    char *token;
    int lock;
    /* The rig. */
    struct lumi_rig_link *link;
    struct lumi_pool *requests; /* one thread: in order */
    struct lumi_pool *drives;   /* one thread */
    struct lumi_drive_map drive_map;
    bool profile_asked;       /* of the board, since it was there first */
    bool drive_busy;          /* it takes the link's notices */
    atomic_bool drive_cancel; /* at the next position */
    atomic_bool drive_stop;   /* now: an emergency stop */
    struct lumi_camera_host *hosts[LUMI_RIG_CAMERAS];
    struct lumi_gpio *gpio;
    int gpio_camera[LUMI_GPIO_LINES]; /* of SYNC and POWER lines, −1 all */
    struct lumi_pool *judges, *chores;
    bool disk_asked;
    int64_t measured_ns; /* when the disk's speed was; 0 never */
    double disk_bytes_per_second;
    int64_t utc_offset_ns;
    /* The end. */
    bool ending, resting;
    int64_t ending_until_ns;
    int code; /* why it ended */
};

int64_t lumi_service_now(void);        /* CLOCK_MONOTONIC */
int64_t lumi_service_utc_offset(void); /* Unix time less that */
void *lumi_service_task(size_t size, void (*work)(struct lumi_task *), void (*done)(struct lumi_task *));

/* service_ports.c: what the engine asks. */
void lumi_service_ports(struct lumi_service *service, struct lumi_engine_ports *ports);
/* service_pictures.c: the cameras' pictures. */
int lumi_service_pictures_start(struct lumi_service *service, struct lumi_error *error);
void lumi_service_picture(void *context, const struct lumi_engine_picture *picture); /* a port of the engine */
void lumi_service_pictures_tick(struct lumi_service *service, int64_t now);
/* service_rig.c */
void lumi_service_rig_ports(struct lumi_service *service, struct lumi_engine_ports *ports);
/* For where the arm is and what plans come to; the engine asks for itself before a sweep. */
void lumi_service_read_profile(struct lumi_service *service);
/* Asks the board, or the drive, to stop at the next safe place; a reply is not waited for. To the engine this is a
 * pause from elsewhere: the capture goes on by itself next time, other than after lumi_engine_pause. */
void lumi_service_rest(struct lumi_service *service);
/* service_watch.c: what happens goes to the engine. */
void lumi_service_drain(struct lumi_service *service);
void lumi_service_tick(struct lumi_service *service);
void lumi_service_measure(struct lumi_service *service, bool speed);
/* An emergency stop, from any thread: to the board by the link's own, to the drive by the one that watches it. False:
 * no board is there; it is stopped when it comes back. */
bool lumi_service_stop_at_once(struct lumi_service *service);
/* In the edge thread. */
void lumi_service_estop(void *context, bool pressed, int64_t at_ns);
void lumi_service_chip(void *context, int line, bool gone);

#endif
