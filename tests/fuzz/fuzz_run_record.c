/* What the engine reads of others: the record of a run, and what Slurm's programs print. The first byte chooses. */
#include "checks.h"

#include "pipeline/engine/run_record.h"
#include "pipeline/engine/slurm_queue.h"

#include <glib.h>

static void read_record(const uint8_t *data, size_t size)
{
    struct lumi_record record;
    struct lumi_error error = {0};

    lumi_record_init(&record);
    if (checked(lumi_record_parse((const char *)data, size, "fuzz", &record, &error), &error) == LUMI_OK &&
        (!record.folder[0] || !record.capture[0] || !record.output[0] || !record.command[0] || record.retries < 0))
        abort();
    for (guint i = 0; i < record.jobs->len; i++)
        if (g_array_index(record.jobs, struct lumi_record_job, i).shares < 1)
            abort();
    lumi_record_finish(&record);
}

static void read_queue(const char *text)
{
    GArray *tasks = g_array_new(FALSE, TRUE, sizeof(struct lumi_task));
    struct lumi_error error = {0};
    long long job;

    checked(lumi_slurm_parse_tasks(text, "0123abcd", tasks, &error), &error);
    for (guint i = 0; i < tasks->len; i++) {
        const struct lumi_task *task = &g_array_index(tasks, struct lumi_task, i);
        if (task->job < 1 || task->share < 0 || !memchr(task->stage, 0, sizeof task->stage))
            abort();
    }
    g_array_unref(tasks);
    if (checked(lumi_slurm_parse_job(text, &job, &error), &error) == LUMI_OK && job < 1)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    char *text = g_strndup((const char *)data + 1, size - 1);
    if (data[0] == 'q')
        read_queue(text);
    else
        read_record(data + 1, size - 1);
    g_free(text);
    return 0;
}
