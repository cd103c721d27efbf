/* Watching a capture as lumid takes it. */
#include "cli/capture_watch.h"

#include "cli/capture_text.h"

#include <stdio.h>
#include <string.h>

#define PATIENCE 30.0 /* s without lumid: it may be restarting */

struct watching {
    const struct cli_watch *watch;
    bool begun; /* something has been under way */
    char state[32], text[512];
    bool complete, ended;
    long missing;
};

static bool is_over(const char *state)
{
    return !strcmp(state, "done") || !strcmp(state, "failed") || !strcmp(state, "red") || !strcmp(state, "idle");
}

static void say(JsonObject *event, const char *what, const char *text)
{
    const char *time = cli_json_text(event, "time");
    const char *camera = cli_json_text(event, "camera");

    if (strstr(text, camera)) /* it says so itself */
        camera = "";
    cli_progress_end();
    printf("%.8s  %-9s %s%s%s\n", strlen(time) > 19 ? time + 11 : "        ", what, camera, *camera ? ": " : "", text);
    fflush(stdout);
}

static void say_event(const char *kind, JsonObject *event)
{
    char text[1024];

    if (!strcmp(kind, "state")) {
        snprintf(text, sizeof text, "%s%s%s", cli_json_text(event, "state"), *cli_json_text(event, "text") ? ": " : "",
                 cli_json_text(event, "text"));
        say(event, "state", text);
    } else if (!strcmp(kind, "check")) {
        if (!strcmp(cli_json_text(event, "verdict"), "green"))
            return;
        snprintf(text, sizeof text, "%s %s: %s", cli_json_text(event, "verdict"), cli_json_text(event, "name"),
                 cli_json_text(event, "reason"));
        say(event, "check", text);
    } else if (!strcmp(kind, "incident"))
        say(event, "incident", cli_json_text(event, "text"));
    else if (!strcmp(kind, "sealed"))
        say(event, "sealed", cli_json_text(event, "text"));
    else if (!strcmp(kind, "frame") && !strcmp(cli_json_text(event, "state"), "rejected")) {
        snprintf(text, sizeof text, "shot %ld is rejected: %s", cli_json_int(event, "shot"),
                 cli_json_text(event, "text"));
        say(event, "frame", text);
    } else if (!strcmp(kind, "shot") && cli_json_bool(event, "lost")) {
        snprintf(text, sizeof text, "%ld was lost", cli_json_int(event, "shot"));
        say(event, "shot", text);
    } else if (!strcmp(kind, "gap")) {
        snprintf(text, sizeof text, "%ld events went by unseen", cli_json_int(event, "lost"));
        say(event, "gap", text);
    }
}

/* An operator's terminal gets one line that is redrawn. */
static void draw(JsonObject *progress)
{
    char line[512];

    cli_capture_line(progress, line, sizeof line);
    cli_progress_line(line);
}

static bool take(void *context, const char *kind, const char *id, const char *data, JsonObject *object)
{
    struct watching *watching = context;
    bool progress = !strcmp(kind, "progress");

    if (watching->watch->json) {
        printf("{\"event\":\"%s\",\"id\":\"%s\",\"data\":%s}\n", kind, id, data);
        if (fflush(stdout))
            return false; /* who reads our output has gone */
    } else if (!progress)
        say_event(kind, object);
    if (!progress)
        return true;
    if (!watching->watch->json)
        draw(object);
    g_strlcpy(watching->state, cli_json_text(object, "state"), sizeof watching->state);
    g_strlcpy(watching->text, cli_json_text(object, "text"), sizeof watching->text);
    watching->complete = cli_json_bool(object, "complete");
    watching->missing = cli_json_int(object, "missing") + cli_json_int(object, "rejected");
    watching->ended = is_over(watching->state);
    return watching->watch->follow || !watching->ended;
}

int cli_watch_capture(struct cli_lumid *lumid, const struct cli_watch *watch, struct lumi_error *error)
{
    struct watching watching = {.watch = watch};

    LUMI_TRY(cli_lumid_events(lumid, PATIENCE, take, &watching, error));
    cli_progress_end();
    if (!watching.ended)
        return LUMI_OK;
    if (!strcmp(watching.state, "idle")) {
        if (!watch->json)
            puts("nothing is being captured");
        return LUMI_OK;
    }
    if (strcmp(watching.state, "done"))
        return lumi_fail(error, LUMI_ERR_IO, "%s: %s", watching.state, watching.text);
    if (!watching.complete)
        return lumi_fail(error, LUMI_ERR_IO,
                         "the capture is closed, but %ld frames are missing ('lumi capture retake')", watching.missing);
    if (!watch->json)
        printf("complete: %s\n", watching.text);
    return LUMI_OK;
}

int cli_capture_await(struct cli_lumid *lumid, JsonNode **answer, char **text, struct lumi_error *error)
{
    for (;;) {
        JsonObject *object;
        const char *state;
        char line[512];

        LUMI_TRY(cli_lumid_get(lumid, "/api/v1/capture", answer, text, error));
        object = json_node_get_object(*answer);
        state = cli_json_text(object, "state");
        if (strcmp(state, "preflight")) {
            cli_progress_end();
            if (!strcmp(state, "red") || !strcmp(state, "failed"))
                return lumi_fail(error, LUMI_ERR_IO, "%s", cli_json_text(object, "text"));
            return LUMI_OK;
        }
        snprintf(line, sizeof line, "preflight: %s", cli_json_text(object, "text"));
        cli_progress_line(line);
        g_clear_pointer(answer, json_node_unref);
        g_clear_pointer(text, g_free);
        g_usleep(100000);
    }
}
