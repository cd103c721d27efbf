/* What the threads of simulated cameras share: one lock for all of it. */
#ifndef LUMI_SIM_GIGE_GIGE_PRIV_H
#define LUMI_SIM_GIGE_GIGE_PRIV_H

#include "sim/gige/gige.h"
#include "sim/gige/gige_control.h"
#include "sim/gige/gige_stream.h"

#include <netinet/in.h>
#include <pthread.h>

#define GIGE_CAMERAS 64
#define GIGE_HISTORY 6 /* frames a camera can send packets of again */
#define GIGE_WAITING 256
#define GIGE_WORKERS 16

struct gige_camera {
    struct sim_gige_camera options;
    struct gige_identity identity;
    struct gige_control control;
    int gvcp, broadcast, gvsp; /* sockets */
    bool unplugged, busy;      /* busy: a worker makes its frame */
    uint16_t block;            /* id of the last frame */
    uint64_t number;           /* of frames ever: noise */
    struct gige_block history[GIGE_HISTORY];
    int newest;
    struct sim_gige_exposure waiting[GIGE_WAITING];
    int first, count;
    uint64_t next_free_ns; /* of a camera that runs by itself */
    struct sim_gige_status status;
};
struct sim_gige {
    struct sim_gige_source source;
    pthread_mutex_t lock;
    pthread_cond_t work; /* CLOCK_MONOTONIC */
    struct gige_camera *cameras[GIGE_CAMERAS];
    int count;
    bool stop;
    int wake[2]; /* of the network's thread */
    pthread_t network, workers[GIGE_WORKERS];
    int worker_count;
    bool network_runs;
};

uint64_t gige_clock_ns(void);                                       /* CLOCK_MONOTONIC */
uint64_t gige_ticks(const struct gige_camera *camera, uint64_t ns); /* of the camera's clock, at shared time `ns` */

/* gige_network.c */
int gige_sockets_open(struct gige_camera *camera, struct lumi_error *error);
void gige_sockets_close(struct gige_camera *camera);
void *gige_network(void *gige);
/* gige_worker.c */
void *gige_worker(void *gige);
/* Where its frames go; false: nowhere. With the lock. */
bool gige_destination(struct gige_camera *camera, struct sockaddr_in *to);
void gige_forget(struct gige_camera *camera); /* frames that wait and those that were sent; with the lock */

#endif
