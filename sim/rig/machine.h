/* A whole rig in virtual time: mechanics, board, the firmware's core on it, a link, and a host that speaks the wire's
 * protocol. Runs as fast as it computes; the same seed and the same calls give the same run.
 *
 * 1. Time passes only inside sim_machine_run, _run_until and the commands that wait for a reply.
 * 2. The host sends heartbeats by itself, as the client library does, and keeps every event it is told. */
#ifndef LUMI_SIM_RIG_MACHINE_H
#define LUMI_SIM_RIG_MACHINE_H

#include "firmware/host/host_board.h"
#include "proto/mechanism/sweep_plan.h"
#include "proto/wire/client.h"
#include "sim/rig/mechanics.h"

struct sim_machine;
struct sim_fault_script;

struct sim_machine_options {
    struct sim_mechanics_options mechanics;
    uint64_t seed;
    enum board_link link;
    double link_delay; /* s, one way */
    double link_rate;  /* bytes/s */
    bool host;         /* a client of ours is at the far end; otherwise bytes go through sim_machine_put and _get */
    uint32_t loop_latency, loop_longest; /* ticks, see host_board_set_loop; 0: its own */
};
void sim_machine_options_init(struct sim_machine_options *options, const struct lumi_rig *truth);

/* NULL: no memory. `truth` is the rig as it is; the board knows nothing until sim_machine_configure. */
struct sim_machine *sim_machine_create(const struct lumi_rig *truth, const struct sim_machine_options *options);
void sim_machine_destroy(struct sim_machine *machine);
struct sim_mechanics *sim_machine_mechanics(struct sim_machine *machine); /* stays the machine's */
struct host_board *sim_machine_board(struct sim_machine *machine);
/* Things that will go wrong (faults.h); stays the caller's and is not changed. NULL: none. */
void sim_machine_set_faults(struct sim_machine *machine, const struct sim_fault_script *script);

uint64_t sim_machine_now(const struct sim_machine *machine);      /* ticks */
uint32_t sim_machine_restarts(const struct sim_machine *machine); /* that the host has seen */
double sim_machine_seconds(const struct sim_machine *machine);
void sim_machine_run(struct sim_machine *machine, double seconds);
/* Until `done` says so (asked after everything that happens), or so many seconds have passed: false. */
typedef bool (*sim_machine_condition)(struct sim_machine *machine, void *context);
bool sim_machine_run_until(struct sim_machine *machine, sim_machine_condition done, void *context, double seconds);

/* ---- the host ---- */

/* Sends `request` (its command filled in) and waits for the reply: LUMI_ERR_BUSY where the board refuses,
 * LUMI_ERR_FORMAT where it says that the arguments cannot be, LUMI_ERR_IO without an answer in 10 s or lost with a
 * restart, else the reply (may be NULL) and LUMI_OK. */
int sim_machine_request(struct sim_machine *machine, lumi_wire_Request *request, lumi_wire_Reply *reply,
                        struct lumi_error *error);
/* Profile into the board's flash. */
int sim_machine_configure(struct sim_machine *machine, const struct lumi_rig *rig, struct lumi_error *error);
/* Homes and waits until it is done, at most half an hour; LUMI_ERR_IO where the board restarts meanwhile. */
int sim_machine_home(struct sim_machine *machine, bool wind_up, int turn, struct lumi_error *error);
int sim_machine_load_plan(struct sim_machine *machine, const struct lumi_plan *plan, struct lumi_error *error);
/* Starts the plan that was loaded; does not wait. */
int sim_machine_start(struct sim_machine *machine, int first_shot, bool only_missing, struct lumi_error *error);
/* Until the sweep has ended, however; LUMI_ERR_IO if it has not in so many seconds, or the board has restarted. */
int sim_machine_wait_sweep(struct sim_machine *machine, double seconds, struct lumi_error *error);
/* Releases all faults that stand. */
int sim_machine_clear(struct sim_machine *machine, struct lumi_error *error);
int sim_machine_pause(struct sim_machine *machine, struct lumi_error *error);
/* The state of every shot of the loaded plan, as the board has it, `count` of them. */
int sim_machine_shots(struct sim_machine *machine, uint8_t *states, int count, struct lumi_error *error);
/* Asks for the status now. */
int sim_machine_status(struct sim_machine *machine, lumi_wire_Status *status, struct lumi_error *error);
void sim_machine_emergency_stop(struct sim_machine *machine);

/* Every event the host was told, in order. */
struct sim_machine_event {
    uint32_t start;   /* how often the board had restarted before */
    uint64_t arrived; /* ticks */
    lumi_wire_Event event;
};
const struct sim_machine_event *sim_machine_events(const struct sim_machine *machine, int *count);
uint32_t sim_machine_events_lost(const struct sim_machine *machine);
/* The last event of a kind (lumi_wire_Event_…_tag) at or after place `from`, or NULL. */
const lumi_wire_Event *sim_machine_find(const struct sim_machine *machine, int from, int kind);
lumi_wire_Status sim_machine_last_status(const struct sim_machine *machine); /* of the last heartbeat */

/* ---- without a host of ours: the link's bytes ---- */
/* Our host goes away for good; whatever was under way on the link is lost. */
void sim_machine_release_host(struct sim_machine *machine);
void sim_machine_put(struct sim_machine *machine, const uint8_t *data, size_t size);
size_t sim_machine_get(struct sim_machine *machine, uint8_t *data, size_t size);

/* ---- what a test judges by ---- */

/* Every step pulse: its tick. And the e-stop's edges, pressed and let go in turn. */
const uint64_t *sim_machine_step_ticks(const struct sim_machine *machine, int *count);
const uint64_t *sim_machine_estop_ticks(const struct sim_machine *machine, int *count);
/* Ticks at which the board started, the first of them 0. */
const uint64_t *sim_machine_start_ticks(const struct sim_machine *machine, int *count);

/* ---- what goes wrong, now ---- */
void sim_machine_estop(struct sim_machine *machine, bool pressed);
void sim_machine_power(struct sim_machine *machine, bool on);
void sim_machine_reset(struct sim_machine *machine, enum board_reset cause);
void sim_machine_link_cut(struct sim_machine *machine, bool cut);     /* as a wire that breaks: nobody is told */
void sim_machine_unplug(struct sim_machine *machine, bool unplugged); /* both ends know */
void sim_machine_link_noise(struct sim_machine *machine, double share);
void sim_machine_host_gone(struct sim_machine *machine, bool gone); /* the host's program hangs */

#endif
