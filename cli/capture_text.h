/* What lumid says of a capture, in words for a person. */
#ifndef LUMI_CLI_CAPTURE_TEXT_H
#define LUMI_CLI_CAPTURE_TEXT_H

#include "cli/lumid_client.h"

/* One line: "sweeping, shot 31/72, 480/1152 frames stored, 2 missing, 0:17 left". `capture`: a Capture. */
void cli_capture_line(JsonObject *capture, char *line, size_t size);
/* "0:17 min", "1:02 h" */
void cli_duration(double seconds, char *text, size_t size);
/* The checks of a preflight, a line each; `all`: the green ones too. Returns how many are red and not overridden. */
int cli_print_checks(JsonObject *answer, bool all);
/* Simple wishes (pause, resume, …): asks, and prints what lumid says. */
int cli_capture_wish(const char *path, JsonBuilder *body, bool json, const char *done, struct lumi_error *error);

#define CLI_CAPTURE_JSON_OPTION(variable)                                                                              \
    {                                                                                                                  \
        "json", 0, 0, G_OPTION_ARG_NONE, &(variable), "one JSON object on standard output", NULL                       \
    }

#endif
