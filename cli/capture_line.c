/* A capture in one line. */
#include "cli/capture_text.h"

#include <math.h>
#include <stdio.h>

#define DURATION_MAX (999 * 3600.0)

void cli_duration(double seconds, char *text, size_t size)
{
    long whole = seconds > 0 ? (long)(fmin(seconds, DURATION_MAX) + 0.5) : 0;

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
