/* Firing the cameras: when each line goes up and down so that the middle of every exposure falls where the plan wants
 * it; brackets, focus lines, lags, busy times; what the feedback inputs answer; what was lost.
 *
 * 1. A shot has a number and is in one of the states below, kept for the whole sweep in two bits a shot. It leaves
 *    PLANNED once, and every change is an event. FIRED means: every line of it went up at its time.
 * 2. Edges are queued ahead by the main loop and put out by the board's trigger timer. Lines can be shared by nothing
 * but one camera each. */
#ifndef LUMI_FIRMWARE_CORE_FIRING_H
#define LUMI_FIRMWARE_CORE_FIRING_H

#include "firmware/board/board.h"
#include "proto/mechanism/sweep_plan.h"

enum shot_state { SHOT_PLANNED = 0, SHOT_FIRED = 1, SHOT_LOST = 2 };

struct firing; /* firing_state.h */

/* What is told of a shot when its last line has fallen (or when it is lost): for events. */
struct shot_record {
    uint32_t number;
    enum shot_state state;
    uint32_t cameras;  /* bit a camera that was fired */
    uint64_t middle;   /* planned tick of the exposures' middle */
    uint64_t edge[16]; /* tick at which camera i's trigger rose; 0: it did not */
    double position;   /* steps, at `middle` */
};
/* Called from firing_poll. */
typedef void (*firing_report)(void *context, const struct shot_record *record);
typedef void (*firing_report_edge)(void *context, int input, bool active, uint64_t at, uint32_t shot);

void firing_init(struct firing *firing, const struct board *board, firing_report report, firing_report_edge report_edge,
                 void *context);
/* Before a sweep: all shots PLANNED but those below `from`, which keep what they are. */
void firing_begin(struct firing *firing, const struct lumi_rig *rig, const struct lumi_plan *plan);

/* Wants shot `number`, the middle of its exposures at `middle` (ticks). False: too early to take (queue full), ask
 * again; a time that is too near or past marks it lost, reports it and returns true. */
bool firing_shoot(struct firing *firing, uint32_t number, int exposure, uint64_t middle, double position);
/* The least ticks between now and `middle` that firing_shoot needs for this exposure (lead, lag, half the exposure). */
uint64_t firing_lead(const struct firing *firing, int exposure);
/* Ticks after a shot's middle before all cameras can take the next. */
uint64_t firing_busy(const struct firing *firing, int exposure);
/* Nothing more is fired: what has begun is finished (`finish`), or all lines fall at once and it is lost. What is
 * queued and has not begun goes back to PLANNED. From interrupts only with finish = false. */
void firing_stop(struct firing *firing, bool finish);
bool firing_busy_now(const struct firing *firing); /* lines are up or queued */
enum shot_state firing_state(const struct firing *firing, uint32_t number);
void firing_set_state(struct firing *firing, uint32_t number, enum shot_state state); /* a host that retakes */
void firing_count(const struct firing *firing, uint32_t *fired, uint32_t *lost);
/* One pattern outside a sweep: each channel of `channels` alone, one after another. */
bool firing_test(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, double exposure, double gap);
/* A record pulse on the cameras' lines (video): start or stop. */
bool firing_record(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, bool start, uint64_t at);

void firing_poll(struct firing *firing);
uint64_t firing_next_poll(const struct firing *firing);
void firing_on_trigger(struct firing *firing, uint64_t at);
void firing_on_feedback(struct firing *firing, int input, bool active, uint64_t at);

#endif
