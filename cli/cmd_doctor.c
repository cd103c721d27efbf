/* lumi doctor: is this computer ready for a rig? */
#include "cli/lumid_client.h"
#include "daemon/doctor/doctor.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static char *captures, *config;
static gboolean json, speed, quiet;

static const GOptionEntry options[] = {
    {"captures", 0, 0, G_OPTION_ARG_FILENAME, &captures, "where captures are to be kept (as lumid.conf says)",
     "FOLDER"},
    {"config", 0, 0, G_OPTION_ARG_FILENAME, &config, "lumid's configuration (/etc/lumisphere/lumid.conf)", "FILE"},
    {"speed", 0, 0, G_OPTION_ARG_NONE, &speed, "also how fast the disk is: writes 256 MiB and takes them away", NULL},
    {"quiet", 'q', 0, G_OPTION_ARG_NONE, &quiet, "only what is not green", NULL},
    CLI_LUMID_OPTIONS,
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "one JSON object on standard output", NULL},
    {0},
};

struct report {
    JsonBuilder *builder;
    int counts[3];
};

static void put(JsonBuilder *builder, const char *name, const char *value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_string_value(builder, value);
}

static void take(void *context, const struct lumi_doctor_finding *finding)
{
    struct report *report = context;

    report->counts[finding->verdict]++;
    if (report->builder) {
        json_builder_begin_object(report->builder);
        put(report->builder, "name", finding->name);
        put(report->builder, "verdict", lumi_doctor_verdict_name(finding->verdict));
        put(report->builder, "found", finding->found);
        put(report->builder, "remedy", finding->remedy);
        json_builder_end_object(report->builder);
    } else if (!quiet || finding->verdict != LUMI_DOCTOR_GREEN) {
        printf("%-7s %-19s %s\n", lumi_doctor_verdict_name(finding->verdict), finding->name, finding->found);
        if (*finding->remedy && finding->verdict != LUMI_DOCTOR_GREEN)
            printf("%-27s > %s\n", "", finding->remedy);
    }
}

/* Whether lumid answers, and is of the same version. */
static int ask_lumid(struct report *report, struct lumi_error *error)
{
    struct lumi_doctor_finding finding = {.name = "lumid"};
    struct lumi_error why;
    struct cli_lumid *lumid;
    JsonNode *root = NULL;
    int code;

    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_get(lumid, "/api/v1/status", &root, NULL, &why);
    if (code != LUMI_OK) {
        finding.verdict = code == LUMI_ERR_IO ? LUMI_DOCTOR_YELLOW : LUMI_DOCTOR_RED;
        snprintf(finding.found, sizeof finding.found, "%.500s", why.text);
        if (code == LUMI_ERR_IO)
            snprintf(finding.remedy, sizeof finding.remedy, "systemctl enable --now lumid; journalctl -u lumid");
    } else {
        JsonObject *status = json_node_get_object(root);
        const char *version = cli_json_text(status, "version");
        bool same = !strcmp(version, LUMI_VERSION);
        finding.verdict = same ? LUMI_DOCTOR_GREEN : LUMI_DOCTOR_YELLOW;
        snprintf(finding.found, sizeof finding.found, "version %.40s at %.200s, %.40s", version, cli_lumid_url(lumid),
                 cli_json_text(cli_json_object(status, "capture"), "state"));
        if (!same)
            snprintf(finding.remedy, sizeof finding.remedy, "this is lumi %s: systemctl restart lumid", LUMI_VERSION);
        json_node_unref(root);
    }
    cli_lumid_close(lumid);
    take(report, &finding);
    return LUMI_OK;
}

static int examine(struct report *report, struct lumi_error *error)
{
    struct lumi_doctor_options how;

    lumi_doctor_options_init(&how);
    how.captures = captures;
    how.speed = speed;
    how.unix_s = time(NULL);
    how.user = getuid();
    if (config)
        how.config = config;
    lumi_doctor_run(&how, take, report);
    return ask_lumid(report, error);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autoptr(JsonBuilder) builder = json ? json_builder_new() : NULL;
    struct report report = {.builder = builder};

    (void)argc;
    (void)argv;
    if (builder) {
        json_builder_begin_object(builder);
        json_builder_set_member_name(builder, "findings");
        json_builder_begin_array(builder);
    }
    LUMI_TRY(examine(&report, error));
    if (builder) {
        json_builder_end_array(builder);
        json_builder_set_member_name(builder, "yellow");
        json_builder_add_int_value(builder, report.counts[LUMI_DOCTOR_YELLOW]);
        json_builder_set_member_name(builder, "red");
        json_builder_add_int_value(builder, report.counts[LUMI_DOCTOR_RED]);
        json_builder_end_object(builder);
        JsonNode *root = json_builder_get_root(builder);
        g_autofree char *text = json_to_string(root, FALSE);
        json_node_unref(root);
        puts(text);
    }
    if (report.counts[LUMI_DOCTOR_RED])
        return lumi_fail(error, LUMI_ERR_IO, "%d red: a capture cannot be made like this",
                         report.counts[LUMI_DOCTOR_RED]);
    return LUMI_OK;
}

const struct cli_command cli_doctor = {
    .name = "doctor",
    .arguments = "",
    .summary = "is this computer ready for a rig",
    .description =
        "Looks at what was built in, at boards and cameras, at what this user may open, at network, disk, memory and "
        "clock, at lumid's configuration, and whether lumid answers. A line each: green, yellow (it may work, or it "
        "may "
        "not matter), red (it will not), and below it what to do. Nothing is changed, but for --speed.\n\nExit status "
        "1 "
        "where something is red.\n\n" CLI_LUMID_WHERE,
    .options = options,
    .run = run,
};
