/* What lumid says of a capture, in words for a person. */
#include "cli/capture_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void cli_duration(double seconds, char *text, size_t size)
{
    long whole = isfinite(seconds) && seconds > 0 ? (long)(seconds + 0.5) : 0;

    if (whole >= 3600)
        snprintf(text, size, "%ld:%02ld h", whole / 3600, whole / 60 % 60);
    else
        snprintf(text, size, "%ld:%02ld min", whole / 60, whole % 60);
}

void cli_capture_line(JsonObject *capture, char *line, size_t size)
{
    g_autoptr(GString) out = g_string_new(cli_json_text(capture, "state"));
    long round = cli_json_int(capture, "round"), lost = cli_json_int(capture, "lost");
    long missing = cli_json_int(capture, "missing"), rejected = cli_json_int(capture, "rejected");
    double left = cli_json_double(capture, "seconds_left");
    char text[32];

    if (round > 0)
        g_string_append_printf(out, ", retakes, round %ld", round);
    if (cli_json_int(capture, "shots"))
        g_string_append_printf(out, ", shot %ld/%ld", cli_json_int(capture, "fired"), cli_json_int(capture, "shots"));
    if (cli_json_int(capture, "frames"))
        g_string_append_printf(out, ", %ld/%ld frames stored",
                               cli_json_int(capture, "stored") + cli_json_int(capture, "accepted") + rejected,
                               cli_json_int(capture, "frames"));
    if (lost)
        g_string_append_printf(out, ", %ld shots lost", lost);
    if (rejected)
        g_string_append_printf(out, ", %ld rejected", rejected);
    if (missing)
        g_string_append_printf(out, ", %ld missing", missing);
    if (isfinite(left) && left > 0) {
        cli_duration(left, text, sizeof text);
        g_string_append_printf(out, ", %s left", text);
    }
    g_strlcpy(line, out->str, size);
}

int cli_print_checks(JsonObject *answer, bool all)
{
    int red = 0;

    for (int i = 0; i < cli_json_count(answer, "checks"); i++) {
        JsonObject *check = cli_json_element(answer, "checks", i);
        const char *verdict = cli_json_text(check, "verdict");
        bool overridden = cli_json_bool(check, "overridden");
        if (!strcmp(verdict, "red") && !overridden)
            red++;
        if (all || strcmp(verdict, "green"))
            printf("%-9s %-14s %s%s\n", verdict, cli_json_text(check, "name"), cli_json_text(check, "reason"),
                   overridden ? " (overridden)" : "");
    }
    return red;
}

int cli_capture_wish(const char *path, JsonBuilder *body, bool json, const char *done, struct lumi_error *error)
{
    g_autofree char *text = NULL;
    struct cli_lumid *lumid;
    JsonNode *root = NULL;
    char line[512];
    int code;

    LUMI_TRY(cli_lumid_open(&lumid, error));
    code = cli_lumid_post(lumid, path, body, &root, &text, error);
    if (code == LUMI_OK && json)
        puts(text);
    else if (code == LUMI_OK) {
        cli_capture_line(json_node_get_object(root), line, sizeof line);
        printf("%s; now: %s\n", done, line);
    }
    if (root)
        json_node_unref(root);
    cli_lumid_close(lumid);
    return code;
}
