/* lumi rig home: finds the index mark, so that the position is known. */
#include "cli/rig_link.h"

static char *address;
static gboolean wind_up;
static int turn;
static double seconds = 900;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"wind-up", 0, 0, G_OPTION_ARG_NONE, &wind_up, "all the way up first, so that the turn is found as well", NULL},
    {"turn", 0, 0, G_OPTION_ARG_INT, &turn, "otherwise: the turn of the string that the rig is in (0)", "N"},
    {"timeout", 0, 0, G_OPTION_ARG_DOUBLE, &seconds, "gives up, and stops, after so long (900)", "SECONDS"},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_bench bench = {.interrupts = cli_rig_interrupts, .progress = cli_rig_progress};
    int code;

    (void)argc;
    (void)argv;
    if (!(seconds > 0 && seconds <= 86400))
        return lumi_fail(error, LUMI_ERR_ARG, "--timeout: 0 to 86400 seconds");
    LUMI_TRY(cli_rig_open(address, &bench.link, error));
    cli_rig_catch_interrupts();
    code = lumi_rig_bench_home(&bench, wind_up, turn, seconds, error);
    lumi_rig_link_close(bench.link);
    return code;
}

const struct cli_command cli_rig_home = {
    .name = "rig home",
    .arguments = "",
    .summary = "search the index mark, so that the position is known",
    .description =
        "The platform turns until the index switch has been found from the sweep's side. On a rig whose arm "
        "hangs on a string say in which turn it is, or let it wind up. Ctrl-C slows down and stops; a second "
        "one is an emergency stop.",
    .options = options,
    .run = run,
};
