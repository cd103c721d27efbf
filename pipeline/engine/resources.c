/* How much of this computer a run may use.
 *
 * Memory: /proc/meminfo's MemAvailable; of every control group from the process's own to the root, its limit less what
 * is charged to it, where page cache that can be dropped (inactive_file) does not count (Linux,
 * Documentation/admin-guide/cgroup-v2.rst, "Memory Interface Files"; cgroup-v1/memory.rst). */
#define _GNU_SOURCE /* sched_getaffinity, CPU_COUNT */
#include "pipeline/engine/resources.h"

#include <glib.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A file of a few lines, or NULL. */
static char *read_small(const char *root, const char *folder, const char *name)
{
    g_autofree char *path = g_strconcat(root, folder, name, NULL);
    char *text = NULL;

    return g_file_get_contents(path, &text, NULL, NULL) ? text : NULL;
}

/* The number the file begins with; `missing` where there is none ("max"). */
static int64_t read_number(const char *root, const char *folder, const char *name, int64_t missing)
{
    g_autofree char *text = read_small(root, folder, name);
    char *end = NULL;
    const gint64 number = text ? g_ascii_strtoll(text, &end, 10) : 0;

    return text && end != text && number >= 0 ? number : missing;
}

/* The number behind `word` at the beginning of a line. */
static int64_t number_after(const char *text, const char *word, int64_t missing)
{
    const size_t length = strlen(word);

    for (const char *line = text; line && *line; line = strchr(line, '\n'), line += line ? 1 : 0)
        if (!strncmp(line, word, length)) {
            char *end;
            const gint64 number = g_ascii_strtoll(line + length, &end, 10);
            return end != line + length && number >= 0 ? number : missing;
        }
    return missing;
}

static void limit_memory(struct lumi_resources *resources, int64_t bytes, const char *by)
{
    if (bytes < resources->memory) {
        resources->memory = bytes < 0 ? 0 : bytes;
        resources->memory_by = by;
    }
}

static void limit_cores(struct lumi_resources *resources, int64_t cores, const char *by)
{
    if (cores >= 1 && cores < resources->cores) {
        resources->cores = (int)cores;
        resources->cores_by = by;
    }
}

/* One group of either version: what its files say. */
static void limit_by_group(const char *root, const char *folder, bool second, struct lumi_resources *resources)
{
    const char *const most = second ? "/memory.max" : "/memory.limit_in_bytes";
    const char *const used = second ? "/memory.current" : "/memory.usage_in_bytes";
    const int64_t limit = read_number(root, folder, most, INT64_MAX);
    int64_t quota = -1, period = 0;

    if (limit < INT64_MAX / 2) { /* version 1 says "none" with a number near that */
        g_autofree char *stat = read_small(root, folder, "/memory.stat");
        const int64_t cache = number_after(stat, second ? "inactive_file " : "total_inactive_file ", 0);
        const int64_t held = read_number(root, folder, used, 0);
        limit_memory(resources, limit - (held > cache ? held - cache : 0), "its cgroup");
    }
    if (second) {
        g_autofree char *text = read_small(root, folder, "/cpu.max");
        long long a, b;
        if (text && sscanf(text, "%lld %lld", &a, &b) == 2)
            quota = a, period = b;
    } else {
        quota = read_number(root, folder, "/cpu.cfs_quota_us", -1);
        period = read_number(root, folder, "/cpu.cfs_period_us", 0);
    }
    if (quota > 0 && period > 0) /* a share of a core is a core; a half one more than that is none more */
        limit_cores(resources, MAX(1, quota / period), "its cgroup");
}

/* The group and all above it, up to the mount. */
static void limit_by_groups(const char *root, const char *mount, const char *group, bool second,
                            struct lumi_resources *resources)
{
    g_autofree char *folder = g_strconcat(mount, group, NULL);
    const size_t shortest = strlen(mount);

    for (;;) {
        size_t length = strlen(folder);
        while (length > shortest && folder[length - 1] == '/')
            folder[--length] = '\0';
        limit_by_group(root, folder, second, resources);
        if (length <= shortest)
            return;
        char *slash = strrchr(folder, '/');
        folder[slash && (size_t)(slash - folder) > shortest ? (size_t)(slash - folder) : shortest] = '\0';
    }
}

static bool has_controller(const char *list, const char *name)
{
    g_auto(GStrv) names = g_strsplit(list, ",", -1);

    return g_strv_contains((const char *const *)names, name);
}

/* /proc/self/cgroup: "NUMBER:CONTROLLERS:GROUP", without controllers for version 2. */
static void limit_by_cgroups(const char *root, struct lumi_resources *resources)
{
    g_autofree char *text = read_small(root, "/proc/self", "/cgroup");
    g_auto(GStrv) lines = g_strsplit(text ? text : "", "\n", -1);

    for (int i = 0; lines[i]; i++) {
        g_auto(GStrv) parts = g_strsplit(lines[i], ":", 3);
        if (g_strv_length(parts) != 3)
            continue;
        if (!parts[1][0])
            limit_by_groups(root, "/sys/fs/cgroup", parts[2], true, resources);
        else if (has_controller(parts[1], "memory"))
            limit_by_groups(root, "/sys/fs/cgroup/memory", parts[2], false, resources);
        else if (has_controller(parts[1], "cpu"))
            limit_by_groups(root, "/sys/fs/cgroup/cpu", parts[2], false, resources);
    }
}

static int64_t from_environment(const char *name)
{
    const char *text = getenv(name);
    char *end;
    const gint64 number = text ? g_ascii_strtoll(text, &end, 10) : 0;

    return text && end != text && !*end && number > 0 ? number : -1;
}

/* Slurm does not always bind a task to what it was given (TaskPlugin=task/none). */
static void limit_by_slurm(struct lumi_resources *resources)
{
    const int64_t megabyte = 1 << 20;

    if (!getenv("SLURM_JOB_ID"))
        return;
    int64_t cores = from_environment("SLURM_CPUS_PER_TASK");
    if (cores < 0)
        cores = from_environment("SLURM_CPUS_ON_NODE");
    limit_cores(resources, cores, "Slurm");
    const int64_t node = from_environment("SLURM_MEM_PER_NODE"), core = from_environment("SLURM_MEM_PER_CPU");
    if (node > 0)
        limit_memory(resources, node < INT64_MAX / megabyte ? node * megabyte : INT64_MAX, "Slurm");
    else if (core > 0)
        limit_memory(resources, core < (int64_t)1 << 40 ? core * megabyte * resources->cores : INT64_MAX, "Slurm");
}

void lumi_resources_find(const char *root, struct lumi_resources *resources)
{
    cpu_set_t set;
    const long online = sysconf(_SC_NPROCESSORS_ONLN);

    *resources = (struct lumi_resources){.cores = online < 1 ? 1 : (int)online,
                                         .cores_by = "the computer",
                                         .memory = INT64_MAX,
                                         .memory_by = "the computer"};
    if (!sched_getaffinity(0, sizeof set, &set))
        limit_cores(resources, CPU_COUNT(&set), "the process's affinity");
    g_autofree char *memory = read_small(root, "/proc", "/meminfo");
    const int64_t kilobytes = memory ? number_after(memory, "MemAvailable:", -1) : -1;
    if (kilobytes >= 0)
        limit_memory(resources, kilobytes > INT64_MAX / 1024 ? INT64_MAX : kilobytes * 1024, "the computer");
    limit_by_cgroups(root, resources);
    limit_by_slurm(resources);
}
