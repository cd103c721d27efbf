/* lumi devices: cameras and boards on this computer. */
#include "cli/lumid_client.h"
#include "daemon/camera/camera_device.h"
#include "daemon/rig/stream.h"

#include <stdio.h>
#include <string.h>

#define CAMERAS_MAX 64
#define BOARDS_MAX 8
#define SERIAL_FOLDER "/dev/serial/by-id"

static gboolean json, remote;

static const GOptionEntry options[] = {
    {"ask", 0, 0, G_OPTION_ARG_NONE, &remote, "ask lumid instead: what is on its computer", NULL},
    CLI_LUMID_OPTIONS,
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {0},
};

static void put(JsonBuilder *builder, const char *name, const char *value)
{
    g_autofree char *valid = g_utf8_make_valid(value, -1);

    json_builder_set_member_name(builder, name);
    json_builder_add_string_value(builder, valid);
}

/* The object of /api/v1/devices, made here. */
static void put_cameras(JsonBuilder *builder)
{
    g_autofree struct lumi_camera_identity *cameras = g_new0(struct lumi_camera_identity, CAMERAS_MAX);
    struct lumi_error error = {0};
    int count = lumi_camera_list(cameras, CAMERAS_MAX, &error);

    json_builder_set_member_name(builder, "cameras");
    json_builder_begin_array(builder);
    for (int i = 0; i < count && i < CAMERAS_MAX; i++) {
        json_builder_begin_object(builder);
        put(builder, "backend", lumi_camera_backend_name(cameras[i].backend));
        put(builder, "serial", cameras[i].serial);
        put(builder, "vendor", cameras[i].vendor);
        put(builder, "model", cameras[i].model);
        put(builder, "firmware", cameras[i].firmware);
        put(builder, "address", cameras[i].address);
        json_builder_set_member_name(builder, "hardware_trigger");
        json_builder_add_boolean_value(builder, cameras[i].hardware_trigger);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    put(builder, "cameras_error", count < 0 ? error.text : "");
}

static void put_boards(JsonBuilder *builder)
{
    struct lumi_rig_usb_board boards[BOARDS_MAX];
    struct lumi_error error = {0};
    int count = lumi_rig_usb_list(boards, BOARDS_MAX, &error);

    json_builder_set_member_name(builder, "boards");
    json_builder_begin_array(builder);
    for (int i = 0; i < count && i < BOARDS_MAX; i++) {
        json_builder_begin_object(builder);
        put(builder, "serial", boards[i].serial);
        put(builder, "place", boards[i].place);
        put(builder, "text", boards[i].text);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    put(builder, "boards_error", count < 0 ? error.text : "");
}

static JsonNode *look_here(void)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    put_cameras(builder);
    put_boards(builder);
    json_builder_end_object(builder);
    return json_builder_get_root(builder);
}

static int ask_lumid(JsonNode **root, struct lumi_error *error)
{
    struct cli_lumid *lumid;
    int code;

    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_get(lumid, "/api/v1/devices", root, NULL, error);
    cli_lumid_close(lumid);
    return code;
}

static bool is_doubled(JsonObject *devices, int at)
{
    JsonObject *camera = cli_json_element(devices, "cameras", at);

    for (int i = 0; i < cli_json_count(devices, "cameras"); i++) {
        JsonObject *other = cli_json_element(devices, "cameras", i);
        if (i != at && !strcmp(cli_json_text(camera, "backend"), cli_json_text(other, "backend")) &&
            !strcmp(cli_json_text(camera, "serial"), cli_json_text(other, "serial")))
            return true;
    }
    return false;
}

/* A board on a serial line looks like any adapter: the lines are named, nobody is asked. */
static void print_serial_lines(void)
{
    GDir *folder = g_dir_open(SERIAL_FOLDER, 0, NULL);
    const char *name;

    while (folder && (name = g_dir_read_name(folder)))
        printf("serial   %s/%s (a board? lumi rig status --link serial:...)\n", SERIAL_FOLDER, name);
    if (folder)
        g_dir_close(folder);
}

static void print_text(JsonObject *devices)
{
    for (int i = 0; i < cli_json_count(devices, "cameras"); i++) {
        JsonObject *camera = cli_json_element(devices, "cameras", i);
        printf("camera   %s:%s  %s %s, at %s%s%s\n", cli_json_text(camera, "backend"), cli_json_text(camera, "serial"),
               cli_json_text(camera, "vendor"), cli_json_text(camera, "model"), cli_json_text(camera, "address"),
               cli_json_bool(camera, "hardware_trigger") ? ", trigger by wire" : "",
               is_doubled(devices, i) ? " - ANOTHER CAMERA HAS THIS SERIAL NUMBER" : "");
    }
    if (*cli_json_text(devices, "cameras_error"))
        printf("camera   cannot be listed: %s\n", cli_json_text(devices, "cameras_error"));
    else if (!cli_json_count(devices, "cameras"))
        puts("camera   none found");
    for (int i = 0; i < cli_json_count(devices, "boards"); i++) {
        JsonObject *board = cli_json_element(devices, "boards", i);
        const char *text = cli_json_text(board, "text");
        printf("board    usb:%s  at %s%s%s\n", cli_json_text(board, "serial"), cli_json_text(board, "place"),
               *text ? ": " : "", text);
    }
    if (*cli_json_text(devices, "boards_error"))
        printf("board    cannot be listed: %s\n", cli_json_text(devices, "boards_error"));
    else if (!cli_json_count(devices, "boards"))
        puts("board    none on USB");
}

static void print_left_out(void)
{
    for (int i = 0; i < LUMI_CAMERA_BACKENDS; i++) {
        const char *why = lumi_camera_backend_missing((enum lumi_camera_backend)i);
        if (why)
            printf("not seen cameras through %s: %s\n", lumi_camera_backend_name((enum lumi_camera_backend)i), why);
    }
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    JsonNode *root = NULL;

    (void)argc;
    (void)argv;
    if (remote)
        LUMI_TRY(ask_lumid(&root, error));
    else
        root = look_here();
    if (json) {
        g_autofree char *text = json_to_string(root, FALSE);
        puts(text);
    } else {
        print_text(json_node_get_object(root));
        if (!remote) {
            print_serial_lines();
            print_left_out();
        }
    }
    json_node_unref(root);
    return LUMI_OK;
}

const struct cli_command cli_devices = {
    .name = "devices",
    .arguments = "",
    .summary = "cameras and boards on this computer",
    .description =
        "Every camera that can be seen now, with the address by which lumid.conf names it (BACKEND:SERIAL), and the "
        "rig's boards on USB. Cameras that leave files in a folder are not listed: they are known by the folder. lumid "
        "need not run; --ask asks it instead, for what is on another computer.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
