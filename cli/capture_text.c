/* What lumid says of a capture, in words for a person. */
#include "cli/capture_text.h"

#include <stdio.h>
#include <string.h>

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
