/* What the core remembers. Only for firmware/core and for ports that place it; see core.h. */
#ifndef LUMI_FIRMWARE_CORE_CORE_STATE_H
#define LUMI_FIRMWARE_CORE_CORE_STATE_H

#include "firmware/core/core.h"
#include "firmware/core/drop_string.h"
#include "firmware/core/firing_state.h"
#include "firmware/core/homing_state.h"
#include "firmware/core/lamp.h"
#include "firmware/core/motion_state.h"
#include "firmware/core/profile_store.h"
#include "firmware/core/safety.h"
#include "firmware/core/states.h"
#include "firmware/core/sweep.h"
#include "proto/wire/server.h"

#include <assert.h>

#define CORE_SECONDS(s) ((uint64_t)((s) * (double)BOARD_TICK_HZ + 0.5))
#define CORE_START_TICKS (BOARD_TICK_HZ / 200) /* a move is begun this far ahead: 5 ms */

struct core {
    const struct board *board;
    lumi_wire_State state;
    uint64_t now; /* of this poll */

    /* The profile, and what follows from it. */
    struct lumi_rig rig;
    struct profile_store_copy profile;
    bool has_profile;
    double steps_per_turn;
    uint32_t uploaded; /* bytes of a new profile that lie in scratch.store.data */

    struct lumi_plan plan;
    bool has_plan;
    uint32_t plan_crc;

    struct motion motion;
    struct homing homing;
    struct firing firing;
    struct lamp lamp;
    struct drop_string string;
    struct safety safety;
    struct sweep sweep;

    /* Home and Jog, until the brake is open and they begin. */
    bool begun, homing_asked; /* homing_asked: how it ended is still to be told */
    enum homing_goal home_goal;
    int32_t home_turn;
    int64_t jog_target;
    struct motion_limits jog_limits;

    bool lit; /* the status lamp: a profile, and no fault */
    struct lumi_wire_server server;
    lumi_wire_Event event; /* being made */
    /* Profiles are loaded while nothing is fired: a message being decoded and the queued edges share their room. What
     * is uploaded (store.data) stays while edges come and go. */
    union {
        struct profile_store_scratch store;
        struct firing_edge edges[FIRING_EDGES];
    };
    struct lumi_error error;
};

static_assert(FIRING_EDGES * sizeof(struct firing_edge) <= offsetof(struct profile_store_scratch, data),
              "edges must not reach into what is uploaded");

/* core.c */
void core_state_event(struct core *core, enum state_event event);
/* At rest, what was going on is over: known or lost, with a fault or without. */
void core_rest(struct core *core);
/* What is going on ends as soon as it may; shots that have begun are finished, or what is left of them is over. */
void core_stop_soon(struct core *core, bool finish);
/* Loads what flash has; the state follows. */
void core_load_profile(struct core *core);
/* Starts a move: within the profile's limits at most, and not past an emergency stop. */
bool core_move(struct core *core, int64_t target, const struct motion_limits *limits, uint64_t at);
/* The profile's limits in steps, with the speed given (rad/s). */
struct motion_limits core_limits(const struct core *core, double speed);
bool core_external(const struct core *core);
double core_pitch(const struct core *core, double step);

/* core_report.c: events, and the status. */
uint64_t core_ns(uint64_t ticks);
void core_report_started(struct core *core);
void core_report_state(struct core *core, lumi_wire_State from, lumi_wire_State to);
void core_report_shot(void *context, const struct shot_record *record);
void core_report_feedback(void *context, int input, bool active, uint64_t at, uint32_t shot);
void core_report_turn(struct core *core, int turn, int64_t step, uint64_t at);
void core_report_fault(struct core *core, int fault, bool set, const char *text);
void core_report_homed(struct core *core, bool found, const char *text);
void core_report_ended(struct core *core, lumi_wire_SweepEnded_How how);
void core_report_note(struct core *core, const char *text);
void core_status(void *context, lumi_wire_Status *status);

/* commands.c, commands_store.c */
void core_execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply);
void core_refuse(lumi_wire_Reply *reply, lumi_wire_Result result, const char *text);
bool core_refuse_unless_rest(const struct core *core, lumi_wire_Reply *reply);
void core_command_load_plan(struct core *core, const lumi_wire_LoadPlan *load, lumi_wire_Reply *reply);
void core_command_read_plan(struct core *core, lumi_wire_Reply *reply);
void core_command_read_profile(struct core *core, const lumi_wire_ReadProfile *read, lumi_wire_Reply *reply);
void core_command_write_profile(struct core *core, const lumi_wire_WriteProfile *write, lumi_wire_Reply *reply);
void core_command_commit_profile(struct core *core, const lumi_wire_CommitProfile *commit, lumi_wire_Reply *reply);
void core_command_read_shots(struct core *core, const lumi_wire_ReadShots *read, lumi_wire_Reply *reply);
void core_command_mark_shots(struct core *core, const lumi_wire_MarkShots *mark, lumi_wire_Reply *reply);

#endif
