/* The cameras' last pictures: figures, files, and who is told that there is a new one. */
#include "daemon/http/api_priv.h"

#include <math.h>
#include <stdatomic.h>

#define TOLD_NS 1000000000LL /* from one event of a camera to the next, at least */
#define LATE_MS 250          /* those that had to wait are looked for so often */

struct lumi_api_pictures {
    struct lumi_http *http;
    atomic_uint fresh; /* a bit a camera: on its way to the server's thread; a letter is, too */
    /* In the server's thread. */
    uint32_t due; /* a bit a camera: to be told, and not yet */
    int64_t told_ns[LUMI_PICTURES_CAMERAS];
    GSource *late;
};

/* ---- figures ---- */

void lumi_api_picture(JsonBuilder *builder, struct lumi_pictures *pictures, const struct lumi_picture *picture)
{
    lumi_api_put_text(builder, "frame", picture->frame);
    if (picture->shot >= 0)
        lumi_api_put_int(builder, "shot", picture->shot);
    else
        lumi_api_put_double(builder, "shot", NAN);
    lumi_api_put_time(builder, "time", picture->unix_us);
    lumi_api_put_int(builder, "number", (int64_t)picture->number);
    lumi_api_put_int(builder, "width", picture->width);
    lumi_api_put_int(builder, "height", picture->height);
    lumi_api_put_double(builder, "sharpness", lumi_pictures_sharpness_of(pictures, picture));
    lumi_api_put_double(builder, "mean", picture->mean);
    lumi_api_put_double(builder, "clipped_low", picture->clipped_low);
    lumi_api_put_double(builder, "clipped_high", picture->clipped_high);
    lumi_api_put_array(builder, "histogram");
    for (int i = 0; i < LUMI_PICTURE_BINS; i++)
        json_builder_add_int_value(builder, picture->histogram[i]);
    json_builder_end_array(builder);
}

static void put_last(JsonBuilder *builder, struct lumi_pictures *pictures, int camera)
{
    struct lumi_picture *picture = pictures ? lumi_pictures_last(pictures, camera) : NULL;

    json_builder_set_member_name(builder, "last");
    if (!picture) {
        json_builder_add_null_value(builder);
        return;
    }
    json_builder_begin_object(builder);
    lumi_api_picture(builder, pictures, picture);
    json_builder_end_object(builder);
    lumi_picture_release(picture);
}

static void put_live(JsonBuilder *builder, struct lumi_http *http, int camera)
{
    struct lumi_error error = {0};
    const bool live = http->options.pictures && lumi_engine_look_check(http->options.engine, camera, &error) == LUMI_OK;

    lumi_api_put_bool(builder, "live", live);
    lumi_api_put_text(builder, "text", error.text);
}

void lumi_api_get_cameras(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    const struct lumi_engine_status *status = http->status;
    g_autoptr(JsonBuilder) builder = json_builder_new();

    (void)body;
    lumi_engine_status(http->options.engine, http->status);
    json_builder_begin_object(builder);
    lumi_api_put_array(builder, "cameras");
    for (int c = 0; c < status->camera_count; c++) {
        const struct lumi_engine_camera_status *camera = &status->cameras[c];
        json_builder_begin_object(builder);
        lumi_api_put_text(builder, "name", camera->name);
        lumi_api_put_bool(builder, "there", camera->there);
        put_live(builder, http, c);
        put_last(builder, http->options.pictures, c);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(answer, 200, builder);
}

/* ---- files ---- */

static void release(void *picture)
{
    lumi_picture_release(picture);
}

GBytes *lumi_api_picture_bytes(struct lumi_picture *picture)
{
    return g_bytes_new_with_free_func(picture->jpeg, picture->size, release, picture);
}

void lumi_api_serve_last(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);
    const int camera = http->options.pictures ? lumi_pictures_camera(http->options.pictures, body->part) : -1;
    struct lumi_picture *picture = camera < 0 ? NULL : lumi_pictures_last(http->options.pictures, camera);

    if (!picture) {
        lumi_api_send_problem(message, 404, "notfound",
                              camera < 0 ? "there is no camera of this name" : "it has taken no picture yet");
        return;
    }
    g_autofree char *number = g_strdup_printf("%" G_GUINT64_FORMAT, picture->number);
    g_autoptr(GBytes) bytes = lumi_api_picture_bytes(picture);
    soup_message_headers_replace(headers, "Cache-Control", "no-store");
    soup_message_headers_replace(headers, "X-Lumid-Picture", number);
    soup_message_headers_replace(headers, "Content-Type", "image/jpeg");
    soup_server_message_set_status(message, 200, NULL);
    soup_message_body_append_bytes(soup_server_message_get_response_body(message), bytes);
}

