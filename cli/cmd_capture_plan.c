/* lumi capture plan: plans to begin with, and what a plan comes to. Needs neither rig nor lumid. */
#include "cli/capture_text.h"
#include "cli/rig_files.h"
#include "proto/mechanism/plan_forecast.h"

#include <stdio.h>
#include <string.h>

static char *profile;
static gboolean json, print;
static double pixel_bytes = 1;

static const GOptionEntry options[] = {
    {"profile", 0, 0, G_OPTION_ARG_FILENAME, &profile, "the rig: a file, or arc16, arc16x2, bar2", "PROFILE"},
    {"print", 0, 0, G_OPTION_ARG_NONE, &print, "the whole plan as text, with every default, to be kept in a file",
     NULL},
    {"pixel-bytes", 0, 0, G_OPTION_ARG_DOUBLE, &pixel_bytes,
     "bytes a pixel takes on the disk: 1 for raw 8 bits (the default), 2 for raw 10 to 16 bits, about 0.3 for JPEG",
     "N"},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {0},
};

static void forecast(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_plan_forecast *totals)
{
    double bytes[LUMI_RIG_CAMERAS];

    for (int i = 0; i < LUMI_RIG_CAMERAS; i++)
        bytes[i] = pixel_bytes;
    lumi_plan_forecast(plan, rig, bytes, totals);
}

static const char *mode_name(enum lumi_plan_mode mode)
{
    static const char *const names[] = {"continuous", "start-stop", "video"};

    return names[mode];
}

static void put_json(JsonBuilder *builder, const char *name, const struct lumi_plan *plan,
                     const struct lumi_plan_forecast *totals)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"seconds", totals->seconds},
                   {"blur", totals->blur},
                   {"bytes", totals->bytes},
                   {"bytes_per_second", totals->bytes_per_second},
                   {"blur_near", totals->blur_near},
                   {"view_volume_m", totals->volume},
                   {"view_volume_height_m", totals->volume_height},
                   {"nearest_sharp_m", totals->nearest}};

    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "plan");
    json_builder_add_string_value(builder, name);
    json_builder_set_member_name(builder, "mode");
    json_builder_add_string_value(builder, mode_name(plan->mode));
    json_builder_set_member_name(builder, "shots");
    json_builder_add_int_value(builder, totals->shots);
    json_builder_set_member_name(builder, "frames");
    json_builder_add_int_value(builder, totals->frames);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        json_builder_set_member_name(builder, numbers[i].name);
        json_builder_add_double_value(builder, numbers[i].value);
    }
    json_builder_end_object(builder);
}

static void print_builder(JsonBuilder *builder)
{
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);

    json_node_unref(root);
    puts(text);
}

static void print_row(const char *name, const struct lumi_plan *plan, const struct lumi_plan_forecast *totals)
{
    g_autofree char *bytes = g_format_size((guint64)totals->bytes);
    char time[32];

    cli_duration(totals->seconds, time, sizeof time);
    printf("%-8s %-11s %6d %7d %10s %10s %8.1f MB/s %5.2f px %5.2f m %6.2f m\n", name, mode_name(plan->mode),
           totals->shots, totals->frames, time, bytes, totals->bytes_per_second * 1e-6, totals->blur, totals->volume,
           totals->nearest);
}

static void print_head(void)
{
    printf("%-8s %-11s %6s %7s %10s %10s %13s %8s %7s %8s\n", "plan", "mode", "shots", "frames", "time", "disk", "",
           "blur", "volume", "nearest");
}

/* All there are, each with what it comes to for this rig or why it cannot be. */
static int print_all(const struct lumi_rig *rig, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_error why;
    struct lumi_plan_forecast totals;
    struct lumi_plan plan;

    (void)error;
    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "rig");
    json_builder_add_string_value(builder, rig->name);
    json_builder_set_member_name(builder, "plans");
    json_builder_begin_array(builder);
    if (!json)
        print_head();
    for (int i = 0; lumi_plan_builtin_names[i]; i++) {
        const char *name = lumi_plan_builtin_names[i];
        if (lumi_plan_builtin(name, rig, &plan, &why) != LUMI_OK) {
            if (!json)
                printf("%-8s not with this rig: %s\n", name, why.text);
            continue;
        }
        forecast(&plan, rig, &totals);
        if (json)
            put_json(builder, name, &plan, &totals);
        else
            print_row(name, &plan, &totals);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    if (json)
        print_builder(builder);
    else
        printf("\nlumi capture plan turn --profile %s --print >FILE   keeps one of them, to be changed\n", profile);
    return LUMI_OK;
}

static int read_plan(const char *name, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    int code = cli_read_plan(name, rig, plan, error);

    if (code == LUMI_ERR_NOTFOUND && lumi_plan_builtin(name, rig, plan, NULL) != LUMI_ERR_NOTFOUND)
        return lumi_plan_builtin(name, rig, plan, error);
    return code;
}

static int print_one(const char *name, const struct lumi_rig *rig, struct lumi_error *error)
{
    static char text[LUMI_PLAN_TEXT_MAX];
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_plan plan;
    struct lumi_plan_forecast totals;

    LUMI_TRY(read_plan(name, rig, &plan, error));
    forecast(&plan, rig, &totals);
    if (print) {
        lumi_plan_print(&plan, rig, text, sizeof text);
        fputs(text, stdout);
    } else if (json) {
        put_json(builder, name, &plan, &totals);
        print_builder(builder);
    } else {
        print_head();
        print_row(plan.name, &plan, &totals);
    }
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig rig;

    if (!profile)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "--profile PROFILE is missing ('lumi rig profile get' reads the board's)");
    if (json && print)
        return lumi_fail(error, LUMI_ERR_ARG, "either --json or --print");
    if (print && !argc)
        return lumi_fail(error, LUMI_ERR_ARG, "--print wants a PLAN");
    if (!(pixel_bytes > 0 && pixel_bytes <= 16))
        return lumi_fail(error, LUMI_ERR_ARG, "--pixel-bytes: a number above 0 and at most 16 wanted");
    LUMI_TRY(cli_read_rig(profile, &rig, error));
    return argc ? print_one(argv[0], &rig, error) : print_all(&rig, error);
}

const struct cli_command cli_capture_plan = {
    .name = "capture plan",
    .arguments = "[PLAN] --profile PROFILE",
    .summary = "what a plan comes to; plans to begin with",
    .description =
        "PLAN is a file in the form of docs/rig-plan.md, or one of the plans to begin with: turn (one continuous "
        "sweep, "
        "as the rig is meant), slow (twice its time and exposure), still (stands at every position), hdr (the same "
        "with "
        "three exposures). Prints shots, frames, how long the sweep takes, what it needs on the disk and how fast, and "
        "how far pictures smear at the sphere's equator; the radius within which every view is there; and how near to "
        "the "
        "cameras things may be to be rendered sharp (proto/mechanism/plan_forecast.h has the formulas). Without PLAN a "
        "line for each of the plans to begin with.\n\n"
        "Ends with exit status 3 and one line where the rig cannot do it. Nothing is asked of rig or lumid.",
    .options = options,
    .max_arguments = 1,
    .run = run,
};
