/* Simulated GigE Vision cameras: each at an address of its own, answering GVCP and sending its frames by GVSP, as real
 * ones do. What they see and when they expose is the caller's.
 *
 * 1. A trigger is told by what came of it: when the exposure began and ended. A camera that is not armed for its line
 *    lets it pass, and counts it.
 * 2. A frame carries the time at which its exposure began, by the camera's own clock.
 * 3. Pictures are made by worker threads, the earliest exposure first; the frames of a camera leave in their order. */
#ifndef LUMI_SIM_GIGE_GIGE_H
#define LUMI_SIM_GIGE_GIGE_H

#include "proto/base/raster.h"
#include "proto/base/result.h"
#include "sim/sensor.h"

#include <stdbool.h>
#include <stdint.h>

struct sim_gige;

/* What goes wrong with one frame. */
struct sim_gige_fault {
    bool dropped, doubled;
    double late; /* s, beyond what it takes anyway */
    double loss; /* share of its packets that are not sent the first time */
};
struct sim_gige_exposure {
    bool line;                 /* by the hardware line; otherwise as `fire` asked */
    uint64_t begin_ns, end_ns; /* by the clock that all share */
    double angle, drop, moved; /* the rig at the middle, and how far it turned; the source's to read */
    double askew;              /* radians, how far somebody has turned the camera aside; the source's as well */
    struct sim_gige_fault fault;
};

struct sim_gige_source {
    void *context;
    /* The light on a camera's sensor, linear RGB, 1 is white at the reference exposure; created here. In a worker's
     * thread. */
    int (*picture)(void *context, int camera, const struct sim_gige_exposure *exposure, struct lumi_raster *picture,
                   struct lumi_error *error);
    /* A trigger that is no line (software, action command, running free): the caller answers with an exposure, at once
     * or later, from any thread. Called in the network's thread, without locks. */
    void (*fire)(void *context, int camera);
    void (*exposure_time)(void *context, int camera, double seconds); /* it was set; may be NULL */
    uint64_t (*now_ns)(void *context);                                /* the clock that all share */
};

struct sim_gige_camera {
    char address[16]; /* "127.0.0.2" */
    char serial[16], model[32], name[16];
    int width, height;
    double clock_offset; /* s, of its clock against the shared one */
    double clock_ppm;
    double reference; /* s, of exposure at gain 1 that make light 1 white */
    int jpeg_quality;
    struct sim_sensor sensor;
    uint64_t seed; /* of lost packets and noise */
};
void sim_gige_camera_init(struct sim_gige_camera *camera);

/* NULL: no memory. */
struct sim_gige *sim_gige_create(const struct sim_gige_source *source);
/* Its number, from 0. LUMI_ERR_IO, LUMI_ERR_BUSY where the address cannot be had. Before sim_gige_start. */
int sim_gige_add(struct sim_gige *gige, const struct sim_gige_camera *camera, struct lumi_error *error);
int sim_gige_start(struct sim_gige *gige, int workers, struct lumi_error *error);
void sim_gige_destroy(struct sim_gige *gige); /* ends the threads; NULL is fine */

/* From any thread. */
void sim_gige_expose(struct sim_gige *gige, int camera, const struct sim_gige_exposure *exposure);
/* Without power and network; when it is back it has forgotten what it was told. */
void sim_gige_unplug(struct sim_gige *gige, int camera, bool unplugged);

struct sim_gige_status {
    bool acquiring, controlled;
    uint64_t triggers, frames;      /* edges of its line, frames sent */
    uint64_t packets, lost, resent; /* sent, left out, sent again as asked */
    int waiting;                    /* exposures whose frames are still to come */
    double exposure;                /* s, as it is set */
};
void sim_gige_status(struct sim_gige *gige, int camera, struct sim_gige_status *status);

#endif
