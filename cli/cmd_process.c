/* lumi process: from a capture to a field. */
#include "cli/command.h"
#include "cli/engine_options.h"
#include "cli/process_options.h"
#include "cli/process_run.h"

static char *output;
static gboolean as_json;
static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &output, "the field to write", "FILE.lumi"},
    PROCESS_OPTIONS,
    ENGINE_OPTIONS,
    {"json", 0, 0, G_OPTION_ARG_NONE, &as_json, "print what each stage did as one JSON object", NULL},
    {0},
};

static int run_recorded(struct lumi_record *record, const char *capture, struct lumi_error *error)
{
    record->retries = 2;
    LUMI_TRY(engine_options_read(record, error));
    if (as_json && record->engine != LUMI_ENGINE_LOCAL)
        return lumi_fail(error, LUMI_ERR_ARG, "--json is for --engine local ('lumi status --json' tells of a cluster)");
    process_record(record, capture, output, engine_options.command);
    g_autofree char *work = process_work(capture);
    const struct process_run how = {.record = record,
                                    .capture = capture,
                                    .output = output,
                                    .work = work,
                                    .wait = !engine_options.no_wait,
                                    .every_s = engine_options.every,
                                    .json = as_json};
    return process_run(&how, error);
}

static int run_process(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_record record;

    (void)argc;
    if (!output)
        return lumi_fail(error, LUMI_ERR_ARG, "-o FILE.lumi is missing");
    lumi_record_init(&record);
    const int code = run_recorded(&record, argv[0], error);
    lumi_record_finish(&record);
    return code;
}

const struct cli_command cli_process = {
    .name = "process",
    .arguments = "CAPTURE -o FILE.lumi",
    .summary = "make a light field from a capture",
    .description = "Runs every stage of the pipeline that the capture wants ('lumi stage' lists them). What the stages "
                   "make is kept beside the capture (in CAPTURE.work): a run that was "
                   "stopped goes on where it stopped, and a stage whose input and parameters have not changed is "
                   "skipped. The file appears when it is whole.\n\n"
                   "With --engine slurm the stages are job arrays of the cluster this computer belongs to; capture and "
                   "work folder lie where all its computers see them. 'lumi status' tells how far a run is, 'lumi "
                   "retry' goes on with one, 'lumi clear' throws away what it made.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_process,
};
