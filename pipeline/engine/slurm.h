/* The Slurm engine: every stage a job array of shares, each stage's job behind those it reads of.
 *
 * Invariants.
 * 1. What is done is told by the keys in the work folder, never by Slurm: the queue may lose its memory, and the
 * process that handed the jobs over may be gone. Asking again hands over what is missing.
 * 2. A task is `lumi stage STAGE --share K/N`: one share of whatever the stage works on when the task begins. So the
 *    second phase, whose number of views only the first one finds out, is handed over together with it.
 * 3. A work folder's jobs bear its mark in their names; they are found again by that. */
#ifndef LUMI_PIPELINE_ENGINE_SLURM_H
#define LUMI_PIPELINE_ENGINE_SLURM_H

#include "pipeline/engine/outstanding.h"
#include "pipeline/engine/run_record.h"
#include "pipeline/engine/slurm_queue.h"

/* The eight digits that the jobs of a work folder bear; free with g_free. */
char *lumi_slurm_mark(const char *work);

/* All tasks of the work folder that Slurm still knows of (struct lumi_task); those that ended some minutes ago are
 * forgotten unless it keeps accounts. LUMI_ERR_IO: it does not answer. */
int lumi_slurm_tasks(const char *work, GArray **tasks, struct lumi_error *error);
/* Tasks that wait or run, among them. */
int lumi_slurm_count_live(const GArray *tasks);

/* Hands over what is missing and writes the jobs' numbers into the record, one by one. */
int lumi_slurm_submit(struct lumi_run *run, const struct lumi_progress *progress, struct lumi_record *record,
                      struct lumi_error *error);
/* Takes back what waits or runs, and awaits that. */
int lumi_slurm_cancel(const char *work, struct lumi_error *error);

/* What tasks left when they gave up: "STAGE share K: LINE", sorted (char *). */
GPtrArray *lumi_slurm_failures(const char *work);

/* The least share with something to do: tells which array numbers a stage's job needs, "1-4,7"; free with g_free. */
char *lumi_slurm_array(const struct lumi_progress *progress, int shares);
/* In how many shares a stage's images are divided. */
int lumi_slurm_shares(int count, int chunk);

#endif
