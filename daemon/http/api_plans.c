/* The rig's profile, plans to begin with, and what a plan comes to before anything turns. */
#include "daemon/http/api_priv.h"
#include "daemon/http/api_report.h"
#include "proto/mechanism/plan_forecast.h"

#include <math.h>
#include <string.h>

#define PROBLEMS_MAX 64

/* False: it is answered. */
static bool know_rig(struct lumi_http *http, struct lumi_api_answer *answer, struct lumi_rig *rig, const char **source)
{
    if (lumi_engine_profile(http->options.engine, rig, source))
        return true;
    lumi_api_problem(
        answer, 409, "busy",
        "no board has said what the rig is: connect it, and set its profile if it has none (lumi rig profile set)");
    return false;
}

static char *rig_text(const struct lumi_rig *rig)
{
    char *text = g_malloc(LUMI_RIG_TEXT_MAX);

    lumi_rig_print(rig, text, LUMI_RIG_TEXT_MAX);
    return text;
}

void lumi_api_get_profile(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    g_autofree struct lumi_rig *rig = g_new0(struct lumi_rig, 1);
    const char *source;
    double radius = 0;

    (void)body;
    if (!know_rig(http, answer, rig, &source))
        return;
    g_autofree char *text = rig_text(rig);
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "name", rig->name);
    lumi_api_put_text(builder, "text", text);
    lumi_api_put_text(builder, "source", source);
    for (int i = 0; i < rig->camera_count; i++)
        radius = fmax(radius, rig->cameras[i].radius);
    lumi_api_put_double(builder, "radius_m", radius);
    lumi_api_put_int(builder, "positions", rig->positions);
    lumi_api_put_int(builder, "turns", rig->turns);
    lumi_api_put_array(builder, "cameras");
    for (int i = 0; i < rig->camera_count; i++)
        json_builder_add_string_value(builder, rig->cameras[i].name);
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

/* ---- plans to begin with ---- */

static const char *title_of(const char *name)
{
    static const char *const titles[][2] = {{"turn", "One sweep, as the rig is meant"},
                                            {"slow", "Twice the time, twice the exposure"},
                                            {"still", "Stands at every position"},
                                            {"hdr", "Stands, three exposures at every position"}};

    for (size_t i = 0; i < G_N_ELEMENTS(titles); i++)
        if (!strcmp(titles[i][0], name))
            return titles[i][1];
    return name;
}

static void put_plan(JsonBuilder *builder, const char *name, const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    char text[LUMI_PLAN_TEXT_MAX];

    lumi_plan_print(plan, rig, text, sizeof text);
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "name", name);
    lumi_api_put_text(builder, "title", title_of(name));
    lumi_api_put_text(builder, "text", text);
    json_builder_end_object(builder);
}

