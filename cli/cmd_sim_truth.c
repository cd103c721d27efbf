/* lumi sim truth: views of a simulated place with poses and depth, to judge by. */
#include "cli/command.h"
#include "pipeline/exchange/exchange.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "sim/place.h"
#include "sim/truth.h"

#include <limits.h>

static char *out, *rig_text, *from, *poses, *size_text, *format_text, *lens_text;
#define NOT_GIVEN INT_MIN
static int random_count = NOT_GIVEN, seed = 1, threads;
static double fov, scale = 1, volume, eye_distance, shadow;
static gboolean no_depth, inward;

static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out, "folder for transforms.json, images and depth", "DIR"},
    {"rig", 0, 0, G_OPTION_ARG_STRING, &rig_text,
     "arc16, arc16x2, bar2, planar:ROWSxCOLS:SPACING or sphere:ROWSxCOLS:RADIUS (metres): its views, or with --random "
     "the "
     "volume they are in",
     "RIG"},
    {"from", 0, 0, G_OPTION_ARG_FILENAME, &from, "a capture of lumi sim shoot, in place of --rig", "CAPTURE"},
    {"poses", 0, 0, G_OPTION_ARG_FILENAME, &poses,
     "the cameras and poses of a transforms.json, whose images need not exist", "FILE"},
    {"random", 0, 0, G_OPTION_ARG_INT, &random_count, "so many views from places inside the rig's volume", "N"},
    {"seed", 0, 0, G_OPTION_ARG_INT, &seed, "of the random views (1)", "S"},
    {"volume", 0, 0, G_OPTION_ARG_DOUBLE, &volume, "radius in metres within which random eyes are (0.6 of the rig's)",
     "R"},
    {"stereo", 0, 0, G_OPTION_ARG_DOUBLE, &eye_distance,
     "with --random, one view more, the second: the right eye, so far from the first view, which is the left one",
     "METRES"},
    {"fov", 0, 0, G_OPTION_ARG_DOUBLE, &fov, "horizontal field of view in degrees", "DEGREES"},
    {"size", 0, 0, G_OPTION_ARG_STRING, &size_text,
     "size of the views in pixels (with --random: 4 by 3, as many pixels a degree as the rig's pictures)", "WxH"},
    {"scale", 0, 0, G_OPTION_ARG_DOUBLE, &scale, "shrinks a rig's counts and resolution (1)", "S"},
    {"lens", 0, 0, G_OPTION_ARG_STRING, &lens_text, "pinhole, brown or fisheye, for planar and sphere", "LENS"},
    {"inward", 0, 0, G_OPTION_ARG_NONE, &inward, "a sphere's cameras look at its centre", NULL},
    {"tripod-shadow", 0, 0, G_OPTION_ARG_DOUBLE, &shadow,
     "with the shadow of the tripod that stands under cameras on a sphere of this radius, but without the tripod",
     "METRES"},
    {"format", 0, 0, G_OPTION_ARG_STRING, &format_text, "png, jpeg or exr (linear light)", "FORMAT"},
    {"no-depth", 0, 0, G_OPTION_ARG_NONE, &no_depth, "no depth maps", NULL},
    {"threads", 'j', 0, G_OPTION_ARG_INT, &threads, "threads (all)", "N"},
    {0},
};

static void progress(void *context, int done, int total)
{
    cli_progress(context, done, total);
}

static int read_poses(struct sim_rig *views, struct lumi_error *error)
{
    struct lumi_exchange list;
    uint8_t *text;
    size_t size;

    LUMI_TRY(lumi_file_read(poses, (size_t)1 << 28, &text, &size, error));
    lumi_exchange_init(&list);
    int code = lumi_exchange_parse_transforms((const char *)text, size, poses, &list, error);
    for (int i = 0; code == LUMI_OK && i < (int)list.images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(&list, i);
        struct lumi_lens lens;
        code = lumi_exchange_lens(lumi_exchange_camera(&list, image->camera), poses, &lens, error);
        if (code == LUMI_OK)
            code = sim_rig_add(views, &lens, &image->pose, error);
    }
    lumi_exchange_finish(&list);
    lumi_free(text);
    if (code == LUMI_OK && views->count == 0)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: no frames", poses);
    return code;
}

