/* lumi capture status: how a capture stands. */
#include "cli/capture_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static gboolean json, checks, cameras;

static const GOptionEntry options[] = {
    {"checks", 0, 0, G_OPTION_ARG_NONE, &checks, "every check of the last preflight", NULL},
    {"cameras", 0, 0, G_OPTION_ARG_NONE, &cameras, "every camera", NULL},
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static void print_capture(JsonObject *capture)
{
    const char *text = cli_json_text(capture, "text"), *path = cli_json_text(capture, "path");
    long frames = cli_json_int(capture, "frames");
    char left[32];
    g_autofree char *bytes = g_format_size((guint64)cli_json_int(capture, "bytes"));

    printf("state     %s%s%s\n", cli_json_text(capture, "state"), *text ? ": " : "", text);
    if (*path)
        printf("capture   %s, plan %s%s\n", path, cli_json_text(capture, "plan"),
               cli_json_bool(capture, "complete") ? ", complete" : "");
    if (cli_json_int(capture, "shots"))
        printf("shots     %ld of %ld fired, %ld lost\n", cli_json_int(capture, "fired"), cli_json_int(capture, "shots"),
               cli_json_int(capture, "lost"));
    if (frames)
        printf("frames    %ld: %ld planned, %ld triggered, %ld exposed, %ld received, %ld stored, %ld accepted, %ld "
               "rejected, %ld missing; %s\n",
               frames, cli_json_int(capture, "planned"), cli_json_int(capture, "triggered"),
               cli_json_int(capture, "exposed"), cli_json_int(capture, "received"), cli_json_int(capture, "stored"),
               cli_json_int(capture, "accepted"), cli_json_int(capture, "rejected"), cli_json_int(capture, "missing"),
               bytes);
    if (isfinite(cli_json_double(capture, "seconds_left"))) {
        cli_duration(cli_json_double(capture, "seconds_left"), left, sizeof left);
        printf("left      %s%s\n", left, cli_json_int(capture, "round") ? " (retakes)" : "");
    }
}

static void print_rig(JsonObject *rig, bool estop)
{
    g_autoptr(GString) faults = g_string_new(NULL);
    JsonArray *list = json_object_get_array_member(rig, "faults");

    for (guint i = 0; list && i < json_array_get_length(list); i++)
        g_string_append_printf(faults, "%s%s", i ? ", " : "", json_array_get_string_element(list, i));
    if (strcmp(cli_json_text(rig, "link"), "open"))
        printf("rig       no board (%s): %s\n", cli_json_text(rig, "link"), cli_json_text(rig, "text"));
    else
        printf("rig       %s%s at %s, firmware %s; faults: %s\n", cli_json_text(rig, "state"),
               cli_json_bool(rig, "position_known") ? "" : " (not homed)", cli_json_text(rig, "address"),
               cli_json_text(rig, "firmware"), faults->len ? faults->str : "none");
    if (estop)
        puts("rig       EMERGENCY STOP is pressed");
}

static void print_cameras(JsonObject *status)
{
    int count = cli_json_count(status, "cameras"), there = 0, armed = 0;

    for (int i = 0; i < count; i++) {
        JsonObject *camera = cli_json_element(status, "cameras", i);
        there += cli_json_bool(camera, "there");
        armed += cli_json_bool(camera, "armed");
    }
    printf("cameras   %d of %d there, %d armed\n", there, count, armed);
    for (int i = 0; i < count; i++) {
        JsonObject *camera = cli_json_element(status, "cameras", i);
        JsonObject *identity = cli_json_object(camera, "identity");
        if (!cameras && cli_json_bool(camera, "there"))
            continue;
        printf("  %-8s %-5s %s %s %s, %ld frames, %ld dropped, %ld late\n", cli_json_text(camera, "name"),
               cli_json_bool(camera, "there") ? "there" : "AWAY", cli_json_text(identity, "model"),
               cli_json_text(identity, "serial"), cli_json_text(identity, "address"), cli_json_int(camera, "matched"),
               cli_json_int(camera, "dropped"), cli_json_int(camera, "late"));
    }
}

static void print_store(JsonObject *store)
{
    g_autofree char *waiting = g_format_size((guint64)cli_json_int(store, "waiting_bytes"));
    g_autofree char *free_bytes = g_format_size((guint64)cli_json_int(store, "disk_free_bytes"));
    double rate = cli_json_double(store, "bytes_per_second");

    printf("disk      %s free, %s wait to be written", free_bytes, waiting);
    if (isfinite(rate) && rate > 0)
        printf(", %.1f MB/s", rate * 1e-6);
    putchar('\n');
    if (cli_json_bool(store, "copy_failed"))
        printf("disk      the second copy is given up: %s\n", cli_json_text(store, "copy_text"));
}

static void print_status(const struct cli_lumid *lumid, JsonObject *status)
{
    printf("lumid     %s at %s\n", cli_json_text(status, "version"), cli_lumid_url(lumid));
    print_capture(cli_json_object(status, "capture"));
    print_rig(cli_json_object(status, "rig"), cli_json_bool(status, "estop"));
    print_cameras(status);
    print_store(cli_json_object(status, "store"));
    cli_print_checks(status, checks);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autofree char *text = NULL;
    struct cli_lumid *lumid;
    JsonNode *root = NULL;
    int code;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_get(lumid, "/api/v1/status", &root, &text, error);
    if (code == LUMI_OK && json)
        puts(text);
    else if (code == LUMI_OK)
        print_status(lumid, json_node_get_object(root));
    if (root)
        json_node_unref(root);
    cli_lumid_close(lumid);
    return code;
}

const struct cli_command cli_capture_status = {
    .name = "capture status",
    .arguments = "",
    .summary = "how the capture, the rig, the cameras and the disk stand",
    .description = "A look, now; 'lumi capture watch' goes on looking. Cameras that are away and checks that are not "
                   "green are always named.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
