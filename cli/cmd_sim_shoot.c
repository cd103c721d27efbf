/* lumi sim shoot: a capture of a simulated place. */
#include "cli/command.h"
#include "sim/errors.h"
#include "sim/place.h"
#include "sim/shoot.h"

#include <math.h>

static char *out, *rig_text, *size_text, *format_text, *lens_text, *depth_dir;
static char *pose_error, *mechanism_error, *truth_poses, *truth_capture, *bracket_text;
static char **fault_texts;
static gboolean tripod, arm;
static double camera_gain;
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
    {"tripod", 0, 0, G_OPTION_ARG_NONE, &tripod, "the rig stands on one, and sees it", NULL},
    {"arm", 0, 0, G_OPTION_ARG_NONE, &arm, "the end of the rig's arm is in every picture", NULL},
    {"camera-gain", 0, 0, G_OPTION_ARG_DOUBLE, &camera_gain,
     "every camera has a gain of its own, of this standard deviation; some frames drift (0)", "STOPS"},
    {"brackets", 0, 0, G_OPTION_ARG_STRING, &bracket_text,
     "a shot at each of these stops, as -2,0,2; what was exposed is reported, a little off", "STOPS,..."},
    {"fault", 0, 0, G_OPTION_ARG_STRING_ARRAY, &fault_texts,
     "unfocused=CAMERA, black=FRAME, swapped=CAMERA:CAMERA, backwards, missing-row=ROW, isolated=CAMERA, "
     "unequal-brackets; may be given again",
     "FAULT"},
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

static int make_takes(struct sim_takes *takes, struct lumi_error *error)
{
    g_auto(GStrv) parts = g_strsplit(bracket_text ? bracket_text : "", ",", -1);

    *takes = (struct sim_takes){.gain = camera_gain, .arm = arm, .seed = (uint64_t)seed};
    if (!(camera_gain >= 0 && camera_gain <= 4))
        return lumi_fail(error, LUMI_ERR_ARG, "--camera-gain %g: 0 to 4 stops wanted", camera_gain);
    for (int i = 0; fault_texts && fault_texts[i]; i++)
        LUMI_TRY(sim_takes_add_fault(takes, fault_texts[i], error));
    for (int i = 0; parts[i]; i++) {
        if (i == SIM_BRACKET)
            return lumi_fail(error, LUMI_ERR_ARG, "--brackets: at most %d shots wanted", SIM_BRACKET);
        LUMI_TRY(cli_parse_doubles("--brackets", parts[i], ',', 1, &takes->brackets[i], error));
        if (!(fabs(takes->brackets[i]) <= 10))
            return lumi_fail(error, LUMI_ERR_ARG, "--brackets %s: -10 to 10 stops wanted", parts[i]);
        takes->bracket_count = i + 1;
        takes->base_s = 0.004;
    }
    return LUMI_OK;
}

static int make_errors(const struct sim_takes *takes, struct sim_rig *rig, struct sim_output *output,
                       struct lumi_error *error)
{
    struct sim_errors errors = {.seed = (uint64_t)seed, .backwards = sim_takes_has(takes, SIM_FAULT_BACKWARDS)};
    double numbers[2] = {0, 0};

    if (pose_error)
        LUMI_TRY(cli_parse_doubles("--pose-error", pose_error, ',', 2, numbers, error));
    if (mechanism_error)
        LUMI_TRY(sim_errors_parse(mechanism_error, &errors.mechanism, error));
    if (!pose_error && !mechanism_error && !errors.backwards && !sim_takes_has(takes, SIM_FAULT_SWAPPED))
        return LUMI_OK;
    errors.position_m = numbers[0] / 1000;
    errors.rotation = numbers[1] * LUMI_PI / 180;
    output->given_poses = true;
    return sim_errors_apply(&errors, rig, error);
}

static int open_place(const char *name, const struct sim_rig *rig, struct sim_scene **scene, struct lumi_error *error)
{
    if (tripod && rig->plane)
        return lumi_fail(error, LUMI_ERR_ARG, "--tripod: cameras on a sphere are wanted");
    return tripod ? sim_place_open_stand(name, rig->radius, true, scene, error) : sim_place_open(name, scene, error);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct sim_rig_options rig_options;
    struct sim_scene *scene = NULL;
    struct sim_output output;
    struct sim_takes takes;
    struct sim_rig rig = {0};
    const struct sim_shoot_truth truth = {truth_poses, truth_capture};
    int code;

    (void)argc;
    LUMI_TRY(parse(&rig_options, &output, error));
    LUMI_TRY(make_takes(&takes, error));
    output.context = argv[0];
    if (!(fabs(turned) <= 90))
        return lumi_fail(error, LUMI_ERR_ARG, "--turned %g: -90 to 90 degrees wanted", turned);
    LUMI_GOTO(code, done, sim_rig_init(&rig, rig_text ? rig_text : "arc16", &rig_options, error));
    if (turned != 0 && !rig.mechanism) {
        code = lumi_fail(error, LUMI_ERR_ARG, "--turned: a rig that turns is wanted: arc16, arc16x2, bar2, arc:…");
        goto done;
    }
    output.profile = &rig.profile;
    LUMI_GOTO(code, done, make_errors(&takes, &rig, &output, error));
    LUMI_GOTO(code, done, sim_takes_apply(&takes, &rig, error));
    LUMI_GOTO(code, done, open_place(argv[0], &rig, &scene, error));
    LUMI_GOTO(code, done, sim_shoot(scene, argv[0], &rig, &output, &takes, &truth, out, error));
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
