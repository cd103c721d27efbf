/* How cameras take their pictures, and what goes wrong with them. */
#ifndef LUMI_SIM_TAKES_H
#define LUMI_SIM_TAKES_H

#include "proto/base/raster.h"
#include "sim/rigs.h"

#define SIM_BRACKET 8
#define SIM_FAULTS 16

enum sim_fault_kind {
    SIM_FAULT_UNFOCUSED,        /* =CAMERA: blurred by a twentieth of the picture's width */
    SIM_FAULT_BLACK,            /* =FRAME: nothing but noise */
    SIM_FAULT_SWAPPED,          /* =CAMERA:CAMERA: each has the other's pictures */
    SIM_FAULT_BACKWARDS,        /* the platform turns the other way than it tells */
    SIM_FAULT_MISSING_ROW,      /* =ROW: its frames are lost */
    SIM_FAULT_ISOLATED,         /* =CAMERA: its pictures are mirrored, so that they share nothing with the others' */
    SIM_FAULT_UNEQUAL_BRACKETS, /* every fifth position lacks its last shot */
};

struct sim_fault {
    enum sim_fault_kind kind;
    char first[LUMI_RIG_NAME], second[LUMI_RIG_NAME];
};

struct sim_takes {
    double gain; /* stops, one standard deviation a camera; one frame in eight is off by half as much again */
    int bracket_count;
    double brackets[SIM_BRACKET]; /* stops, in the order of the shots; none: one shot */
    double base_s;                /* the exposure at 0 stops, as reported; 0: none is reported */
    bool arm;                     /* in the picture */
    struct sim_fault faults[SIM_FAULTS];
    int fault_count;
    uint64_t seed;
};

/* One fault: "black=r01c02". LUMI_ERR_ARG lists what there is. */
int sim_takes_add_fault(struct sim_takes *takes, const char *text, struct lumi_error *error);
bool sim_takes_has(const struct sim_takes *takes, enum sim_fault_kind kind);
/* Cameras, frames and rows that faults name are the rig's; views of swapped cameras change their true poses. A rig
 * that has such faults must be `shaken`. */
int sim_takes_apply(const struct sim_takes *takes, struct sim_rig *rig, struct lumi_error *error);

/* The exposure of a shot: stops against 1 that reach the sensor beyond what was asked for, and what the camera reports,
 * seconds. A shutter is a few hundredths off what it was asked for, and tells so. */
struct sim_take {
    bool lost;
    double stops;      /* on top of the sensor's own */
    double exposure_s; /* 0: not reported */
};
void sim_takes_shot(const struct sim_takes *takes, const struct sim_rig *rig, int view, int shot,
                    struct sim_take *take);

/* What the faults and the arm do to the light on the sensor. */
void sim_takes_disturb(const struct sim_takes *takes, const struct sim_rig *rig, int view, struct lumi_raster *picture);

#endif
