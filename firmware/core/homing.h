/* Finding the index mark: from anywhere, with backlash taken up, and on request all the way up the string. */
#ifndef LUMI_FIRMWARE_CORE_HOMING_H
#define LUMI_FIRMWARE_CORE_HOMING_H

#include "firmware/core/motion.h"
#include "proto/mechanism/rig.h"

/* What the search goes for. */
enum homing_goal {
    HOMING_INDEX = 0, /* the index mark, by the shortest search; the turn is `turn`, given by the operator (0 for a rig
                         whose arm is held) */
    HOMING_WOUND      /* turn back until the arm is all the way up, then the index mark that turn 0 begins with */
};
enum homing_result { HOMING_RUNNING = 0, HOMING_DONE, HOMING_FAILED };

struct homing; /* homing_state.h */

void homing_start(struct homing *homing, struct motion *motion, const struct lumi_rig *rig, enum homing_goal goal,
                  int turn);
/* Main loop, until it is no longer HOMING_RUNNING. Afterwards the position is known (DONE), or lost, and `reason` says
 * why (a static text). */
enum homing_result homing_poll(struct homing *homing, const char **reason);
void homing_cancel(struct homing *homing);
/* Interrupt: an edge of the index switch or the wound switch, debounced or not; `position` is the step it fell on. */
void homing_on_input(struct homing *homing, enum board_input input, bool active, uint64_t at);
bool homing_active(const struct homing *homing);

#endif
