/* lumi capture watch: a capture as it is taken. */
#include "cli/capture_watch.h"

static gboolean json, follow;

static const GOptionEntry options[] = {
    {"follow", 'f', 0, G_OPTION_ARG_NONE, &follow, "go on when the capture has ended, and when there is none", NULL},
    CLI_LUMID_OPTIONS,
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "every event as one line of JSON on standard output", NULL},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct cli_watch watch = {.json = json, .follow = follow};
    struct cli_lumid *lumid;
    int code;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_watch_capture(lumid, &watch, error);
    cli_lumid_close(lumid);
    return code;
}

const struct cli_command cli_capture_watch = {
    .name = "capture watch",
    .arguments = "",
    .summary = "watch a capture as it is taken, until it has ended",
    .description =
        "One line of progress on a terminal; what happens besides (states, incidents, rejected frames, checks that are "
        "not green) as lines with the time, UTC. Ends with the capture: exit status 0 where it is complete, 1 where "
        "frames are missing or it failed.\n\nWith --json every event is one line, {\"event\": KIND, \"id\": ID, "
        "\"data\": {...}}, as docs/api.md describes them. Where lumid goes away for at most half a minute, watching "
        "goes on without a gap.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
