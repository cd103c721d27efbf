/* Whether the index marks of a sweep come where they should: a motor that has lost steps, or a belt that has jumped, is
 * found at the next mark. Rising steps only.
 *
 * Turn n begins with its mark at step lumi_rig_position_step(n · positions). A mark that comes within the profile's
 * index_window of that is right; the switch closing anywhere else is early; a window that ends without it: missed.
 *
 * How to use it: index_watch_begin where a sweep's own motion starts, index_watch_end where it is over;
 * index_watch_on_input from the interrupt, before or after anybody else's; index_watch_poll in the main loop, every few
 * milliseconds, for the verdict. */
#ifndef LUMI_FIRMWARE_CORE_INDEX_WATCH_H
#define LUMI_FIRMWARE_CORE_INDEX_WATCH_H

#include "firmware/core/debounce.h"
#include "proto/mechanism/rig.h"

enum index_verdict { INDEX_OK = 0, INDEX_MISSED, INDEX_EARLY };

struct index_watch {
    bool active;
    double steps_per_turn, window; /* steps; window 0: not watched */
    int64_t next;                  /* turn whose mark must come next */
    uint64_t left_at;              /* tick since which its window is known to have been left; 0: it has not */
    struct debounce input;         /* shared with the interrupt */
};

/* From `position` on, where the switch is `closed` or not. A mark whose window that is in already may come, but need
 * not. */
void index_watch_begin(struct index_watch *watch, const struct lumi_rig *rig, int64_t position, bool closed);
void index_watch_end(struct index_watch *watch);
/* Interrupt: the switch has changed, bouncing or not, at `position`. */
void index_watch_on_input(struct index_watch *watch, bool closed, int64_t position, uint64_t at);
/* The platform is at `position` now. INDEX_MISSED once for every window that has been left without an edge, the
 * debouncing's time later. */
enum index_verdict index_watch_poll(struct index_watch *watch, const struct board *board, int64_t position,
                                    uint64_t now);

/* What index_watch_poll is made of. The switch has closed (debounced) at `position`. */
enum index_verdict index_watch_edge(struct index_watch *watch, int64_t position);
/* Up to `position` all edges have been told. */
enum index_verdict index_watch_position(struct index_watch *watch, int64_t position);

#endif
