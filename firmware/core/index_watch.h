/* Whether the index marks of a sweep come where they should: a motor that has lost steps, or a belt that has jumped, is
 * found at the next mark. Rising steps only.
 *
 * Turn n begins with its mark at step lumi_rig_position_step(n · positions). A mark that comes within the profile's
 * index_window of that is right; the switch closing anywhere else is early; a window that ends without it: missed. */
#ifndef LUMI_FIRMWARE_CORE_INDEX_WATCH_H
#define LUMI_FIRMWARE_CORE_INDEX_WATCH_H

#include "proto/mechanism/rig.h"

enum index_verdict { INDEX_OK = 0, INDEX_MISSED, INDEX_EARLY };

struct index_watch {
    double steps_per_turn, window; /* steps; window 0: not watched */
    int64_t next;                  /* turn whose mark must come next */
};

/* From `position` on. A mark whose window it is in already may come, but need not. */
void index_watch_begin(struct index_watch *watch, const struct lumi_rig *rig, int64_t position);
/* The switch has closed (debounced) at `position`. */
enum index_verdict index_watch_edge(struct index_watch *watch, int64_t position);
/* The platform has got to `position`: INDEX_MISSED once for every window it has left without an edge. Debouncing takes
 * its time, so tell edges before positions, and positions as they were DEBOUNCE_TICKS and a poll ago. */
enum index_verdict index_watch_position(struct index_watch *watch, int64_t position);

#endif
