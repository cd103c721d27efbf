/* What Slurm says of the jobs of one run. */
#include "pipeline/engine/slurm_queue.h"

#include "pipeline/graph/graph.h"

#include <string.h>

enum { TASKS_MAX = 1000000 };

char *lumi_slurm_job_name(const char *stage, const char *mark)
{
    return g_strdup_printf("lumi.%s.%s", stage, mark);
}

char *lumi_slurm_names(const char *mark)
{
    GString *names = g_string_new(NULL);

    for (int i = 0; lumi_stages[i]; i++) {
        g_autofree char *name = lumi_slurm_job_name(lumi_stages[i]->name, mark);
        g_string_append_printf(names, "%s%s", i ? "," : "", name);
    }
    return g_string_free(names, FALSE);
}

/* Compact and long words of squeue(1) and sacct(1), "JOB STATE CODES"; sacct says "CANCELLED by 1000". */
static enum lumi_task_state state_of(const char *word)
{
    static const char *const waiting[] = {"PENDING",       "SUSPENDED",    "REQUEUED",
                                          "REQUEUE_HOLD",  "SPECIAL_EXIT", "REQUEUE_FED",
                                          "RESV_DEL_HOLD", "STOPPED",      NULL};
    static const char *const running[] = {"RUNNING",   "CONFIGURING", "COMPLETING", "RESIZING",
                                          "SIGNALING", "STAGE_OUT",   NULL};

    if (g_strv_contains(waiting, word))
        return LUMI_TASK_WAITING;
    if (g_strv_contains(running, word))
        return LUMI_TASK_RUNNING;
    return strcmp(word, "COMPLETED") ? LUMI_TASK_FAILED : LUMI_TASK_DONE;
}

/* "12_3", "12", and "12_[1-4]" or "12+0" for those that wait as one. */
static bool parse_id(const char *text, struct lumi_task *task)
{
    char *end;

    task->job = g_ascii_strtoll(text, &end, 10);
    if (end == text || task->job < 1 || task->job == G_MAXINT64)
        return false;
    if (*end == '_' && g_ascii_isdigit(end[1])) {
        const gint64 share = g_ascii_strtoll(end + 1, &end, 10);
        task->share = share < G_MAXINT ? (int)share : 0;
        return *end == '\0' && share < G_MAXINT;
    }
    return *end == '\0' || *end == '_' || *end == '+';
}

/* "lumi.STAGE.MARK"; false: somebody else's. */
static bool parse_name(const char *name, const char *mark, struct lumi_task *task)
{
    g_auto(GStrv) parts = g_strsplit(name, ".", 4);

    if (g_strv_length(parts) != 3 || strcmp(parts[0], "lumi") != 0 || strcmp(parts[2], mark) != 0)
        return false;
    return g_strlcpy(task->stage, parts[1], sizeof task->stage) < sizeof task->stage;
}

/* By why a task waits. "launch failed requeued held" is what becomes of one that a computer does not take, as after a
 * crash of slurmctld that gave a job's number twice; "job requeued in held state" of one that was put back so. */
static bool will_never_run(const char *reason)
{
    return strstr(reason, "NeverSatisfied") || strstr(reason, "requeued held") || strstr(reason, "requeued in held");
}

int lumi_slurm_parse_tasks(const char *text, const char *mark, GArray *tasks, struct lumi_error *error)
{
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);

    for (int i = 0; lines[i]; i++) {
        g_auto(GStrv) parts = g_strsplit(g_strstrip(lines[i]), "|", 5);
        struct lumi_task task = {0};
        if (!parts[0])
            continue;
        if (g_strv_length(parts) < 3 || tasks->len >= TASKS_MAX)
            return lumi_fail(error, LUMI_ERR_FORMAT, "Slurm said what makes no sense here: '%.60s'", lines[i]);
        if (!parse_name(parts[1], mark, &task))
            continue;
        if (!parse_id(parts[0], &task))
            return lumi_fail(error, LUMI_ERR_FORMAT, "Slurm said what is no job's number: '%.40s'", parts[0]);
        parts[2][strcspn(parts[2], " +")] = '\0';
        g_strlcpy(task.word, parts[2], sizeof task.word);
        task.state = state_of(parts[2]);
        task.never = parts[3] && will_never_run(parts[3]);
        g_array_append_val(tasks, task);
    }
    return LUMI_OK;
}

int lumi_slurm_parse_job(const char *text, long long *job, struct lumi_error *error)
{
    char *end;

    *job = g_ascii_strtoll(text, &end, 10);
    if (end == text || *job < 1 || *job == G_MAXINT64 || (*end && !strchr(";\n", *end)))
        return lumi_fail(error, LUMI_ERR_FORMAT, "sbatch did not print a job's number: '%.*s'",
                         (int)MIN(strcspn(text, "\r\n"), 60), text);
    return LUMI_OK;
}
