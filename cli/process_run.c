/* A run on this computer, or on a cluster. */
#include "cli/process_run.h"

#include "cli/color_options.h"
#include "cli/command.h"
#include "cli/process_options.h"
#include "pipeline/calibrate/calibrate_stage.h"
#include "pipeline/engine/local.h"
#include "pipeline/engine/slurm_run.h"
#include "pipeline/graph/graph.h"
#include "pipeline/hdr/merge_stage.h"
#include "proto/base/file.h"

#include <json-glib/json-glib.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

static JsonBuilder *builder;
static double stage_wall, stage_cpu;

static double seconds(clockid_t clock)
{
    struct timespec now;

    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* The most memory that this process has held so far, bytes. */
static double peak_memory(void)
{
    struct rusage usage = {0};

    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * (double)usage.ru_maxrss;
}

static const struct lumi_run *running;

#define REMARKS_SHOWN 20

/* What the stage found, a line each; NULL: it finds nothing. */
static char *remarks_of(const struct lumi_stage *stage)
{
    if (stage == &lumi_stage_calibrate)
        return lumi_calibrate_remarks(running);
    return stage == &lumi_stage_merge ? lumi_merge_remarks(running) : NULL;
}

/* What a person wants to know of a stage at once; the rest is in its report. */
static void say_remarks(const struct lumi_stage *stage)
{
    g_autofree char *text = remarks_of(stage);
    g_autofree char *line = stage == &lumi_stage_calibrate ? lumi_calibrate_line(running) : NULL;
    int shown = 0, more = 0;

    if (line)
        printf("  %s; %s/calibrate/report.txt\n", line, running->work);
    g_auto(GStrv) lines = g_strsplit(text ? text : "", "\n", -1);
    for (int i = 0; lines[i]; i++) {
        if (!lines[i][0])
            continue;
        if (shown < REMARKS_SHOWN)
            printf("  %s\n", lines[i]);
        more += shown++ >= REMARKS_SHOWN;
    }
    if (more)
        printf("  and %d more: %s/%s/report.txt\n", more, running->work, stage->name);
}

static void add_remarks(const struct lumi_stage *stage)
{
    g_autofree char *text = remarks_of(stage);

    if (!text)
        return;
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    json_builder_set_member_name(builder, "remarks");
    json_builder_begin_array(builder);
    for (int i = 0; lines[i]; i++)
        if (lines[i][0])
            json_builder_add_string_value(builder, lines[i]);
    json_builder_end_array(builder);
}

static void report(const struct lumi_stage *stage, bool done, int outputs, int skipped)
{
    if (!done) {
        stage_wall = seconds(CLOCK_MONOTONIC);
        stage_cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
        return;
    }
    double wall = seconds(CLOCK_MONOTONIC) - stage_wall, cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - stage_cpu;
    cli_progress_end();
    if (!builder) {
        printf("%-18s %5d made %5d there %8.1f s %8.1f core-s %6.0f MB at most so far\n", stage->name,
               outputs - skipped, skipped, wall, cpu, peak_memory() / 1e6);
        say_remarks(stage);
        fflush(stdout);
        return;
    }
    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "stage");
    json_builder_add_string_value(builder, stage->name);
    json_builder_set_member_name(builder, "made");
    json_builder_add_int_value(builder, outputs - skipped);
    json_builder_set_member_name(builder, "there");
    json_builder_add_int_value(builder, skipped);
    json_builder_set_member_name(builder, "wall_s");
    json_builder_add_double_value(builder, wall);
    json_builder_set_member_name(builder, "core_s");
    json_builder_add_double_value(builder, cpu);
    json_builder_set_member_name(builder, "peak_bytes");
    json_builder_add_int_value(builder, (gint64)peak_memory());
    add_remarks(stage);
    json_builder_end_object(builder);
}

static void print_json(const struct lumi_run *run)
{
    json_builder_end_array(builder);
    json_builder_set_member_name(builder, "images");
    json_builder_add_int_value(builder, run->count);
    json_builder_set_member_name(builder, "width");
    json_builder_add_int_value(builder, run->grid.width);
    json_builder_set_member_name(builder, "height");
    json_builder_add_int_value(builder, run->grid.height);
    json_builder_end_object(builder);
    g_autoptr(JsonNode) root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, TRUE);
    puts(text);
}

void process_record(struct lumi_record *record, const char *capture, const char *output, const char *command)
{
    record->folder = g_get_current_dir();
    record->capture = g_canonicalize_filename(capture, NULL);
    record->output = g_canonicalize_filename(output, NULL);
    record->threads = process_options.threads;
    process_options_list(record->arguments);
    if (command) {
        record->command = g_strdup(command);
        return;
    }
    g_autofree char *program = g_file_read_link("/proc/self/exe", NULL);
    record->command = g_shell_quote(program ? program : "lumi");
}

char *process_work(const char *capture)
{
    size_t length = strlen(capture);

    while (length > 1 && capture[length - 1] == '/')
        length--;
    return process_options.work ? g_strdup(process_options.work) : g_strdup_printf("%.*s.work", (int)length, capture);
}

static int run_local(const struct process_run *how, const struct lumi_parameters *parameters, struct lumi_error *error)
{
    const struct lumi_record *record = how->record;
    struct lumi_run *run;
    int code;

    LUMI_TRY(lumi_slurm_check_idle(how->work, error));
    LUMI_TRY(lumi_graph_open(how->capture, how->work, parameters, record->threads, LUMI_RUN_ALONE, &run, error));
    run->progress = cli_progress;
    running = run;
    lumi_engine_use_local(run, process_options_say);
    if (how->json) {
        builder = json_builder_new();
        json_builder_begin_object(builder);
        json_builder_set_member_name(builder, "stages");
        json_builder_begin_array(builder);
    }
    code = lumi_record_write(how->work, record, error);
    if (code == LUMI_OK)
        code = lumi_graph_process(run, how->output, report, error);
    if (builder && code == LUMI_OK)
        print_json(run);
    g_clear_object(&builder);
    lumi_run_close(run);
    return code;
}

int process_run(const struct process_run *how, struct lumi_error *error)
{
    struct lumi_parameters parameters;

    LUMI_TRY(process_options_read(&parameters, error));
    LUMI_TRY(color_options_check(&parameters, error));
    LUMI_TRY(lumi_file_check_output(how->output, how->capture, error));
    LUMI_TRY(lumi_file_check_place(how->output, error));
    if (how->record->engine == LUMI_ENGINE_LOCAL)
        return run_local(how, &parameters, error);
    const struct lumi_slurm_run run = {.record = how->record,
                                       .parameters = &parameters,
                                       .work = how->work,
                                       .again = how->again,
                                       .wait = how->wait,
                                       .every_s = how->every_s,
                                       .say = process_options_say,
                                       .progress = cli_progress};
    return lumi_slurm_run(&run, error);
}
