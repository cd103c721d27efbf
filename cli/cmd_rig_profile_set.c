/* lumi rig profile set: writes a profile to the board. */
#include "cli/rig_files.h"
#include "cli/rig_link.h"

static char *address;
static gboolean replace_newer;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"replace-newer", 0, 0, G_OPTION_ARG_NONE, &replace_newer, "even where a newer firmware wrote the one on the board",
     NULL},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_link *link;
    struct lumi_rig rig;
    int code;

    (void)argc;
    LUMI_TRY(cli_read_rig(argv[0], &rig, error));
    LUMI_TRY(cli_rig_open(address, &link, error));
    code = lumi_rig_bench_write_profile(link, &rig, replace_newer, error);
    lumi_rig_link_close(link);
    return code;
}

const struct cli_command cli_rig_profile_set = {
    .name = "rig profile set",
    .arguments = "PROFILE",
    .summary = "write a rig profile to the board",
    .description =
        "A file in the form of docs/rig-profile.md, or arc16, arc16x2, bar2. It is checked here and on the "
        "board, written to the board's flash beside the one that is there, and read back. Only while nothing "
        "moves; the position is unknown afterwards (lumi rig home).",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
