/* lumi sim board: a simulated rig with its board behind a pseudo-terminal. */
#include "cli/command.h"
#include "cli/rig_files.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "sim/rig/serve.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

static char *profile = "arc16", *faults_path, *link_path;
static double speed = 1, seconds;
static int seed = 1;
static gboolean blank;
static volatile sig_atomic_t stop;

static const GOptionEntry options[] = {
    {"profile", 0, 0, G_OPTION_ARG_STRING, &profile, "the rig as it is: a file, or arc16 (default), arc16x2, bar2",
     "PROFILE"},
    {"pty", 0, 0, G_OPTION_ARG_FILENAME, &link_path, "makes a symbolic link to the pseudo-terminal there", "LINK"},
    {"faults", 0, 0, G_OPTION_ARG_FILENAME, &faults_path, "what goes wrong, and when (docs/rig-simulation.md)", "FILE"},
    {"speed", 0, 0, G_OPTION_ARG_DOUBLE, &speed, "virtual seconds a second (1)", "FACTOR"},
    {"seconds", 0, 0, G_OPTION_ARG_DOUBLE, &seconds, "ends after so many virtual seconds", "S"},
    {"blank", 0, 0, G_OPTION_ARG_NONE, &blank, "the board has no profile yet", NULL},
    {"seed", 0, 0, G_OPTION_ARG_INT, &seed, "of jitter and bounce (1)", "S"},
    {0},
};

static void on_signal(int number)
{
    (void)number;
    stop = 1;
}

static void ready(void *context, const char *path)
{
    (void)context;
    printf("%s\n", path);
    fflush(stdout);
}

static int read_faults(struct sim_fault_script *script, struct lumi_error *error)
{
    uint8_t *text;
    size_t size;
    int code;

    LUMI_TRY(lumi_file_read(faults_path, 1 << 20, &text, &size, error));
    code = sim_fault_script_parse((const char *)text, size, faults_path, script, error);
    lumi_free(text);
    return code;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    static struct sim_fault_script script;
    struct sim_serve_options serve;
    struct sigaction action = {.sa_handler = on_signal};
    struct lumi_rig rig;

    (void)argc;
    (void)argv;
    if (!(speed > 0 && speed <= 1000))
        return lumi_fail(error, LUMI_ERR_ARG, "--speed: more than 0, at most 1000");
    if (!(seconds >= 0 && seconds <= 1e6))
        return lumi_fail(error, LUMI_ERR_ARG, "--seconds: 0 to 1000000");
    LUMI_TRY(cli_read_rig(profile, &rig, error));
    sim_serve_options_init(&serve, &rig);
    if (faults_path)
        LUMI_TRY(read_faults(&script, error));
    serve.machine.seed = (uint64_t)seed;
    serve.faults = faults_path ? &script : NULL;
    serve.link = link_path;
    serve.speed = speed;
    serve.seconds = seconds;
    serve.blank = blank;
    serve.stop = &stop;
    serve.ready = ready;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    return sim_serve(&rig, &serve, error);
}

const struct cli_command cli_sim_board = {
    .name = "sim board",
    .arguments = "",
    .summary = "simulate a rig with its board behind a pseudo-terminal",
    .description =
        "The firmware's own code on a simulated board, with motor, string, switches and cameras behind it. It prints "
        "the pseudo-terminal's path and runs until Ctrl-C; `lumi rig status --link serial:PATH` and all other rig "
        "commands work on it as on a real one. A fault script says what goes wrong.",
    .options = options,
    .run = run,
};
