/* Calling Slurm's programs. */
#include "pipeline/engine/slurm_call.h"

#include "pipeline/engine/slurm.h"

#include <glib.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_WAIT = 600, STEP_US = 200000 };

/* What it said, as one line. */
static int fail_saying(const char *program, char *said, struct lumi_error *error)
{
    g_strstrip(said);
    g_strdelimit(said, "\r\n", ' ');
    return lumi_fail(error, LUMI_ERR_IO, "%s: %.300s", program, said[0] ? said : "failed");
}

int lumi_slurm_call(char **argv, char **out, struct lumi_error *error)
{
    g_autoptr(GError) reason = NULL;
    g_autofree char *said = NULL, *printed = NULL;
    int status;

    if (!g_spawn_sync(NULL, argv, NULL, G_SPAWN_SEARCH_PATH, NULL, NULL, &printed, &said, &status, &reason)) {
        if (g_error_matches(reason, G_SPAWN_ERROR, G_SPAWN_ERROR_NOENT))
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "there is no '%s' here; is this a computer of a Slurm cluster?",
                             argv[0]);
        return lumi_fail(error, LUMI_ERR_IO, "%s: %s", argv[0], reason->message);
    }
    if (!g_spawn_check_wait_status(status, NULL))
        return fail_saying(argv[0], said, error);
    if (out)
        *out = g_steal_pointer(&printed);
    return LUMI_OK;
}

/* Accounts, where they are kept, know of tasks that the queue has forgotten; where they are not, sacct fails. */
static void add_accounts(const char *names, const char *mark, GArray *tasks)
{
    char *const argv[] = {
        "sacct", "-n", "-X", "-P", "--delimiter=|", "-o", "JobID,JobName,State", "--name", (char *)(size_t)names, NULL};
    g_autofree char *out = NULL;
    struct lumi_error error;
    const guint before = tasks->len;

    if (lumi_slurm_call((char **)(size_t)argv, &out, &error) != LUMI_OK ||
        lumi_slurm_parse_tasks(out, mark, tasks, &error) != LUMI_OK) {
        g_array_set_size(tasks, before);
        return;
    }
    for (guint i = tasks->len; i > before; i--) /* what still lives the queue has told */
        if (g_array_index(tasks, struct lumi_task, i - 1).state != LUMI_TASK_FAILED)
            g_array_remove_index(tasks, i - 1);
}

int lumi_slurm_tasks(const char *work, GArray **result, struct lumi_error *error)
{
    g_autofree char *mark = lumi_slurm_mark(work), *out = NULL;
    g_autofree char *names = NULL;
    g_autoptr(GArray) tasks = g_array_new(FALSE, TRUE, sizeof(struct lumi_task));

    *result = NULL;
    names = lumi_slurm_names(mark);
    char *const argv[] = {"squeue", "-h", "-r", "-t", "all", "-n", names, "-o", "%F_%K|%j|%T|%r", NULL};
    LUMI_TRY(lumi_slurm_call((char **)(size_t)argv, &out, error));
    LUMI_TRY(lumi_slurm_parse_tasks(out, mark, tasks, error));
    add_accounts(names, mark, tasks);
    *result = g_steal_pointer(&tasks);
    return LUMI_OK;
}

static int cancel_all(const GArray *tasks, struct lumi_error *error)
{
    g_autoptr(GPtrArray) arguments = g_ptr_array_new_with_free_func(g_free);
    long long before = 0;

    g_ptr_array_add(arguments, g_strdup("scancel"));
    for (guint i = 0; i < tasks->len; i++) {
        const struct lumi_task *task = &g_array_index(tasks, struct lumi_task, i);
        if (task->state <= LUMI_TASK_RUNNING && task->job != before)
            g_ptr_array_add(arguments, g_strdup_printf("%lld", before = task->job));
    }
    g_ptr_array_add(arguments, NULL);
    return lumi_slurm_call((char **)arguments->pdata, NULL, error);
}

int lumi_slurm_cancel(const char *work, struct lumi_error *error)
{
    for (int step = 0; step * (STEP_US / 1e6) < LONGEST_WAIT; step++) {
        g_autoptr(GArray) tasks = NULL;
        LUMI_TRY(lumi_slurm_tasks(work, &tasks, error));
        if (lumi_slurm_count_live(tasks) == 0)
            return LUMI_OK;
        if (step == 0)
            LUMI_TRY(cancel_all(tasks, error));
        g_usleep(STEP_US);
    }
    return lumi_fail(error, LUMI_ERR_BUSY, "%s: its jobs do not end", work);
}
