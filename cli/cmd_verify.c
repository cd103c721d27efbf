/* lumi verify: a capture against its checksums, its rows and its manifests. */
#include "cli/command.h"
#include "proto/capture/capture.h"

#include <json-glib/json-glib.h>
#include <stdio.h>

static gboolean json;

static const GOptionEntry options[] = {
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {NULL, 0, 0, 0, NULL, NULL, NULL},
};

static void on_problem(void *context, const char *file, const char *text)
{
    JsonBuilder *builder = context;

    if (!json) {
        cli_progress_end();
        printf("%s: %s\n", file, text);
        return;
    }
    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "file");
    json_builder_add_string_value(builder, file);
    json_builder_set_member_name(builder, "problem");
    json_builder_add_string_value(builder, text);
    json_builder_end_object(builder);
}

static int on_progress(void *context, int64_t done, int64_t total)
{
    (void)context;
    cli_progress("verify: MB", (long)(done >> 20), (long)(total >> 20));
    return 0;
}

static void print_json(JsonBuilder *builder, const char *path, const struct lumi_verify_result *result,
                       const char *seal)
{
    json_builder_set_member_name(builder, "capture");
    json_builder_add_string_value(builder, path);
    json_builder_set_member_name(builder, "sealed");
    json_builder_add_boolean_value(builder, result->sealed);
    json_builder_set_member_name(builder, "seal");
    json_builder_add_string_value(builder, seal);
    json_builder_set_member_name(builder, "files");
    json_builder_add_int_value(builder, result->files);
    json_builder_set_member_name(builder, "bytes");
    json_builder_add_int_value(builder, result->bytes);
    json_builder_set_member_name(builder, "whole");
    json_builder_add_boolean_value(builder, result->problems == 0);
    json_builder_end_object(builder);
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    json_node_unref(root);
    puts(text);
}

static int run_verify(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_verify_result result;
    char seal[65];

    (void)argc;
    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "problems");
    json_builder_begin_array(builder);
    LUMI_TRY(lumi_capture_verify(argv[0], on_problem, on_progress, builder, &result, error));
    cli_progress_end();
    json_builder_end_array(builder);
    LUMI_TRY(lumi_capture_seal_of(argv[0], seal, error));
    if (json)
        print_json(builder, argv[0], &result, seal);
    if (result.problems)
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %d problem%s in %d files", argv[0], result.problems,
                         result.problems == 1 ? "" : "s", result.files);
    if (!json)
        printf("%s: whole, %s: %d files, %lld bytes\n", argv[0], result.sealed ? "sealed" : "open", result.files,
               (long long)result.bytes);
    if (!json && seal[0])
        printf("seal: %s\n", seal);
    return LUMI_OK;
}

const struct cli_command cli_verify = {
    .name = "verify",
    .arguments = "CAPTURE",
    .summary = "check a capture against its checksums",
    .description =
        "Reads every file of the capture and compares it with the checksum taken when it came in, the rows "
        "of the database with the files, and, where the capture is sealed, all of it with the manifests of "
        "the BagIt bag (RFC 8493).\n\nOf a sealed capture that is whole it prints the seal as well: the SHA-256 of "
        "its tagmanifest-sha256.txt, by which copies are told to be the same (docs/api.md, captures/delete)."
        "\n\nPrints one line a problem and ends with exit status 3 if there is "
        "one.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run_verify,
};
