/* lumi pair: let a phone in. */
#include "cli/lumid_client.h"
#include "daemon/access/qr.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static char *role;
static gboolean json;

static const GOptionEntry options[] = {
    {"role", 0, 0, G_OPTION_ARG_STRING, &role, "what the phone may: watch or operate (operate)", "ROLE"},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "print one JSON object, lumid's", NULL},
    CLI_LUMID_OPTIONS,
    {0},
};

static const char *text_of(JsonNode *root, const char *name)
{
    return json_object_get_string_member_with_default(json_node_get_object(root), name, "");
}

static int print(JsonNode *root, struct lumi_error *error)
{
    g_autofree char *square = NULL;
    const char *url = text_of(root, "url");

    LUMI_TRY(lumi_qr_terminal(url, isatty(STDOUT_FILENO), &square, error));
    printf("%s\naddress      %.*s\ncode         %s   (once, within 5 minutes; role %s)\nfingerprint  %s\n\n"
           "The phone says that it does not know this certificate: compare the fingerprint, once, and go on.\n",
           square, (int)strcspn(url, "#"), url, text_of(root, "code"), text_of(root, "role"),
           text_of(root, "fingerprint"));
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = json_builder_new();
    struct cli_lumid *lumid = NULL;
    g_autofree char *text = NULL;
    JsonNode *root = NULL;

    (void)argc;
    (void)argv;
    json_builder_begin_object(body);
    json_builder_add_string_value(json_builder_set_member_name(body, "role"), role ? role : "operate");
    json_builder_end_object(body);
    LUMI_TRY(cli_lumid_open(&lumid, error));
    int code = cli_lumid_post(lumid, "/api/v1/session/pair", body, &root, &text, error);
    if (code == LUMI_OK && json)
        puts(text);
    else if (code == LUMI_OK)
        code = print(root, error);
    if (root)
        json_node_unref(root);
    cli_lumid_close(lumid);
    return code;
}

const struct cli_command cli_pair = {
    .name = "pair",
    .arguments = "",
    .summary = "let a phone use the rig: a code to scan or to type",
    .description = "Prints the rig's address, a code, and both as a square that the phone's camera reads. The code "
                   "lets in one phone, once, within five minutes; there must be a user already (lumi user "
                   "add).\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
