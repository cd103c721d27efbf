/* lumi sim rig: a whole simulated rig as separate processes. */
#include "cli/command.h"
#include "cli/rig_files.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "sim/gige/gige_namespace.h"
#include "sim/gige/rig_processes.h"
#include "sim/rigs.h"

#include <glib/gstdio.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char *profile, *rig_text = "arc16", *size_text, *faults_path, *folder, *layout = "raw", *process;
static double scale = 1, speed = 1, full_well, read_noise, exposure = 0.004, white = 0.004, position_time,
              patience = 120;
static int seed = 1, processes, first_host = 2, bits, port = 8470;
static gboolean own_network, drive, continuous;
static volatile sig_atomic_t stop;

static const GOptionEntry options[] = {
    {"folder", 'o', 0, G_OPTION_ARG_FILENAME, &folder,
     "where board, rig.txt, plan.txt, lumid.conf and captures are made (rig)", "DIR"},
    {"rig", 0, 0, G_OPTION_ARG_STRING, &rig_text,
     "arc16 (default), arc16x2, bar2 or arc:CAMERASxPOSITIONS:RADIUS (metres)", "RIG"},
    {"scale", 0, 0, G_OPTION_ARG_DOUBLE, &scale, "shrinks its counts and resolution alike (1)", "S"},
    {"size", 0, 0, G_OPTION_ARG_STRING, &size_text, "size of the pictures, whatever the scale", "WxH"},
    {"profile", 0, 0, G_OPTION_ARG_FILENAME, &profile, "a rig of one's own instead: its profile", "FILE"},
    {"drive", 0, 0, G_OPTION_ARG_NONE, &drive,
     "an industrial drive turns the platform: a Modbus server, with drive.map (docs/rig-drive.md)", NULL},
    {"faults", 0, 0, G_OPTION_ARG_FILENAME, &faults_path, "what goes wrong, and when (docs/rig-simulation.md)", "FILE"},
    {"seed", 0, 0, G_OPTION_ARG_INT, &seed, "of jitter, bounce and noise; in the cameras' serial numbers (1)", "S"},
    {"speed", 0, 0, G_OPTION_ARG_DOUBLE, &speed, "virtual seconds a second (1)", "FACTOR"},
    {"processes", 'j', 0, G_OPTION_ARG_INT, &processes, "with cameras in them, each drawing at once (all processors)",
     "N"},
    {"host", 0, 0, G_OPTION_ARG_INT, &first_host, "the cameras are at 127.0.0.N and on (2)", "N"},
    {"own-network", 0, 0, G_OPTION_ARG_NONE, &own_network,
     "in a network namespace, with COMMAND: other programs' cameras are not met", NULL},
    {"full-well", 0, 0, G_OPTION_ARG_DOUBLE, &full_well, "electrons at white: turns shot noise on", "ELECTRONS"},
    {"read-noise", 0, 0, G_OPTION_ARG_DOUBLE, &read_noise, "electrons, one standard deviation (0)", "ELECTRONS"},
    {"exposure", 0, 0, G_OPTION_ARG_DOUBLE, &exposure, "of the plan, seconds (0.004)", "S"},
    {"white", 0, 0, G_OPTION_ARG_DOUBLE, &white,
     "seconds of exposure that make a picture as bright as the place (0.004)", "S"},
    {"continuous", 0, 0, G_OPTION_ARG_NONE, &continuous, "the plan turns evenly instead of stopping at every position",
     NULL},
    {"position-time", 0, 0, G_OPTION_ARG_DOUBLE, &position_time,
     "of the plan, seconds from position to position (as drawing needs, 2 at least)", "S"},
    {"patience", 0, 0, G_OPTION_ARG_DOUBLE, &patience,
     "in lumid.conf: seconds a frame may take, which is as long as the drawing takes here (120)", "S"},
    {"layout", 0, 0, G_OPTION_ARG_STRING, &layout, "of the frames in lumid.conf: raw (default), rgb or jpeg", "LAYOUT"},
    {"bits", 0, 0, G_OPTION_ARG_INT, &bits, "of raw frames in lumid.conf: 8, 10, 12 or 16 (the most)", "BITS"},
    {"port", 0, 0, G_OPTION_ARG_INT, &port, "of the API in lumid.conf (8470)", "PORT"},
    {"process", 0, 0, G_OPTION_ARG_STRING, &process, "in lumid.conf: what is started with a capture", "COMMAND"},
    {0},
};

static void on_signal(int number)
{
    (void)number;
    stop = 1;
}

static void ready(const struct sim_rig_processes *rig)
{
    char first[16], last[16];

    sim_rig_processes_address(rig, 0, first);
    sim_rig_processes_address(rig, rig->rig.camera_count - 1, last);
    printf("ready: board serial:%s/board, %d cameras at %s to %s, lumid --config %s/lumid.conf\n", rig->folder,
           rig->rig.camera_count, first, last, rig->folder);
    printf("plan: %d positions a turn, one every %.1f s\n", rig->rig.positions, rig->position_time);
    fflush(stdout);
}

