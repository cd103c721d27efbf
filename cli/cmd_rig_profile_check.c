/* lumi rig profile check: whether such a rig can be. Needs no rig. */
#include "cli/command.h"
#include "cli/rig_files.h"
#include "proto/mechanism/kinematics.h"

#include <json-glib/json-glib.h>
#include <stdio.h>

static gboolean json, print;

static const GOptionEntry options[] = {
    {"print", 0, 0, G_OPTION_ARG_NONE, &print, "the whole profile as it is understood, with every default", NULL},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {0},
};

static int print_text(const struct lumi_rig *rig)
{
    static char text[LUMI_RIG_TEXT_MAX];

    lumi_rig_print(rig, text, sizeof text);
    fputs(text, stdout);
    return LUMI_OK;
}

static void print_json(const char *name, const struct lumi_rig *rig)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "profile");
    json_builder_add_string_value(builder, name);
    json_builder_set_member_name(builder, "name");
    json_builder_add_string_value(builder, rig->name);
    json_builder_set_member_name(builder, "cameras");
    json_builder_add_int_value(builder, rig->camera_count);
    json_builder_set_member_name(builder, "positions");
    json_builder_add_int_value(builder, rig->positions);
    json_builder_set_member_name(builder, "turns");
    json_builder_add_int_value(builder, rig->turns);
    json_builder_set_member_name(builder, "rows");
    json_builder_add_int_value(builder, lumi_rig_rows(rig));
    json_builder_set_member_name(builder, "steps_per_turn");
    json_builder_add_double_value(builder, lumi_rig_steps_per_turn(rig));
    json_builder_end_object(builder);
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    json_node_unref(root);
    puts(text);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig rig;

    (void)argc;
    if (json && print)
        return lumi_fail(error, LUMI_ERR_ARG, "either --json or --print");
    LUMI_TRY(cli_read_rig(argv[0], &rig, error));
    if (print)
        return print_text(&rig);
    if (json)
        print_json(argv[0], &rig);
    else
        printf("%s: %s, %d camera%s, %d turn%s of %d positions, %d rows, %g steps a turn\n", argv[0], rig.name,
               rig.camera_count, rig.camera_count == 1 ? "" : "s", rig.turns, rig.turns == 1 ? "" : "s", rig.positions,
               lumi_rig_rows(&rig), lumi_rig_steps_per_turn(&rig));
    return LUMI_OK;
}

const struct cli_command cli_rig_profile_check = {
    .name = "rig profile check",
    .arguments = "PROFILE",
    .summary = "check a rig profile; needs no rig",
    .description = "Reads the profile and checks what the board would check: ratios, string, cameras, wiring, limits, "
                   "and what is done when something goes wrong. PROFILE is a file (docs/rig-profile.md) or one of "
                   "arc16, arc16x2 and bar2; --print writes it whole, which is how a profile of one's own is begun.\n\n"
                   "Ends with exit status 3 and one line where such a rig cannot be.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
