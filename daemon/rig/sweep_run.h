/* A whole sweep as its host sees it: load the plan, start, follow what the board tells, write it down, and in the end
 * know what is missing. The board does the sweep by itself: a host that goes away and comes back finds out what was
 * done, and goes on. */
#ifndef LUMI_DAEMON_RIG_SWEEP_RUN_H
#define LUMI_DAEMON_RIG_SWEEP_RUN_H

#include "daemon/rig/bench.h"
#include "daemon/rig/drive.h"
#include "daemon/rig/sweep_log.h"

struct lumi_rig_sweep_progress {
    lumi_wire_State state;
    bool connected;
    uint32_t shots, fired, lost; /* of all, as the board counts */
    uint32_t turn;               /* of a video: the last mark */
};

struct lumi_rig_sweep_run {
    struct lumi_rig_link *link;
    const struct lumi_rig *rig; /* the board's profile */
    const struct lumi_plan *plan;
    bool resume;     /* goes on with what is missing; joins a sweep that is going on */
    bool again;      /* takes every shot again, though the board holds an unfinished sweep of this plan; with resume
                        only what is missing, though the board holds one of another plan */
    double patience; /* s without a word from the board before it is given up (60) */
    struct lumi_rig_sweep_log *log;
    struct lumi_rig_drive *drive; /* of a rig that has one; otherwise NULL */
    bool home_drive, reset_drive;
    int64_t utc_offset_ns; /* Unix time less CLOCK_MONOTONIC */
    void *context;
    /* How often the operator has asked to stop so far: once pauses at the next safe place, twice stops now, three times
     * is an emergency stop. May be NULL. */
    int (*interrupts)(void *context);
    void (*progress)(void *context, const struct lumi_rig_sweep_progress *progress); /* may be NULL */
    /* Filled in. */
    uint32_t shots, fired, lost, missing;
    bool ended;
    lumi_wire_SweepEnded_How how;
};
void lumi_rig_sweep_run_init(struct lumi_rig_sweep_run *run);
/* LUMI_OK: complete, every shot fired. Otherwise the text says what ended it and what is missing: LUMI_ERR_CANCELLED
 * (the operator), LUMI_ERR_BUSY (the board refuses), LUMI_ERR_IO (a fault, lost shots, no word from the board),
 * LUMI_ERR_EXISTS (an unfinished sweep of this plan is on the board, and neither resume nor again was said; or one of
 * another plan, and resume without again). */
int lumi_rig_sweep_run(struct lumi_rig_sweep_run *run, struct lumi_error *error);

/* "3, 17-24, 30" of the shots that are not fired, cut with "…" where it gets long; states: two bits a shot would be 0
 * planned, 1 fired, 2 lost; here one byte each. */
void lumi_rig_missing_text(const uint8_t *states, uint32_t count, char *text, size_t size);
int lumi_rig_read_shots(struct lumi_rig_link *link, uint32_t count, uint8_t *states, struct lumi_error *error);

#endif
