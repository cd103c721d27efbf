/* lumi rig clear: releases an emergency stop and faults. */
#include "cli/rig_link.h"

#include <stdio.h>

static char *address;

static const GOptionEntry options[] = {CLI_RIG_LINK_OPTION(address), {0}};

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_link *link;
    uint32_t cleared;
    char faults[256];
    int code;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_rig_open(address, &link, error));
    code = lumi_rig_bench_clear(link, &cleared, error);
    lumi_rig_link_close(link);
    LUMI_TRY(code);
    printf("cleared: %s\n", lumi_rig_fault_text(cleared, faults, sizeof faults));
    return LUMI_OK;
}

const struct cli_command cli_rig_clear = {
    .name = "rig clear",
    .arguments = "",
    .summary = "release an emergency stop and the faults whose cause is gone",
    .description =
        "Names every fault that stands. Where a cause is still there (the switch is pressed, the string hangs "
        "loose) the board refuses and says which. Nothing moves by it.",
    .options = options,
    .run = run,
};
