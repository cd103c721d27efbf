/* What a crew does with a rig by hand: look, home, jog, fire for a test, read and write the profile, clear a fault.
 * Each function waits until the board is done, with an end to every wait; the daemon may use them from a worker thread.
 */
#ifndef LUMI_DAEMON_RIG_BENCH_H
#define LUMI_DAEMON_RIG_BENCH_H

#include "daemon/rig/link.h"
#include "proto/mechanism/rig.h"

struct lumi_rig_bench {
    struct lumi_rig_link *link;
    void *context;
    /* How often the operator has asked to stop so far (Ctrl-C): once stops what moves; again is an emergency stop. May
     * be NULL. */
    int (*interrupts)(void *context);
    /* Several times a second. May be NULL. */
    void (*progress)(void *context, const lumi_wire_Status *status);
};

/* Opens a link and waits for its session. `address` NULL: the one board on USB. The link only looks and acknowledges
 * nothing by itself (link.h: observer, holds), so that bench work takes no event away from a sweep's log. */
int lumi_rig_bench_open(const char *address, double seconds, struct lumi_rig_link **link, struct lumi_error *error);

int lumi_rig_bench_status(struct lumi_rig_link *link, lumi_wire_Status *status, struct lumi_error *error);
/* LUMI_ERR_NOTFOUND: the board has none. */
int lumi_rig_bench_read_profile(struct lumi_rig_link *link, struct lumi_rig *rig, struct lumi_error *error);
/* Checks it, writes it, reads it back. `replace_newer`: even over one of a newer firmware's format. */
int lumi_rig_bench_write_profile(struct lumi_rig_link *link, const struct lumi_rig *rig, bool replace_newer,
                                 struct lumi_error *error);

/* LUMI_ERR_BUSY where the board refuses, LUMI_ERR_IO where it tried and failed, LUMI_ERR_CANCELLED after an interrupt;
 * with the board's reason. `seconds`: for all of it. */
int lumi_rig_bench_home(const struct lumi_rig_bench *bench, bool wind_up, int turn, double seconds,
                        struct lumi_error *error);
int lumi_rig_bench_jog(const struct lumi_rig_bench *bench, double turns, double speed, double seconds,
                       struct lumi_error *error);
/* Cameras: bit a camera, 0 for all. */
int lumi_rig_bench_test(const struct lumi_rig_bench *bench, uint32_t cameras, double exposure, double gap,
                        double seconds, struct lumi_error *error);
/* Stops what moves: at the next safe place, or slowing down now; waits until it stands. */
int lumi_rig_bench_stop(const struct lumi_rig_bench *bench, bool at_once, double seconds, struct lumi_error *error);
/* Every way of stopping that does not wait for a reply: until the board confirms it. */
int lumi_rig_bench_emergency_stop(struct lumi_rig_link *link, double seconds, struct lumi_error *error);
/* Clears the faults that stand; `cleared`: bit each that did. LUMI_ERR_BUSY: a cause is still there. */
int lumi_rig_bench_clear(struct lumi_rig_link *link, uint32_t *cleared, struct lumi_error *error);

/* Nothing moves, nor will without a command. */
bool lumi_rig_state_at_rest(lumi_wire_State state);
/* "estop, slack", into `text`; "none". */
const char *lumi_rig_fault_text(uint32_t faults, char *text, size_t size);

#endif
