/* lumi capture resume: go on after a pause, an interruption or a crash. */
#include "cli/capture_text.h"

static gboolean json;

static const GOptionEntry options[] = {CLI_LUMID_OPTIONS, CLI_CAPTURE_JSON_OPTION(json), {0}};

static int run(int argc, char **argv, struct lumi_error *error)
{
    (void)argc;
    (void)argv;
    return cli_capture_wish("/api/v1/capture/resume", NULL, json, "lumid goes on", error);
}

const struct cli_command cli_capture_resume = {
    .name = "capture resume",
    .arguments = "",
    .summary = "go on after a pause, an interruption or a crash",
    .description =
        "What is stored stays; what is missing is taken. After an interruption its cause has to be gone: 'lumi capture "
        "status' says what it was, 'lumi capture clear' releases the board's faults.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
