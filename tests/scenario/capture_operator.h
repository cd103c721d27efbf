/* An operator who wants a capture, whatever happens: starts it, clears faults whose cause is gone, goes on after
 * interruptions, starts the daemon again when it died, asks for what is missing; and what must be true of the capture
 * in the end, judged from the bytes of its files and from what the world knows. */
#ifndef LUMI_TESTS_SCENARIO_CAPTURE_OPERATOR_H
#define LUMI_TESTS_SCENARIO_CAPTURE_OPERATOR_H

#include "capture_world.h"

struct capture_operator {
    struct world w;
    int starts, retakes, restarts, resumes, clears;
    bool keeps_going; /* asks again for what is missing */
    bool complete;
    char last[1200];    /* what was refused last */
    char capture[1024]; /* the sealed one */
};

/* Until the capture is sealed and complete; false with w.why: it is not, after so many seconds. */
bool capture_operator_run(struct capture_operator *o, double patience);
/* Starts another capture. */
void capture_operator_begin(struct capture_operator *o);
/* One look and one action. */
void capture_operator_act(struct capture_operator *o);

struct capture_account {
    int rows, stored, accepted, rejected, missing, retaken;
    int flawed; /* accepted, though they should not be */
};
/* The sealed capture: every planned frame once and accounted for; every file what it says it is. */
bool capture_truth_judge(struct world *world, const char *path, bool complete, struct capture_account *account);

#endif
