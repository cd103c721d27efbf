/* lumi import: a capture from other people's pictures and poses, or from what a rig's cameras recorded by themselves.
 */
#include "cli/command.h"

#include "cli/rig_files.h"
#include "pipeline/exchange/exchange.h"
#include "pipeline/exchange/recordings.h"

#include <stdio.h>
#include <string.h>

static char *output, *images, *every, *flip;
static int limit, threads;
static double unit, focal, fov, plane;
static gboolean trust, strict;
static char *rig_name, *plan_path, *lens_path, *brackets, *marks, *white_balance, **cameras;

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
    {"rig", 0, 0, G_OPTION_ARG_STRING, &rig_name,
     "SOURCE has a folder (memory card) or a video for each camera of this rig: a profile's file, or arc16, arc16x2, "
     "bar2",
     "PROFILE"},
    {"camera", 0, 0, G_OPTION_ARG_STRING_ARRAY, &cameras, "whose pictures are where; may be given for each camera",
     "NAME=FOLDER"},
    {"plan", 0, 0, G_OPTION_ARG_FILENAME, &plan_path, "the sweep's plan, where it is not what the profile is meant for",
     "FILE"},
    {"lens", 0, 0, G_OPTION_ARG_FILENAME, &lens_path,
     "the rig's lens of the same name, as 'lumi calibrate lens' wrote it, instead of the profile's", "FILE"},
    {"brackets", 0, 0, G_OPTION_ARG_STRING, &brackets,
     "stops of the shots at every position, in their order (found from the exposures)", "-2,0,2"},
    {"white-balance", 0, 0, G_OPTION_ARG_STRING, &white_balance,
     "of all raw files: camera (the median of what they say), daylight, auto (grey on the whole) or factors",
     "WHAT|R,G,B"},
    {"marks", 0, 0, G_OPTION_ARG_STRING, &marks,
     "videos: when the first turn begins and the last ends, in seconds of the first camera's (by the rig's lamp)",
     "BEGIN,END"},
    {"strict", 0, 0, G_OPTION_ARG_NONE, &strict, "with --rig: whatever is missing or damaged is an error", NULL},
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

static int read_brackets(struct lumi_ingest_options *ingest, struct lumi_error *error)
{
    if (!brackets)
        return LUMI_OK;
    g_auto(GStrv) parts = g_strsplit(brackets, ",", -1);
    ingest->bracket = (int)g_strv_length(parts);
    if (ingest->bracket < 1 || ingest->bracket > LUMI_PLAN_BRACKET)
        return lumi_fail(error, LUMI_ERR_ARG, "--brackets %s: one to %d numbers wanted", brackets, LUMI_PLAN_BRACKET);
    LUMI_TRY(cli_parse_doubles("--brackets", brackets, ',', ingest->bracket, ingest->offsets, error));
    for (int i = 0; i < ingest->bracket; i++)
        if (!(ingest->offsets[i] >= -20 && ingest->offsets[i] <= 20))
            return lumi_fail(error, LUMI_ERR_ARG, "--brackets %s: -20 to 20 stops wanted", brackets);
    return LUMI_OK;
}

static int read_white(struct lumi_ingest_options *ingest, struct lumi_error *error)
{
    static const char *const names[] = {"camera", "daylight", "auto", NULL};
    int choice = LUMI_INGEST_WHITE_GIVEN;

    if (!white_balance)
        return LUMI_OK;
    if (strchr(white_balance, ',')) {
        LUMI_TRY(cli_parse_doubles("--white-balance", white_balance, ',', 3, ingest->white_given, error));
        for (int c = 0; c < 3; c++)
            if (!(ingest->white_given[c] >= 0.01 && ingest->white_given[c] <= 100))
                return lumi_fail(error, LUMI_ERR_ARG, "--white-balance %s: factors of 0.01 to 100 wanted",
                                 white_balance);
    } else {
        LUMI_TRY(cli_parse_choice("--white-balance", white_balance, names, &choice, error));
    }
    ingest->white = (enum lumi_ingest_white)choice;
    return LUMI_OK;
}

static int read_marks(struct lumi_ingest_options *ingest, struct lumi_error *error)
{
    if (!marks)
        return LUMI_OK;
    LUMI_TRY(cli_parse_doubles("--marks", marks, ',', 2, ingest->marks, error));
    if (!(ingest->marks[0] >= 0 && ingest->marks[1] > ingest->marks[0] && ingest->marks[1] < 1e6))
        return lumi_fail(error, LUMI_ERR_ARG, "--marks %s: two times in seconds wanted, the second later", marks);
    return LUMI_OK;
}

