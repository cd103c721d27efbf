/* lumi rig profile get: the profile that is on the board. */
#include "cli/rig_link.h"
#include "proto/base/file.h"

#include <stdio.h>
#include <string.h>

static char *address, *out;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out, "a file, instead of standard output", "FILE"},
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    static char text[LUMI_RIG_TEXT_MAX];
    struct lumi_rig_link *link;
    struct lumi_rig rig;
    int code;

    (void)argc;
    (void)argv;
    if (out)
        LUMI_TRY(lumi_file_check_place(out, error));
    LUMI_TRY(cli_rig_open(address, &link, error));
    code = lumi_rig_bench_read_profile(link, &rig, error);
    lumi_rig_link_close(link);
    LUMI_TRY(code);
    lumi_rig_print(&rig, text, sizeof text);
    if (out)
        return lumi_file_write(out, text, strlen(text), true, error);
    fputs(text, stdout);
    return LUMI_OK;
}

const struct cli_command cli_rig_profile_get = {
    .name = "rig profile get",
    .arguments = "",
    .summary = "print the rig profile that is on the board",
    .description = "The text is that of docs/rig-profile.md and says the same numbers, bit for bit.",
    .options = options,
    .run = run,
};
