/* lumi status: how far a run is. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "cli/process_run.h"
#include "pipeline/engine/outstanding.h"
#include "pipeline/engine/slurm.h"
#include "pipeline/graph/graph.h"

#include <json-glib/json-glib.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static gboolean as_json;
static const GOptionEntry options[] = {
    {"work", 'w', 0, G_OPTION_ARG_FILENAME, &process_options.work, "where the stages keep their files (CAPTURE.work)",
     "DIR"},
    {"json", 0, 0, G_OPTION_ARG_NONE, &as_json, "print one JSON object", NULL},
    {0},
};

/* A stage's tasks on the cluster. */
struct tasks {
    int waiting, running, failed;
};

static struct tasks count_tasks(const GArray *all, const char *stage)
{
    struct tasks tasks = {0};

    for (guint i = 0; all && i < all->len; i++) {
        const struct lumi_task *task = &g_array_index(all, struct lumi_task, i);
        if (strcmp(task->stage, stage) != 0)
            continue;
        tasks.waiting += task->state == LUMI_TASK_WAITING;
        tasks.running += task->state == LUMI_TASK_RUNNING;
        tasks.failed += task->state == LUMI_TASK_FAILED;
    }
    return tasks;
}

static void print_text(const struct lumi_record *record, const struct lumi_progress *progress, const GArray *tasks,
                       const GPtrArray *failures)
{
    const bool slurm = record->engine == LUMI_ENGINE_SLURM;

    printf("%s -> %s (%s)\n", record->capture, record->output, slurm ? "slurm" : "local");
    printf("%-18s %7s %7s %7s%s\n", "stage", "outputs", "done", "there",
           slurm ? "   tasks: waiting running failed" : "");
    for (int i = 0; lumi_stages[i]; i++) {
        const struct lumi_progress *p = &progress[i];
        const struct tasks t = count_tasks(tasks, lumi_stages[i]->name);
        g_autofree char *outputs = p->known ? g_strdup_printf("%d", p->count) : g_strdup("?");
        if (!p->wanted)
            continue;
        printf("%-18s %7s %7d %7d", lumi_stages[i]->name, outputs, p->done, p->files);
        if (tasks)
            printf("   %14d %7d %6d", t.waiting, t.running, t.failed);
        putchar('\n');
    }
    for (guint i = 0; i < failures->len; i++)
        printf("%s\n", (const char *)g_ptr_array_index(failures, i));
    printf("%s\n", lumi_outstanding_none(progress)             ? "done"
                   : tasks && lumi_slurm_count_live(tasks) > 0 ? "under way"
                                                               : "not done; 'lumi retry' goes on with it");
}

static void add_int(JsonBuilder *builder, const char *name, gint64 value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_int_value(builder, value);
}

static void add_text(JsonBuilder *builder, const char *name, const char *value)
{
    g_autofree char *valid = g_utf8_make_valid(value, -1);

    json_builder_set_member_name(builder, name);
    json_builder_add_string_value(builder, valid);
}

static void add_stage(JsonBuilder *builder, const char *name, const struct lumi_progress *p, const GArray *tasks)
{
    const struct tasks t = count_tasks(tasks, name);

    json_builder_begin_object(builder);
    add_text(builder, "stage", name);
    if (p->known)
        add_int(builder, "outputs", p->count);
    add_int(builder, "done", p->done);
    add_int(builder, "there", p->files);
    if (tasks) {
        add_int(builder, "tasks_waiting", t.waiting);
        add_int(builder, "tasks_running", t.running);
        add_int(builder, "tasks_failed", t.failed);
    }
    json_builder_end_object(builder);
}

static void print_json(const struct lumi_record *record, const struct lumi_progress *progress, const GArray *tasks,
                       const GPtrArray *failures)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    add_text(builder, "capture", record->capture);
    add_text(builder, "output", record->output);
    add_text(builder, "engine", record->engine == LUMI_ENGINE_SLURM ? "slurm" : "local");
    json_builder_set_member_name(builder, "stages");
    json_builder_begin_array(builder);
    for (int i = 0; lumi_stages[i]; i++)
        if (progress[i].wanted)
            add_stage(builder, lumi_stages[i]->name, &progress[i], tasks);
    json_builder_end_array(builder);
    json_builder_set_member_name(builder, "failures");
    json_builder_begin_array(builder);
    for (guint i = 0; i < failures->len; i++)
        json_builder_add_string_value(builder, g_ptr_array_index(failures, i));
    json_builder_end_array(builder);
    json_builder_set_member_name(builder, "done");
    json_builder_add_boolean_value(builder, lumi_outstanding_none(progress));
    json_builder_end_object(builder);
    g_autoptr(JsonNode) root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, TRUE);
    puts(text);
}

static int look(struct lumi_record *record, const char *work, struct lumi_error *error)
{
    struct lumi_parameters parameters;
    g_autoptr(GArray) tasks = NULL;
    struct lumi_error quiet = {0};
    struct lumi_run *run;

    LUMI_TRY(lumi_record_read(work, record, error));
    LUMI_TRY(process_options_take(record->arguments, error));
    if (chdir(record->folder)) /* names in its options begin there */
        return lumi_fail_errno(error, record->folder, "go to");
    LUMI_TRY(process_options_read(&parameters, error));
    LUMI_TRY(lumi_graph_open(record->capture, work, &parameters, 1, LUMI_RUN_LOOK, &run, error));
    if (record->engine == LUMI_ENGINE_SLURM && lumi_slurm_tasks(work, &tasks, &quiet) != LUMI_OK)
        process_options_say(quiet.text);
    struct lumi_progress *progress = lumi_outstanding_find(run);
    g_autoptr(GPtrArray) failures = lumi_slurm_failures(work);
    (as_json ? print_json : print_text)(record, progress, tasks, failures);
    lumi_outstanding_free(progress);
    lumi_run_close(run);
    return LUMI_OK;
}

static int run_status(int argc, char **argv, struct lumi_error *error)
{
    g_autofree char *typed = process_work(argv[0]), *work = g_canonicalize_filename(typed, NULL);
    struct lumi_record record;

    (void)argc;
    lumi_record_init(&record);
    const int code = look(&record, work, error);
    lumi_record_finish(&record);
    return code;
}

const struct cli_command cli_status = {
    .name = "status",
    .arguments = "CAPTURE",
    .summary = "tell how far a run is",
    .description = "Counts, stage by stage, what is done (made from what it would be made from now) and what is there, "
                   "and the cluster's tasks that wait, run or have failed not long ago; a task that gave up is named "
                   "with what it said last. Where the first stages choose the views, later ones have '?' outputs until "
                   "then.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_status,
};
