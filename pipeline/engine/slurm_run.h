/* A whole run on a cluster. */
#ifndef LUMI_PIPELINE_ENGINE_SLURM_RUN_H
#define LUMI_PIPELINE_ENGINE_SLURM_RUN_H

#include "pipeline/engine/run_record.h"
#include "pipeline/run/run.h"

struct lumi_slurm_run {
    struct lumi_record *record;
    const struct lumi_parameters *parameters;
    const char *work;
    bool again;                    /* go on beside jobs of this run that are in the queue; false: LUMI_ERR_BUSY */
    bool wait;                     /* until the field is there; false: only hand over */
    int every_s;                   /* seconds between questions to the queue */
    void (*say)(const char *line); /* may be NULL */
    void (*progress)(const char *what, long done, long total); /* may be NULL */
};

/* Hands over what is missing. Where it waits, shares that were killed are handed over again, up to record->retries
 * times; LUMI_ERR_IO with what a task said last, where one has given up. */
int lumi_slurm_run(const struct lumi_slurm_run *how, struct lumi_error *error);

/* LUMI_ERR_BUSY: jobs of the run that this work folder's record tells of are in the queue. LUMI_OK where there is no
 * such record, or no queue. */
int lumi_slurm_check_idle(const char *work, struct lumi_error *error);

#endif
