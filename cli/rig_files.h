/* Rig profiles and plans from the command line. */
#ifndef LUMI_CLI_RIG_FILES_H
#define LUMI_CLI_RIG_FILES_H

#include "proto/mechanism/sweep_plan.h"

/* `name`: a file in the form of docs/rig-profile.md, or where there is no such file one of the built-in rigs. */
int cli_read_rig(const char *name, struct lumi_rig *rig, struct lumi_error *error);
/* A file in the form of docs/rig-plan.md, checked against the rig. */
int cli_read_plan(const char *path, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error);

/* Puts lenses of a file of `[lens NAME]` sections (lumi calibrate lens) in the place of the rig's of these names; where
 * both have one lens, whatever it is called. */
int cli_change_lenses(const char *path, struct lumi_rig *rig, struct lumi_error *error);

#endif
