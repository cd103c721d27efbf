/* What `lumi process` and `lumi retry` share: a run on this computer, or on a cluster. */
#ifndef LUMI_CLI_PROCESS_RUN_H
#define LUMI_CLI_PROCESS_RUN_H

#include "pipeline/engine/run_record.h"
#include "pipeline/run/run.h"

#include <stdbool.h>

struct process_run {
    struct lumi_record *record;
    const char *capture, *output, *work; /* as they were typed */
    bool again;                          /* lumi retry */
    bool wait;                           /* for the cluster */
    int every_s;                         /* asks its queue */
    bool json;
};

/* Fills what a record holds beside the engine's own options; relative names begin here. */
void process_record(struct lumi_record *record, const char *capture, const char *output, const char *command);
/* "CAPTURE.work" where none was given; free with g_free. */
char *process_work(const char *capture);

/* The process options have been read into process_options. */
int process_run(const struct process_run *how, struct lumi_error *error);

#endif