/* NAME=FOLDER; the texts are split in place. */
static int read_cameras(struct lumi_ingest_source *sources, struct lumi_ingest_options *ingest,
                        struct lumi_error *error)
{
    for (char **camera = cameras; camera && *camera; camera++) {
        char *equals = strchr(*camera, '=');
        if (!equals || equals == *camera || !equals[1])
            return lumi_fail(error, LUMI_ERR_ARG, "--camera %s: NAME=FOLDER wanted", *camera);
        if (ingest->source_count == LUMI_RIG_CAMERAS)
            return lumi_fail(error, LUMI_ERR_ARG, "--camera: a rig has at most %d", LUMI_RIG_CAMERAS);
        *equals = '\0';
        sources[ingest->source_count++] = (struct lumi_ingest_source){*camera, equals + 1};
    }
    ingest->sources = sources;
    return LUMI_OK;
}

static void say(const char *line)
{
    cli_progress_end();
    printf("%s\n", line);
}

static int run_ingest(const char *folder, const char *date, struct lumi_error *error)
{
    struct lumi_ingest_source sources[LUMI_RIG_CAMERAS];
    struct lumi_ingest_options ingest;
    struct lumi_plan plan;
    struct lumi_rig rig;

    lumi_ingest_options_init(&ingest);
    LUMI_TRY(cli_read_rig(rig_name, &rig, error));
    if (lens_path)
        LUMI_TRY(cli_change_lenses(lens_path, &rig, error));
    if (plan_path) {
        LUMI_TRY(cli_read_plan(plan_path, &rig, &plan, error));
        ingest.plan = &plan;
    }
    LUMI_TRY(read_brackets(&ingest, error));
    LUMI_TRY(read_marks(&ingest, error));
    LUMI_TRY(read_white(&ingest, error));
    LUMI_TRY(read_cameras(sources, &ingest, error));
    if (!folder && ingest.source_count == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "from where? SOURCE or --camera NAME=FOLDER is needed");
    ingest.rig = &rig;
    ingest.folder = folder;
    ingest.trust = trust;
    ingest.strict = strict;
    ingest.threads = threads;
    ingest.date = date;
    ingest.found = say;
    ingest.progress = cli_progress;
    return lumi_ingest(output, &ingest, error);
}

static int run_list(const char *source, const char *date, struct lumi_error *error)
{
    struct lumi_import_options import;

    lumi_import_options_init(&import);
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
    return lumi_import(source, output, &import, error);
}

static int run_import(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(GDateTime) now = g_date_time_new_now_utc();
    g_autofree char *date = g_date_time_format(now, "%Y-%m-%d");

    if (!output)
        return lumi_fail(error, LUMI_ERR_ARG, "where to? -o CAPTURE is needed");
    if (limit < 0 || !is_length(unit) || !is_length(focal) || !is_length(plane) || !(fov >= 0 && fov < 180))
        return lumi_fail(error, LUMI_ERR_ARG, "--limit, --unit, --focal, --plane and --fov want positive numbers");
    if (flip && strspn(flip, "xy") != strlen(flip))
        return lumi_fail(error, LUMI_ERR_ARG, "--flip %s: x, y or xy wanted", flip);
    LUMI_TRY(cli_check_threads(threads, error));
    if (rig_name && (images || every || flip || limit > 0 || unit > 0 || focal > 0 || fov > 0 || plane > 0))
        return lumi_fail(error, LUMI_ERR_ARG,
                         "--rig: the profile says all of --images, --every, --flip, --limit, --unit, "
                         "--focal, --fov and --plane");
    if (rig_name)
        return run_ingest(argc > 0 ? argv[0] : NULL, date, error);
    if (cameras || plan_path || lens_path || brackets || marks || white_balance || strict)
        return lumi_fail(
            error, LUMI_ERR_ARG,
            "--camera, --plan, --lens, --brackets, --white-balance, --marks and --strict want a rig: --rig PROFILE");
    if (argc < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "from where? SOURCE is needed");
    return run_list(argv[0], date, error);
}

const struct cli_command cli_import = {
    .name = "import",
    .arguments = "[SOURCE] -o CAPTURE",
    .summary = "make a capture from pictures with poses, or from the cards or videos of a rig",
    .description =
        "SOURCE is a nerfstudio transforms.json, a folder with a COLMAP model (cameras and images, .bin or .txt; its "
        "pictures are looked for in images/ beside it, or where --images says), or a folder of pictures named as in "
        "the "
        "Stanford Light Field Archive (out_ROW_COLUMN_Y_X.png). Pictures are copied byte for byte.\n\n"
        "With --rig SOURCE is a folder with a sub-folder for each camera of the rig, called as in its profile: what "
        "lay on "
        "its memory card, or a video (NAME.mp4). Pictures are matched to the sweep's shots by their order and the "
        "times in them; the "
        "cameras' clocks may differ. What is missing, too much or damaged is said in a line each, kept in the capture, "
        "and the rest imported; poses are those of the rig's mechanism.\n\n"
        "Exit status 3 with one line for pictures that are missing, damaged, of another size than their camera, or two "
        "of one name, for lens models that are not supported, and for poses that are no poses. Nothing is left behind "
        "then.",
    .options = options,
    .min_arguments = 0,
    .max_arguments = 1,
    .run = run_import,
};
