/* What the plan's totals and its check share: the time of one position of a start-stop sweep. */
#ifndef LUMI_PROTO_MECHANISM_SWEEP_PLAN_PRIV_H
#define LUMI_PROTO_MECHANISM_SWEEP_PLAN_PRIV_H

#include "proto/mechanism/sweep_plan.h"

/* From the begin of a move over `distance` to the first exposure's, and from there until all is done. */
double plan_position_wait(const struct lumi_plan *plan, const struct lumi_rig *rig, double distance);
double plan_bracket_length(const struct lumi_plan *plan, const struct lumi_rig *rig);

#endif
