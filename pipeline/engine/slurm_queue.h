/* What Slurm says of the jobs of one run. */
#ifndef LUMI_PIPELINE_ENGINE_SLURM_QUEUE_H
#define LUMI_PIPELINE_ENGINE_SLURM_QUEUE_H

#include "proto/base/result.h"

#include <glib.h>
#include <stdbool.h>

enum lumi_task_state { LUMI_TASK_WAITING, LUMI_TASK_RUNNING, LUMI_TASK_DONE, LUMI_TASK_FAILED };

struct lumi_task {
    long long job;
    int share;      /* its number in the array, from 1; 0: the job waits as one */
    char stage[32]; /* from the job's name */
    enum lumi_task_state state;
    char word[24]; /* Slurm's own: "TIMEOUT" */
    bool never;    /* waits for something that will not be */
};

/* Jobs are called "lumi.STAGE.MARK"; a mark belongs to a work folder. Free with g_free. */
char *lumi_slurm_job_name(const char *stage, const char *mark);
/* The names of all its jobs, separated by commas. Free with g_free. */
char *lumi_slurm_names(const char *mark);

/* Lines "JOB_SHARE|NAME|STATE|REASON" (the reason may be missing), as squeue and sacct are asked for. Jobs of other
 * names are passed over. LUMI_ERR_FORMAT: a line is nothing of that kind. Appends struct lumi_task to `tasks`. */
int lumi_slurm_parse_tasks(const char *text, const char *mark, GArray *tasks, struct lumi_error *error);

/* The number `sbatch --parsable` printed: "12" or "12;cluster". */
int lumi_slurm_parse_job(const char *text, long long *job, struct lumi_error *error);

#endif
