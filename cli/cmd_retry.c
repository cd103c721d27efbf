/* lumi retry: go on with a run. */
#include "cli/command.h"
#include "cli/engine_options.h"
#include "cli/process_options.h"
#include "cli/process_run.h"

#include <unistd.h>

static const GOptionEntry options[] = {
    {"work", 'w', 0, G_OPTION_ARG_FILENAME, &process_options.work, "where the stages keep their files (CAPTURE.work)",
     "DIR"},
    ENGINE_OPTIONS,
    {0},
};

static int retry(struct lumi_record *record, const char *capture, struct lumi_error *error)
{
    g_autofree char *typed = process_work(capture), *work = g_canonicalize_filename(typed, NULL);

    LUMI_TRY(lumi_record_read(work, record, error));
    LUMI_TRY(engine_options_read(record, error));
    if (engine_options.command) {
        g_free(record->command);
        record->command = g_strdup(engine_options.command);
    }
    LUMI_TRY(process_options_take(record->arguments, error));
    if (chdir(record->folder)) /* names in its options begin there */
        return lumi_fail_errno(error, record->folder, "go to");
    const struct process_run how = {.record = record,
                                    .capture = record->capture,
                                    .output = record->output,
                                    .work = work,
                                    .again = true,
                                    .wait = !engine_options.no_wait,
                                    .every_s = engine_options.every};
    return process_run(&how, error);
}

static int run_retry(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_record record;

    (void)argc;
    lumi_record_init(&record);
    const int code = retry(&record, argv[0], error);
    lumi_record_finish(&record);
    return code;
}

const struct cli_command cli_retry = {
    .name = "retry",
    .arguments = "CAPTURE",
    .summary = "go on with a run that failed or was killed",
    .description =
        "As 'lumi process' was asked for it, with all its options, from where it stands: what is there is "
        "not made again. On a cluster, shares that failed or are missing are handed over again, and it waits "
        "for what is under way.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_retry,
};
