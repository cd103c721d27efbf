/* lumi rig stop: stops what moves. */
#include "cli/rig_link.h"

static char *address;
static gboolean now, emergency;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"now", 0, 0, G_OPTION_ARG_NONE, &now, "slows down now; a shot that has begun may be lost", NULL},
    {"emergency", 0, 0, G_OPTION_ARG_NONE, &emergency, "not one step more, as the switch on the rig does", NULL},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_bench bench = {.progress = cli_rig_progress};
    int code;

    (void)argc;
    (void)argv;
    if (now && emergency)
        return lumi_fail(error, LUMI_ERR_ARG, "either --now or --emergency");
    LUMI_TRY(cli_rig_open(address, &bench.link, error));
    code =
        emergency ? lumi_rig_bench_emergency_stop(bench.link, 5, error) : lumi_rig_bench_stop(&bench, now, 300, error);
    lumi_rig_link_close(bench.link);
    return code;
}

const struct cli_command cli_rig_stop = {
    .name = "rig stop",
    .arguments = "",
    .summary = "stop what moves",
    .description = "A sweep stops at its next safe place; what was not fired stays planned, and lumi rig run --resume "
                   "takes it. For people in danger there is the switch on the rig: it needs no program.",
    .options = options,
    .run = run,
};
