/* Calling Slurm's programs. */
#ifndef LUMI_PIPELINE_ENGINE_SLURM_CALL_H
#define LUMI_PIPELINE_ENGINE_SLURM_CALL_H

#include "proto/base/result.h"

/* Runs argv[0] and awaits its end; what it printed goes to *out (may be NULL; free with g_free). LUMI_ERR_NOTFOUND:
 * there is no such program here; LUMI_ERR_IO: it failed, and said why. */
int lumi_slurm_call(char **argv, char **out, struct lumi_error *error);

#endif
