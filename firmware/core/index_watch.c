/* Whether index marks come where they should. */
#include "firmware/core/index_watch.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>

void index_watch_begin(struct index_watch *watch, const struct lumi_rig *rig, int64_t position)
{
    watch->steps_per_turn = lumi_rig_steps_per_turn(rig);
    watch->window = rig->control.motion.index_window / (2 * LUMI_PI) * watch->steps_per_turn;
    /* The first turn whose window begins after here. */
    watch->next = (int64_t)floor(((double)position + watch->window) / watch->steps_per_turn) + 1;
}

enum index_verdict index_watch_edge(struct index_watch *watch, int64_t position)
{
    double s = watch->steps_per_turn;
    int64_t turn = (int64_t)floor((double)position / s + 0.5);

    if (!(watch->window > 0))
        return INDEX_OK;
    if (fabs((double)position - (double)turn * s) > watch->window)
        return INDEX_EARLY;
    if (turn >= watch->next)
        watch->next = turn + 1;
    return INDEX_OK;
}

enum index_verdict index_watch_position(struct index_watch *watch, int64_t position)
{
    if (!(watch->window > 0) || (double)position <= (double)watch->next * watch->steps_per_turn + watch->window)
        return INDEX_OK;
    watch->next++;
    return INDEX_MISSED;
}
