/* lumi capture pause: let the rig stop at the next safe place. */
#include "cli/capture_text.h"

static gboolean json;

static const GOptionEntry options[] = {CLI_LUMID_OPTIONS, CLI_CAPTURE_JSON_OPTION(json), {0}};

static int run(int argc, char **argv, struct lumi_error *error)
{
    (void)argc;
    (void)argv;
    return cli_capture_wish("/api/v1/capture/pause", NULL, json,
                            "lumid stops at the next safe place ('lumi capture resume' goes on)", error);
}

const struct cli_command cli_capture_pause = {
    .name = "capture pause",
    .arguments = "",
    .summary = "let the rig stop at the next safe place",
    .description = "Frames that are on their way are still taken in. 'lumi capture resume' goes on where the sweep "
                   "was.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
