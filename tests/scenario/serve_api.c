/* The API over an engine that only says what a script makes it say, for the command line's tests.
 * usage: serve_api ENDING PORT_FILE [TOKEN [CERTIFICATE]]   ENDING: complete, missing, red
 * Every wish is taken; a start makes preflight, a sweep of 8 shots with an incident, and the ending. */
#include "daemon/http/api_server.h"
#include "tests/unit/engine_double.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

static struct lumi_http *http;
static const char *ending;
static int step = -1;

static int64_t now_ns(void *context)
{
    struct timespec time;

    (void)context;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static bool emergency_stop(void *context)
{
    (void)context;
    return true;
}

static void tell(enum lumi_engine_tale kind, int shot, const char *text)
{
    static uint64_t number;
    struct lumi_engine_told told = {.kind = kind,
                                    .number = ++number,
                                    .state = engine_double.status.state,
                                    .shot = shot,
                                    .camera = kind == LUMI_TALE_INCIDENT ? 0 : -1};

    told.unix_us = 1700000000000000 + (int64_t)number * 1000;
    snprintf(told.text, sizeof told.text, "%s", text);
    lumi_http_told(http, &told);
}

static void enter(enum lumi_engine_state state, const char *text)
{
    engine_double.status.state = state;
    snprintf(engine_double.status.text, sizeof engine_double.status.text, "%.500s", text);
    tell(LUMI_TALE_STATE, -1, text);
}

static void finish(struct lumi_engine_status *status)
{
    status->seconds_left = NAN;
    if (!strcmp(ending, "missing")) {
        status->accepted = 7;
        status->planned = 0;
        status->missing = engine_double.missing_count = 1;
        snprintf(engine_double.missing[0].frame, sizeof engine_double.missing[0].frame, "c00-t00-p007");
        snprintf(engine_double.missing[0].reason, sizeof engine_double.missing[0].reason, "the camera was away");
    } else
        status->complete = true;
    tell(LUMI_TALE_SEALED, -1, status->capture);
    enter(LUMI_ENGINE_DONE, status->capture);
}

static gboolean tick(void *context)
{
    struct lumi_engine_status *status = &engine_double.status;

    (void)context;
    if (step < 0) {
        if (strcmp(engine_double.call, "start"))
            return G_SOURCE_CONTINUE;
        step = 0;
        return G_SOURCE_CONTINUE;
    }
    step++;
    if (step == 3 && !strcmp(ending, "red") && !engine_double.has_override) {
        status->checks[0].verdict = LUMI_RED;
        snprintf(status->checks[0].reason, sizeof status->checks[0].reason, "the board does not answer");
        enter(LUMI_ENGINE_RED, "link: the board does not answer");
        engine_double.call[0] = '\0';
        step = -1;
    } else if (step == 3) {
        snprintf(status->capture, sizeof status->capture, "/captures/%s", engine_double.name);
        status->shots = status->frames = status->planned = 8;
        enter(LUMI_ENGINE_SWEEPING, "");
    } else if (step > 3 && step <= 11) {
        status->fired++;
        status->planned--;
        status->accepted++;
        status->seconds_left = 11 - step;
        tell(LUMI_TALE_SHOT, step - 4, "");
        if (step == 6)
            tell(LUMI_TALE_INCIDENT, 2, "a frame came late");
    } else if (step == 12)
        finish(status);
    return G_SOURCE_CONTINUE;
}

int main(int argc, char **argv)
{
    g_autoptr(GMainLoop) loop = g_main_loop_new(NULL, FALSE);
    g_autofree char *text = NULL;
    struct lumi_http_options options;
    struct lumi_error error;

    if (argc < 3)
        return 2;
    ending = argv[1];
    engine_double_reset();
    lumi_http_options_init(&options);
    options.listen = "localhost:0";
    options.token = argc > 3 ? argv[3] : NULL;
    options.token_everywhere = true;
    options.certificate = argc > 4 ? argv[4] : NULL;
    options.engine = engine_double_engine();
    options.now_ns = now_ns;
    options.emergency_stop = emergency_stop;
    if (lumi_http_start(&options, &http, &error) != LUMI_OK) {
        fprintf(stderr, "serve_api: %s\n", error.text);
        return 1;
    }
    g_timeout_add(50, tick, NULL);
    text = g_strdup_printf("%d\n", lumi_http_port(http));
    if (!g_file_set_contents(argv[2], text, -1, NULL)) /* appears whole */
        return 1;
    g_main_loop_run(loop);
    return 0;
}