/* ---- who is told ---- */

static void tell(struct lumi_api_pictures *pictures, int camera, int64_t now)
{
    struct lumi_http *http = pictures->http;
    struct lumi_picture *picture = lumi_pictures_last(http->options.pictures, camera);
    const char *name = lumi_pictures_name(http->options.pictures, camera);
    g_autoptr(JsonBuilder) builder = NULL;

    pictures->due &= ~(1u << camera);
    if (!picture)
        return;
    pictures->told_ns[camera] = now;
    builder = json_builder_new();
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "camera", name);
    lumi_api_picture(builder, http->options.pictures, picture);
    json_builder_end_object(builder);
    lumi_picture_release(picture);
    lumi_api_events_latest(http->events, "picture", name, lumi_api_finish(builder));
}

static void tell_due(struct lumi_api_pictures *pictures)
{
    const int64_t now = pictures->http->options.now_ns(pictures->http->options.context);

    for (int c = 0; c < LUMI_PICTURES_CAMERAS; c++)
        if (pictures->due & 1u << c && (!pictures->told_ns[c] || now - pictures->told_ns[c] >= TOLD_NS))
            tell(pictures, c, now);
}

static gboolean on_late(void *context)
{
    struct lumi_api_pictures *pictures = context;

    tell_due(pictures);
    if (pictures->due)
        return G_SOURCE_CONTINUE;
    lumi_api_drop(&pictures->late);
    return G_SOURCE_REMOVE;
}

struct fresh_letter {
    struct lumi_api_letter letter;
    struct lumi_api_pictures *pictures;
};

static void take_fresh(struct lumi_api_letter *letter, bool dropped)
{
    struct lumi_api_pictures *pictures = ((struct fresh_letter *)letter)->pictures;

    g_free(letter);
    if (dropped)
        return;
    const uint32_t fresh = atomic_exchange(&pictures->fresh, 0);
    pictures->due |= fresh;
    for (int c = 0; c < LUMI_PICTURES_CAMERAS; c++)
        if (fresh & 1u << c)
            lumi_api_live_picture(pictures->http->live, c);
    tell_due(pictures);
    if (pictures->due && !pictures->late)
        pictures->late = lumi_api_attach(g_timeout_source_new(LATE_MS), G_PRIORITY_DEFAULT, on_late, pictures);
}

/* In a thread of the pictures': one letter, however many come before it is read. */
static void on_made(void *context, int camera)
{
    struct lumi_api_pictures *pictures = context;
    struct fresh_letter *letter;

    if (atomic_fetch_or(&pictures->fresh, 1u << camera) != 0)
        return;
    letter = g_new0(struct fresh_letter, 1);
    letter->letter.read = take_fresh;
    letter->pictures = pictures;
    lumi_api_post_give(pictures->http->to_server, &letter->letter);
}

/* ---- life ---- */

struct lumi_api_pictures *lumi_api_pictures_create(struct lumi_http *http)
{
    struct lumi_api_pictures *made = g_new0(struct lumi_api_pictures, 1);

    made->http = http;
    if (http->options.pictures)
        lumi_pictures_listen(http->options.pictures, on_made, made);
    return made;
}

void lumi_api_pictures_silence(struct lumi_api_pictures *pictures)
{
    if (pictures && pictures->http->options.pictures)
        lumi_pictures_listen(pictures->http->options.pictures, NULL, NULL);
}

void lumi_api_pictures_destroy(struct lumi_api_pictures *pictures)
{
    if (pictures)
        lumi_api_drop(&pictures->late);
    g_free(pictures);
}