void lumi_api_get_plans(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    g_autofree struct lumi_rig *rig = g_new0(struct lumi_rig, 1);
    struct lumi_plan plan;
    struct lumi_error error;
    const char *source;

    (void)body;
    if (!know_rig(http, answer, rig, &source))
        return;
    json_builder_begin_object(builder);
    lumi_api_put_array(builder, "plans");
    for (int i = 0; lumi_plan_builtin_names[i]; i++)
        if (lumi_plan_builtin(lumi_plan_builtin_names[i], rig, &plan, NULL) == LUMI_OK)
            put_plan(builder, lumi_plan_builtin_names[i], &plan, rig);
    json_builder_end_array(builder);
    lumi_api_put_array(builder, "impossible");
    for (int i = 0; lumi_plan_builtin_names[i]; i++)
        if (lumi_plan_builtin(lumi_plan_builtin_names[i], rig, &plan, &error) != LUMI_OK) {
            json_builder_begin_object(builder);
            lumi_api_put_text(builder, "name", lumi_plan_builtin_names[i]);
            lumi_api_put_text(builder, "title", title_of(lumi_plan_builtin_names[i]));
            lumi_api_put_text(builder, "reason", error.text);
            json_builder_end_object(builder);
        }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

/* ---- checking ---- */

enum { CHECK_PLAN, CHECK_PROFILE };
const struct lumi_api_field lumi_api_check_fields[] = {
    {.name = "plan", .type = LUMI_API_STRING, .required = true, .max = LUMI_PLAN_TEXT_MAX},
    {.name = "profile", .type = LUMI_API_STRING, .max = LUMI_RIG_TEXT_MAX},
    {0},
};

struct check {
    struct lumi_rig rig;
    struct lumi_plan plan;
    struct lumi_plan_problem problems[PROBLEMS_MAX];
    int count;
    double pixel_bytes[LUMI_RIG_CAMERAS];
    struct lumi_plan_forecast forecast;
};

static void add_problem(struct check *check, const char *format, ...) G_GNUC_PRINTF(2, 3);
static void add_problem(struct check *check, const char *format, ...)
{
    va_list list;

    if (check->count >= PROBLEMS_MAX)
        return;
    va_start(list, format);
    g_vsnprintf(check->problems[check->count].text, sizeof check->problems->text, format, list);
    va_end(list);
    check->problems[check->count++].line = 0;
}

static const struct lumi_engine_camera_status *configured(const struct lumi_http *http, const char *name)
{
    for (int i = 0; i < http->status->camera_count; i++)
        if (!strcmp(http->status->cameras[i].name, name))
            return &http->status->cameras[i];
    return NULL;
}

/* As frames of this format come to the disk; JPEG by experience. */
static double bytes_a_pixel(const struct lumi_frame_format *format)
{
    switch (format->layout) {
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
        return format->bits > 8 ? 2 : 1;
    case LUMI_LAYOUT_RGB:
        return 3;
    case LUMI_LAYOUT_JPEG:
    case LUMI_LAYOUT_FILE:
        return 0.3;
    default:
        return 1;
    }
}

/* What lumid would refuse, beside what the rig cannot do. */
static void check_lumid(struct lumi_http *http, struct check *check)
{
    const uint32_t cameras = lumi_plan_cameras(&check->plan, &check->rig);

    if (check->plan.mode == LUMI_PLAN_VIDEO)
        add_problem(check, "a video has no shots to keep account of: film it with lumi rig run, take the films in with "
                           "lumi import");
    for (int i = 0; i < check->rig.camera_count; i++) {
        const struct lumi_engine_camera_status *camera = configured(http, check->rig.cameras[i].name);
        check->pixel_bytes[i] = camera ? bytes_a_pixel(&camera->status.format) : 1;
        if (cameras >> i & 1 && !camera)
            add_problem(check, "camera '%s' of the plan is not configured", check->rig.cameras[i].name);
    }
}

static void put_count(JsonBuilder *builder, const char *name, int count, bool known)
{
    if (known)
        lumi_api_put_int(builder, name, count);
    else
        lumi_api_put_double(builder, name, NAN);
}

static void put_forecast(JsonBuilder *builder, const struct lumi_plan_forecast *f, bool known)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"seconds", f->seconds},
                   {"bytes", f->bytes},
                   {"bytes_per_second", f->bytes_per_second},
                   {"blur_px", f->blur},
                   {"blur_near_px", f->blur_near},
                   {"view_volume_m", f->volume},
                   {"view_volume_height_m", f->volume_height},
                   {"spacing_m", f->spacing},
                   {"nearest_sharp_m", f->nearest}};

    put_count(builder, "shots", f->shots, known);
    put_count(builder, "frames", f->frames, known);
    put_count(builder, "rows", f->rows, known);
    put_count(builder, "columns", f->columns, known);
    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        lumi_api_put_double(builder, numbers[i].name, known ? numbers[i].value : NAN);
}

static void put_check(JsonBuilder *builder, struct lumi_http *http, const struct check *check, bool known)
{
    lumi_api_put_bool(builder, "runnable", check->count == 0);
    lumi_api_put_text(builder, "name", check->plan.name);
    lumi_api_put_array(builder, "problems");
    for (int i = 0; i < check->count && i < PROBLEMS_MAX; i++) {
        json_builder_begin_object(builder);
        put_count(builder, "line", check->problems[i].line, check->problems[i].line > 0);
        lumi_api_put_text(builder, "text", check->problems[i].text);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_array(builder, "warnings");
    if (known && http->status->disk_free_bytes >= 0 && check->forecast.bytes > (double)http->status->disk_free_bytes) {
        g_autofree char *needed = g_format_size((guint64)check->forecast.bytes);
        g_autofree char *there = g_format_size((guint64)http->status->disk_free_bytes);
        g_autofree char *text = g_strdup_printf("it needs some %s on the disk, %s are free", needed, there);
        json_builder_add_string_value(builder, text);
    }
    json_builder_end_array(builder);
    put_count(builder, "turns", check->plan.turns, known);
    put_forecast(builder, &check->forecast, known);
}

void lumi_api_post_check(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    g_autofree struct check *check = g_new0(struct check, 1);
    const char *plan = body->values[CHECK_PLAN].string, *profile = body->values[CHECK_PROFILE].string, *source;
    struct lumi_error error;
    bool known;

    if (profile) {
        int code = lumi_rig_parse(profile, strlen(profile), "the profile", &check->rig, &error);
        if (code != LUMI_OK) {
            lumi_api_problem_of(answer, code, error.text);
            return;
        }
    } else if (!know_rig(http, answer, &check->rig, &source))
        return;
    lumi_engine_status(http->options.engine, http->status);
    check->count = MIN(
        PROBLEMS_MAX, lumi_plan_problems(plan, strlen(plan), &check->rig, &check->plan, check->problems, PROBLEMS_MAX));
    known = check->count == 0;
    if (known) {
        check_lumid(http, check);
        lumi_plan_forecast(&check->plan, &check->rig, check->pixel_bytes, &check->forecast);
    }
    json_builder_begin_object(builder);
    put_check(builder, http, check, known);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}
