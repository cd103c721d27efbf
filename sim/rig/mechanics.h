/* The simulated rig: what the board's wires do to motor, platform, string, arm and cameras, and what the switches say.
 * In virtual time, in ticks of BOARD_TICK_HZ. The same object stands behind the firmware as a library (firmware/host)
 * and behind the flashed bytes on the emulated board (sim/board).
 *
 * 1. The caller tells every change of an output when it happens, in order of time, and never goes back.
 * 2. sim_mechanics_next says when something changes by itself; the caller advances there and is told the inputs. */
#ifndef LUMI_SIM_RIG_MECHANICS_H
#define LUMI_SIM_RIG_MECHANICS_H

#include "firmware/board/board.h"
#include "proto/base/geometry.h"
#include "proto/mechanism/rig.h"

struct sim_mechanics;

/* Physics that the rig profile does not hold; sim_mechanics_options_init fills in a sound rig. */
struct sim_mechanics_options {
    uint64_t seed;
    double motor_torque;   /* N·m, holding; falls with speed */
    double torque_corner;  /* full steps/s at which it has fallen to half */
    double inertia;        /* kg·m² of the platform with arm and cameras */
    double friction;       /* N·m at the platform */
    double detent_damping; /* of the rotor's swing about its step, share of critical */
    double backlash;       /* rad at the platform, of the belt; may differ from what the profile believes */
    double index_angle;    /* rad, where the switch closes, against the profile's idea of 0 */
    double index_width;    /* rad */
    double index_bounce;   /* s, of contact bounce */
    double arm_length;     /* m, and with mass the swing */
    double arm_frequency;  /* Hz, of the swing about the string */
    double arm_damping;    /* share of critical */
    double string_stretch; /* share of its length at the arm's weight */
    double start_turns;    /* where the platform and string stand at the beginning */
    double camera_jitter;  /* s, one standard deviation of the shutter lag */
    double supply;         /* V */
};
void sim_mechanics_options_init(struct sim_mechanics_options *options, const struct lumi_rig *rig);

/* `truth`: the rig as it is (lags, ratios), which may differ from the profile the board believes. */
struct sim_mechanics *sim_mechanics_create(const struct lumi_rig *truth, const struct sim_mechanics_options *options);
void sim_mechanics_destroy(struct sim_mechanics *mechanics);

/* Outputs of the board. */
void sim_mechanics_step(struct sim_mechanics *mechanics, uint64_t at, bool forward);
void sim_mechanics_trigger_lines(struct sim_mechanics *mechanics, uint64_t at, uint16_t lines);
void sim_mechanics_output(struct sim_mechanics *mechanics, uint64_t at, enum board_output output, bool active);

/* Time. `input` and `feedback` tell changes on the way, in order. */
struct sim_mechanics_listener {
    void *context;
    void (*input)(void *context, enum board_input input, bool active, uint64_t at);
    void (*feedback)(void *context, int input, bool active, uint64_t at);
};
uint64_t sim_mechanics_next(struct sim_mechanics *mechanics);
void sim_mechanics_advance(struct sim_mechanics *mechanics, uint64_t to, const struct sim_mechanics_listener *listener);
bool sim_mechanics_input(const struct sim_mechanics *mechanics, enum board_input input);
bool sim_mechanics_feedback(const struct sim_mechanics *mechanics, int input);
int sim_mechanics_supply_mv(const struct sim_mechanics *mechanics);

/* Truth, now (the time last advanced to). */
double sim_mechanics_turns(const struct sim_mechanics *mechanics); /* the platform, true, in turns from step 0 */
double sim_mechanics_angle(const struct sim_mechanics *mechanics); /* rad, true direction of the platform */
double sim_mechanics_drop(const struct sim_mechanics *mechanics);  /* rad, true, swing included */
double sim_mechanics_swing(const struct sim_mechanics *mechanics); /* rad, of platform and arm, away from rest */
bool sim_mechanics_falling(const struct sim_mechanics *mechanics); /* nothing holds the arm */
int64_t sim_mechanics_missed_steps(const struct sim_mechanics *mechanics);
void sim_mechanics_pose(const struct sim_mechanics *mechanics, int camera, struct lumi_pose *pose);

/* What the cameras did, one record an exposure, in order. */
struct sim_exposure {
    int camera;
    uint64_t trigger, begin, end; /* ticks */
    double angle, drop;           /* platform and arm at the exposure's middle */
    double swing;                 /* rad/s·s: how far they moved in it */
    bool lost;                    /* the trigger came while the camera was busy */
};
const struct sim_exposure *sim_mechanics_exposures(const struct sim_mechanics *mechanics, int *count);
/* How long exposure number n of a bracket lasts, for cameras that bracket by themselves. */
void sim_mechanics_set_exposures(struct sim_mechanics *mechanics, const double *seconds, int count);

#endif
