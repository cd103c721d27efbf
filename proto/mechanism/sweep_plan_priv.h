/* What the plan's totals and its check share: the time of one position of a start-stop sweep. */
#ifndef LUMI_PROTO_MECHANISM_SWEEP_PLAN_PRIV_H
#define LUMI_PROTO_MECHANISM_SWEEP_PLAN_PRIV_H

#include "proto/mechanism/sweep_plan.h"

/* From the move's begin to the first exposure's, from there until all is done, and both with the board's own margin. */
double plan_position_wait(const struct lumi_plan *plan, const struct lumi_rig *rig);
double plan_bracket_length(const struct lumi_plan *plan, const struct lumi_rig *rig);
double plan_position_busy(const struct lumi_plan *plan, const struct lumi_rig *rig);

#endif
