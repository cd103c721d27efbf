/* lumi user list: who may use the rig. */
#include "cli/access_files.h"

#include <json-glib/json-glib.h>
#include <stdio.h>

static gboolean json;

static const GOptionEntry options[] = {
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "print one JSON object", NULL}, CLI_USERS_OPTION, {0}};

static void print_json(const struct lumi_users *users)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    json_builder_begin_array(json_builder_set_member_name(builder, "users"));
    for (int i = 0; i < users->count; i++) {
        json_builder_begin_object(builder);
        json_builder_add_string_value(json_builder_set_member_name(builder, "name"), users->user[i].name);
        json_builder_add_string_value(json_builder_set_member_name(builder, "role"),
                                      lumi_role_name(users->user[i].role));
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    g_autoptr(JsonNode) root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    puts(text);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autofree struct lumi_users *users = g_new0(struct lumi_users, 1);
    g_autofree char *path = NULL;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_users_load(users, &path, error));
    if (json)
        print_json(users);
    for (int i = 0; i < users->count && !json; i++)
        printf("%-7s  %s\n", lumi_role_name(users->user[i].role), users->user[i].name);
    return LUMI_OK;
}

const struct cli_command cli_user_list = {
    .name = "user list",
    .arguments = "",
    .summary = "list who may use the rig from a browser",
    .description = "The role, and the name.",
    .options = options,
    .run = run,
};
