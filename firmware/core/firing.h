/* Firing the cameras: when each line goes up and down so that the middle of every exposure falls where the plan wants
 * it; brackets, focus lines, lags, busy times; what the feedback inputs answer; what was lost.
 *
 * 1. A shot has a number and is in one of the states below, kept for the whole sweep in two bits a shot. It leaves
 *    PLANNED once, and every change is an event. FIRED means: every line of it went up at its time, within
 *    FIRING_LATE_TICKS, and nothing stopped it before the last exposure's end.
 * 2. Edges are queued ahead by the main loop and put out by the board's trigger timer, one pattern at a time; edges
 * that fall on one tick are one pattern. Lines of one shot and the next may overlap: a line is up while anybody holds
 * it.
 * 3. A camera that would still be busy when its trigger comes is not triggered: the shot is lost, and said to be.
 * 4. The board's trigger timer calls firing_on_trigger from an interrupt, never from within trigger_at. */
#ifndef LUMI_FIRMWARE_CORE_FIRING_H
#define LUMI_FIRMWARE_CORE_FIRING_H

#include "firmware/board/board.h"
#include "proto/mechanism/sweep_plan.h"

/* An edge this late makes its shot lost: 100 µs, 0.0012° at 12°/s. Several lines whose edges are closer together than
 * the board's interrupt takes come that late at most. */
#define FIRING_LATE_TICKS (BOARD_TICK_HZ / 10000)
/* firing_shoot wants its first edge this far ahead: more than a call of core_poll takes. */
#define FIRING_MARGIN_TICKS (BOARD_TICK_HZ / 500)
#define FIRING_NO_SHOT UINT32_MAX

enum shot_state { SHOT_PLANNED = 0, SHOT_FIRED = 1, SHOT_LOST = 2 };

struct firing; /* firing_state.h */
struct firing_edge;

/* What is told of a shot when its last line has fallen and its last exposure is over (or when it is lost): for events.
 */
struct shot_record {
    uint32_t number;
    enum shot_state state;
    int exposure;     /* which of its position's bracket */
    uint32_t cameras; /* bit a camera whose trigger rose */
    uint16_t lines;   /* their trigger outputs */
    uint64_t middle;  /* planned tick of the exposures' middle */
    int64_t edge[16]; /* ticks from `middle` to the rising edge of trigger output i, where it rose */
    double position;  /* steps, at `middle` */
};
/* Called from firing_poll and firing_shoot. */
typedef void (*firing_report)(void *context, const struct shot_record *record);
/* `shot`: whose exposure it is, or FIRING_NO_SHOT. */
typedef void (*firing_report_edge)(void *context, int input, bool active, uint64_t at, uint32_t shot);

/* `edges`: room for FIRING_EDGES of them, the caller's; while nothing is busy it may hold something else. */
void firing_init(struct firing *firing, const struct board *board, struct firing_edge *edges, firing_report report,
                 firing_report_edge report_edge, void *context);
/* Before a sweep: the cameras' numbers and the exposures. Shots keep their states; see firing_plan_again. */
void firing_begin(struct firing *firing, const struct lumi_rig *rig, const struct lumi_plan *plan);
/* Shots first .. first + count − 1 are PLANNED. */
void firing_plan_again(struct firing *firing, uint32_t first, uint32_t count);
/* What the host knows better than the board. */
void firing_mark(struct firing *firing, uint32_t first, uint32_t count, enum shot_state state);

/* Wants shot `number`, the middle of its exposures at `middle` (ticks). False: too early to take (queue full), ask
 * again; a time that is too near or past, or a busy camera, marks it lost, reports it and returns true. */
bool firing_shoot(struct firing *firing, uint32_t number, int exposure, uint64_t middle, double position);
/* The shot cannot be taken: it is lost, and reported. */
void firing_lose(struct firing *firing, uint32_t number, int exposure, uint64_t middle, double position);
/* The least ticks between now and `middle` that firing_shoot needs for this exposure (lead, lag, half the exposure). */
uint64_t firing_lead(const struct firing *firing, int exposure);
/* Ticks from the middle of exposure `exposure` to its end. */
uint64_t firing_half(const struct firing *firing, int exposure);
/* Ticks from the middle of exposure `from` to the earliest middle of exposure `to`, so that between the end of one and
 * the trigger of the next lies `gap` and every camera takes it. */
uint64_t firing_spacing(const struct firing *firing, int from, int to, uint64_t gap);
/* Nothing more is fired: what has begun is finished (`finish`), or all lines fall at once and it is lost. What is
 * queued and has not begun goes back to PLANNED. From interrupts only with finish = false. */
void firing_stop(struct firing *firing, bool finish);
/* After a stop at once: record pulses go out again; shots wait for firing_begin. At rest. */
void firing_release(struct firing *firing);
/* The platform is not where it should be: what has begun is finished and lost. */
void firing_spoil(struct firing *firing);
bool firing_begun(const struct firing *firing, uint32_t first); /* a shot from `first` on is under way */
bool firing_busy_now(const struct firing *firing);              /* lines are up or queued, or exposures under way */
enum shot_state firing_state(const struct firing *firing, uint32_t number);
/* Queued or under way: its state is still to come. */
bool firing_pending(const struct firing *firing, uint32_t number);
/* The first shot that is PLANNED, or LUMI_PLAN_SHOTS_MAX. */
uint32_t firing_next_planned(struct firing *firing);
void firing_count(const struct firing *firing, uint32_t *fired, uint32_t *lost);
/* One pattern outside a sweep: each channel of `cameras` alone, one after another; `exposure` and `gap` in seconds.
 * False: something is under way, or no such camera is wired. */
bool firing_test(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, double exposure, double gap);
/* A record pulse on the cameras' lines (video): start, or stop for those that were started. False: the queue is full,
 * or everything was stopped. */
bool firing_record(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, bool start, uint64_t at);
/* The cameras have had their start pulse, and no stop; a pulse that was queued and dropped counts for nothing. */
bool firing_recording(struct firing *firing);

void firing_poll(struct firing *firing);
uint64_t firing_next_poll(const struct firing *firing);
void firing_on_trigger(struct firing *firing, uint64_t at);
void firing_on_feedback(struct firing *firing, int input, bool active, uint64_t at);

#endif
