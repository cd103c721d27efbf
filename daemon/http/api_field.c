/* The light field so far: how far it has come, and views of it. */
#include "daemon/http/api_priv.h"

#include <string.h>

#define PI 3.14159265358979323846
#define SIZE_LEAST 16

struct lumi_api_field_views {
    struct lumi_http *http;
    struct lumi_field *field; /* the server's thread's */
};

/* ---- how far it is ---- */

static void put_status(JsonBuilder *builder, const struct lumi_field_status *status)
{
    lumi_api_put_int(builder, "frames", status->frames);
    lumi_api_put_int(builder, "rows", status->rows);
    lumi_api_put_int(builder, "views", status->views);
}

static void tell_news(void *context)
{
    struct lumi_api_field_views *views = context;
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_field_status status;

    lumi_field_status(views->field, &status);
    json_builder_begin_object(builder);
    put_status(builder, &status);
    json_builder_end_object(builder);
    lumi_api_events_latest(views->http->events, "field", "", lumi_api_finish(builder));
}

void lumi_api_serve_field(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    struct lumi_api_answer answer = {0};
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_field_status status;

    (void)body;
    lumi_field_status(http->field->field, &status);
    json_builder_begin_object(builder);
    lumi_api_put_bool(builder, "running", status.running);
    put_status(builder, &status);
    lumi_api_put_text(builder, "text", status.text);
    json_builder_end_object(builder);
    lumi_api_answer_json(&answer, 200, builder);
    lumi_api_send(message, &answer);
}

/* ---- views ---- */

/* One who waits for a view. */
struct waiting {
    struct lumi_api_letter letter; /* asks the engine which capture it is */
    struct lumi_http *http;
    SoupServerMessage *message;
    struct lumi_field_gaze gaze;
    char *who;
    char capture[sizeof((struct lumi_engine_status *)0)->capture];
    bool away, gone; /* the letter is; who asked has hung up meanwhile */
};

static void end_waiting(struct waiting *waiting)
{
    g_signal_handlers_disconnect_by_data(waiting->message, waiting);
    g_object_unref(waiting->message);
    g_free(waiting->who);
    g_free(waiting);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    struct waiting *waiting = context;

    (void)message;
    waiting->gone = true;
    if (waiting->away)
        return;
    lumi_field_forget(waiting->http->field->field, waiting);
    end_waiting(waiting);
}

static void send_picture(SoupServerMessage *message, const struct lumi_field_result *result)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);
    g_autofree char *frames = g_strdup_printf("%d", result->frames);

    soup_message_headers_replace(headers, "Cache-Control", "no-store");
    soup_message_headers_replace(headers, "X-Lumid-Frames", frames);
    soup_message_headers_replace(headers, "Content-Type", "image/jpeg");
    soup_server_message_set_status(message, 200, NULL);
    soup_message_body_append_bytes(soup_server_message_get_response_body(message), result->jpeg);
}

static void on_answered(void *context, const struct lumi_field_result *result)
{
    struct waiting *waiting = context;
    SoupServerMessage *message = waiting->message;

    switch (result->outcome) {
    case LUMI_FIELD_DRAWN:
        send_picture(message, result);
        break;
    case LUMI_FIELD_SUPERSEDED:
        lumi_api_send_problem(message, 409, "cancelled", result->text);
        break;
    case LUMI_FIELD_LATE:
        lumi_api_send_problem(message, 503, "busy", result->text);
        break;
    default:
        lumi_api_send_problem(message, 409, "busy", result->text);
    }
    soup_server_message_unpause(message);
    end_waiting(waiting);
}

/* Two who look at once do not push each other's questions out. */
static char *name_of(SoupServerMessage *message, const char *viewer)
{
    GSocketAddress *address = soup_server_message_get_remote_address(message);
    g_autofree char *host = NULL;

    if (G_IS_INET_SOCKET_ADDRESS(address))
        host = g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address)));
    return g_strdup_printf("%s %s", host ? host : "", viewer ? viewer : "");
}

