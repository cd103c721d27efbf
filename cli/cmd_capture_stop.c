/* lumi capture stop: end the sweep. */
#include "cli/capture_text.h"

#include <stdio.h>

static gboolean json, at_once, keep_open, emergency;

static const GOptionEntry options[] = {
    {"now", 0, 0, G_OPTION_ARG_NONE, &at_once, "slow down at once, not at the next position", NULL},
    {"keep-open", 0, 0, G_OPTION_ARG_NONE, &keep_open,
     "leave the capture open: 'lumi capture retake' takes what is missing", NULL},
    {"emergency", 0, 0, G_OPTION_ARG_NONE, &emergency, "an emergency stop: motor off, by every way there is", NULL},
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static int stop_now(struct lumi_error *error)
{
    g_autofree char *text = NULL;
    struct cli_lumid *lumid;
    JsonNode *root = NULL;
    int code;

    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_post(lumid, "/api/v1/capture/emergency-stop", NULL, &root, &text, error);
    if (code == LUMI_OK && json)
        puts(text);
    else if (code == LUMI_OK)
        puts(json_object_get_boolean_member_with_default(json_node_get_object(root), "sent", FALSE)
                 ? "emergency stop: it has gone to the board"
                 : "emergency stop: the board is away; it is stopped when it comes back. Use the switch at the rig");
    if (root)
        json_node_unref(root);
    cli_lumid_close(lumid);
    return code;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = NULL;

    (void)argc;
    (void)argv;
    if (emergency && (at_once || keep_open))
        return lumi_fail(error, LUMI_ERR_ARG, "--emergency goes with neither --now nor --keep-open");
    if (emergency)
        return stop_now(error);
    body = json_builder_new();
    json_builder_begin_object(body);
    json_builder_set_member_name(body, "at_once");
    json_builder_add_boolean_value(body, at_once);
    json_builder_set_member_name(body, "seal");
    json_builder_add_boolean_value(body, !keep_open);
    json_builder_end_object(body);
    return cli_capture_wish("/api/v1/capture/stop", body, json,
                            keep_open ? "lumid stops; the capture stays open"
                                      : "lumid stops and closes the capture with what is there",
                            error);
}

const struct cli_command cli_capture_stop = {
    .name = "capture stop",
    .arguments = "",
    .summary = "end the sweep",
    .description =
        "The capture is closed as incomplete, its missing frames named; 'lumi capture retake' opens it again. "
        "With --keep-open it stays open. After --emergency the motor is off and 'lumi capture clear' "
        "releases it.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
