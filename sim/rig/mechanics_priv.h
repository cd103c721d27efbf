/* Inside the simulated rig: platform.c moves it, switches.c reads it, rig_cameras.c photographs from it, mechanics.c
 * keeps them in step. */
#ifndef LUMI_SIM_RIG_MECHANICS_PRIV_H
#define LUMI_SIM_RIG_MECHANICS_PRIV_H

#include "sim/rig/mechanics.h"
#include "sim/rig/oscillator.h"

#include <glib.h>

#define TICKS(seconds) ((uint64_t)((seconds)*BOARD_TICK_HZ + 0.5))
#define SECONDS(ticks) ((double)(ticks) / BOARD_TICK_HZ)

/* All places of the platform are in microsteps of the truth, from step 0. */
struct sim_platform {
    double steps_per_turn;
    double omega, omega_sway, omega_arm; /* rad/s; omega at standstill */
    double lag_limit;                    /* microsteps: two full steps, where the motor slips */
    double play;                         /* microsteps, of belt and friction together */

    int64_t count; /* pulses */
    double field;  /* where the field points */
    double seat;   /* where the load is drawn to: the field, less the play */
    bool energised;
    double rate;        /* full steps/s, from the last two pulses */
    uint64_t last_step; /* when */
    uint64_t still_at;  /* with no pulse until then the field no longer turns */
    bool last_forward;
    struct sim_oscillator body, sway; /* about the seat, in microsteps */
    struct sim_oscillator arm;        /* about `rest`, in rad */
    double rest;                      /* of the arm's drop: where it comes to rest */
    double given;                     /* rad: what the string has been paid out for */
    double loose;                     /* rad: given, but not taken by the arm (brake, snag) */
    double fallen, fall_speed;        /* rad, rad/s */
    double fallen_total, dropped_total;
    int64_t missed, slip; /* full steps: lost so far; still to be lost */
    bool snagged;
    bool brake_wanted, brake_holds;
    uint64_t brake_at;    /* when it begins to hold */
    uint64_t loose_since; /* nothing holds the arm since then; BOARD_NEVER: something does */
};

struct sim_camera {
    int stage; /* 0: idle; 1: waits for its begin, 2: for the middle, 3: for the end */
    uint64_t begin, middle, end, busy_until, next;
    int record;
    double begin_angle;
    uint32_t taken; /* triggers so far */
    bool recording;
    uint64_t frames; /* of the recording, so far */
    uint64_t started;
    uint64_t focused_since;
    double exposure; /* s, of its own; 0: as all */
    struct sim_camera_fault fault;
};

#define SIM_EDGES 64

struct sim_edge {
    uint64_t at;
    enum board_input input;
    bool active;
};

/* What the caller is told at the next advance. */
struct sim_message {
    uint64_t at;
    int input;
    bool feedback, active;
};

struct sim_mechanics {
    struct lumi_rig truth;
    struct sim_mechanics_options options;
    uint64_t now;
    struct sim_platform platform;
    bool outputs[BOARD_OUTPUTS];
    bool driver_fault;
    double supply;
    bool reached; /* an industrial drive's line */
    struct sim_drive_fault drive_fault;

    bool contact[BOARD_INPUTS]; /* what the mechanics say */
    bool level[BOARD_INPUTS];   /* after bounce */
    enum sim_force force[BOARD_INPUTS];
    struct sim_edge edges[SIM_EDGES]; /* in order of time */
    int edge_count;
    uint64_t bounces;              /* so far */
    double edge_below, edge_above; /* edges of the index mark around the platform's place, microsteps */
    bool on_mark;                  /* between them */

    uint16_t lines;
    struct sim_camera cameras[LUMI_RIG_CAMERAS];
    uint64_t cameras_next;
    double exposures[16];
    int exposure_count;
    int feedback[LUMI_RIG_FEEDBACKS]; /* cameras that hold the input active */
    GArray *records;                  /* struct sim_exposure */
    GArray *video;                    /* struct sim_video_frame */
    GArray *messages;                 /* struct sim_message */
};

void sim_platform_init(struct sim_mechanics *mechanics);
void sim_platform_step(struct sim_mechanics *mechanics, bool forward);
void sim_platform_advance(struct sim_mechanics *mechanics, uint64_t to);
void sim_platform_carry(struct sim_mechanics *mechanics, double place); /* an industrial drive has, to there */
/* After an output, the driver, the supply or the string changed. */
void sim_platform_powers(struct sim_mechanics *mechanics);
double sim_platform_place(const struct sim_mechanics *mechanics); /* of the body, microsteps */
/* When the platform's own state changes (brake), or the place must be looked at again because a switch is near. */
uint64_t sim_platform_next(struct sim_mechanics *mechanics);

/* Compares the contacts with the mechanics at `now` and `before`, where the body was when last looked at. */
void sim_switches_look(struct sim_mechanics *mechanics, double before, uint64_t since);
void sim_switches_run(struct sim_mechanics *mechanics); /* edges that are due */
void sim_switches_start(struct sim_mechanics *mechanics);
double sim_switches_distance(struct sim_mechanics *mechanics); /* microsteps to the nearest edge of the index */
bool sim_switches_level(const struct sim_mechanics *mechanics, enum board_input input);

void sim_cameras_lines(struct sim_mechanics *mechanics, uint16_t lines);
void sim_cameras_run(struct sim_mechanics *mechanics); /* what is due */

void sim_mechanics_tell(struct sim_mechanics *mechanics, bool feedback, int input, bool active, uint64_t at);

#endif
