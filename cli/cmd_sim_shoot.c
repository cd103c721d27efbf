/* lumi sim shoot: a capture of a simulated place. */
#include "cli/command.h"
#include "sim/errors.h"
#include "sim/place.h"
#include "sim/shoot.h"

#include <math.h>

static char *out, *rig_text, *size_text, *format_text, *lens_text, *depth_dir;
static char *pose_error, *mechanism_error, *truth_poses, *truth_capture;
static int threads, bits, seed = 1;
static double fov, scale = 1, turned, exposure, vignetting, full_well, read_noise;
static gboolean inward;

static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out, "the capture to make", "CAPTURE"},
    {"rig", 0, 0, G_OPTION_ARG_STRING, &rig_text,
     "arc16 (default), arc16x2, bar2, arc:CAMERASxPOSITIONS:RADIUS, planar:ROWSxCOLS:SPACING or "
     "sphere:ROWSxCOLS:RADIUS (metres)",
     "RIG"},
    {"scale", 0, 0, G_OPTION_ARG_DOUBLE, &scale,
     "shrinks counts and resolution alike, so that parallax between neighbours stays (1)", "S"},
    {"size", 0, 0, G_OPTION_ARG_STRING, &size_text, "size of the pictures, whatever the scale", "WxH"},
    {"fov", 0, 0, G_OPTION_ARG_DOUBLE, &fov, "horizontal field of view in degrees, for planar and sphere", "DEGREES"},
    {"lens", 0, 0, G_OPTION_ARG_STRING, &lens_text, "pinhole, brown or fisheye, for planar and sphere", "LENS"},
    {"inward", 0, 0, G_OPTION_ARG_NONE, &inward, "a sphere's cameras look at its centre", NULL},
    {"format", 0, 0, G_OPTION_ARG_STRING, &format_text,
     "png (default), jpeg, exr (linear light) or dng (what a sensor says behind its colour filter)", "FORMAT"},
    {"truth-depth", 0, 0, G_OPTION_ARG_FILENAME, &depth_dir, "also writes every frame's true depth there, NAME.exr",
     "DIR"},
    {"pose-error", 0, 0, G_OPTION_ARG_STRING, &pose_error,
     "every camera is beside its place: standard deviations along and about each axis, as 5,0.5; the capture's poses "
     "are the rig's, priors",
     "MM,DEGREES"},
    {"mechanism-error", 0, 0, G_OPTION_ARG_STRING, &mechanism_error,
     "the rig is not what its profile says: yes, or a list of axis, wobble, arm, drop, backlash, pan, tilt, roll "
     "(degrees), centre, radius (mm), as axis=0.3,radius=4",
     "LIST"},
    {"truth-poses", 0, 0, G_OPTION_ARG_FILENAME, &truth_poses, "also writes every frame's true pose, a transforms.json",
     "FILE"},
    {"truth-capture", 0, 0, G_OPTION_ARG_FILENAME, &truth_capture,
     "also makes a second capture: the same pictures with their true poses", "CAPTURE"},
    {"turned", 0, 0, G_OPTION_ARG_DOUBLE, &turned,
     "degrees that the rig turns during every exposure: motion blur about the true pose (0)", "DEGREES"},
    {"exposure", 0, 0, G_OPTION_ARG_DOUBLE, &exposure, "stops (0)", "STOPS"},
    {"vignetting", 0, 0, G_OPTION_ARG_DOUBLE, &vignetting, "share of the light lost in the corners (0)", "SHARE"},
    {"full-well", 0, 0, G_OPTION_ARG_DOUBLE, &full_well, "electrons at white: turns shot noise on", "ELECTRONS"},
    {"read-noise", 0, 0, G_OPTION_ARG_DOUBLE, &read_noise, "electrons, one standard deviation (0)", "ELECTRONS"},
    {"bits", 0, 0, G_OPTION_ARG_INT, &bits, "of the linear converter: 8, 10 or 12 (none); 10 and 12 give 16-bit PNG",
     "BITS"},
    {"seed", 0, 0, G_OPTION_ARG_INT, &seed, "of noise and errors (1)", "S"},
    {"threads", 'j', 0, G_OPTION_ARG_INT, &threads, "threads (all)", "N"},
    {0},
};

