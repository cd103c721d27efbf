/* lumi info: what is in a capture or a field. */
#include "cli/command.h"
#include "pipeline/evaluate/info.h"

#include <stdio.h>

static gboolean json;

static int run_info(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_info info;

    (void)argc;
    LUMI_TRY(lumi_info_read(argv[0], 0, &info, error));
    g_autofree char *text = json ? lumi_info_json(&info, argv[0]) : lumi_info_text(&info, argv[0]);
    fputs(text, stdout);
    if (json)
        putchar('\n');
    return LUMI_OK;
}

static const GOptionEntry options[] = {
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object", NULL},
    {0},
};

const struct cli_command cli_info = {
    .name = "info",
    .arguments = "CAPTURE|FILE.lumi",
    .summary = "say what is in a capture or a light field",
    .description =
        "Counts, sizes by part (images, geometry, index) and the compression factor against 24-bit RGB. Of a "
        "light field the fine level's pixels are counted: the coarse level shows them a second time.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_info,
};
