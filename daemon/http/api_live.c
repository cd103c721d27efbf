/* Live previews: multipart/x-mixed-replace, a JPEG a part (RFC 2046, 5.1; what browsers show as a moving picture since
 * Netscape 1.1). Who watches has at most one picture on its way: whoever is slow misses pictures and costs no memory;
 * who takes nothing for half a minute is hung up on. */
#include "daemon/http/api_priv.h"

#include <string.h>

#define BOUNDARY "lumid-picture"
#define WATCHERS 64
#define TICK_MS 1000
#define PATIENCE_NS (30 * 1000000000LL)

struct watcher {
    struct lumi_api_live *live;
    SoupServerMessage *message;
    int camera;
    uint64_t seen; /* number of the picture that it was given last */
    bool busy;     /* one is on its way */
    int64_t written_ns;
};

struct lumi_api_live {
    struct lumi_http *http;
    GPtrArray *watchers;
    GSource *tick;
};

static int64_t now(const struct lumi_api_live *live)
{
    return live->http->options.now_ns(live->http->options.context);
}

static void give(struct watcher *watcher, const void *data, size_t size)
{
    SoupMessageBody *body = soup_server_message_get_response_body(watcher->message);

    soup_message_body_append(body, SOUP_MEMORY_COPY, data, size);
    watcher->busy = true;
    soup_server_message_unpause(watcher->message);
}

/* The boundary stands behind each picture, so that it is known to be whole, and shown, at once. */
static void pump(struct watcher *watcher)
{
    struct lumi_pictures *pictures = watcher->live->http->options.pictures;
    struct lumi_picture *picture = watcher->busy ? NULL : lumi_pictures_last(pictures, watcher->camera);
    g_autoptr(GString) part = NULL;

    if (!picture || picture->number == watcher->seen) {
        lumi_picture_release(picture);
        return;
    }
    watcher->seen = picture->number;
    part = g_string_sized_new(picture->size + 128);
    g_string_append_printf(part, "Content-Type: image/jpeg\r\nContent-Length: %zu\r\n\r\n", picture->size);
    g_string_append_len(part, (const char *)picture->jpeg, (gssize)picture->size);
    g_string_append(part, "\r\n--" BOUNDARY "\r\n");
    lumi_picture_release(picture);
    give(watcher, part->str, part->len);
}

void lumi_api_live_picture(struct lumi_api_live *live, int camera)
{
    for (guint i = 0; i < live->watchers->len; i++) {
        struct watcher *watcher = live->watchers->pdata[i];
        if (watcher->camera == camera)
            pump(watcher);
    }
}

/* ---- who comes and goes ---- */

static void look_after(struct watcher *watcher)
{
    GSocket *socket = lumi_api_socket(watcher->message);

    if (!socket ||
        (!lumi_api_has_hung_up(socket) && !(watcher->busy && now(watcher->live) - watcher->written_ns > PATIENCE_NS)))
        return;
    g_socket_shutdown(socket, TRUE, TRUE, NULL);
    if (!watcher->busy)
        give(watcher, "\r\n", 2); /* fails, and the message is finished */
}

static gboolean on_tick(void *context)
{
    struct lumi_api_live *live = context;

    if (!live->watchers->len) {
        lumi_api_drop(&live->tick);
        return G_SOURCE_REMOVE;
    }
    for (guint i = 0; i < live->watchers->len; i++)
        look_after(live->watchers->pdata[i]);
    return G_SOURCE_CONTINUE;
}

static void on_wrote_chunk(SoupServerMessage *message, void *context)
{
    struct watcher *watcher = context;

    (void)message;
    watcher->busy = false;
    watcher->written_ns = now(watcher->live);
    pump(watcher);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    struct watcher *watcher = context;

    g_signal_handlers_disconnect_by_data(message, watcher);
    g_ptr_array_remove_fast(watcher->live->watchers, watcher);
}

static void free_watcher(void *data)
{
    struct watcher *watcher = data;

    lumi_pictures_watch(watcher->live->http->options.pictures, watcher->camera, false);
    g_object_unref(watcher->message);
    g_free(watcher);
}

static void begin(struct lumi_api_live *live, SoupServerMessage *message, int camera)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);
    struct watcher *watcher = g_new0(struct watcher, 1);

    *watcher =
        (struct watcher){.live = live, .message = g_object_ref(message), .camera = camera, .written_ns = now(live)};
    lumi_api_guard_spare(live->http->guard, message); /* look_after instead */
    soup_server_message_set_status(message, 200, NULL);
    soup_message_headers_replace(headers, "Content-Type", "multipart/x-mixed-replace; boundary=" BOUNDARY);
    soup_message_headers_replace(headers, "Cache-Control", "no-store");
    soup_message_headers_set_encoding(headers, SOUP_ENCODING_CHUNKED);
    soup_message_body_set_accumulate(soup_server_message_get_response_body(message), FALSE);
    g_signal_connect(message, "wrote-chunk", G_CALLBACK(on_wrote_chunk), watcher);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), watcher);
    g_ptr_array_add(live->watchers, watcher);
    lumi_pictures_watch(live->http->options.pictures, camera, true);
    give(watcher, "--" BOUNDARY "\r\n", strlen("--" BOUNDARY "\r\n"));
    if (!live->tick)
        live->tick = lumi_api_attach(g_timeout_source_new(TICK_MS), G_PRIORITY_DEFAULT, on_tick, live);
}

void lumi_api_serve_live(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const int camera = http->options.pictures ? lumi_pictures_camera(http->options.pictures, body->part) : -1;

    if (camera < 0)
        lumi_api_send_problem(message, 404, "notfound", "there is no camera of this name");
    else if (http->live->watchers->len >= WATCHERS)
        lumi_api_send_problem(message, 503, "limit", "too many watch the cameras already");
    else
        begin(http->live, message, camera);
}

/* ---- life ---- */

struct lumi_api_live *lumi_api_live_create(struct lumi_http *http)
{
    struct lumi_api_live *made = g_new0(struct lumi_api_live, 1);

    made->http = http;
    made->watchers = g_ptr_array_new_with_free_func(free_watcher);
    return made;
}

void lumi_api_live_destroy(struct lumi_api_live *live)
{
    if (!live)
        return;
    lumi_api_drop(&live->tick);
    for (guint i = 0; i < live->watchers->len; i++) {
        struct watcher *watcher = live->watchers->pdata[i];
        g_signal_handlers_disconnect_by_data(watcher->message, watcher);
    }
    g_ptr_array_unref(live->watchers);
    g_free(live);
}
