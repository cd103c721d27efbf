/* The simulated rig: what the board's wires do to motor, platform, string, arm and cameras, and what the switches say.
 * In virtual time, in ticks of BOARD_TICK_HZ. The same object stands behind the firmware as a library (firmware/host)
 * and behind the flashed bytes on the emulated board (sim/board). docs/rig-simulation.md says what is modelled.
 *
 * 1. The caller tells every change of an output when it happens, in order of time, and never goes back.
 * 2. sim_mechanics_next says when something changes by itself; the caller advances there and is told the inputs. What
 *    happens while the caller only tells outputs is told at the next advance, with the time at which it happened.
 * 3. Random things (jitter, bounce) come from the seed and from how often the thing has happened: the same run gives
 *    the same numbers. */
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
    double damping;        /* of the platform's swing about the motor's field, share of critical */
    double backlash;       /* rad at the platform, of the belt; may differ from what the profile believes */
    double sway_share;     /* of the cameras' angle that follows a second mode, the arm bending sideways; 0 .. 1 */
    double sway_frequency; /* Hz, of that mode */
    double sway_damping;   /* share of critical */
    double arm_frequency;  /* Hz, of the arm's swing on its string */
    double arm_damping;    /* share of critical */
    double string_stretch; /* share of what is paid out, by the arm's weight */
    double index_angle;    /* rad, where the index switch closes, rising steps, against step 0 */
    double index_width;    /* rad */
    double switch_bounce;  /* s, of contact bounce, of every switch */
    double wound_turns;    /* turns at and below which the wound switch is closed */
    double rest_turns;     /* turns at which the arm is on its upper rest: it cannot be wound further */
    double end_turns;      /* turns beyond the whole string at which the end-of-string switch closes */
    double slack_angle;    /* rad of arm that hangs loose at which the slack switch closes */
    double brake_delay;    /* s, from the output's edge until the brake holds */
    double start_turns;    /* where platform and string stand at the beginning */
    double camera_jitter;  /* s, one standard deviation of the shutter lag */
    double supply;         /* V */
    double video_rate;     /* frames/s of cameras that record */
    bool video;            /* trigger lines start and stop recording */
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

bool sim_mechanics_enabled(const struct sim_mechanics *mechanics); /* the enable line of motor or drive */
/* A rig with an industrial drive, whose place is the drive's business: it has turned the platform to there by now, and
 * its position-reached line is so. */
void sim_mechanics_drive_to(struct sim_mechanics *mechanics, double turns, bool reached);

/* Truth, now (the time last advanced to). */
double sim_mechanics_turns(const struct sim_mechanics *mechanics); /* the platform, true, in turns from step 0 */
double sim_mechanics_angle(const struct sim_mechanics *mechanics); /* rad, true direction of the cameras' plane */
double sim_mechanics_drop(const struct sim_mechanics *mechanics);  /* rad, true, swing included */
/* rad, how far platform and arm get from rest in the swing they are in */
double sim_mechanics_swing(const struct sim_mechanics *mechanics);
bool sim_mechanics_falling(const struct sim_mechanics *mechanics);  /* nothing holds the arm */
double sim_mechanics_fallen(const struct sim_mechanics *mechanics); /* rad, by which it has fallen so far, ever */
/* rad, by which it has dropped into a string that hung loose (paid out behind a closed brake or a snag), ever */
double sim_mechanics_dropped(const struct sim_mechanics *mechanics);
int64_t sim_mechanics_missed_steps(const struct sim_mechanics *mechanics); /* full steps */
int64_t sim_mechanics_steps(const struct sim_mechanics *mechanics); /* pulses so far, backward ones counted down */
/* The place, in microsteps of the truth, to which the motor's field points: where the platform comes to rest. */
void sim_mechanics_pose(const struct sim_mechanics *mechanics, int camera, struct lumi_pose *pose);

/* What the cameras did, one record an exposure, in order of their triggers. */
struct sim_exposure {
    int camera;
    uint64_t trigger, begin, end; /* ticks */
    double field;                 /* microsteps, at the trigger: the motor's field */
    double angle, drop;           /* platform and arm at the exposure's middle */
    double moved;                 /* rad: how far the platform's angle went from begin to end */
    double swing;                 /* rad: sim_mechanics_swing at the middle */
    int exposure;                 /* which of the bracket the camera made of it */
    bool lost;                    /* the trigger came while the camera was busy, or it is dead */
    bool done;                    /* the middle has passed: angle, drop, moved and swing stand */
};
const struct sim_exposure *sim_mechanics_exposures(const struct sim_mechanics *mechanics, int *count);
/* How long exposure number n of a bracket lasts, for cameras that bracket by themselves. */
void sim_mechanics_set_exposures(struct sim_mechanics *mechanics, const double *seconds, int count);

/* Frames of cameras that record (options.video), in order of time; the exposures above are then none. */
struct sim_video_frame {
    int camera;
    uint64_t at;
    double angle, drop;
    bool lamp; /* the camera sees it lit */
};
const struct sim_video_frame *sim_mechanics_video(const struct sim_mechanics *mechanics, int *count);

/* Things that go wrong, now. */
enum sim_force { SIM_FORCE_NONE = 0, SIM_FORCE_INACTIVE, SIM_FORCE_ACTIVE };
void sim_mechanics_force_input(struct sim_mechanics *mechanics, enum board_input input, enum sim_force force);
void sim_mechanics_pulse_input(struct sim_mechanics *mechanics, enum board_input input, double seconds); /* a glitch */
void sim_mechanics_set_bounce(struct sim_mechanics *mechanics, double seconds);
void sim_mechanics_set_supply(struct sim_mechanics *mechanics, double volts);
void sim_mechanics_driver_fault(struct sim_mechanics *mechanics, bool fault); /* the driver cuts the current */
void sim_mechanics_snag(struct sim_mechanics *mechanics, bool snagged);       /* the string does not run off its rod */
/* The motor does not follow the next `steps` full steps (rounded up to what it can slip: four). */
void sim_mechanics_slip(struct sim_mechanics *mechanics, int steps);
struct sim_camera_fault {
    bool dead;         /* takes no trigger */
    double lag;        /* s, more than it should */
    double busy;       /* s, more than it should */
    bool feedback_off; /* exposes, but does not say so */
    double exposure;   /* times what it was told; 0: that */
    /* What becomes of its frames: for who makes them (sim/gige). */
    bool unplugged; /* takes no trigger either */
    bool frames_dropped, frames_doubled;
    double frames_late;  /* s */
    double packets_lost; /* share */
    double askew;        /* degrees that it looks aside: somebody has run into it */
};
/* Of an industrial drive: for who plays it. */
struct sim_drive_fault {
    bool alarm;  /* the cause of one is there */
    bool silent; /* it answers nothing */
};
const struct sim_drive_fault *sim_mechanics_drive_faults(const struct sim_mechanics *mechanics);
void sim_mechanics_drive_fault(struct sim_mechanics *mechanics, const struct sim_drive_fault *fault);
const struct sim_camera_fault *sim_mechanics_camera_faults(const struct sim_mechanics *mechanics, int camera);
/* How long this camera exposes from now on; 0: as the others. */
void sim_mechanics_set_camera_exposure(struct sim_mechanics *mechanics, int camera, double seconds);
void sim_mechanics_camera_fault(struct sim_mechanics *mechanics, int camera, const struct sim_camera_fault *fault);

#endif
