/* A network of one's own: nothing outside is reached, and no other program's cameras are met. */
#ifndef LUMI_SIM_GIGE_GIGE_NAMESPACE_H
#define LUMI_SIM_GIGE_GIGE_NAMESPACE_H

#include "proto/base/result.h"

/* The calling process, and what it starts, moves into a new network namespace in which the loopback network is up.
 * Needs root or user namespaces; LUMI_ERR_UNSUPPORTED says what is missing. Before any thread is started. */
int sim_gige_own_network(struct lumi_error *error);

#endif
