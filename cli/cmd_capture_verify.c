/* lumi capture verify: a capture on lumid's disk against its checksums. */
#include "cli/capture_text.h"

#include <stdio.h>
#include <string.h>

#define PATIENCE 60 /* s until a connection that broke is there again */

static gboolean json;

static const GOptionEntry options[] = {
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

struct following {
    const char *name;
    bool good;
    char *text, *data;
};

static bool on_event(void *context, const char *kind, const char *id, const char *data, JsonObject *object)
{
    struct following *f = context;
    const char *state;

    (void)id;
    if (strcmp(kind, "verify") || !object || strcmp(cli_json_text(object, "capture"), f->name))
        return true;
    state = cli_json_text(object, "state");
    if (!strcmp(state, "running")) {
        if (cli_json_int(object, "total") > 0)
            cli_progress("verify: MB", cli_json_int(object, "done") >> 20, cli_json_int(object, "total") >> 20);
        return true;
    }
    f->good = !strcmp(state, "good");
    f->text = g_strdup(cli_json_text(object, "text"));
    f->data = g_strdup(data);
    return false;
}

static int ask(struct cli_lumid *lumid, const char *name, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = json_builder_new();
    JsonNode *root = NULL;

    json_builder_begin_object(body);
    json_builder_set_member_name(body, "capture");
    json_builder_add_string_value(body, name);
    json_builder_end_object(body);
    LUMI_TRY(cli_lumid_post(lumid, "/api/v1/captures/verify", body, &root, NULL, error));
    json_node_unref(root);
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct following f = {.name = argv[0]};
    struct cli_lumid *lumid = NULL;
    int code;

    (void)argc;
    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = ask(lumid, f.name, error);
    if (code == LUMI_OK)
        code = cli_lumid_events(lumid, PATIENCE, on_event, &f, error);
    cli_progress_end();
    if (code == LUMI_OK && json)
        puts(f.data);
    if (code == LUMI_OK && !f.good)
        code = lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %s", f.name, f.text);
    else if (code == LUMI_OK && !json)
        printf("%s: %s\n", f.name, f.text);
    g_free(f.text);
    g_free(f.data);
    cli_lumid_close(lumid);
    return code;
}

const struct cli_command cli_capture_verify = {
    .name = "capture verify",
    .arguments = "NAME",
    .summary = "check a capture on lumid's disk against its checksums",
    .description =
        "What 'lumi verify' does, where the capture is: NAME is that of its directory in lumid's folder. lumid "
        "reads every file of it in a thread of low priority, and keeps what it found. Ends with exit status 3 "
        "where the capture is damaged.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
