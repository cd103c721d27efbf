/* lumi import: a capture from other people's pictures and poses. */
#include "cli/command.h"

#include "pipeline/exchange/exchange.h"

#include <stdio.h>
#include <string.h>

static char *output, *images, *every, *flip;
static int limit, threads;
static double unit, focal, fov, plane;
static gboolean trust;

static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &output, "the capture to make (needed)", "CAPTURE"},
    {"images", 0, 0, G_OPTION_ARG_FILENAME, &images, "folder that the names of pictures are relative to", "FOLDER"},
    {"every", 0, 0, G_OPTION_ARG_STRING, &every, "every R-th row and C-th column, or every K-th frame", "RxC|K"},
    {"limit", 0, 0, G_OPTION_ARG_INT, &limit, "at most so many frames", "N"},
    {"unit", 0, 0, G_OPTION_ARG_DOUBLE, &unit, "metres a unit of the source (1; Stanford names: 0.001)", "METRES"},
    {"focal", 0, 0, G_OPTION_ARG_DOUBLE, &focal, "Stanford names: focal length in pixels", "PIXELS"},
    {"fov", 0, 0, G_OPTION_ARG_DOUBLE, &fov, "Stanford names: horizontal field of view in degrees", "DEGREES"},
    {"plane", 0, 0, G_OPTION_ARG_DOUBLE, &plane, "Stanford names: distance of the plane the pictures are aligned on",
     "METRES"},
    {"flip", 0, 0, G_OPTION_ARG_STRING, &flip, "Stanford names: x, y or xy count to the left or upwards", "AXES"},
    {"trust", 0, 0, G_OPTION_ARG_NONE, &trust, "do not decode every picture to see whether it is whole", NULL},
    {"threads", 'j', 0, G_OPTION_ARG_INT, &threads, "threads (all)", "N"},
    {0},
};

static int read_every(struct lumi_import_options *import, struct lumi_error *error)
{
    int stride[2] = {0, 0};

    if (!every)
        return LUMI_OK;
    if (strchr(every, 'x'))
        LUMI_TRY(cli_parse_ints("--every", every, 'x', 2, stride, error));
    else
        LUMI_TRY(cli_parse_ints("--every", every, 'x', 1, stride, error));
    if (stride[0] < 1 || (strchr(every, 'x') && stride[1] < 1))
        return lumi_fail(error, LUMI_ERR_ARG, "--every %s: numbers from 1 wanted", every);
    import->every_row = stride[0];
    import->every_column = stride[1];
    return LUMI_OK;
}

/* 0 stands for: not given. */
static bool is_length(double value)
{
    return value >= 0 && value <= 1e9;
}

static int run_import(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(GDateTime) now = g_date_time_new_now_utc();
    g_autofree char *date = g_date_time_format(now, "%Y-%m-%d");
    struct lumi_import_options import;

    (void)argc;
    lumi_import_options_init(&import);
    if (!output)
        return lumi_fail(error, LUMI_ERR_ARG, "where to? -o CAPTURE is needed");
    if (limit < 0 || !is_length(unit) || !is_length(focal) || !is_length(plane) || !(fov >= 0 && fov < 180))
        return lumi_fail(error, LUMI_ERR_ARG, "--limit, --unit, --focal, --plane and --fov want positive numbers");
    if (flip && strspn(flip, "xy") != strlen(flip))
        return lumi_fail(error, LUMI_ERR_ARG, "--flip %s: x, y or xy wanted", flip);
    LUMI_TRY(cli_check_threads(threads, error));
    LUMI_TRY(read_every(&import, error));
    import.images = images;
    import.limit = limit;
    import.unit = unit;
    import.focal = focal;
    import.fov = fov * LUMI_PI / 180;
    import.plane = plane;
    import.flip_x = flip && strchr(flip, 'x');
    import.flip_y = flip && strchr(flip, 'y');
    import.trust = trust;
    import.threads = threads;
    import.date = date;
    import.progress = cli_progress;
    return lumi_import(argv[0], output, &import, error);
}

const struct cli_command cli_import = {
    .name = "import",
    .arguments = "SOURCE -o CAPTURE",
    .summary = "make a capture from pictures with poses",
    .description =
        "SOURCE is a nerfstudio transforms.json, a folder with a COLMAP model (cameras and images, .bin or .txt; its "
        "pictures are looked for in images/ beside it, or where --images says), or a folder of pictures named as in "
        "the "
        "Stanford Light Field Archive (out_ROW_COLUMN_Y_X.png). Pictures are copied byte for byte.\n\n"
        "Exit status 3 with one line for pictures that are missing, damaged, of another size than their camera, or two "
        "of one name, for lens models that are not supported, and for poses that are no poses. Nothing is left behind "
        "then.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_import,
};
