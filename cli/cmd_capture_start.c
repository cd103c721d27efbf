/* lumi capture start: a capture from a plan. */
#include "cli/capture_text.h"
#include "cli/capture_watch.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/mechanism/sweep_plan.h"

#include <math.h>
#include <stdio.h>

static char *name, *title;
static char **overrides;
static gboolean json, watch, preflight;

static const GOptionEntry options[] = {
    {"name", 0, 0, G_OPTION_ARG_STRING, &name, "of the capture's directory (made from date and plan)", "NAME"},
    {"title", 0, 0, G_OPTION_ARG_STRING, &title, "for people, kept in the capture", "TEXT"},
    {"override", 0, 0, G_OPTION_ARG_STRING_ARRAY, &overrides, "this check may be red (may be given again)", "CHECK"},
    {"preflight", 0, 0, G_OPTION_ARG_NONE, &preflight, "only the preflight: every check, and nothing is captured",
     NULL},
    {"watch", 'w', 0, G_OPTION_ARG_NONE, &watch, "then watch until the capture has ended", NULL},
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static void put(JsonBuilder *body, const char *key, const char *value)
{
    if (!value)
        return;
    json_builder_set_member_name(body, key);
    json_builder_add_string_value(body, value);
}

static int make_body(const char *path, JsonBuilder *body, struct lumi_error *error)
{
    uint8_t *plan = NULL;
    size_t size;

    LUMI_TRY(lumi_file_read(path, LUMI_PLAN_TEXT_MAX, &plan, &size, error));
    g_autofree char *text = g_strndup((const char *)plan, size);
    lumi_free(plan);
    if (!g_utf8_validate(text, -1, NULL))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no plan: it is no text", path);
    json_builder_begin_object(body);
    put(body, "plan", text);
    put(body, "name", name);
    put(body, "title", title);
    if (overrides) {
        json_builder_set_member_name(body, "override");
        json_builder_begin_array(body);
        for (int i = 0; overrides[i]; i++)
            json_builder_add_string_value(body, overrides[i]);
        json_builder_end_array(body);
    }
    json_builder_end_object(body);
    return LUMI_OK;
}

static void print_answer(JsonObject *answer, const char *text)
{
    char left[32];

    if (json) {
        puts(text);
        return;
    }
    cli_print_checks(answer, preflight);
    if (preflight || !*cli_json_text(answer, "path"))
        return;
    printf("started: %s, %ld shots, %ld frames", cli_json_text(answer, "path"), cli_json_int(answer, "shots"),
           cli_json_int(answer, "frames"));
    if (isfinite(cli_json_double(answer, "seconds_left"))) {
        cli_duration(cli_json_double(answer, "seconds_left"), left, sizeof left);
        printf(", %s", left);
    }
    putchar('\n');
}

static int start(struct cli_lumid *lumid, const char *path, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = json_builder_new();
    struct cli_watch how = {.json = json};
    g_autofree char *text = NULL;
    JsonNode *answer = NULL;
    int code;

    LUMI_TRY(make_body(path, body, error));
    LUMI_TRY(cli_lumid_post(lumid, preflight ? "/api/v1/capture/preflight" : "/api/v1/capture/start", body, NULL, NULL,
                            error));
    code = cli_capture_await(lumid, &answer, &text, error);
    if (answer) {
        if (!(json && watch))
            print_answer(json_node_get_object(answer), text);
        json_node_unref(answer);
    }
    return code == LUMI_OK && watch ? cli_watch_capture(lumid, &how, error) : code;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct cli_lumid *lumid;
    int code;

    (void)argc;
    if (preflight && watch)
        return lumi_fail(error, LUMI_ERR_ARG, "--preflight has nothing to --watch");
    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = start(lumid, argv[0], error);
    cli_lumid_close(lumid);
    return code;
}

const struct cli_command cli_capture_start = {
    .name = "capture start",
    .arguments = "PLAN",
    .summary = "capture what a plan says",
    .description =
        "PLAN is a file in the form of docs/rig-plan.md ('lumi capture plan' makes one). lumid looks first whether "
        "rig, "
        "cameras and disk are ready (the preflight) and begins only when nothing is red, or what is red is overridden "
        "by name. Returns when the preflight has its verdict; exit status 1 where it is red, with the reasons. The "
        "capture goes on without this program: 'lumi capture watch' looks on.\n\nWith --json: the verdict as one JSON "
        "object; with --watch and --json the events, a line each.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
