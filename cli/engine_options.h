/* The options that say where a run runs; `lumi process` and `lumi retry` have them. */
#ifndef LUMI_CLI_ENGINE_OPTIONS_H
#define LUMI_CLI_ENGINE_OPTIONS_H

#include "pipeline/engine/run_record.h"

struct engine_options {
    char *engine, *command, **slurm;
    int chunk, retries, every;
    gboolean no_wait;
};
extern struct engine_options engine_options;

/* clang-format off */
#define ENGINE_OPTIONS                                                                                                 \
    {"engine", 0, 0, G_OPTION_ARG_STRING, &engine_options.engine, "local (this computer) or slurm (a cluster) (local)", "NAME"}, \
    {"slurm", 0, 0, G_OPTION_ARG_STRING_ARRAY, &engine_options.slurm, "an option for sbatch; for one stage's job alone with STAGE: before it; may be repeated", "NAME=VALUE"}, \
    {"chunk", 0, 0, G_OPTION_ARG_INT, &engine_options.chunk, "images a task on a cluster (16)", "N"},                   \
    {"retries", 0, 0, G_OPTION_ARG_INT, &engine_options.retries, "how often a task on a cluster is tried again (2)", "N"}, \
    {"command", 0, 0, G_OPTION_ARG_STRING, &engine_options.command, "what starts lumi on a cluster's computers (this program)", "WORDS"}, \
    {"no-wait", 0, 0, G_OPTION_ARG_NONE, &engine_options.no_wait, "hand over to the cluster, and end", NULL},           \
    {"every", 0, 0, G_OPTION_ARG_INT, &engine_options.every, "how often the cluster is asked how far it is (5)", "SECONDS"}
/* clang-format on */

/* Checks them, and puts those that were given into the record. */
int engine_options_read(struct lumi_record *record, struct lumi_error *error);

#endif