static void progress(void *context, int done, int total)
{
    cli_progress(context, done, total);
}

static int parse(struct sim_rig_options *rig, struct sim_output *output, struct lumi_error *error)
{
    static const char *const lenses[] = {"default", "pinhole", "brown", "fisheye", NULL};
    static const char *const formats[] = {"png", "jpeg", "exr", "dng", NULL};
    int size[2] = {0, 0}, lens = 0, format = 0;

    if (!out)
        return lumi_fail(error, LUMI_ERR_ARG, "-o CAPTURE is missing");
    LUMI_TRY(cli_check_threads(threads, error));
    if (size_text)
        LUMI_TRY(cli_parse_ints("--size", size_text, 'x', 2, size, error));
    if (lens_text)
        LUMI_TRY(cli_parse_choice("--lens", lens_text, lenses, &lens, error));
    if (format_text)
        LUMI_TRY(cli_parse_choice("--format", format_text, formats, &format, error));
    sim_rig_options_init(rig);
    rig->scale = scale;
    rig->width = size[0];
    rig->height = size[1];
    rig->fov = fov;
    rig->lens = (enum sim_lens_kind)lens;
    rig->inward = inward;
    sim_output_init(output);
    output->format = (enum sim_format)format;
    output->threads = threads;
    output->depth_dir = depth_dir;
    output->turned = turned * LUMI_PI / 180;
    output->sensor.exposure = exposure;
    output->sensor.vignetting = vignetting;
    output->sensor.full_well = full_well;
    output->sensor.read_noise = read_noise;
    output->sensor.bits = bits;
    output->sensor.seed = (uint64_t)seed;
    output->progress = progress;
    return sim_sensor_check(&output->sensor, error);
}

static int make_errors(struct sim_rig *rig, struct sim_output *output, struct lumi_error *error)
{
    struct sim_errors errors = {.seed = (uint64_t)seed};
    double numbers[2] = {0, 0};

    if (pose_error)
        LUMI_TRY(cli_parse_doubles("--pose-error", pose_error, ',', 2, numbers, error));
    if (mechanism_error)
        LUMI_TRY(sim_errors_parse(mechanism_error, &errors.mechanism, error));
    if (!pose_error && !mechanism_error)
        return LUMI_OK;
    errors.position_m = numbers[0] / 1000;
    errors.rotation = numbers[1] * LUMI_PI / 180;
    output->given_poses = true;
    return sim_errors_apply(&errors, rig, error);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct sim_rig_options rig_options;
    struct sim_scene *scene = NULL;
    struct sim_output output;
    struct sim_rig rig = {0};
    const struct sim_shoot_truth truth = {truth_poses, truth_capture};
    int code;

    (void)argc;
    LUMI_TRY(parse(&rig_options, &output, error));
    output.context = argv[0];
    if (!(fabs(turned) <= 90))
        return lumi_fail(error, LUMI_ERR_ARG, "--turned %g: -90 to 90 degrees wanted", turned);
    LUMI_GOTO(code, done, sim_rig_init(&rig, rig_text ? rig_text : "arc16", &rig_options, error));
    if (turned != 0 && !rig.mechanism) {
        code = lumi_fail(error, LUMI_ERR_ARG, "--turned: a rig that turns is wanted: arc16, arc16x2, bar2, arc:…");
        goto done;
    }
    output.profile = &rig.profile;
    LUMI_GOTO(code, done, make_errors(&rig, &output, error));
    LUMI_GOTO(code, done, sim_place_open(argv[0], &scene, error));
    LUMI_GOTO(code, done, sim_shoot(scene, argv[0], &rig, &output, &truth, out, error));
done:
    sim_scene_destroy(scene);
    sim_rig_finish(&rig);
    return code;
}

const struct cli_command cli_sim_shoot = {
    .name = "sim shoot",
    .arguments = "PLACE -o CAPTURE",
    .summary = "photograph a simulated place with a simulated rig",
    .description = "Places: room (an interior), court (an exterior), object (for cameras that look inwards). Writes a "
                   "capture with true poses. A full arc16 is 1,152 frames of 1280x1024: some hours of one core; "
                   "--scale 0.25 is 72 frames of 320x256.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
