/* An operator who wants a sweep finished, whatever happens: clears faults when their cause is gone, homes, loads the
 * plan again after a restart, and starts what is missing. And what must have been true all along, judged afterwards
 * from the cameras' records, the step pulses and the board's events. */
#ifndef LUMI_TESTS_SCENARIO_RIG_OPERATOR_H
#define LUMI_TESTS_SCENARIO_RIG_OPERATOR_H

#include "rig_fixture.h"

#define OPERATOR_SHOTS 512
#define OPERATOR_CLEARS 512

struct rig_operator {
    struct rig_fixture f;
    struct sim_fault_script script;
    bool fired[OPERATOR_SHOTS]; /* as the board has told */
    int events_read, shots;
    uint64_t clears[OPERATOR_CLEARS]; /* ticks at which a clear went through */
    int clear_count;
    bool complete;
    char refused[1024]; /* why the last clear was */
    char why[4096];     /* what was wrong; empty: nothing */
};

/* Both return false with `why` filled. */
bool rig_operator_run(struct rig_operator *o, double patience);
bool rig_operator_judge(struct rig_operator *o);

#endif
