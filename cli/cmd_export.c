/* lumi export: a capture's cameras and poses for other programs. */
#include "cli/command.h"

#include "pipeline/exchange/exchange.h"

static char *transforms, *colmap;
static gboolean text, original_names;

static const GOptionEntry options[] = {
    {"transforms", 0, 0, G_OPTION_ARG_FILENAME, &transforms, "write nerfstudio's transforms.json there", "FILE"},
    {"colmap", 0, 0, G_OPTION_ARG_FILENAME, &colmap, "write a COLMAP model into that folder", "FOLDER"},
    {"text", 0, 0, G_OPTION_ARG_NONE, &text, "the COLMAP model as text, not binary", NULL},
    {"original-names", 0, 0, G_OPTION_ARG_NONE, &original_names,
     "name pictures as their source did, not by the capture's files", NULL},
    {0},
};

static int run_export(int argc, char **argv, struct lumi_error *error)
{
    (void)argc;
    if (!transforms && !colmap)
        return lumi_fail(error, LUMI_ERR_ARG, "what? --transforms FILE or --colmap FOLDER is needed");
    if (transforms)
        LUMI_TRY(lumi_export_transforms(argv[0], transforms, original_names, error));
    if (colmap)
        LUMI_TRY(lumi_export_colmap(argv[0], colmap, text, original_names, error));
    return LUMI_OK;
}

const struct cli_command cli_export = {
    .name = "export",
    .arguments = "CAPTURE",
    .summary = "write cameras and poses for other programs",
    .description = "From a capture: nerfstudio's transforms.json, a COLMAP model. Numbers are written so that reading "
                   "them gives the same ones.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_export,
};
