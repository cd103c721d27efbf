/* lumi process: from a capture to a field. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "pipeline/engine/local.h"
#include "pipeline/graph/graph.h"

#include <json-glib/json-glib.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

static char *output;
static gboolean as_json;
static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &output, "the field to write", "FILE.lumi"},
    PROCESS_OPTIONS,
    {"json", 0, 0, G_OPTION_ARG_NONE, &as_json, "print what each stage did as one JSON object", NULL},
    {0},
};

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

static int run_process(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_parameters parameters;
    struct lumi_run *run;
    int code;

    (void)argc;
    if (!output)
        return lumi_fail(error, LUMI_ERR_ARG, "-o FILE.lumi is missing");
    LUMI_TRY(process_options_read(&parameters, error));
    LUMI_TRY(lumi_graph_open(argv[0], process_options.work, &parameters, process_options.threads, true, &run, error));
    run->progress = cli_progress;
    lumi_engine_use_local(run, process_options_say);
    if (as_json) {
        builder = json_builder_new();
        json_builder_begin_object(builder);
        json_builder_set_member_name(builder, "stages");
        json_builder_begin_array(builder);
    }
    code = lumi_graph_process(run, output, report, error);
    if (builder && code == LUMI_OK)
        print_json(run);
    g_clear_object(&builder);
    lumi_run_close(run);
    return code;
}

const struct cli_command cli_process = {
    .name = "process",
    .arguments = "CAPTURE -o FILE.lumi",
    .summary = "make a light field from a capture",
    .description = "Runs every stage of the pipeline that the capture wants ('lumi stage' lists them). What the stages "
                   "make is kept beside the capture (in CAPTURE.work): a run that was "
                   "stopped goes on where it stopped, and a stage whose input and parameters have not changed is "
                   "skipped. The file appears when it is whole.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_process,
};
