/* A whole run on a cluster. */
#include "pipeline/engine/slurm_run.h"

#include "pipeline/engine/slurm.h"
#include "pipeline/graph/deliver.h"
#include "pipeline/graph/graph.h"
#include "proto/base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <glib/gstdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATIENCE = 12 }; /* questions with the same answer before the work folder is looked at again */

/* One process at a time hands over: it holds this until it ends. */
static int lock_hand_over(const char *work, int *lock, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(work, ".hand-over", NULL);

    if (g_mkdir_with_parents(work, 0777))
        return lumi_fail_errno(error, work, "create");
    *lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (*lock < 0)
        return lumi_fail_errno(error, path, "create");
    if (flock(*lock, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) {
        close(*lock);
        *lock = -1;
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: another process is handing over that run", work);
    }
    return LUMI_OK;
}

static int look(const struct lumi_slurm_run *how, struct lumi_run **run, struct lumi_progress **progress,
                struct lumi_error *error)
{
    LUMI_TRY(lumi_graph_open(how->record->capture, how->work, how->parameters, 1, LUMI_RUN_LOOK, run, error));
    *progress = lumi_outstanding_find(*run);
    return LUMI_OK;
}

static bool is_done(const struct lumi_progress *progress)
{
    return !progress->wanted || (progress->known && progress->done == progress->count);
}

static bool has_live_task(const GArray *tasks, int stage)
{
    for (guint t = 0; t < tasks->len; t++) {
        const struct lumi_task *task = &g_array_index(tasks, struct lumi_task, t);
        if (task->state <= LUMI_TASK_RUNNING && !task->never && !strcmp(task->stage, lumi_stages[stage]->name))
            return true;
    }
    return false;
}

/* Whether every stage with something to do has a task that waits or runs, and none has given up. Nor does one wait or
 * run for what is done: a slurmctld that was killed may believe that for minutes, and keep what comes after waiting. */
static bool is_under_way(const struct lumi_progress *progress, const GArray *tasks, const char *work)
{
    g_autoptr(GPtrArray) failures = lumi_slurm_failures(work);

    for (int i = 0; lumi_stages[i]; i++) {
        if (is_done(&progress[i]) == has_live_task(tasks, i))
            return false;
    }
    return failures->len == 0;
}

/* Leaves the field where it is wanted, unless the last task did. */
static int deliver(const struct lumi_slurm_run *how, const struct lumi_run *run, struct lumi_error *error)
{
    const struct lumi_stage *last = NULL;
    struct stat made, there;

    for (int i = 0; lumi_stages[i]; i++)
        last = lumi_stages[i];
    g_autofree char *path = lumi_run_path(run, last->name, -1, last->extension);
    if (stat(path, &made))
        return lumi_fail_errno(error, path, "stat");
    if (!stat(how->record->output, &there) && there.st_size == made.st_size && there.st_mtime >= made.st_mtime)
        return LUMI_OK;
    return lumi_deliver(path, how->record->output, error);
}

static long count_handed_over(const struct lumi_record *record)
{
    long count = 0;

    for (guint i = 0; i < record->jobs->len; i++)
        count += g_array_index(record->jobs, struct lumi_record_job, i).shares;
    return count;
}

/* Until nothing of the run is in the queue any more. A queue that does not answer is asked again: it may be restarted.
 */
static void await(const struct lumi_slurm_run *how)
{
    const long total = count_handed_over(how->record);
    int before = -1, same = 0;
    bool answered = true;

    for (; same < PATIENCE; g_usleep((gulong)how->every_s * G_USEC_PER_SEC)) {
        g_autoptr(GArray) tasks = NULL;
        struct lumi_error error;
        if (lumi_slurm_tasks(how->work, &tasks, &error) != LUMI_OK) {
            if (answered && how->say)
                how->say("Slurm does not answer; it is asked again");
            answered = false;
            continue;
        }
        answered = true;
        const int live = lumi_slurm_count_live(tasks);
        if (live == 0)
            return;
        same = live == before ? same + 1 : 0;
        before = live;
        if (how->progress)
            how->progress("Slurm's tasks", MAX(0, total - live), total);
    }
}

static int fail_with_note(const struct lumi_slurm_run *how, const GPtrArray *failures, struct lumi_error *error)
{
    if (failures->len)
        return lumi_fail(error, LUMI_ERR_IO, "%s%s", (const char *)g_ptr_array_index(failures, 0),
                         failures->len > 1 ? " (and others: 'lumi status' tells)" : "");
    return lumi_fail(error, LUMI_ERR_IO, "%s: tasks were killed more than %d times ('lumi status' tells which)",
                     how->work, how->record->retries);
}

/* One look, and what it asks for; *over where there is nothing left to do or to await. *handed: how often this process
 * has handed over. */
static int step(const struct lumi_slurm_run *how, bool first, int *handed, bool *over, struct lumi_error *error)
{
    g_autoptr(GPtrArray) failures = lumi_slurm_failures(how->work);
    g_autoptr(GArray) tasks = NULL;
    struct lumi_progress *progress;
    struct lumi_run *run;
    int code;

    LUMI_TRY(look(how, &run, &progress, error));
    LUMI_GOTO(code, out, lumi_slurm_tasks(how->work, &tasks, error));
    const bool live = lumi_slurm_count_live(tasks) > 0;
    *over = lumi_outstanding_none(progress) && !live;
    if (*over) {
        code = first ? lumi_record_write(how->work, how->record, error) : LUMI_OK;
        if (code == LUMI_OK)
            code = deliver(how, run, error);
    } else if (live && first && !how->again) {
        code = lumi_fail(error, LUMI_ERR_BUSY,
                         "%s: %d tasks of an earlier run are in Slurm's queue ('lumi status', "
                         "'lumi retry')",
                         how->work, lumi_slurm_count_live(tasks));
    } else if (!live || !is_under_way(progress, tasks, how->work)) {
        if (*handed > 0 && (failures->len || *handed > how->record->retries)) {
            code = fail_with_note(how, failures, error);
            goto out;
        }
        if (live)
            LUMI_GOTO(code, out, lumi_slurm_cancel(how->work, error));
        (*handed)++;
        code = lumi_slurm_submit(run, progress, how->record, error);
    }
out:
    lumi_outstanding_free(progress);
    lumi_run_close(run);
    return code;
}

int lumi_slurm_run(const struct lumi_slurm_run *how, struct lumi_error *error)
{
    bool over = false;
    int lock = -1, handed = 0, code;

    LUMI_TRY(lumi_file_check_output(how->record->output, how->record->capture, error));
    LUMI_TRY(lumi_file_check_place(how->record->output, error));
    LUMI_TRY(lumi_file_check_output(how->work, how->record->capture, error));
    LUMI_TRY(lock_hand_over(how->work, &lock, error));
    for (bool first = true;; first = false) {
        code = step(how, first, &handed, &over, error);
        if (code != LUMI_OK || over || !how->wait)
            break;
        await(how);
    }
    close(lock);
    return code;
}

int lumi_slurm_check_idle(const char *work, struct lumi_error *error)
{
    g_autoptr(GArray) tasks = NULL;
    struct lumi_record record;
    struct lumi_error unread;

    lumi_record_init(&record);
    const bool slurm = lumi_record_read(work, &record, &unread) == LUMI_OK && record.engine == LUMI_ENGINE_SLURM;
    lumi_record_finish(&record);
    if (!slurm || lumi_slurm_tasks(work, &tasks, &unread) != LUMI_OK || lumi_slurm_count_live(tasks) == 0)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_BUSY, "%s: %d tasks of a run on the cluster are in Slurm's queue ('lumi status')",
                     work, lumi_slurm_count_live(tasks));
}
