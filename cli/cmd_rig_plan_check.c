/* lumi rig plan check: whether a rig can make such a sweep, and what it comes to. Needs no rig. */
#include "cli/command.h"
#include "cli/rig_files.h"

#include <json-glib/json-glib.h>
#include <stdio.h>

static char *profile;
static gboolean json, print;

static const GOptionEntry options[] = {
    {"profile", 0, 0, G_OPTION_ARG_FILENAME, &profile, "the rig: a file, or arc16, arc16x2, bar2", "PROFILE"},
    {"print", 0, 0, G_OPTION_ARG_NONE, &print, "the whole plan as it is understood, with every default", NULL},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {0},
};

static void add_double(JsonBuilder *builder, const char *name, double value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_double_value(builder, value);
}

static void print_json(const char *name, const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "plan");
    json_builder_add_string_value(builder, name);
    json_builder_set_member_name(builder, "rig");
    json_builder_add_string_value(builder, rig->name);
    json_builder_set_member_name(builder, "shots");
    json_builder_add_int_value(builder, lumi_plan_shots(plan));
    json_builder_set_member_name(builder, "frames");
    json_builder_add_int_value(builder, lumi_plan_frames(plan, rig));
    add_double(builder, "seconds", lumi_plan_seconds(plan, rig));
    add_double(builder, "blur", lumi_plan_blur(plan, rig));
    json_builder_end_object(builder);
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    json_node_unref(root);
    puts(text);
}

static void print_totals(const char *name, const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    long seconds = (long)(lumi_plan_seconds(plan, rig) + 0.5);

    if (plan->mode == LUMI_PLAN_VIDEO)
        printf("%s: a video of %d turn%s", name, plan->turns, plan->turns == 1 ? "" : "s");
    else
        printf("%s: %d shots, %d frames", name, lumi_plan_shots(plan), lumi_plan_frames(plan, rig));
    printf(" in %ld:%02ld min", seconds / 60, seconds % 60);
    if (plan->mode != LUMI_PLAN_START_STOP)
        printf(", at most %.2f pixels of blur", lumi_plan_blur(plan, rig));
    putchar('\n');
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    static char text[LUMI_PLAN_TEXT_MAX];
    struct lumi_plan plan;
    struct lumi_rig rig;

    (void)argc;
    if (!profile)
        return lumi_fail(error, LUMI_ERR_ARG, "--profile PROFILE is missing");
    if (json && print)
        return lumi_fail(error, LUMI_ERR_ARG, "either --json or --print");
    LUMI_TRY(cli_read_rig(profile, &rig, error));
    LUMI_TRY(cli_read_plan(argv[0], &rig, &plan, error));
    if (print) {
        lumi_plan_print(&plan, &rig, text, sizeof text);
        fputs(text, stdout);
    } else if (json)
        print_json(argv[0], &plan, &rig);
    else
        print_totals(argv[0], &plan, &rig);
    return LUMI_OK;
}

const struct cli_command cli_rig_plan_check = {
    .name = "rig plan check",
    .arguments = "PLAN --profile PROFILE",
    .summary = "check the plan of a sweep against a rig; needs no rig",
    .description =
        "Reads the plan (docs/rig-plan.md) and checks what the board would check: whether motor, cameras and "
        "string can do it in its time, and how far pictures smear while the rig turns. Prints shots, frames, "
        "how long the sweep takes, and the blur.\n\nEnds with exit status 3 and one line where the rig "
        "cannot do it.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
