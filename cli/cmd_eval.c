/* lumi eval: a field against the truth. */
#include "cli/command.h"
#include "cli/render_options.h"
#include "pipeline/evaluate/codec_cost.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/evaluate/flicker.h"
#include "pipeline/evaluate/pose_error.h"

#include <stdio.h>
#include <string.h>

static struct cli_render_options shared;
static char *truth_file, *frames_regex, *difference, *sheet, *codec, *poses, *aligned, *aligned_truth;
static int sheet_views = 12, furthest = 5;
static gboolean json, flicker;

static const GOptionEntry options[] = {
    {"truth", 't', 0, G_OPTION_ARG_FILENAME, &truth_file, "pictures with poses and lenses: a transforms.json", "FILE"},
    {"frames", 0, 0, G_OPTION_ARG_STRING, &frames_regex, "only those whose names this regex matches", "REGEX"},
    {"difference", 0, 0, G_OPTION_ARG_FILENAME, &difference, "write 4 × the absolute difference of every view here",
     "DIR"},
    {"sheet", 0, 0, G_OPTION_ARG_FILENAME, &sheet, "contact sheet: truth, rendering, difference", "PNG"},
    {"sheet-views", 0, 0, G_OPTION_ARG_INT, &sheet_views, "views on it, at most (12)", "N"},
    {"codec", 0, 0, G_OPTION_ARG_FILENAME, &codec,
     "instead: what compression alone cost, against the views before coding in this capture's work folder", "CAPTURE"},
    {"poses", 0, 0, G_OPTION_ARG_FILENAME, &poses,
     "instead: how far these are from the truth's, after the best similarity: a work folder, a places file, a "
     "transforms.json, a COLMAP model's folder",
     "PATH"},
    {"furthest", 0, 0, G_OPTION_ARG_INT, &furthest,
     "with --poses: lists so many pictures, those furthest off first (5)", "N"},
    {"aligned", 0, 0, G_OPTION_ARG_FILENAME, &aligned,
     "the field's poses were found: its work folder or places file; the truth is brought over to them", "PATH"},
    {"aligned-truth", 0, 0, G_OPTION_ARG_FILENAME, &aligned_truth,
     "with --aligned: the true poses of the same pictures", "FILE"},
    {"flicker", 0, 0, G_OPTION_ARG_NONE, &flicker,
     "instead: how much changes from one of the truth's pictures, frames of a path, to the next that should not", NULL},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "machine-readable", NULL},
    CLI_RENDER_OPTIONS(shared),
    {0},
};

static void progress(void *context, const char *what, int done, int total)
{
    (void)context;
    cli_progress(what, done, total);
}

static int run_codec(const char *field, struct lumi_error *error)
{
    struct lumi_codec_cost cost;

    LUMI_TRY(lumi_codec_cost(field, codec, shared.threads, progress, NULL, &cost, error));
    cli_progress_end();
    g_autofree char *text = json ? lumi_codec_cost_json(&cost) : lumi_codec_cost_text(&cost);
    printf("%s%s", text, json ? "\n" : "");
    lumi_codec_cost_finish(&cost);
    return LUMI_OK;
}

static int run_poses(struct lumi_error *error)
{
    struct lumi_pose_set found = {0}, truth = {0};
    struct lumi_pose_error result = {0};
    char *text = NULL;
    int code;

    LUMI_GOTO(code, out, lumi_pose_set_read(poses, &found, error));
    LUMI_GOTO(code, out, lumi_pose_set_read(truth_file, &truth, error));
    LUMI_GOTO(code, out, lumi_pose_error(&found, &truth, &result, error));
    text = json ? lumi_pose_error_json(&result, furthest) : lumi_pose_error_text(&result, furthest);
    printf("%s%s", text, json ? "\n" : "");
out:
    g_free(text);
    lumi_pose_error_finish(&result);
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&truth);
    return code;
}

static int align(struct lumi_truth_set *truth, struct lumi_error *error)
{
    struct lumi_pose_set found = {0}, placed = {0};
    int code;

    LUMI_GOTO(code, out, lumi_pose_set_read(aligned, &found, error));
    LUMI_GOTO(code, out, lumi_pose_set_read(aligned_truth, &placed, error));
    if (truth->count > 0)
        code = lumi_pose_set_align(&placed, &found, &truth->items[0].pose, sizeof *truth->items, truth->count, error);
out:
    lumi_pose_set_finish(&found);
    lumi_pose_set_finish(&placed);
    return code;
}

static int run_flicker(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *how,
                       struct lumi_error *error)
{
    struct lumi_flicker result;

    LUMI_TRY(lumi_flicker(field, truth, how, &result, error));
    cli_progress_end();
    g_autofree char *text = json ? lumi_flicker_json(&result) : lumi_flicker_text(&result);
    printf("%s%s", text, json ? "\n" : "");
    return LUMI_OK;
}

static int run_views(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *how,
                     struct lumi_error *error)
{
    struct lumi_evaluation evaluation;

    LUMI_TRY(lumi_evaluate(field, truth, how, &evaluation, error));
    cli_progress_end();
    g_autofree char *text = json ? lumi_evaluation_json(&evaluation) : lumi_evaluation_text(&evaluation);
    printf("%s%s", text, json ? "\n" : "");
    lumi_evaluation_finish(&evaluation);
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_evaluate_options o = {
        .difference = difference, .sheet = sheet, .sheet_views = sheet_views, .progress = progress};
    struct lumi_truth_set truth;

    if (!aligned != !aligned_truth)
        return lumi_fail(error, LUMI_ERR_ARG, "--aligned PATH and --aligned-truth FILE go together");
    if (poses && (!truth_file || codec || argc))
        return lumi_fail(error, LUMI_ERR_ARG, "--poses PATH goes with --truth FILE alone");
    if (furthest < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "--furthest: 0 and more are wanted");
    if (poses)
        return run_poses(error);
    if (argc != 1)
        return lumi_fail(error, LUMI_ERR_ARG, "FILE is wanted");
    if (!!truth_file + !!codec != 1)
        return lumi_fail(error, LUMI_ERR_ARG, "one of --truth FILE and --codec CAPTURE is wanted");
    LUMI_TRY(cli_check_threads(shared.threads, error));
    if (flicker && (difference || sheet || codec))
        return lumi_fail(error, LUMI_ERR_ARG, "--flicker goes with --truth FILE, without --difference and --sheet");
    if (codec)
        return run_codec(argv[0], error);
    LUMI_TRY(cli_render_options_apply(&shared, &o.render, error));
    LUMI_TRY(lumi_truth_read(truth_file, frames_regex, false, &truth, error));
    int code = aligned ? align(&truth, error) : LUMI_OK;
    if (code == LUMI_OK)
        code = (flicker ? run_flicker : run_views)(argv[0], &truth, &o, error);
    lumi_truth_finish(&truth);
    return code;
}

const struct cli_command cli_eval = {
    .name = "eval",
    .arguments = "[FILE] --truth TRANSFORMS",
    .summary = "compare rendered views with the truth",
    .description = "Renders the truth's views with their own lenses and sizes. For each, the mean and the worst: PSNR "
                   "of RGB; PSNR of "
                   "YUV 4:2:0 as Overbeck et al. 2018, section 8.2, define it; SSIM of luma (Wang et al. 2004); the "
                   "share of pixels "
                   "that no view covers. Uncovered pixels count as black.\n\n"
                   "With --method plane and no --plane-distance the best single plane is searched for first.",
    .options = options,
    .min_arguments = 0,
    .max_arguments = 1,
    .run = run,
};
