/* Inside a whole rig: machine.c turns the world, machine_host.c is the operator's computer. */
#ifndef LUMI_SIM_RIG_MACHINE_PRIV_H
#define LUMI_SIM_RIG_MACHINE_PRIV_H

#include "sim/rig/machine.h"
#include "sim/rig/wire_path.h"

#include <glib.h>

struct sim_fault_run;

struct sim_machine {
    struct lumi_rig truth;
    struct sim_machine_options options;
    uint64_t now;
    struct sim_mechanics *mechanics;
    struct host_board *board;
    struct sim_wire_path to_board, to_host;
    struct sim_fault_run *faults; /* NULL: none */
    bool unplugged, host_gone;

    struct lumi_wire_client client;
    uint32_t starts; /* restarts the client has seen */
    bool replied, request_lost;
    lumi_wire_Reply reply;
    lumi_wire_Status status;
    bool status_known;
    uint32_t events_lost;
    GArray *events;       /* struct sim_machine_event */
    GArray *steps;        /* uint64_t */
    GArray *estops;       /* uint64_t */
    GArray *board_starts; /* uint64_t */
    uint32_t resets;      /* of the board, when last looked at */
    GByteArray *raw;      /* bytes for somebody else's host */
    struct lumi_plan plan;
    bool planned;
};

static inline uint64_t sim_machine_ns(uint64_t ticks)
{
    /* 84 ticks are 1,000 ns. */
    return ticks / 84 * 1000 + ticks % 84 * 1000 / 84;
}
static inline uint64_t sim_machine_ticks(uint64_t ns)
{
    return ns == UINT64_MAX ? BOARD_NEVER : ns / 1000 * 84 + (ns % 1000 * 84 + 999) / 1000;
}

extern const struct lumi_wire_client_ops sim_machine_client_ops;

#endif
