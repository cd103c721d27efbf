/* lumi rig run: a whole sweep. */
#include "cli/rig_files.h"
#include "cli/rig_link.h"
#include "daemon/rig/sweep_run.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <json-glib/json-glib.h>
#include <stdio.h>

static char *address, *log_path, *drive_address, *map_path;
static gboolean resume, again, home_drive, reset_drive, json;
static double patience = 60;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"log", 0, 0, G_OPTION_ARG_FILENAME, &log_path, "writes a JSON line a shot", "FILE"},
    {"resume", 0, 0, G_OPTION_ARG_NONE, &resume, "takes what is missing; joins a sweep that is going on", NULL},
    {"again", 0, 0, G_OPTION_ARG_NONE, &again,
     "everything anew, though the board holds an unfinished sweep; with --resume what is missing, though it holds "
     "another plan's",
     NULL},
    {"patience", 0, 0, G_OPTION_ARG_DOUBLE, &patience, "without a word from the board (60)", "SECONDS"},
    {"drive", 0, 0, G_OPTION_ARG_STRING, &drive_address, "rtu:/dev/ttyUSB1[,baud=N][,parity=E] or tcp:HOST[:PORT]",
     "ADDRESS"},
    {"map", 0, 0, G_OPTION_ARG_FILENAME, &map_path, "the drive's register map (docs/rig-drive.md)", "FILE"},
    {"home-drive", 0, 0, G_OPTION_ARG_NONE, &home_drive, "the drive homes first", NULL},
    {"reset-drive", 0, 0, G_OPTION_ARG_NONE, &reset_drive, "resets an alarm that the drive still has", NULL},
    CLI_RIG_JSON_OPTION(json),
    {0},
};

static void progress(void *context, const struct lumi_rig_sweep_progress *now)
{
    const char *name = now->connected ? lumi_wire_state_name(now->state) : "no word from the board";

    (void)context;
    if (now->shots)
        cli_progress(name ? name : "?", (long)(now->fired + now->lost), (long)now->shots);
    else
        cli_progress(name ? name : "?", (long)now->turn, 0);
}

static int open_drive(struct lumi_rig_drive **drive, struct lumi_error *error)
{
    struct lumi_drive_map map;
    uint8_t *text;
    size_t size;
    int code;

    LUMI_TRY(lumi_file_read(map_path, LUMI_DRIVE_MAP_TEXT_MAX, &text, &size, error));
    code = lumi_drive_map_parse((const char *)text, size, map_path, &map, error);
    lumi_free(text);
    LUMI_TRY(code);
    return lumi_rig_drive_open(drive_address, &map, drive, error);
}

static void print_json(const struct lumi_rig_sweep_run *sweep, int code)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    const struct {
        const char *name;
        uint32_t value;
    } numbers[] = {
        {"shots", sweep->shots}, {"fired", sweep->fired}, {"lost", sweep->lost}, {"missing", sweep->missing}};

    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "plan");
    json_builder_add_string_value(builder, sweep->plan->name);
    for (int i = 0; i < 4; i++) {
        json_builder_set_member_name(builder, numbers[i].name);
        json_builder_add_int_value(builder, numbers[i].value);
    }
    json_builder_set_member_name(builder, "complete");
    json_builder_add_boolean_value(builder, code == LUMI_OK);
    json_builder_end_object(builder);
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    json_node_unref(root);
    puts(text);
}

static int sweep_it(struct lumi_rig_sweep_run *sweep, struct lumi_error *error)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error close_error;
    int code;

    LUMI_TRY(lumi_rig_sweep_log_open(&log, log_path, resume, sweep->plan, sweep->rig, error));
    sweep->log = &log;
    if (log.anew)
        fprintf(stderr, "%s: held no whole line; it is begun anew, and the board is asked for its shots\n", log_path);
    code = lumi_rig_sweep_run(sweep, error);
    cli_progress_end();
    if (lumi_rig_sweep_log_close(&log, &close_error) && code == LUMI_OK) {
        *error = close_error;
        code = close_error.code;
    }
    if (json)
        print_json(sweep, code);
    else if (code == LUMI_OK)
        printf("%s: %u shots fired\n", sweep->plan->name, (unsigned)sweep->fired);
    return code;
}

static int check_options(struct lumi_error *error)
{
    if (!drive_address != !map_path)
        return lumi_fail(error, LUMI_ERR_ARG, "--drive and --map go together");
    if (!(patience > 0 && patience <= 86400))
        return lumi_fail(error, LUMI_ERR_ARG, "--patience: 0 to 86400 seconds");
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_sweep_run sweep;
    struct lumi_plan plan;
    struct lumi_rig rig;
    int code;

    (void)argc;
    LUMI_TRY(check_options(error));
    lumi_rig_sweep_run_init(&sweep);
    LUMI_TRY(cli_rig_open(address, &sweep.link, error));
    cli_rig_catch_interrupts();
    LUMI_GOTO(code, done, lumi_rig_bench_read_profile(sweep.link, &rig, error));
    LUMI_GOTO(code, done, cli_read_plan(argv[0], &rig, &plan, error));
    if (drive_address)
        LUMI_GOTO(code, done, open_drive(&sweep.drive, error));
    sweep.rig = &rig;
    sweep.plan = &plan;
    sweep.resume = resume;
    sweep.again = again;
    sweep.patience = patience;
    sweep.home_drive = home_drive;
    sweep.reset_drive = reset_drive;
    sweep.utc_offset_ns = cli_rig_utc_offset_ns();
    sweep.interrupts = cli_rig_interrupts;
    sweep.progress = progress;
    code = sweep_it(&sweep, error);
done:
    lumi_rig_drive_close(sweep.drive);
    lumi_rig_link_close(sweep.link);
    return code;
}

const struct cli_command cli_rig_run = {
    .name = "rig run",
    .arguments = "PLAN",
    .summary = "do a sweep: turn, and fire the cameras",
    .description =
        "The plan (docs/rig-plan.md) is checked against the profile on the board, given to the board, and started; the "
        "board does it by itself. Ctrl-C pauses at the next safe place, a second one stops now, a third is an "
        "emergency "
        "stop. Ends with 1 and what is missing where not every shot was fired; --resume takes that.\n\nThe log holds "
        "one line of JSON for each thing the board tells, each shot with number, channels, step, turn, pitch and times "
        "by the board's clock and the host's (docs/rig.md).",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
