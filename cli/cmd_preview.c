/* lumi preview: views of a capture that may still be taken. */
#include "cli/command.h"
#include "pipeline/preview/preview_serve.h"
#include "proto/image/image.h"

#include <stdio.h>
#include <unistd.h>

#define DEGREE (LUMI_PI / 180)
#define WORK_BYTES ((size_t)768 << 20) /* for what frames and pictures take while they are worked on */

static char *out, *size_text;
static double x, y, z, yaw, pitch, fov = 70, seconds, density = 6;
static gboolean serve, plain;
static int memory_mib = 512, threads;

static const GOptionEntry options[] = {
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out, "one picture (.jpg .png .tif .exr), and the end", "OUT"},
    {"serve", 0, 0, G_OPTION_ARG_NONE, &serve, "answer lines on standard input (docs/preview.md)", NULL},
    {"x", 0, 0, G_OPTION_ARG_DOUBLE, &x, "metres from the centre of the capture (0)", "M"},
    {"y", 0, 0, G_OPTION_ARG_DOUBLE, &y, "likewise", "M"},
    {"z", 0, 0, G_OPTION_ARG_DOUBLE, &z, "likewise", "M"},
    {"yaw", 0, 0, G_OPTION_ARG_DOUBLE, &yaw, "degrees; 0 looks along +X, 90 along +Y (0)", "DEGREES"},
    {"pitch", 0, 0, G_OPTION_ARG_DOUBLE, &pitch, "degrees; 90 looks along +Z (0)", "DEGREES"},
    {"fov", 0, 0, G_OPTION_ARG_DOUBLE, &fov, "degrees across the width (70)", "DEGREES"},
    {"size", 's', 0, G_OPTION_ARG_STRING, &size_text, "of the picture (960x640)", "WxH"},
    {"seconds", 0, 0, G_OPTION_ARG_DOUBLE, &seconds,
     "with -o: draw after so long, whatever is still to do (all is done)", "S"},
    {"plain", 0, 0, G_OPTION_ARG_NONE, &plain, "no matching: everything lies on one sphere", NULL},
    {"memory", 0, 0, G_OPTION_ARG_INT, &memory_mib, "for views, MiB (512)", "MIB"},
    {"pixels-per-degree", 0, 0, G_OPTION_ARG_DOUBLE, &density, "of views, at most (6)", "N"},
    {"threads", 'j', 0, G_OPTION_ARG_INT, &threads, "threads (all)", "N"},
    {0},
};

static void say_skipped(void *context, const char *text)
{
    (void)context;
    cli_progress_end();
    fprintf(stderr, "lumi preview: %s\n", text);
}

static int check(struct lumi_error *error)
{
    if (!out == !serve)
        return lumi_fail(error, LUMI_ERR_ARG, "one of -o OUT and --serve is wanted");
    if (memory_mib < 16 || memory_mib > 1 << 20)
        return lumi_fail(error, LUMI_ERR_ARG, "--memory %d: 16 to 1048576 wanted", memory_mib);
    if (!(density >= 1 && density <= 100))
        return lumi_fail(error, LUMI_ERR_ARG, "--pixels-per-degree %g: 1 to 100 wanted", density);
    if (!(seconds >= 0))
        return lumi_fail(error, LUMI_ERR_ARG, "--seconds %g: 0 or more wanted", seconds);
    return LUMI_OK;
}

static void work(struct lumi_preview *preview)
{
    const gint64 end = g_get_monotonic_time() + (gint64)(seconds * 1e6);
    struct lumi_preview_status status;

    while ((!(seconds > 0) || g_get_monotonic_time() < end) && lumi_preview_work(preview)) {
        lumi_preview_status(preview, &status);
        cli_progress("preview: views and shapes", status.views + status.shapes, 2L * status.frames);
    }
    cli_progress_end();
}

static int draw(struct lumi_preview *preview, const struct lumi_preview_gaze *gaze, struct lumi_error *error)
{
    struct lumi_preview_status status;
    struct lumi_picture picture;

    work(preview);
    lumi_preview_status(preview, &status);
    if (status.views == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: none of its frames can be shown",
                         status.frames ? "the capture" : "the capture, so far");
    LUMI_TRY(lumi_preview_draw(preview, gaze, &picture, error));
    const int code = lumi_image_write(out, &picture.color, NULL, error);
    if (code == LUMI_OK)
        printf("%s: %d of %d frames, %d of them matched, %.3f %% uncovered\n", out, status.views, status.frames,
               status.shapes, picture.imaged ? 100 * (1 - (double)picture.covered / (double)picture.imaged) : 0);
    lumi_picture_finish(&picture);
    return code;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_preview_gaze gaze = {x, y, z, yaw * DEGREE, pitch * DEGREE, fov * DEGREE, 0, 0};
    struct lumi_preview_options o;
    struct lumi_preview *preview;
    int size[2] = {960, 640}, code;

    (void)argc;
    LUMI_TRY(check(error));
    if (size_text)
        LUMI_TRY(cli_parse_ints("--size", size_text, 'x', 2, size, error));
    gaze.width = size[0];
    gaze.height = size[1];
    LUMI_TRY(lumi_preview_gaze_check(&gaze, error));
    lumi_preview_options_init(&o);
    o.memory_bytes = (size_t)memory_mib << 20;
    o.pixels_per_degree = density;
    o.shapes = !plain;
    o.threads = threads;
    o.skipped = say_skipped;
    lumi_preview_humble(o.memory_bytes + WORK_BYTES);
    LUMI_TRY(lumi_preview_open(argv[0], &o, &preview, error));
    if (serve)
        code = lumi_preview_serve(preview, &o, STDIN_FILENO, STDOUT_FILENO, error);
    else
        code = draw(preview, &gaze, error);
    lumi_preview_close(preview);
    return code;
}

const struct cli_command cli_preview = {
    .name = "preview",
    .arguments = "CAPTURE (-o OUT | --serve)",
    .summary = "views of a capture that is still being taken",
    .description =
        "Draws what is seen from inside the capture with the frames that are stored, as far as they have "
        "come. The capture is read without any lock: whoever writes it is never held up. Frames become small views "
        "in memory; what they show lies on a sphere at first, and view by view where matching against the "
        "neighbours finds it.\n\n"
        "It takes what nobody else wants of the processor and the disk, and stays within its memory.\n\n"
        "Places are metres from the centre of the capture; +Z is a rig's rotation axis, +X its index mark.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
