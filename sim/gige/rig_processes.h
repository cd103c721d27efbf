/* A whole simulated rig as separate processes: the firmware behind a pseudo-terminal, GigE Vision cameras on loopback
 * addresses that photograph a simulated place from where they truly are, and what goes wrong with them. */
#ifndef LUMI_SIM_GIGE_RIG_PROCESSES_H
#define LUMI_SIM_GIGE_RIG_PROCESSES_H

#include "proto/mechanism/rig.h"
#include "proto/mechanism/sweep_plan.h"
#include "sim/gige/gige.h"
#include "sim/rig/faults.h"

#include <signal.h>

struct sim_rig_processes {
    const char *place; /* of sim/place.h */
    struct lumi_rig rig;
    char folder[512]; /* absolute, is there: board, rig.txt, plan.txt, lumid.conf and captures are made in it */
    bool drive; /* an industrial drive turns the platform: a Modbus server at 127.0.0.first_host + cameras, 1502 */
    uint64_t seed;
    double speed;   /* virtual seconds a second */
    int processes;  /* that draw; 0: as many as there are processors */
    int first_host; /* addresses: 127.0.0.first_host and on */
    struct sim_sensor sensor;
    double reference;                      /* s of exposure that make a picture as bright as the place is */
    const struct sim_fault_script *faults; /* or NULL */
    /* Into the files. */
    bool continuous;      /* the plan's mode; otherwise start-stop */
    double position_time; /* of the plan; 0: as long as drawing turns out to take, 2 s at least */
    double exposure;
    char layout[16]; /* of lumid's frames: "raw", "jpeg", "rgb" */
    int bits;
    double patience;     /* s, until a frame that does not come is taken again: drawing may be slow */
    int port;            /* of lumid's API */
    const char *process; /* command after a capture, or NULL */
    const char *preview; /* the program that draws the light field so far, or NULL: lumid's own choice */
    const volatile sig_atomic_t *stop;
    void (*ready)(const struct sim_rig_processes *rig); /* when all run; or NULL */
    /* Started then, in the same network, with LUMI_SIM_RIG=folder; all ends when it does. Ends with NULL; or NULL. */
    char *const *command;
};
void sim_rig_processes_init(struct sim_rig_processes *rig);

/* Until *stop, or `command` ends (LUMI_ERR_IO where it failed), or one of the rig's own does (LUMI_ERR_IO, its name).
 */
int sim_rig_processes_run(const struct sim_rig_processes *rig, struct lumi_error *error);

#define SIM_RIG_DRIVE_PORT 1502 /* the protocol's own, 502, wants rights */

/* "127.0.0.2", and the serial number, of a camera; the drive has the address after the last. */
void sim_rig_processes_address(const struct sim_rig_processes *rig, int camera, char address[16]);
void sim_rig_processes_serial(const struct sim_rig_processes *rig, int camera, char serial[16]);

#endif
