/* lumi stage: one stage of the pipeline over a range of images. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "pipeline/engine/local.h"
#include "pipeline/graph/graph.h"

#include <stdio.h>

static char *range;
static const GOptionEntry options[] = {
    {"range", 'r', 0, G_OPTION_ARG_STRING, &range, "images A to B−1, counted from 0 (all)", "A:B"},
    PROCESS_OPTIONS,
    {0},
};

static int list_stages(void)
{
    for (int i = 0; lumi_stages[i]; i++)
        puts(lumi_stages[i]->name);
    return LUMI_OK;
}

static int run_stage(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_parameters parameters;
    struct lumi_run *run;
    int ends[2], skipped = 0, code;

    if (argc == 0)
        return list_stages();
    if (argc != 2)
        return lumi_fail(error, LUMI_ERR_ARG, "a stage and a capture wanted");
    const struct lumi_stage *stage = lumi_stage_by_name(argv[0]);
    if (!stage)
        return lumi_fail(error, LUMI_ERR_ARG, "no stage '%s' ('lumi stage' lists them)", argv[0]);
    if (range)
        LUMI_TRY(cli_parse_ints("--range", range, ':', 2, ends, error));
    LUMI_TRY(process_options_read(&parameters, error));
    LUMI_TRY(lumi_graph_open(argv[1], process_options.work, &parameters, process_options.threads, false, &run, error));
    run->progress = cli_progress;
    lumi_engine_use_local(run, process_options_say);
    code = lumi_graph_prepare(run, stage, error);
    const int all = code == LUMI_OK ? lumi_stage_count(run, stage) : 0;
    if (code == LUMI_OK)
        code = lumi_run_stage(run, stage, range ? ends[0] : 0, range ? ends[1] : -1, &skipped, error);
    if (code == LUMI_OK) {
        cli_progress_end();
        int outputs = stage->whole || all == 0 || !range ? all : ends[1] - ends[0];
        printf("%s: %d made, %d there\n", stage->name, outputs - skipped, skipped);
    }
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