static int choose_views(struct sim_rig *views, struct lumi_error *error)
{
    static const char *const lenses[] = {"default", "pinhole", "brown", "fisheye", NULL};
    struct sim_rig_options rig_options;
    int size[2] = {0, 0}, lens = 0;

    sim_rig_options_init(&rig_options);
    if (size_text)
        LUMI_TRY(cli_parse_ints("--size", size_text, 'x', 2, size, error));
    if (lens_text)
        LUMI_TRY(cli_parse_choice("--lens", lens_text, lenses, &lens, error));
    rig_options.scale = scale;
    rig_options.lens = (enum sim_lens_kind)lens;
    rig_options.inward = inward;
    if (poses)
        return read_poses(views, error);
    if (random_count == NOT_GIVEN && from)
        return sim_rig_from_capture(views, from, error);
    if (random_count == NOT_GIVEN) {
        rig_options.width = size[0];
        rig_options.height = size[1];
        rig_options.fov = fov;
        return sim_rig_init(views, rig_text, &rig_options, error);
    }
    struct sim_rig around;
    if (from)
        LUMI_TRY(sim_rig_from_capture(&around, from, error));
    else
        LUMI_TRY(sim_rig_init(&around, rig_text, &rig_options, error));
    struct sim_random_options random = {.count = random_count,
                                        .width = size[0],
                                        .height = size[1],
                                        .fov = fov > 0         ? fov
                                               : around.plane  ? 50
                                               : around.inward ? 40
                                                               : 75,
                                        .volume = volume,
                                        .eye_distance = eye_distance,
                                        .seed = (uint64_t)seed};
    int code = sim_rig_random(&around, &random, views, error);
    sim_rig_finish(&around);
    return code;
}

static int open_place(const char *name, struct sim_scene **scene, struct lumi_error *error)
{
    if (!(shadow >= 0 && shadow <= 10))
        return lumi_fail(error, LUMI_ERR_ARG, "--tripod-shadow: a sphere's radius in metres is wanted, 10 at most");
    return shadow > 0 ? sim_place_open_stand(name, shadow, false, scene, error) : sim_place_open(name, scene, error);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    static const char *const formats[] = {"png", "jpeg", "exr", NULL};
    struct sim_scene *scene = NULL;
    struct sim_rig views = {0};
    struct sim_output output;
    int format = 0, code;

    (void)argc;
    if (!out)
        return lumi_fail(error, LUMI_ERR_ARG, "-o DIR is missing");
    if (!rig_text)
        rig_text = (char *)"arc16";
    LUMI_TRY(cli_check_threads(threads, error));
    sim_output_init(&output);
    if (format_text)
        LUMI_TRY(cli_parse_choice("--format", format_text, formats, &format, error));
    output.format = (enum sim_format)format;
    output.depth = !no_depth;
    output.threads = threads;
    output.progress = progress;
    output.context = argv[0];
    LUMI_GOTO(code, done, choose_views(&views, error));
    LUMI_GOTO(code, done, open_place(argv[0], &scene, error));
    LUMI_GOTO(code, done, sim_truth_write(scene, &views, &output, out, error));
done:
    sim_scene_destroy(scene);
    sim_rig_finish(&views);
    return code;
}

const struct cli_command cli_sim_truth = {
    .name = "sim truth",
    .arguments = "PLACE -o DIR",
    .summary = "make views of a simulated place with true poses and depth",
    .description =
        "Writes DIR/transforms.json (nerfstudio's convention), DIR/images and DIR/depth (OpenEXR, channel Z, "
        "metres along the optical axis): every view of a rig or capture, given poses, or "
        "--random N views from inside the rig's volume.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
