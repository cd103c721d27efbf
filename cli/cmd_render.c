/* lumi render: views of a field, as pictures or a film. */
#include "cli/command.h"
#include "cli/render_options.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/evaluate/pictures.h"

#include <stdio.h>
#include <string.h>

static struct cli_render_options shared;
static char **pose_texts, *poses_file, *frames_regex, *path_name, *out, *projection_name, *size_text, *depth_file;
static double fov, eye_distance = 0.064;
static gboolean stereo;
static int bits = 8, frames = 120, frames_per_second = 30, quality = 20;

static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out,
     "a picture (.png .jpg .tif .exr), a film (.webm), or a folder where there are several poses", "OUT"},
    {"pose", 'p', 0, G_OPTION_ARG_STRING_ARRAY, &pose_texts,
     "x,y,z,yaw,pitch[,roll]: metres and degrees; yaw 0 looks along +X, 90 along +Y, pitch 90 up (may be repeated)",
     "POSE"},
    {"poses", 0, 0, G_OPTION_ARG_FILENAME, &poses_file, "poses, lenses and sizes of a transforms.json", "FILE"},
    {"frames", 0, 0, G_OPTION_ARG_STRING, &frames_regex, "only those of its frames whose names this regex matches",
     "REGEX"},
    {"path", 0, 0, G_OPTION_ARG_STRING, &path_name, "orbit or dolly: a closed path that suits the field", "PATH"},
    {"count", 0, 0, G_OPTION_ARG_INT, &frames, "pictures on the path (120)", "N"},
    {"fps", 0, 0, G_OPTION_ARG_INT, &frames_per_second, "pictures a second of a film (30)", "N"},
    {"film-quality", 0, 0, G_OPTION_ARG_INT, &quality, "0 to 63, lower is better (20)", "Q"},
    {"projection", 0, 0, G_OPTION_ARG_STRING, &projection_name, "perspective (default), fisheye or equirectangular",
     "PROJECTION"},
    {"size", 's', 0, G_OPTION_ARG_STRING, &size_text, "of a picture, of one eye's with --stereo (960x640)", "WxH"},
    {"fov", 0, 0, G_OPTION_ARG_DOUBLE, &fov, "degrees across the width (60, fisheye 180, equirectangular 360)",
     "DEGREES"},
    {"stereo", 0, 0, G_OPTION_ARG_NONE, &stereo, "two eyes side by side, the left one left", NULL},
    {"eye-distance", 0, 0, G_OPTION_ARG_DOUBLE, &eye_distance, "metres between them (0.064)", "M"},
    {"bits", 0, 0, G_OPTION_ARG_INT, &bits, "of a PNG: 8 (default) or 16", "BITS"},
    {"depth", 0, 0, G_OPTION_ARG_FILENAME, &depth_file,
     "also write metres along the optical axis (other projections: along the ray): EXR, channel Z; a folder where "
     "there are several poses",
     "OUT"},
    CLI_RENDER_OPTIONS(shared),
    {0},
};

static void progress(void *context, const char *what, int done, int total)
{
    (void)context;
    cli_progress(what, done, total);
}

static void free_shot(void *shot)
{
    g_free(((struct lumi_shot *)shot)->name);
}

static int shots_of_poses(GArray *shots, const struct lumi_lens *lens, struct lumi_error *error)
{
    for (int i = 0; pose_texts && pose_texts[i]; i++) {
        struct lumi_shot shot = {.lens = *lens};
        LUMI_TRY(lumi_pose_parse(pose_texts[i], &shot.pose, error));
        shot.name = g_strdup_printf("pose%04d", i);
        g_array_append_val(shots, shot);
    }
    return LUMI_OK;
}

static int shots_of_file(GArray *shots, struct lumi_error *error)
{
    struct lumi_truth_set truth;

    if (!poses_file)
        return LUMI_OK;
    LUMI_TRY(lumi_truth_read(poses_file, frames_regex, true, &truth, error));
    for (int i = 0; i < truth.count; i++) {
        struct lumi_shot shot = {g_strdup(truth.items[i].name), truth.items[i].lens, truth.items[i].pose};
        g_array_append_val(shots, shot);
    }
    lumi_truth_finish(&truth);
    return LUMI_OK;
}

static int shots_of_path(GArray *shots, const struct lumi_field *field, const struct lumi_lens *lens,
                         struct lumi_error *error)
{
    static const char *const paths[] = {"orbit", "dolly", NULL};
    int path = 0;

