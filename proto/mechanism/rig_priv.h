/* What the checks of rig, control and plan share. */
#ifndef LUMI_PROTO_MECHANISM_RIG_PRIV_H
#define LUMI_PROTO_MECHANISM_RIG_PRIV_H

#include "proto/mechanism/rig.h"

#define RIG_DEGREE (LUMI_PI / 180)
#define RIG_REFUSE(...) return lumi_fail(error, LUMI_ERR_FORMAT, __VA_ARGS__)

/* Written so that NaN fails. */
static inline bool rig_within(double value, double low, double high)
{
    return value >= low && value <= high;
}

/* A name that can be a file's name: letters, digits, '.', '_', '-', no dot first, ends within LUMI_RIG_NAME. */
bool rig_name_ok(const char *name);

/* Length of the string outside the rod at the sweep's start: 0 where it lies along an arc. */
double rig_string_start(const struct lumi_rig *rig);

/* Motion, triggers, video and safety (rig_control_check.c). */
int rig_check_control(const struct lumi_rig *rig, struct lumi_error *error);

#endif
