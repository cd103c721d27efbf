/* lumi rig jog: turns the platform by hand. */
#include "cli/rig_link.h"

static char *address;
static double speed, seconds = 900;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"speed", 0, 0, G_OPTION_ARG_DOUBLE, &speed, "degrees a second (the profile's home speed)", "SPEED"},
    {"timeout", 0, 0, G_OPTION_ARG_DOUBLE, &seconds, "gives up, and stops, after so long (900)", "SECONDS"},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_bench bench = {.interrupts = cli_rig_interrupts, .progress = cli_rig_progress};
    double turns;
    int code;

    (void)argc;
    LUMI_TRY(cli_parse_doubles("TURNS", argv[0], ',', 1, &turns, error));
    if (!(speed >= 0 && speed <= 36000))
        return lumi_fail(error, LUMI_ERR_ARG, "--speed: degrees a second, not negative");
    if (!(seconds > 0 && seconds <= 86400))
        return lumi_fail(error, LUMI_ERR_ARG, "--timeout: 0 to 86400 seconds");
    LUMI_TRY(cli_rig_open(address, &bench.link, error));
    cli_rig_catch_interrupts();
    code = lumi_rig_bench_jog(&bench, turns, speed * (3.14159265358979323846 / 180), seconds, error);
    lumi_rig_link_close(bench.link);
    return code;
}

const struct cli_command cli_rig_jog = {
    .name = "rig jog",
    .arguments = "TURNS",
    .summary = "turn the platform by so many turns",
    .description = "A fraction is fine (0.25); a negative number, which winds the string up, goes after '--': lumi rig "
                   "jog -- -0.5. The position must be known (lumi rig home). Ctrl-C slows down and stops; a second one "
                   "is an emergency stop.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