    if (!path_name)
        return LUMI_OK;
    LUMI_TRY(cli_parse_choice("--path", path_name, paths, &path, error));
    if (frames < 1 || frames > 100000)
        return lumi_fail(error, LUMI_ERR_ARG, "--count %d: 1 to 100000 wanted", frames);
    for (int i = 0; i < frames; i++) {
        struct lumi_shot shot = {.lens = *lens, .name = g_strdup_printf("frame%05d", i)};
        lumi_path_pose(field, (enum lumi_path)path, i, frames, &shot.pose);
        g_array_append_val(shots, shot);
    }
    return LUMI_OK;
}

static int output_lens(struct lumi_lens *lens, struct lumi_error *error)
{
    static const char *const projections[] = {"perspective", "fisheye", "equirectangular", NULL};
    int projection = 0, size[2] = {960, 640};

    if (projection_name)
        LUMI_TRY(cli_parse_choice("--projection", projection_name, projections, &projection, error));
    if (size_text)
        LUMI_TRY(cli_parse_ints("--size", size_text, 'x', 2, size, error));
    return lumi_output_lens((enum lumi_output_projection)projection, size[0], size[1], fov * LUMI_PI / 180, lens,
                            error);
}

static int check(struct lumi_error *error)
{
    if (!out)
        return lumi_fail(error, LUMI_ERR_ARG, "-o OUT is missing");
    if (!!pose_texts + !!poses_file + !!path_name != 1)
        return lumi_fail(error, LUMI_ERR_ARG, "one of --pose, --poses and --path is wanted");
    if (bits != 8 && bits != 16)
        return lumi_fail(error, LUMI_ERR_ARG, "--bits %d: 8 or 16 wanted", bits);
    if (frames_per_second < 1 || frames_per_second > 1000 || quality < 0 || quality > 63)
        return lumi_fail(error, LUMI_ERR_ARG, "--fps 1 to 1000 and --film-quality 0 to 63 wanted");
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_picture_options o = {.stereo = stereo,
                                     .eye_distance = eye_distance,
                                     .bits = bits,
                                     .frames_per_second = frames_per_second,
                                     .video_quality = quality,
                                     .depth = depth_file,
                                     .progress = progress};
    g_autoptr(GArray) shots = g_array_new(FALSE, TRUE, sizeof(struct lumi_shot));
    struct lumi_renderer *renderer = NULL;
    struct lumi_picture_report report;
    struct lumi_lens lens;
    int code;

    (void)argc;
    g_array_set_clear_func(shots, free_shot);
    LUMI_TRY(check(error));
    LUMI_TRY(cli_render_options_apply(&shared, &o.render, error));
    LUMI_TRY(output_lens(&lens, error));
    LUMI_TRY(shots_of_poses(shots, &lens, error));
    LUMI_TRY(shots_of_file(shots, error));
    if (o.render.method == LUMI_METHOD_PLANE && !(o.render.plane_distance > 0))
        return lumi_fail(error, LUMI_ERR_ARG, "--method plane wants a --plane-distance");
    o.render.disks.sample = lumi_picture_sample(out, bits);
    LUMI_TRY(lumi_renderer_open(argv[0], &o.render, &renderer, error));
    LUMI_GOTO(code, done, shots_of_path(shots, lumi_renderer_field(renderer), &lens, error));
    LUMI_GOTO(code, done,
              lumi_pictures_write(renderer, (struct lumi_shot *)(void *)shots->data, (int)shots->len, out, &o, &report,
                                  error));
    cli_progress_end();
    printf("%s: %d picture%s, %.3f %% uncovered\n", out, report.pictures, report.pictures == 1 ? "" : "s",
           report.imaged ? 100 * (1 - (double)report.covered / (double)report.imaged) : 0);
    if (report.damaged)
        fprintf(stderr, "lumi render: %s: %d damaged tile%s\n", argv[0], report.damaged,
                report.damaged == 1 ? "" : "s");
done:
    lumi_renderer_close(renderer);
    return code;
}

const struct cli_command cli_render = {
    .name = "render",
    .arguments = "FILE -o OUT",
    .summary = "render views of a light field",
    .description = "Renders what is seen from the given poses. Poses are in the field's own frame: right-handed, "
                   "metres, +Z up; for "
                   "a rig's captures +Z is the rotation axis and +X the index mark; imported captures keep their "
                   "source's axes.\n\n"
                   "Pixels that no view covers are black; their share is printed.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
