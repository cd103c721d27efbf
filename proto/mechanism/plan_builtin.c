/* Plans to begin with. */
#include "proto/mechanism/sweep_plan.h"

#include <string.h>

const char *const lumi_plan_builtin_names[] = {"turn", "slow", "still", "hdr", NULL};

/* The shortest of some times from position to position that the rig keeps. */
static int find_position_time(const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    static const double seconds[] = {0.4, 0.5, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10};
    int code = LUMI_ERR_FORMAT;

    for (size_t i = 0; code != LUMI_OK && i < sizeof seconds / sizeof seconds[0]; i++) {
        plan->position_time = seconds[i];
        code = lumi_plan_check(plan, rig, error);
    }
    return code;
}

int lumi_plan_builtin(const char *name, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    int which = 0;

    while (lumi_plan_builtin_names[which] && strcmp(lumi_plan_builtin_names[which], name))
        which++;
    if (!lumi_plan_builtin_names[which])
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%.80s: there is no such plan", name);
    lumi_plan_init(plan, rig);
    memset(plan->name, 0, sizeof plan->name);
    memcpy(plan->name, lumi_plan_builtin_names[which], strlen(lumi_plan_builtin_names[which]));
    if (which == 0)
        return lumi_plan_check(plan, rig, error);
    if (which == 1) {
        plan->turn_time *= 2;
        plan->exposures[0] *= 2;
        return lumi_plan_check(plan, rig, error);
    }
    plan->mode = LUMI_PLAN_START_STOP;
    plan->exposures[0] = 1.0 / 60;
    if (which == 3) {
        plan->bracket = 3;
        plan->exposures[0] = 1.0 / 240;
        plan->exposures[1] = 1.0 / 60;
        plan->exposures[2] = 1.0 / 15;
    }
    return find_position_time(rig, plan, error);
}
