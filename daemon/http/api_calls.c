/* What can be asked: the table of routes, and everything that is answered at once. */
#include "daemon/http/api_priv.h"
#include "daemon/http/api_report.h"

#include <string.h>

#define MISSING_MAX 4096
#define LIST_MAX 256

static void answer_capture(struct lumi_http *http, struct lumi_api_answer *answer, unsigned status)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    lumi_engine_status(http->options.engine, http->status);
    json_builder_begin_object(builder);
    lumi_api_capture(builder, http->status);
    lumi_api_checks(builder, http->status);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, status, builder);
}

void lumi_api_answer_wish(struct lumi_http *http, struct lumi_api_answer *answer, int code,
                          const struct lumi_error *error)
{
    if (code == LUMI_OK)
        answer_capture(http, answer, 202);
    else
        lumi_api_problem_of(answer, code, error->text);
}

static int64_t now(struct lumi_http *http)
{
    return http->options.now_ns(http->options.context);
}

static void get_status(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    (void)body;
    lumi_engine_status(http->options.engine, http->status);
    json_builder_begin_object(builder);
    lumi_api_status(builder, http->status);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

static void get_capture(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    (void)body;
    answer_capture(http, answer, 200);
}

enum { START_PLAN, START_NAME, START_TITLE, START_OVERRIDE };
static const struct lumi_api_field start_fields[] = {
    {.name = "plan", .type = LUMI_API_STRING, .required = true, .max = LUMI_PLAN_TEXT_MAX},
    {.name = "name", .type = LUMI_API_STRING, .max = LUMI_API_STRING_MAX},
    {.name = "title", .type = LUMI_API_STRING, .max = LUMI_API_STRING_MAX},
    {.name = "override", .type = LUMI_API_STRINGS, .max = LUMI_ENGINE_CHECKS},
    {0},
};

static void start(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body, bool only)
{
    const char *plan = body->values[START_PLAN].string;
    struct lumi_engine_start wanted = {
        .name = body->values[START_NAME].string,
        .title = body->values[START_TITLE].string,
        .override = (const char *const *)body->values[START_OVERRIDE].strings,
        .preflight_only = only,
    };
    struct lumi_error error;
    int code = lumi_engine_start(http->options.engine, now(http), plan, strlen(plan), &wanted, &error);

    lumi_api_answer_wish(http, answer, code, &error);
}

static void post_start(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    start(http, answer, body, false);
}

static void post_preflight(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    start(http, answer, body, true);
}

static const struct lumi_api_field no_fields[] = {{0}};

static void post_pause(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;

    (void)body;
    lumi_api_answer_wish(http, answer, lumi_engine_pause(http->options.engine, now(http), &error), &error);
}

static void post_resume(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;

    (void)body;
    lumi_api_answer_wish(http, answer, lumi_engine_resume(http->options.engine, now(http), &error), &error);
}

static const struct lumi_api_field stop_fields[] = {
    {.name = "at_once", .type = LUMI_API_BOOL},
    {.name = "seal", .type = LUMI_API_BOOL, .initially = true},
    {0},
};

static void post_stop(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;
    int code =
        lumi_engine_stop(http->options.engine, now(http), body->values[0].boolean, body->values[1].boolean, &error);

    lumi_api_answer_wish(http, answer, code, &error);
}

static const struct lumi_api_field retake_fields[] = {
    {.name = "capture", .type = LUMI_API_STRING, .max = 1023},
    {.name = "frames", .type = LUMI_API_STRINGS, .max = LUMI_PLAN_SHOTS_MAX},
    {0},
};

static void post_retake(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;
    int code = lumi_engine_retake(http->options.engine, now(http), body->values[0].string,
                                  (const char *const *)body->values[1].strings, &error);

    lumi_api_answer_wish(http, answer, code, &error);
}

static void post_clear(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;

    (void)body;
    lumi_api_answer_wish(http, answer, lumi_engine_clear(http->options.engine, now(http), &error), &error);
}

static const struct lumi_api_field home_fields[] = {
    {.name = "turn", .type = LUMI_API_INT, .max = 10000},
    {.name = "wind_up", .type = LUMI_API_BOOL},
    {0},
};

static void post_home(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;
    int code =
        lumi_engine_home(http->options.engine, now(http), body->values[0].number, body->values[1].boolean, &error);

    lumi_api_answer_wish(http, answer, code, &error);
}

struct stop_letter {
    struct lumi_api_letter letter;
    struct lumi_http *http;
};

static void tell_stop(struct lumi_api_letter *letter, bool dropped)
{
    struct lumi_http *http = ((struct stop_letter *)letter)->http;

    if (!dropped)
        lumi_engine_emergency_stop(http->options.engine, now(http));
    g_free(letter);
}

/* The board first, from this thread; the engine is told when it gets round to it. */
static void serve_emergency_stop(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    bool sent = http->options.emergency_stop(http->options.context);
    struct stop_letter *letter = g_new0(struct stop_letter, 1);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_api_answer answer = {0};

    (void)body;
    letter->letter.read = tell_stop;
    letter->http = http;
    lumi_api_post_give(http->to_engine, &letter->letter);
    json_builder_begin_object(builder);
    lumi_api_put_bool(builder, "sent", sent);
    json_builder_end_object(builder);
    lumi_api_answer_json(&answer, 202, builder);
    lumi_api_send(message, &answer);
}

static void get_missing(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autofree struct lumi_engine_missing *list = g_new0(struct lumi_engine_missing, MISSING_MAX);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    int count = lumi_engine_missing(http->options.engine, list, MISSING_MAX);

    (void)body;
    json_builder_begin_object(builder);
    lumi_api_put_int(builder, "count", count);
    lumi_api_put_array(builder, "missing");
    for (int i = 0; i < count && i < MISSING_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_missing(builder, &list[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

static void get_processing(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autofree struct lumi_process_status *list = g_new0(struct lumi_process_status, LIST_MAX);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    int count = http->options.handover ? lumi_handover_list(http->options.handover, list, LIST_MAX) : 0;

    (void)body;
    json_builder_begin_object(builder);
    lumi_api_put_bool(builder, "configured", http->options.handover && http->options.processes);
    lumi_api_put_array(builder, "processing");
    for (int i = 0; i < count && i < LIST_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_processing(builder, &list[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

static const struct lumi_api_field process_fields[] = {
    {.name = "capture", .type = LUMI_API_STRING, .required = true, .max = 1023},
    {.name = "again", .type = LUMI_API_BOOL},
    {0},
};

/* A name is that of a capture in lumid's folder, as the list of captures has it; otherwise it is a path. */
static void post_processing(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    const char *given = body->values[0].string;
    g_autofree char *path = strchr(given, '/') || !http->options.folder
                                ? g_strdup(given)
                                : g_build_filename(http->options.folder, given, NULL);
    struct lumi_error error;
    int code;

    if (!http->options.handover) {
        lumi_api_problem(answer, 409, "busy", "the configuration names no processing command");
        return;
    }
    code = lumi_handover_give(http->options.handover, path, body->values[1].boolean, &error);
    if (code != LUMI_OK)
        lumi_api_problem_of(answer, code, error.text);
    else {
        get_processing(http, answer, body);
        answer->status = 202;
    }
}

static void get_ingest(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autofree struct lumi_ingest_status *list = g_new0(struct lumi_ingest_status, LIST_MAX);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    int count = http->options.ingest ? lumi_ingest_list(http->options.ingest, list, LIST_MAX) : 0;

    (void)body;
    json_builder_begin_object(builder);
    lumi_api_put_bool(builder, "configured", http->options.ingest != NULL);
    lumi_api_put_array(builder, "ingest");
    for (int i = 0; i < count && i < LIST_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_ingest(builder, &list[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

static void get_metrics(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    (void)body;
    lumi_engine_status(http->options.engine, http->status);
    lumi_api_answer(answer, 200, "text/plain; version=0.0.4; charset=utf-8", lumi_api_metrics(http->status));
}

static void get_openapi(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    (void)http;
    (void)body;
    lumi_api_answer(answer, 200, "application/json", g_strdup(lumi_api_openapi));
}

const struct lumi_api_route lumi_api_routes[] = {
    {"/api/v1/status", "GET", LUMI_API_WATCH, NULL, get_status, NULL},
    {"/api/v1/devices", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_devices},
    {"/api/v1/capture", "GET", LUMI_API_WATCH, NULL, get_capture, NULL},
    {"/api/v1/capture/preflight", "POST", LUMI_API_OPERATE, start_fields, post_preflight, NULL},
    {"/api/v1/capture/start", "POST", LUMI_API_OPERATE, start_fields, post_start, NULL},
    {"/api/v1/capture/pause", "POST", LUMI_API_OPERATE, no_fields, post_pause, NULL},
    {"/api/v1/capture/resume", "POST", LUMI_API_OPERATE, no_fields, post_resume, NULL},
    {"/api/v1/capture/stop", "POST", LUMI_API_OPERATE, stop_fields, post_stop, NULL},
    {"/api/v1/capture/retake", "POST", LUMI_API_OPERATE, retake_fields, post_retake, NULL},
    {"/api/v1/capture/clear", "POST", LUMI_API_OPERATE, no_fields, post_clear, NULL},
    {"/api/v1/capture/home", "POST", LUMI_API_OPERATE, home_fields, post_home, NULL},
    {"/api/v1/capture/jog", "POST", LUMI_API_OPERATE, lumi_api_jog_fields, lumi_api_post_jog, NULL},
    {"/api/v1/capture/frames", "GET", LUMI_API_WATCH, NULL, lumi_api_get_frames, NULL},
    {"/api/v1/capture/emergency-stop", "POST", LUMI_API_WATCH, no_fields, NULL, serve_emergency_stop},
    {"/api/v1/captures", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_captures},
    {"/api/v1/captures/{name}/thumbnail.jpg", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_thumbnail},
    {"/api/v1/captures/{name}/bundle.tar", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_bundle},
    {"/api/v1/captures/verify", "POST", LUMI_API_OPERATE, lumi_api_verify_fields, lumi_api_see_verify,
     lumi_api_serve_verify},
    {"/api/v1/captures/delete", "POST", LUMI_API_OPERATE, lumi_api_delete_fields, lumi_api_see_delete,
     lumi_api_serve_delete},
    {"/api/v1/profile", "GET", LUMI_API_WATCH, NULL, lumi_api_get_profile, NULL},
    {"/api/v1/plans", "GET", LUMI_API_WATCH, NULL, lumi_api_get_plans, NULL},
    {"/api/v1/plans/check", "POST", LUMI_API_WATCH, lumi_api_check_fields, lumi_api_post_check, NULL},
    {"/api/v1/missing", "GET", LUMI_API_WATCH, NULL, get_missing, NULL},
    {"/api/v1/processing", "GET", LUMI_API_WATCH, NULL, get_processing, NULL},
    {"/api/v1/processing", "POST", LUMI_API_OPERATE, process_fields, post_processing, NULL},
    {"/api/v1/ingest", "GET", LUMI_API_WATCH, NULL, get_ingest, NULL},
    {"/api/v1/events", "GET", LUMI_API_WATCH, NULL, lumi_api_see_events, lumi_api_serve_events},
    {"/api/v1/cameras", "GET", LUMI_API_WATCH, NULL, lumi_api_get_cameras, NULL},
    {"/api/v1/cameras/{name}/last.jpg", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_last},
    {"/api/v1/cameras/{name}/live", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_live},
    {"/api/v1/field", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_field},
    {"/api/v1/field/view.jpg", "GET", LUMI_API_WATCH, lumi_api_view_fields, NULL, lumi_api_serve_view},
    {"/metrics", "GET", LUMI_API_WATCH, NULL, get_metrics, NULL},
    {"/", "GET", LUMI_API_ANYBODY, NULL, NULL, lumi_api_serve_page},
    {"/page/{name}", "GET", LUMI_API_ANYBODY, NULL, NULL, lumi_api_serve_page},
    {"/api/v1/session", "GET", LUMI_API_ANYBODY, NULL, NULL, lumi_api_serve_session},
    {"/api/v1/session/login", "POST", LUMI_API_ANYBODY, lumi_api_login_fields, NULL, lumi_api_serve_login},
    {"/api/v1/session/logout", "POST", LUMI_API_WATCH, no_fields, NULL, lumi_api_serve_logout},
    {"/api/v1/session/pair", "POST", LUMI_API_OPERATE, lumi_api_pair_fields, NULL, lumi_api_serve_pair},
    {"/api/v1/session/revoke", "POST", LUMI_API_OPERATE, lumi_api_revoke_fields, NULL, lumi_api_serve_revoke},
    {"/api/v1/session/people", "GET", LUMI_API_WATCH, NULL, NULL, lumi_api_serve_people},
    {"/openapi.json", "GET", LUMI_API_WATCH, NULL, get_openapi, NULL},
    {0},
};
