/* lumi stage: one stage of the pipeline over a range of images. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "pipeline/engine/local.h"
#include "pipeline/engine/outstanding.h"
#include "pipeline/graph/deliver.h"
#include "pipeline/graph/graph.h"

#include <stdio.h>

static char *range, *share, *output;
static const GOptionEntry options[] = {
    {"range", 'r', 0, G_OPTION_ARG_STRING, &range, "images A to B−1, counted from 0 (all)", "A:B"},
    {"share", 0, 0, G_OPTION_ARG_STRING, &share, "the K-th of N equal parts of them, K from 1", "K/N"},
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &output, "where to copy what the stage makes for all images together",
     "FILE"},
    PROCESS_OPTIONS,
    {0},
};

static int list_stages(void)
{
    for (int i = 0; lumi_stages[i]; i++)
        puts(lumi_stages[i]->name);
    return LUMI_OK;
}

/* What the stage has `count` images for: [ends[0], ends[1]). */
static int choose_range(int count, int ends[2], struct lumi_error *error)
{
    int part[2];

    ends[0] = 0, ends[1] = count;
    if (range)
        return cli_parse_ints("--range", range, ':', 2, ends, error);
    if (!share)
        return LUMI_OK;
    LUMI_TRY(cli_parse_ints("--share", share, '/', 2, part, error));
    if (part[1] < 1 || part[0] < 1 || part[0] > part[1])
        return lumi_fail(error, LUMI_ERR_ARG, "--share %s: K/N with 1 <= K <= N wanted", share);
    lumi_share_range(part[0], part[1], count, &ends[0], &ends[1]);
    return LUMI_OK;
}

static int work_on(struct lumi_run *run, const struct lumi_stage *stage, struct lumi_error *error)
{
    int ends[2], skipped = 0;

    run->progress = cli_progress;
    lumi_engine_use_local(run, process_options_say);
    LUMI_TRY(lumi_graph_prepare(run, stage, error));
    const int all = lumi_stage_count(run, stage);
    LUMI_TRY(choose_range(all, ends, error));
    LUMI_TRY(lumi_run_stage(run, stage, ends[0], ends[1], &skipped, error));
    cli_progress_end();
    printf("%s: %d made, %d there\n", stage->name, (stage->whole || all == 0 ? all : ends[1] - ends[0]) - skipped,
           skipped);
    if (!output)
        return LUMI_OK;
    g_autofree char *made = lumi_run_path(run, stage->name, -1, stage->extension);
    return lumi_deliver(made, output, error);
}

static int run_stage(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_parameters parameters;
    struct lumi_run *run;
    int ends[2];

    if (argc == 0)
        return list_stages();
    if (argc != 2)
        return lumi_fail(error, LUMI_ERR_ARG, "a stage and a capture wanted");
    const struct lumi_stage *stage = lumi_stage_by_name(argv[0]);
    if (!stage)
        return lumi_fail(error, LUMI_ERR_ARG, "no stage '%s' ('lumi stage' lists them)", argv[0]);
    if (range && share)
        return lumi_fail(error, LUMI_ERR_ARG, "--range or --share, not both");
    if (output && !stage->whole)
        return lumi_fail(error, LUMI_ERR_ARG, "--output: the stage '%s' makes a file an image", stage->name);
    LUMI_TRY(choose_range(1, ends, error)); /* before the capture is read */
    LUMI_TRY(process_options_read(&parameters, error));
    LUMI_TRY(lumi_graph_open(argv[1], process_options.work, &parameters, process_options.threads, LUMI_RUN_SHARED, &run,
                             error));
    const int code = work_on(run, stage, error);
    lumi_run_close(run);
    return code;
}

const struct cli_command cli_stage = {
    .name = "stage",
    .arguments = "[STAGE CAPTURE]",
    .summary = "run one stage of the pipeline over a range of images",
    .description = "Without arguments, lists the stages in the order they need each other. Several ranges may run at "
                   "once, in one work directory. Give the same parameters as to 'lumi process': what a stage made is "
                   "taken up by it.",
    .options = options,
    .min_arguments = 0,
    .max_arguments = 2,
    .run = run_stage,
};
