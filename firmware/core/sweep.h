/* The plan on board: a whole sweep, from winding to the last shot, without the host.
 *
 * 1. Shots are numbered as the plan numbers them (proto/mechanism/sweep_plan.h); a group is the bracket of one
 * position.
 * 2. A sweep that ends early ends at a safe place: shots that have begun are finished first (unless it must stop at
 *    once), then it slows down; what was not begun stays planned. Going on turns back, runs up anew and takes up the
 *    backlash.
 * 3. The middle of every exposure falls where the motion's curve passes its position; a position may lie between steps.
 */
#ifndef LUMI_FIRMWARE_CORE_SWEEP_H
#define LUMI_FIRMWARE_CORE_SWEEP_H

#include "firmware/core/motion.h"
#include "proto/mechanism/sweep_plan.h"

#include "proto/wire/message.h"

struct core;

enum sweep_phase {
    SWEEP_NONE = 0,
    SWEEP_WIND,    /* towards `start` */
    SWEEP_RECORD,  /* video: cameras have been told to record, and get their time */
    SWEEP_RUN,     /* continuous and video: under way */
    SWEEP_MOVE,    /* start-stop: from position to position */
    SWEEP_SHOOT,   /* start-stop: standing */
    SWEEP_REACH,   /* external drive: until it says that it stands */
    SWEEP_UNRECORD /* video: at rest, cameras are told to stop */
};
enum sweep_intent { SWEEP_GO = 0, SWEEP_TO_ROW_END, SWEEP_TO_REST };

struct sweep {
    bool active;
    enum sweep_phase phase;
    enum sweep_intent intent;
    lumi_wire_SweepEnded_How how; /* if it ends now */
    bool only_missing;
    bool stopping;   /* motion was told to stop */
    bool full_wound; /* wind full: the way up is behind us */
    bool external;
    uint32_t shot;       /* the next to be queued */
    uint32_t end;        /* one past the last */
    int64_t start;       /* step from which the sweep runs up */
    double per_position; /* steps */
    int mark;            /* the next turn mark */
    int marks_end;       /* one past the last */
    uint64_t wake;       /* when sweep_poll has something to do; BOARD_NEVER: when something else happens */
    uint64_t until;      /* record lead, timeouts */
    uint64_t feed_at;    /* continuous: the next shot is queued then */
    uint64_t mark_at;    /* … the next turn mark passes; 0: not known yet */
    /* Start-stop. */
    uint64_t cycle;                  /* tick at which the position's move was due */
    uint64_t period;                 /* position to position */
    uint64_t middle;                 /* of the last queued exposure, for the next one's spacing … */
    int exposure;                    /* … and which; −1: none before */
    uint64_t ready_at;               /* settled */
    uint32_t group_first, group_end; /* the shots of this position */
    int turns_done;                  /* video: turns that were recorded whole */
};

/* Begins: NULL, or why not. The state must allow it. */
const char *sweep_begin(struct core *core, uint32_t first_shot, bool only_missing);
/* External drive: what has not been fired of one bracket. */
const char *sweep_fire_here(struct core *core, uint32_t first_shot, double timeout);
void sweep_poll(struct core *core);
uint64_t sweep_next_poll(const struct core *core);
/* Ends at the next safe place; `how` is told then. */
void sweep_finish(struct core *core, lumi_wire_SweepEnded_How how);
/* Slows down now: shots under way are lost. */
void sweep_break(struct core *core, lumi_wire_SweepEnded_How how);
/* Goes on to the end of the row it is in; false: it is in none. */
bool sweep_end_with_row(struct core *core);
/* At rest, and no fault stands (any more): cameras that were left recording are told to stop. */
void sweep_unrecord(struct core *core);
/* The first shot that is neither fired nor lost, or how many there are. */
uint32_t sweep_next_shot(struct core *core);

/* Between sweep.c and the modes: sweep_continuous.c (video too), sweep_start_stop.c (external drive too). */
double sweep_position(const struct core *core, uint32_t shot); /* steps */
bool sweep_wanted(const struct core *core, uint32_t shot);
void sweep_skip(struct core *core); /* `shot` to the next that is wanted */
void sweep_wake(struct core *core, uint64_t at);
void sweep_done(struct core *core); /* at rest, over */
struct motion_limits sweep_limits(const struct core *core);
void sweep_plan_continuous(struct core *core);
void sweep_poll_continuous(struct core *core);
void sweep_plan_start_stop(struct core *core);
void sweep_poll_start_stop(struct core *core);
void sweep_mark(struct core *core, uint64_t at);
#define SWEEP_AHEAD (BOARD_TICK_HZ / 5) /* shots are queued so long before they must be: 200 ms */

#endif
