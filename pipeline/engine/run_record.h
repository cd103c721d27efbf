/* The record of a run: how it was asked for, and what it has handed to a queue. Kept in the work folder, so that
 * whoever comes later (another process, after a crash) knows how to go on. docs/cluster.md has the format. */
#ifndef LUMI_PIPELINE_ENGINE_RUN_RECORD_H
#define LUMI_PIPELINE_ENGINE_RUN_RECORD_H

#include "proto/base/result.h"

#include <glib.h>

#define LUMI_RECORD_FILE "run.txt"

enum lumi_engine { LUMI_ENGINE_LOCAL = 0, LUMI_ENGINE_SLURM = 1 };

/* A job handed to Slurm. */
struct lumi_record_job {
    char stage[32];
    long long id;
    int shares; /* of its stage; it does some or all of them */
};

struct lumi_record {
    enum lumi_engine engine;
    char *folder;         /* where it was asked for: relative paths in arguments begin there */
    char *capture;        /* absolute */
    char *output;         /* absolute */
    char *command;        /* what a node calls for `lumi` */
    GPtrArray *arguments; /* of `lumi stage`: "--gp=3"; of char *, owned */
    GPtrArray *options;   /* of sbatch: "partition=big", "depth:mem=8G"; of char *, owned */
    int chunk;            /* images a task, 0: chosen */
    int retries;          /* how often a failed share is tried again */
    int threads;          /* a task's, 0: one */
    GArray *jobs;         /* of struct lumi_record_job */
};

void lumi_record_init(struct lumi_record *record);
void lumi_record_finish(struct lumi_record *record);

/* Parsing trusts nothing; `source` stands for the file in errors. The record must be initialised, and is finished by
 * the caller in any case. */
int lumi_record_parse(const char *text, size_t size, const char *source, struct lumi_record *record,
                      struct lumi_error *error);
/* LUMI_ERR_NOTFOUND: nothing was run in this work folder yet. */
int lumi_record_read(const char *work, struct lumi_record *record, struct lumi_error *error);
/* Replaces it, synced. */
int lumi_record_write(const char *work, const struct lumi_record *record, struct lumi_error *error);

#endif
