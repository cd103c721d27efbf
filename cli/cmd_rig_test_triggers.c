/* lumi rig test triggers: fires the cameras one after another. */
#include "cli/rig_link.h"

#include <string.h>

static char *address;
static double exposure = 0.004, gap = 0.5;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"exposure", 0, 0, G_OPTION_ARG_DOUBLE, &exposure, "how long the cameras are set to expose (0.004)", "SECONDS"},
    {"gap", 0, 0, G_OPTION_ARG_DOUBLE, &gap, "between two cameras (0.5)", "SECONDS"},
    {0},
};

static int find_cameras(const struct lumi_rig *rig, int count, char **names, uint32_t *cameras,
                        struct lumi_error *error)
{
    *cameras = 0;
    for (int i = 0; i < count; i++) {
        int camera = 0;
        while (camera < rig->camera_count && strcmp(rig->cameras[camera].name, names[i]) != 0)
            camera++;
        if (camera == rig->camera_count)
            return lumi_fail(error, LUMI_ERR_ARG, "rig %s has no camera '%s'", rig->name, names[i]);
        *cameras |= 1u << camera;
    }
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_bench bench = {.interrupts = cli_rig_interrupts, .progress = cli_rig_progress};
    struct lumi_rig rig;
    uint32_t cameras;
    int code;

    LUMI_TRY(cli_rig_open(address, &bench.link, error));
    cli_rig_catch_interrupts();
    LUMI_GOTO(code, done, lumi_rig_bench_read_profile(bench.link, &rig, error));
    LUMI_GOTO(code, done, find_cameras(&rig, argc, argv, &cameras, error));
    LUMI_GOTO(code, done,
              lumi_rig_bench_test(&bench, cameras, exposure, gap, 30 + LUMI_RIG_CAMERAS * (exposure + gap + 2), error));
done:
    lumi_rig_link_close(bench.link);
    return code;
}

const struct cli_command cli_rig_test_triggers = {
    .name = "rig test triggers",
    .arguments = "[CAMERA...]",
    .summary = "fire the cameras one after another",
    .description = "Those that are named, or all that have a channel, in the profile's order; nothing moves.",
    .options = options,
    .max_arguments = -1,
    .run = run,
};
