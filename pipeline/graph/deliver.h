/* From the work directory to where the user wants it. */
#ifndef LUMI_PIPELINE_GRAPH_DELIVER_H
#define LUMI_PIPELINE_GRAPH_DELIVER_H

#include "proto/base/result.h"

/* Copies `from` to `to` under a temporary name in `to`'s folder, synced and renamed; on failure nothing is left. */
int lumi_deliver(const char *from, const char *to, struct lumi_error *error);

#endif