static int read_rig(struct lumi_rig *rig, struct lumi_error *error)
{
    struct sim_rig_options wanted;
    struct sim_rig made = {0};
    int size[2] = {0, 0}, code;

    if (profile)
        return cli_read_rig(profile, rig, error);
    if (size_text)
        LUMI_TRY(cli_parse_ints("--size", size_text, 'x', 2, size, error));
    sim_rig_options_init(&wanted);
    wanted.scale = scale;
    wanted.width = size[0];
    wanted.height = size[1];
    code = sim_rig_init(&made, rig_text, &wanted, error);
    if (code == LUMI_OK && !made.mechanism)
        code = lumi_fail(error, LUMI_ERR_ARG, "--rig %s: a mechanism is wanted: arc16, arc16x2, bar2, arc:…", rig_text);
    *rig = made.profile;
    sim_rig_finish(&made);
    return code;
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

static int make_folder(char path[512], struct lumi_error *error)
{
    const char *name = folder ? folder : "rig";

    if (g_mkdir_with_parents(name, 0777) != 0)
        return lumi_fail_errno(error, name, "making the folder");
    g_autofree char *whole = realpath(name, NULL);
    if (!whole || strlen(whole) >= 512)
        return lumi_fail(error, LUMI_ERR_ARG, "--folder %s: too long", name);
    strcpy(path, whole);
    return LUMI_OK;
}

static int check(struct lumi_error *error)
{
    static const char *const layouts[] = {"raw", "rgb", "jpeg", NULL};
    int choice;

    LUMI_TRY(cli_parse_choice("--layout", layout, layouts, &choice, error));
    if (!(speed > 0 && speed <= 100))
        return lumi_fail(error, LUMI_ERR_ARG, "--speed: more than 0, at most 100");
    if (!(exposure >= 1e-5 && exposure <= 10))
        return lumi_fail(error, LUMI_ERR_ARG, "--exposure: 0.00001 to 10");
    if (!(white >= 1e-5 && white <= 10))
        return lumi_fail(error, LUMI_ERR_ARG, "--white: 0.00001 to 10");
    if (!(position_time >= 0 && position_time <= 3600))
        return lumi_fail(error, LUMI_ERR_ARG, "--position-time: 0 to 3600");
    if (!(patience >= 0.1 && patience <= 3600))
        return lumi_fail(error, LUMI_ERR_ARG, "--patience: 0.1 to 3600");
    if (port < 0 || port > 65535)
        return lumi_fail(error, LUMI_ERR_ARG, "--port: 0 to 65535");
    if (bits != 0 && bits != 8 && bits != 10 && bits != 12 && bits != 16)
        return lumi_fail(error, LUMI_ERR_ARG, "--bits: 8, 10, 12 or 16");
    return cli_check_threads(processes, error);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    static struct sim_fault_script script;
    struct sigaction action = {.sa_handler = on_signal};
    g_autofree char *own_program = g_file_read_link("/proc/self/exe", NULL); /* of a build that is not installed too */
    struct sim_rig_processes rig;
    char **command = argc > 1 ? argv + 1 + !strcmp(argv[1], "--") : NULL;

    LUMI_TRY(check(error));
    sim_rig_processes_init(&rig);
    LUMI_TRY(read_rig(&rig.rig, error));
    if (faults_path)
        LUMI_TRY(read_faults(&script, error));
    rig.place = argv[0];
    rig.drive = drive;
    if (drive)
        rig.rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    LUMI_TRY(lumi_rig_check(&rig.rig, error));
    rig.seed = (uint64_t)seed;
    rig.speed = speed;
    rig.processes = processes;
    rig.first_host = first_host;
    rig.sensor.full_well = full_well;
    rig.sensor.read_noise = read_noise;
    LUMI_TRY(sim_sensor_check(&rig.sensor, error));
    rig.faults = faults_path ? &script : NULL;
    rig.exposure = exposure;
    rig.reference = white;
    rig.continuous = continuous;
    rig.position_time = position_time;
    g_strlcpy(rig.layout, layout, sizeof rig.layout);
    rig.bits = bits;
    rig.patience = patience;
    rig.port = port;
    rig.process = process;
    rig.preview = own_program;
    rig.stop = &stop;
    rig.ready = ready;
    rig.command = command && *command ? command : NULL;
    if (own_network && !rig.command)
        return lumi_fail(error, LUMI_ERR_ARG, "--own-network: nobody else can reach the rig there; add -- COMMAND");
    LUMI_TRY(make_folder(rig.folder, error));
    if (own_network)
        LUMI_TRY(sim_gige_own_network(error));
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    return sim_rig_processes_run(&rig, error);
}

const struct cli_command cli_sim_rig = {
    .name = "sim rig",
    .arguments = "PLACE [-- COMMAND...]",
    .summary = "simulate a whole rig: board, cameras that photograph a place, and what goes wrong",
    .description =
        "Starts the firmware behind a pseudo-terminal and GigE Vision cameras on loopback addresses, each a program of "
        "its own for whoever talks to it. Triggered by the board's lines, the cameras answer with the picture of PLACE "
        "(room, court, object) for where they truly are at that instant, exposure time and motion blur included. It "
        "prints one line when all is there, with a configuration for lumid, and runs until Ctrl-C, or until COMMAND "
        "ends, which finds the folder in LUMI_SIM_RIG.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = -1,
    .run = run,
};
