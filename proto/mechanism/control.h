/* What the rig's board must know beside the geometry: limits of motion, wiring of the cameras, and what to do when
 * something goes wrong. Part of the rig profile (rig.h), stored on the board and in every capture. No heap, no files.
 */
#ifndef LUMI_PROTO_MECHANISM_CONTROL_H
#define LUMI_PROTO_MECHANISM_CONTROL_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_RIG_CHANNELS 16            /* trigger outputs of the board */
#define LUMI_RIG_FEEDBACKS 4            /* exposure-feedback inputs (flash sync) of the board */
#define LUMI_RIG_STEP_RATE_MAX 100000.0 /* steps/s the board makes */
#define LUMI_RIG_RAMP_MAX 60.0          /* s from rest to speed_max, at most */

/* How the platform is moved. Angles are the platform's. */
enum lumi_rig_drive_kind {
    LUMI_RIG_DRIVE_STEPPER = 0, /* step pulses from the board */
    LUMI_RIG_DRIVE_EXTERNAL = 1 /* an industrial drive the host commands; the board enables it, watches its
                                   position-reached line and fires: start-stop only */
};

struct lumi_rig_motion {
    enum lumi_rig_drive_kind drive;
    double speed_max;        /* rad/s */
    double acceleration_max; /* rad/s² */
    double jerk_max;         /* rad/s³ */
    double home_speed;       /* rad/s, of the search for the index; the final approach takes a quarter of it */
    double wind_speed;       /* rad/s, of turning back */
    double backlash;         /* rad; every stop is approached in the sweep's direction from at least this far */
    double index_window;    /* rad; an index mark this far from where it should be is missed or early; 0: not watched */
    double settle;          /* s, from the last step of a start-stop move to the first exposure, unless the plan says */
    double step_pulse;      /* s, width of a step pulse */
    double direction_setup; /* s, between a change of direction and the next step */
};

/* Wiring and habits of one camera; index is the camera's in the rig. */
struct lumi_rig_trigger {
    int channel;        /* output 0 .. 15; −1: not triggered (it records by itself) */
    double shutter_lag; /* s, from the trigger edge to the exposure's begin */
    double pulse;       /* s, how long the trigger is held */
    double focus_lead; /* s, the focus line is held before the trigger; 0: none. It is output channel `focus_channel` */
    int focus_channel; /* −1: none */
    double busy;       /* s, from one exposure's begin until the next trigger is taken (less is a lost shot), over and
                          above the exposure itself */
    int feedback;      /* input 0 .. 3 whose rising edge is the exposure's begin; −1: none */
};

#define LUMI_RIG_LAMP_BITS 17 /* of the lamp's code at a turn mark: start, 12 of number, 4 of check */
struct lumi_rig_video {
    double record_pulse; /* s, on the trigger channels, to start and again to stop recording; 0: held while recording */
    double record_lead;  /* s, from the record pulse to the first motion */
    double lamp_bit;     /* s, one bit of the lamp's code; several frames of the cameras long */
};

/* The faults of the board, by bit and in this order in every table and on the wire (docs/rig-wire.md). */
enum lumi_rig_fault {
    LUMI_RIG_FAULT_ESTOP = 0,
    LUMI_RIG_FAULT_HOST_LOST,
    LUMI_RIG_FAULT_INDEX_MISSED,
    LUMI_RIG_FAULT_INDEX_EARLY,
    LUMI_RIG_FAULT_STRING_END,
    LUMI_RIG_FAULT_SLACK,
    LUMI_RIG_FAULT_OVERSPEED,
    LUMI_RIG_FAULT_DRIVER,
    LUMI_RIG_FAULT_SUPPLY,
    LUMI_RIG_FAULT_INTERNAL,
    LUMI_RIG_FAULT_WATCHDOG,
    LUMI_RIG_FAULTS
};
extern const char *const lumi_rig_fault_names[LUMI_RIG_FAULTS]; /* "estop", "host-lost", … as in the profile's text */

enum lumi_rig_motor_reaction {
    LUMI_RIG_MOTOR_ROW_END = 0, /* goes on to the end of the row, then stops (host lost only) */
    LUMI_RIG_MOTOR_RAMP,        /* slows down within the limits and holds; position stays known */
    LUMI_RIG_MOTOR_HALT,        /* not one step more, holding current stays; position is known only if it stood */
    LUMI_RIG_MOTOR_OFF          /* not one step more, current off; needs a brake where an arm can fall */
};
enum lumi_rig_trigger_reaction {
    LUMI_RIG_TRIGGERS_FINISH = 0, /* the shot that has begun is finished (its bracket too) */
    LUMI_RIG_TRIGGERS_OFF         /* all outputs inactive at once; the shot is reported lost */
};
struct lumi_rig_reaction {
    enum lumi_rig_motor_reaction motor;
    bool brake; /* closed as well, where one is fitted */
    enum lumi_rig_trigger_reaction triggers;
};

struct lumi_rig_safety {
    double host_timeout;   /* s without a heartbeat during a sweep: the host is lost; 0: never */
    double supply_minimum; /* V; 0: not watched */
    double overspeed;      /* platform rad/s between two index marks that is a fault; 0: not watched */
    bool brake_fitted, slack_fitted, string_end_fitted, wound_fitted, driver_fault_fitted;
    struct lumi_rig_reaction reactions[LUMI_RIG_FAULTS];
};

struct lumi_rig_control {
    struct lumi_rig_motion motion;
    struct lumi_rig_trigger triggers[16]; /* one a camera */
    struct lumi_rig_video video;
    struct lumi_rig_safety safety;
};

/* What stands for everything that a profile does not say: camera i on channel i, nothing fitted, an e-stop halts. */
void lumi_rig_control_init(struct lumi_rig_control *control);

#ifdef __cplusplus
}
#endif
#endif
