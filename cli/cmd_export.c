/* lumi export: cameras, poses, depth and meshes for other programs. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "pipeline/color/exr_set.h"
#include "pipeline/engine/run_record.h"
#include "pipeline/graph/graph.h"

#include "pipeline/exchange/exchange.h"
#include "pipeline/exchange/export_view.h"

#include <unistd.h>

static char *transforms, *colmap, *view, *depth, *mesh, *work, *exr;
static gboolean text, original_names;
static double far_m = 1000;

static const GOptionEntry options[] = {
    {"transforms", 0, 0, G_OPTION_ARG_FILENAME, &transforms, "write nerfstudio's transforms.json there", "FILE"},
    {"colmap", 0, 0, G_OPTION_ARG_FILENAME, &colmap, "write a COLMAP model into that folder", "FOLDER"},
    {"text", 0, 0, G_OPTION_ARG_NONE, &text, "the COLMAP model as text, not binary", NULL},
    {"original-names", 0, 0, G_OPTION_ARG_NONE, &original_names,
     "name pictures as their source did, not by the capture's files", NULL},
    {"view", 0, 0, G_OPTION_ARG_STRING, &view, "the view that --depth and --mesh are of", "NAME|NUMBER"},
    {"depth", 0, 0, G_OPTION_ARG_FILENAME, &depth, "write the view's depth in metres (OpenEXR, channel Z)", "FILE"},
    {"mesh", 0, 0, G_OPTION_ARG_FILENAME, &mesh, "write the view's mesh (PLY)", "FILE"},
    {"exr", 0, 0, G_OPTION_ARG_FILENAME, &exr,
     "copy the views, in linear light before tone mapping, into that folder, with a transforms.json", "FOLDER"},
    {"far", 0, 0, G_OPTION_ARG_DOUBLE, &far_m, "meshes end there (1000)", "METRES"},
    {"work", 0, 0, G_OPTION_ARG_FILENAME, &work, "a capture's work directory (CAPTURE.work)", "FOLDER"},
    {0},
};

/* The run knows by its record which stages its views went through. */
static int export_exr(const char *capture, struct lumi_error *error)
{
    struct lumi_parameters parameters;
    struct lumi_record record;
    struct lumi_run *run = NULL;
    int code;

    g_autofree char *folder = work ? g_strdup(work) : g_strdup_printf("%s.work", capture);
    g_autofree char *to = g_canonicalize_filename(exr, NULL);
    g_autofree char *from = g_canonicalize_filename(capture, NULL), *at = g_canonicalize_filename(folder, NULL);
    lumi_record_init(&record);
    LUMI_GOTO(code, out, lumi_record_read(at, &record, error));
    LUMI_GOTO(code, out, process_options_take(record.arguments, error));
    if (chdir(record.folder)) /* names in its options begin there */
        LUMI_GOTO(code, out, lumi_fail_errno(error, record.folder, "go to"));
    LUMI_GOTO(code, out, process_options_read(&parameters, error));
    LUMI_GOTO(code, out, lumi_graph_open(from, at, &parameters, record.threads, LUMI_RUN_LOOK, &run, error));
    LUMI_GOTO(code, out, lumi_graph_place(run, error));
    code = lumi_exr_set(run, to, error);
out:
    lumi_run_close(run);
    lumi_record_finish(&record);
    return code;
}

static int run_export(int argc, char **argv, struct lumi_error *error)
{
    (void)argc;
    if (!transforms && !colmap && !depth && !mesh && !exr)
        return lumi_fail(error, LUMI_ERR_ARG, "what? --transforms, --colmap, --depth, --mesh or --exr is needed");
    if ((depth || mesh) && !view)
        return lumi_fail(error, LUMI_ERR_ARG, "of which view? --view NAME or NUMBER is needed");
    if (!(far_m > 0))
        return lumi_fail(error, LUMI_ERR_ARG, "--far wants a positive number");
    if (transforms)
        LUMI_TRY(lumi_export_transforms(argv[0], transforms, original_names, error));
    if (colmap)
        LUMI_TRY(lumi_export_colmap(argv[0], colmap, text, original_names, error));
    if (exr && !depth && !mesh)
        return export_exr(argv[0], error);
    if (exr)
        return lumi_fail(error, LUMI_ERR_ARG, "--exr is of all views, --depth and --mesh of one: one after the other");
    if (!depth && !mesh)
        return LUMI_OK;
    struct lumi_export_view export = {
        .source = argv[0], .work = work, .view = view, .depth = depth, .mesh = mesh, .far_m = far_m};
    return lumi_export_view(&export, error);
}

const struct cli_command cli_export = {
    .name = "export",
    .arguments = "CAPTURE|FILE.lumi",
    .summary = "write cameras, poses, depth or meshes for other programs",
    .description =
        "From a capture: nerfstudio's transforms.json (--transforms), a COLMAP model (--colmap); numbers are written "
        "so "
        "that reading them gives the same ones. From a capture that has been processed: its views (--exr). From a "
        ".lumi file, or a capture that has been processed: depth "
        "(--depth, metres along the optical axis) and mesh (--mesh, world coordinates, with texture coordinates and "
        "colours) of one view.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_export,
};
