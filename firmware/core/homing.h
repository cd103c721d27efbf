/* Finding the index mark: from anywhere, with backlash taken up, and on request all the way up the string.
 *
 * What is found: the step at which the index switch closes (its first contact) while the platform turns slowly with
 * rising steps, the sweep's direction, after at least the backlash in that direction. That is step 0 of its turn
 * (lumi_rig_position_step of the turn's first position), where the platform points in the profile's `index` direction.
 * The mark's other edge means nothing.
 *
 * HOMING_INDEX turns back, which winds the string up, until the switch has closed and opened again, and so finds the
 * mark with which the turn begins that the platform stands in; standing on the mark counts as the turn that begins
 * there. Should the arm be all the way up before a mark has come, the mark ahead is that of turn 0, whatever `turn`
 * says. HOMING_WOUND turns back until the arm is all the way up, then on to the first mark: turn 0's.
 *
 * Bounds: a mark within 1.1 turns; a mark no wider than half a turn; winding for as many turns as the string has, and
 * 1.1 more. The switch of the arm's upper end must close between two marks. */
#ifndef LUMI_FIRMWARE_CORE_HOMING_H
#define LUMI_FIRMWARE_CORE_HOMING_H

#include "firmware/core/motion.h"
#include "proto/mechanism/rig.h"

/* What the search goes for. */
enum homing_goal {
    HOMING_INDEX = 0, /* the index mark; the turn is `turn`, given by the operator (0 for a rig whose arm is held) */
    HOMING_WOUND      /* turn back until the arm is all the way up, then the index mark that turn 0 begins with */
};
enum homing_result { HOMING_RUNNING = 0, HOMING_DONE, HOMING_FAILED };

struct homing; /* homing_state.h */

/* Before anything else. */
void homing_init(struct homing *homing, const struct board *board);
/* At rest. `rig` remains the caller's and is used until it ends. The position is lost from here on. */
void homing_start(struct homing *homing, struct motion *motion, const struct lumi_rig *rig, enum homing_goal goal,
                  int turn);
/* Main loop, until it is no longer HOMING_RUNNING; then nothing moves any more. Afterwards the position is known
 * (DONE), or lost, and `reason` says why (a static text). A halt from elsewhere fails it. */
enum homing_result homing_poll(struct homing *homing, const char **reason);
/* Slows down if it moves; the position is lost. */
void homing_cancel(struct homing *homing);
/* Interrupt: the index switch or the wound switch has changed, bouncing or not. */
void homing_on_input(struct homing *homing, enum board_input input, bool active, uint64_t at);
bool homing_active(const struct homing *homing);
uint64_t homing_next_poll(const struct homing *homing);

#endif
