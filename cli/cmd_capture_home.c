/* lumi capture home: find the index mark while lumid has the board. */
#include "cli/capture_text.h"

static gboolean json, wind_up;
static int turn;

static const GOptionEntry options[] = {
    {"turn", 0, 0, G_OPTION_ARG_INT, &turn, "the turn of the string that the rig is in (0)", "N"},
    {"wind-up", 0, 0, G_OPTION_ARG_NONE, &wind_up, "instead: all the way up first, so that the turn is found as well",
     NULL},
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = NULL;

    (void)argc;
    (void)argv;
    if (turn < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "--turn: 0 or more");
    body = json_builder_new();
    json_builder_begin_object(body);
    json_builder_set_member_name(body, "turn");
    json_builder_add_int_value(body, turn);
    json_builder_set_member_name(body, "wind_up");
    json_builder_add_boolean_value(body, wind_up);
    json_builder_end_object(body);
    return cli_capture_wish("/api/v1/capture/home", body, json, "lumid looks for the index mark", error);
}

const struct cli_command cli_capture_home = {
    .name = "capture home",
    .arguments = "",
    .summary = "search the index mark, so that the position is known",
    .description =
        "What 'lumi rig home' does where no lumid runs, which holds the board. Also while a capture waits because "
        "nobody knows where the rig is: then 'lumi capture resume' goes on with it. The rig moves.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
