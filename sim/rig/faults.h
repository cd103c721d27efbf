/* What goes wrong on a simulated rig, and when: a script in text (docs/rig-simulation.md), or a random one. */
#ifndef LUMI_SIM_RIG_FAULTS_H
#define LUMI_SIM_RIG_FAULTS_H

#include "proto/base/result.h"
#include "proto/mechanism/rig.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum sim_fault_kind {
    SIM_FAULT_ESTOP = 0, /* value: 1 pressed, 0 let go; so for all that are on or off */
    SIM_FAULT_LINK_CUT,
    SIM_FAULT_LINK_NOISE, /* value: share of damaged packets */
    SIM_FAULT_UNPLUG,
    SIM_FAULT_HOST_GONE,
    SIM_FAULT_INPUT,  /* index: enum board_input; value: enum sim_force */
    SIM_FAULT_PULSE,  /* index: enum board_input; value: s */
    SIM_FAULT_BOUNCE, /* value: s */
    SIM_FAULT_SNAG,
    SIM_FAULT_DRIVER,
    SIM_FAULT_SUPPLY,      /* value: V; 0: what it was at the beginning */
    SIM_FAULT_CAMERA_DEAD, /* index: camera */
    SIM_FAULT_CAMERA_MUTE,
    SIM_FAULT_CAMERA_LAG,   /* value: s */
    SIM_FAULT_CAMERA_BUSY,  /* value: s */
    SIM_FAULT_SLIP,         /* value: full steps */
    SIM_FAULT_HANG,         /* value: s */
    SIM_FAULT_RESET,        /* index: enum board_reset */
    SIM_FAULT_POWER,        /* value: 1 off, 0 on */
    SIM_FAULT_CUT_IN_FLASH, /* value: bytes until the power goes */
    SIM_FAULT_CAMERA_UNPLUG,
    SIM_FAULT_EXPOSURE, /* value: times what it was told; so for all of these index: camera */
    SIM_FAULT_FRAMES_DROPPED,
    SIM_FAULT_FRAMES_DOUBLED,
    SIM_FAULT_FRAMES_LATE,  /* value: s */
    SIM_FAULT_PACKETS_LOST, /* value: share */
    SIM_FAULT_ASKEW,        /* value: degrees */
    SIM_FAULT_DRIVE_ALARM,
    SIM_FAULT_DRIVE_SILENT,
    SIM_FAULT_KINDS
};

struct sim_fault {
    bool by_shot; /* `at` counts shots, otherwise seconds from when the script was given to the machine */
    double at;
    enum sim_fault_kind kind;
    int index;
    double value;
    double duration; /* s, after which it is undone; 0: it stays */
};

#define SIM_FAULTS_MAX 256
struct sim_fault_script {
    int count;
    struct sim_fault faults[SIM_FAULTS_MAX];
};

/* Errors name `source` and the line. */
int sim_fault_script_parse(const char *text, size_t size, const char *source, struct sim_fault_script *script,
                           struct lumi_error *error);
/* Writes at most `size` bytes, the last of them 0, and returns the length of the whole text. What it writes parses to
 * the same faults. */
size_t sim_fault_script_print(const struct sim_fault_script *script, char *text, size_t size);

/* A script of up to `most` faults within `seconds`, of kinds that the rig can meet. Everything in it is undone after a
 * while, so that an operator can go on. */
void sim_fault_script_random(struct sim_fault_script *script, uint64_t seed, const struct lumi_rig *rig, int most,
                             double seconds);

#endif
