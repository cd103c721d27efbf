/* A simulated rig behind a pseudo-terminal, in real time or a multiple of it: what `lumi rig` and other hosts can be
 * tried on without hardware. */
#ifndef LUMI_SIM_RIG_SERVE_H
#define LUMI_SIM_RIG_SERVE_H

#include "proto/base/result.h"
#include "sim/rig/faults.h"
#include "sim/rig/machine.h"

#include <signal.h>

struct sim_serve_options {
    struct sim_machine_options machine;    /* host is ignored */
    const char *link;                      /* a symbolic link to the pseudo-terminal is made there; NULL: none */
    double speed;                          /* virtual seconds a second */
    double seconds;                        /* virtual, until it ends by itself; 0: never */
    bool blank;                            /* the board has no profile yet; otherwise that of the rig */
    const struct sim_fault_script *faults; /* from when it is served; NULL: none */
    const volatile sig_atomic_t *stop;     /* ends it when it is not 0; NULL: nothing does */
    /* Told the pseudo-terminal's path once it is there. */
    void (*ready)(void *context, const char *path);
    /* After every step of virtual time, a few milliseconds; NULL: nobody is told. What it waits for besides the host is
     * `turn_fd`, −1: nothing. */
    void (*turn)(void *context, struct sim_machine *machine);
    int turn_fd;
    void *context;
};
void sim_serve_options_init(struct sim_serve_options *options, const struct lumi_rig *rig);

/* Until `stop` or the time is over. An existing `link` is replaced if it is a symbolic link that was left
 * behind, else refused (LUMI_ERR_EXISTS). It is removed at the end if it still leads here. */
int sim_serve(const struct lumi_rig *rig, const struct sim_serve_options *options, struct lumi_error *error);

#endif
