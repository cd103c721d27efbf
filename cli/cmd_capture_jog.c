/* lumi capture jog: turn the platform by hand while lumid has the board. */
#include "cli/capture_text.h"

static gboolean json;

static const GOptionEntry options[] = {
    CLI_LUMID_OPTIONS,
    CLI_CAPTURE_JSON_OPTION(json),
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) body = NULL;
    double degrees;

    (void)argc;
    LUMI_TRY(cli_parse_doubles("DEGREES", argv[0], ',', 1, &degrees, error));
    if (!(degrees >= -360 && degrees <= 360) || degrees == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "DEGREES: up to 360 either way, and not 0");
    body = json_builder_new();
    json_builder_begin_object(body);
    json_builder_set_member_name(body, "degrees");
    json_builder_add_double_value(body, degrees);
    json_builder_end_object(body);
    return cli_capture_wish("/api/v1/capture/jog", body, json, "the rig turns", error);
}

const struct cli_command cli_capture_jog = {
    .name = "capture jog",
    .arguments = "DEGREES",
    .summary = "turn the platform by so many degrees",
    .description = "What 'lumi rig jog' does where no lumid runs, which holds the board. A negative number, which "
                   "winds the string "
                   "up, goes after '--': lumi capture jog -- -45. The position must be known (lumi capture home); not "
                   "while a sweep "
                   "goes on. 'lumi capture stop' ends it, 'lumi capture stop --emergency' at once. The rig "
                   "moves.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
