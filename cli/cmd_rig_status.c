/* lumi rig status: what the board says of itself and of the rig. */
#include "cli/rig_link.h"

#include <inttypes.h>
#include <json-glib/json-glib.h>
#include <stdio.h>
#include <stdlib.h>

static char *address;
static gboolean json;

static const GOptionEntry options[] = {CLI_RIG_LINK_OPTION(address), CLI_RIG_JSON_OPTION(json), {0}};

static const char *const input_names[] = {"estop", "index", "slack", "string-end", "wound", "driver-fault", "reached"};
#define INPUTS (int)(sizeof input_names / sizeof input_names[0])
#define DEGREES (180 / 3.14159265358979323846)

static const char *name_of(lumi_wire_State state)
{
    const char *name = lumi_wire_state_name(state);

    return name ? name : "unknown";
}

static void add_bool(JsonBuilder *builder, const char *name, bool value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_boolean_value(builder, value);
}

static void add_int(JsonBuilder *builder, const char *name, int64_t value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_int_value(builder, value);
}

static void add_double(JsonBuilder *builder, const char *name, double value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_double_value(builder, value == value ? value : 0);
}

static void add_string(JsonBuilder *builder, const char *name, const char *value)
{
    json_builder_set_member_name(builder, name);
    json_builder_add_string_value(builder, value);
}

static void add_names(JsonBuilder *builder, const char *name, uint32_t bits, const char *const *names, int count)
{
    json_builder_set_member_name(builder, name);
    json_builder_begin_array(builder);
    for (int i = 0; i < count; i++)
        if (bits >> i & 1)
            json_builder_add_string_value(builder, names[i]);
    json_builder_end_array(builder);
}

static void add_status(JsonBuilder *builder, const lumi_wire_Status *status)
{
    add_string(builder, "state", name_of(status->state));
    add_names(builder, "faults", status->faults, lumi_rig_fault_names, LUMI_RIG_FAULTS);
    add_names(builder, "inputs", status->inputs, input_names, INPUTS);
    add_bool(builder, "position_known", status->position_known);
    add_bool(builder, "turn_known", status->turn_known);
    add_int(builder, "step", status->step);
    add_double(builder, "pitch", status->pitch);
    add_double(builder, "speed", status->speed);
    add_bool(builder, "enabled", status->enabled);
    add_bool(builder, "brake_open", status->brake_open);
    add_double(builder, "supply_v", status->supply_mv * 1e-3);
    add_int(builder, "profile_crc", status->profile_crc);
    add_int(builder, "plan_crc", status->plan_crc);
    add_int(builder, "next_shot", status->next_shot);
    add_int(builder, "shots_fired", status->shots_fired);
    add_int(builder, "shots_lost", status->shots_lost);
    add_int(builder, "events_next", status->events_next);
    add_int(builder, "events_lost", status->events_lost);
}

static void print_json(const struct lumi_rig_link_snapshot *link, const lumi_wire_Status *status)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    char id[2 * sizeof link->welcome.unique_id.bytes + 1] = "";

    for (int i = 0; i < link->welcome.unique_id.size; i++)
        snprintf(id + 2 * i, 3, "%02x", link->welcome.unique_id.bytes[i]);
    json_builder_begin_object(builder);
    add_string(builder, "link", link->name);
    add_string(builder, "board", link->welcome.board);
    add_string(builder, "unique_id", id);
    add_string(builder, "firmware", link->welcome.firmware);
    add_int(builder, "protocol", link->welcome.version);
    add_status(builder, status);
    if (link->clock_matched) {
        add_int(builder, "clock_offset_ns", link->clock_offset_ns);
        add_double(builder, "round_trip_ns", link->round_trip_ns);
    }
    json_builder_end_object(builder);
    JsonNode *root = json_builder_get_root(builder);
    g_autofree char *text = json_to_string(root, FALSE);
    json_node_unref(root);
    puts(text);
}

static void print_text(const struct lumi_rig_link_snapshot *link, const lumi_wire_Status *status)
{
    char faults[256];
    bool any = false;

    printf("board     %s at %s, firmware %s, protocol %u\n", link->welcome.board, link->name, link->welcome.firmware,
           (unsigned)link->welcome.version);
    printf("state     %s\n", name_of(status->state));
    if (status->position_known)
        printf("position  step %" PRId64 ", pitch %.3f deg\n", (int64_t)status->step, status->pitch * DEGREES);
    else
        printf("position  unknown: lumi rig home\n");
    printf("faults    %s\n", lumi_rig_fault_text(status->faults, faults, sizeof faults));
    printf("inputs   ");
    for (int i = 0; i < INPUTS; i++)
        if (status->inputs >> i & 1) {
            printf(" %s", input_names[i]);
            any = true;
        }
    printf("%s\nmotor     %s, brake %s, %.1f V\n", any ? "" : " none active", status->enabled ? "on" : "off",
           status->brake_open ? "open" : "closed", status->supply_mv * 1e-3);
    if (!status->profile_crc)
        printf("profile   none: lumi rig profile set\n");
    if (status->plan_crc)
        printf("sweep     %u fired, %u lost, next is shot %u\n", (unsigned)status->shots_fired,
               (unsigned)status->shots_lost, (unsigned)status->next_shot);
    if (link->clock_matched)
        printf("clock     %.6f s %s the host's, round trip %.2f ms\n",
               (double)llabs((long long)link->clock_offset_ns) * 1e-9,
               link->clock_offset_ns < 0 ? "behind" : "ahead of", link->round_trip_ns * 1e-6);
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_link_snapshot snapshot;
    struct lumi_rig_link *link;
    lumi_wire_Status status;
    int code;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_rig_open(address, &link, error));
    code = lumi_rig_bench_status(link, &status, error);
    lumi_rig_link_snapshot(link, &snapshot);
    if (code == LUMI_OK && json)
        print_json(&snapshot, &status);
    else if (code == LUMI_OK)
        print_text(&snapshot, &status);
    lumi_rig_link_close(link);
    return code;
}

const struct cli_command cli_rig_status = {
    .name = "rig status",
    .arguments = "",
    .summary = "what the rig's board says of itself",
    .description = "Only looks: a sweep that is going on, and the host that watches it, do not notice.",
    .options = options,
    .run = run,
};
