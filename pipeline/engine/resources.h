/* How much of this computer a run may use. */
#ifndef LUMI_PIPELINE_ENGINE_RESOURCES_H
#define LUMI_PIPELINE_ENGINE_RESOURCES_H

#include <stdint.h>

struct lumi_resources {
    int cores;             /* at least 1 */
    const char *cores_by;  /* what limits them: "the computer", "the process's affinity", "its cgroup", "Slurm" */
    int64_t memory;        /* bytes that can still be had, INT64_MAX: not known */
    const char *memory_by; /* "the computer", "its cgroup", "Slurm" */
};

/* The least of what the kernel, the process's control group (version 2, or 1 where that is mounted) and those above it,
 * and a Slurm allocation (SLURM_CPUS_PER_TASK, SLURM_MEM_PER_NODE, SLURM_MEM_PER_CPU) leave. Files are read below
 * `root` ("" outside of tests); what cannot be read limits nothing. */
void lumi_resources_find(const char *root, struct lumi_resources *resources);

#endif