static double real_of(const struct lumi_api_value *value, double otherwise)
{
    return value->given ? value->real : otherwise;
}

/* In the server's thread again. */
static void come_back(struct lumi_api_letter *letter, bool dropped)
{
    struct waiting *waiting = (struct waiting *)letter;

    waiting->away = false;
    if (dropped || waiting->gone)
        end_waiting(waiting);
    else
        lumi_field_ask(waiting->http->field->field, waiting->capture, waiting->who, &waiting->gaze, on_answered,
                       waiting);
}

/* In the engine's. */
static void go_there(struct lumi_api_letter *letter, bool dropped)
{
    struct waiting *waiting = (struct waiting *)letter;
    struct lumi_http *http = waiting->http;

    if (dropped) {
        end_waiting(waiting);
        return;
    }
    lumi_engine_status(http->options.engine, http->status);
    g_strlcpy(waiting->capture, http->status->capture, sizeof waiting->capture);
    letter->read = come_back;
    lumi_api_post_give(http->to_server, letter);
}

void lumi_api_serve_view(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const struct lumi_api_value *values = body->values;
    const struct lumi_field_gaze gaze = {.x = real_of(&values[0], 0),
                                         .y = real_of(&values[1], 0),
                                         .z = real_of(&values[2], 0),
                                         .yaw = real_of(&values[3], 0),
                                         .pitch = real_of(&values[4], 0),
                                         .fov = real_of(&values[5], 70 * PI / 180),
                                         .width = values[6].given ? values[6].number : 640,
                                         .height = values[7].given ? values[7].number : 400};

    if (gaze.width < SIZE_LEAST || gaze.height < SIZE_LEAST) {
        lumi_api_send_problem(message, 400, "argument", "width, height: 16 pixels are the least");
        return;
    }
    struct waiting *waiting = g_new0(struct waiting, 1);
    waiting->letter.read = go_there;
    waiting->http = http;
    waiting->gaze = gaze;
    waiting->who = name_of(message, values[8].string);
    waiting->message = g_object_ref(message);
    waiting->away = true;
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), waiting);
    soup_server_message_pause(message);
    lumi_api_post_give(http->to_engine, &waiting->letter);
}

const struct lumi_api_field lumi_api_view_fields[] = {
    {.name = "x", .type = LUMI_API_NUMBER, .least = -1000, .most = 1000},
    {.name = "y", .type = LUMI_API_NUMBER, .least = -1000, .most = 1000},
    {.name = "z", .type = LUMI_API_NUMBER, .least = -1000, .most = 1000},
    {.name = "yaw", .type = LUMI_API_NUMBER, .least = -1000, .most = 1000},
    {.name = "pitch", .type = LUMI_API_NUMBER, .least = -PI / 2, .most = PI / 2},
    {.name = "fov", .type = LUMI_API_NUMBER, .least = 0.02, .most = 2.9},
    {.name = "width", .type = LUMI_API_INT, .max = 2048},
    {.name = "height", .type = LUMI_API_INT, .max = 2048},
    {.name = "viewer", .type = LUMI_API_STRING, .max = 64},
    {0},
};

/* ---- life ---- */

static void log_line(void *context, const char *text)
{
    (void)context;
    g_printerr("lumid: %s\n", text);
}

int lumi_api_field_create(struct lumi_http *http, struct lumi_api_field_views **views, struct lumi_error *error)
{
    struct lumi_api_field_views *made = g_new0(struct lumi_api_field_views, 1);
    const struct lumi_field_options options = {
        .command = http->options.preview, .context = http->context, .news = tell_news, .log = log_line, .user = made};

    made->http = http;
    *views = made;
    return lumi_field_create(&options, &made->field, error);
}

void lumi_api_field_destroy(struct lumi_api_field_views *views)
{
    if (!views)
        return;
    lumi_field_destroy(views->field);
    g_free(views);
}
