/* lumi capture retake: missing and rejected frames again. */
#include "cli/capture_text.h"

#include <stdio.h>

static gboolean json, list;
static char *capture;

static const GOptionEntry options[] = {
    {"capture", 0, 0, G_OPTION_ARG_STRING, &capture, "another than the last one, also one that is sealed", "NAME"},
    {"list", 0, 0, G_OPTION_ARG_NONE, &list, "only say which frames are missing or rejected, and why", NULL},
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static void print_missing(JsonObject *answer)
{
    long count = cli_json_int(answer, "count");
    int shown = cli_json_count(answer, "missing");

    if (!count)
        puts("no frame is missing");
    for (int i = 0; i < shown; i++) {
        JsonObject *frame = cli_json_element(answer, "missing", i);
        printf("%-20s %-10s %s\n", cli_json_text(frame, "frame"), cli_json_text(frame, "state"),
               cli_json_text(frame, "reason"));
    }
    if (count > shown)
        printf("and %ld more\n", count - shown);
}

static int print_list(struct lumi_error *error)
{
    g_autofree char *text = NULL;
    struct cli_lumid *lumid;
    JsonNode *root = NULL;
    int code;

    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_get(lumid, "/api/v1/missing", &root, &text, error);
    if (code == LUMI_OK && json)
        puts(text);
    else if (code == LUMI_OK)
        print_missing(json_node_get_object(root));
    if (root)
        json_node_unref(root);
    cli_lumid_close(lumid);
    return code;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = NULL;

    if (list)
        return argc || capture ? lumi_fail(error, LUMI_ERR_ARG, "--list goes with neither FRAME nor --capture")
                               : print_list(error);
    body = json_builder_new();
    json_builder_begin_object(body);
    if (capture) {
        json_builder_set_member_name(body, "capture");
        json_builder_add_string_value(body, capture);
    }
    if (argc) {
        json_builder_set_member_name(body, "frames");
        json_builder_begin_array(body);
        for (int i = 0; i < argc; i++)
            json_builder_add_string_value(body, argv[i]);
        json_builder_end_array(body);
    }
    json_builder_end_object(body);
    return cli_capture_wish("/api/v1/capture/retake", body, json, "lumid takes them again", error);
}

const struct cli_command cli_capture_retake = {
    .name = "capture retake",
    .arguments = "[FRAME...]",
    .summary = "take frames again that are missing or rejected",
    .description =
        "Without FRAME all that are missing or rejected; with it those that are named, whatever became of "
        "them. lumid does so by itself at the end of a sweep, as often as its configuration says; this is for "
        "afterwards.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .max_arguments = -1,
    .run = run,
};
