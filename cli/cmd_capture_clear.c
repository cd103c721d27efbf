/* lumi capture clear: release the board's faults whose cause is gone. */
#include "cli/capture_text.h"

static gboolean json;

static const GOptionEntry options[] = {CLI_LUMID_OPTIONS, CLI_CAPTURE_JSON_OPTION(json), {0}};

static int run(int argc, char **argv, struct lumi_error *error)
{
    (void)argc;
    (void)argv;
    return cli_capture_wish("/api/v1/capture/clear", NULL, json, "lumid clears the board's faults", error);
}

const struct cli_command cli_capture_clear = {
    .name = "capture clear",
    .arguments = "",
    .summary = "release the board's faults whose cause is gone",
    .description = "After an emergency stop or a fault: the cause has to be gone first. Nothing moves; 'lumi capture "
                   "resume' goes on with the capture.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
