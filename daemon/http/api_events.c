/* Server-sent events (HTML Living Standard, 9.2). Every event is kept once, in a ring; who listens has a place in it
 * and at most one block on its way, so that a client that does not read costs nothing however long it sleeps: it is
 * told how many it missed ("gap"), and hung up on when it takes nothing for a minute.
 *
 * An event's id is "EPOCH-NUMBER". The epoch is another for every start of the program: who comes back with one of an
 * earlier start gets all that is kept. "progress" (a Capture) has no id: only the newest is worth having; likewise what
 * lumi_api_events_latest tells, of which the newest is kept for every name. */
#define _GNU_SOURCE /* POLLRDHUP */
#include "daemon/http/api_priv.h"
#include "daemon/http/api_report.h"

#include <inttypes.h>
#include <poll.h>
#include <string.h>

#define RING 2048
#define BLOCK_BYTES 32768
#define TICK_MS 500
#define PING_NS (15 * 1000000000LL)
#define PATIENCE_NS (60 * 1000000000LL)

struct event {
    uint64_t number;
    const char *kind;
    char *data; /* one line of JSON */
};

/* Of which only the newest is worth having. */
struct latest {
    const char *kind;
    char *name, *data;
    uint64_t number;
};

struct listener {
    struct lumi_api_events *events;
    SoupServerMessage *message;
    uint64_t next;      /* number of the event it gets next */
    uint64_t latest;    /* number of the last of those that it has seen */
    uint64_t progress;  /* the progress it has seen */
    uint64_t people;    /* and the people */
    bool busy;          /* a block is on its way */
    int64_t written_ns; /* when the last one was */
};

struct lumi_api_events {
    struct lumi_http *http;
    /* In the engine's thread. */
    GArray *told; /* struct lumi_engine_told: not in the ring yet */
    uint64_t told_lost;
    GSource *idle;
    char *seen; /* the progress that was told last */
    /* In the server's. */
    uint32_t epoch;
    struct event ring[RING];
    uint64_t first, next; /* numbers of the oldest that is kept, of the next there will be */
    GPtrArray *listeners;
    GArray *latest; /* struct latest, the newest at the end */
    uint64_t latest_number;
    char *progress;
    uint64_t progress_number;
    bool looking; /* the engine is being asked how far it is */
    GSource *tick;
};

/* From the engine's thread to the server's. */
struct news {
    struct lumi_api_letter letter;
    struct lumi_api_events *events;
    GArray *items; /* struct item */
    uint64_t lost; /* that came before them */
    char *progress;
    bool looked; /* it was asked for */
};

struct item {
    const char *kind;
    char *data;
};

/* ---- the ring ---- */

static void keep(struct lumi_api_events *events, const char *kind, char *data)
{
    struct event *event = &events->ring[events->next % RING];

    g_free(event->data);
    *event = (struct event){.number = events->next, .kind = kind, .data = data};
    events->next++;
    if (events->next - events->first > RING)
        events->first = events->next - RING;
}

/* Of those that were never kept there are numbers only. */
static void keep_lost(struct lumi_api_events *events, uint64_t lost)
{
    events->next += lost;
    if (lost)
        events->first = events->next;
}

/* ---- news ---- */

static void pump_all(struct lumi_api_events *events);

static void take_news(struct lumi_api_letter *letter, bool dropped)
{
    struct news *news = (struct news *)letter;
    struct lumi_api_events *events = news->events;

    if (!dropped)
        keep_lost(events, news->lost);
    for (guint i = 0; i < news->items->len; i++) {
        struct item *item = &g_array_index(news->items, struct item, i);
        if (dropped)
            g_free(item->data);
        else
            keep(events, item->kind, item->data);
    }
    if (news->progress) {
        g_free(events->progress);
        events->progress = news->progress;
        events->progress_number++;
    }
    if (!dropped) {
        events->looking = events->looking && !news->looked;
        pump_all(events);
    }
    g_array_unref(news->items);
    g_free(news);
}

static struct news *make_news(struct lumi_api_events *events)
{
    struct news *news = g_new0(struct news, 1);

    news->letter.read = take_news;
    news->events = events;
    news->items = g_array_new(FALSE, FALSE, sizeof(struct item));
    return news;
}

static void add_item(struct news *news, const char *kind, char *data)
{
    struct item item = {.kind = kind, .data = data};

    g_array_append_val(news->items, item);
}

static void send_news(struct news *news)
{
    lumi_api_post_give(news->events->http->to_server, &news->letter);
}

/* ---- in the engine's thread ---- */

static const char *kind_name(enum lumi_engine_tale kind)
{
    static const char *const names[] = {"state", "check", "shot", "frame", "incident", "sealed"};

    return (unsigned)kind < 6 ? names[kind] : "incident";
}

static void describe(JsonBuilder *builder, const struct lumi_engine_told *told, const struct lumi_engine_status *status)
{
    lumi_api_put_time(builder, "time", told->unix_us);
    if (told->kind == LUMI_TALE_STATE)
        lumi_api_put_text(builder, "state", lumi_engine_state_name(told->state));
    if (told->kind == LUMI_TALE_CHECK && told->check >= 0 && told->check < status->check_count)
        lumi_api_check(builder, &status->checks[told->check]);
    if (told->kind == LUMI_TALE_SHOT || told->kind == LUMI_TALE_FRAME)
        lumi_api_put_int(builder, "shot", told->shot);
    if (told->kind == LUMI_TALE_SHOT)
        lumi_api_put_bool(builder, "lost", told->lost);
    if ((told->kind == LUMI_TALE_FRAME || told->kind == LUMI_TALE_INCIDENT) && told->camera >= 0 &&
        told->camera < status->camera_count)
        lumi_api_put_text(builder, "camera", status->cameras[told->camera].name);
    if (told->kind == LUMI_TALE_FRAME) {
        const char letter[] = {told->letter ? told->letter : 'p', '\0'};
        lumi_api_put_text(builder, "state", lumi_frame_state_name(told->frame_state));
        lumi_api_put_int(builder, "number", told->frame);
        lumi_api_put_text(builder, "letter", letter);
        lumi_api_put_text(builder, "class", lumi_judge_fault_name(told->fault));
    }
    if (told->kind == LUMI_TALE_INCIDENT && told->what[0])
        lumi_api_put_text(builder, "what", told->what);
    if (told->kind != LUMI_TALE_SHOT && told->kind != LUMI_TALE_CHECK)
        lumi_api_put_text(builder, "text", told->text);
}

/* The engine must not be asked while it tells; so what it told becomes events a moment later. */
static void take_told(struct lumi_api_events *events, struct news *news)
{
    g_autoptr(JsonBuilder) builder = NULL;

    if (!events->told->len)
        return;
    builder = json_builder_new();
    lumi_engine_status(events->http->options.engine, events->http->status);
    for (guint i = 0; i < events->told->len; i++) {
        const struct lumi_engine_told *told = &g_array_index(events->told, struct lumi_engine_told, i);
        json_builder_begin_object(builder);
        describe(builder, told, events->http->status);
        json_builder_end_object(builder);
        add_item(news, kind_name(told->kind), lumi_api_finish(builder));
    }
    g_array_set_size(events->told, 0);
    news->lost = events->told_lost;
    events->told_lost = 0;
}

static gboolean on_idle(void *context)
{
    struct lumi_api_events *events = context;
    struct news *news = make_news(events);

    lumi_api_drop(&events->idle);
    take_told(events, news);
    send_news(news);
    return G_SOURCE_REMOVE;
}

static void see_progress(struct lumi_api_events *events, struct news *news)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    lumi_engine_status(events->http->options.engine, events->http->status);
    json_builder_begin_object(builder);
    lumi_api_capture(builder, events->http->status);
    json_builder_end_object(builder);
    g_autofree char *text = lumi_api_finish(builder);
    if (g_strcmp0(text, events->seen)) {
        g_free(events->seen);
        events->seen = g_steal_pointer(&text);
        news->progress = g_strdup(events->seen);
    }
}

static void look(struct lumi_api_events *events, bool asked)
{
    struct news *news = make_news(events);

    take_told(events, news);
    see_progress(events, news);
    news->looked = asked;
    send_news(news);
}

void lumi_api_see_events(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    (void)answer;
    (void)body;
    look(http->events, false);
}

struct look_letter {
    struct lumi_api_letter letter;
    struct lumi_api_events *events;
};

static void on_look(struct lumi_api_letter *letter, bool dropped)
{
    if (!dropped)
        look(((struct look_letter *)letter)->events, true);
    g_free(letter);
}

/* ---- listeners, in the server's thread ---- */

static void put_event(GString *block, const char *kind, const char *data)
{
    g_string_append_printf(block, "event: %s\ndata: %s\n\n", kind, data);
}

static void send_block(struct listener *listener, GString *block)
{
    SoupMessageBody *body = soup_server_message_get_response_body(listener->message);
    GBytes *bytes = g_string_free_to_bytes(block);

    soup_message_body_append_bytes(body, bytes);
    g_bytes_unref(bytes);
    listener->busy = true;
    soup_server_message_unpause(listener->message);
}

/* As many as go into a block; what is left has its turn with the next. */
static void put_latest(struct listener *listener, GString *block)
{
    const GArray *all = listener->events->latest;

    for (guint i = 0; i < all->len && block->len < BLOCK_BYTES; i++) {
        const struct latest *latest = &g_array_index(all, struct latest, i);
        if (latest->number <= listener->latest)
            continue;
        put_event(block, latest->kind, latest->data);
        listener->latest = latest->number;
    }
}

/* Each sees themselves among them. */
static void put_people(struct listener *listener, GString *block)
{
    struct lumi_http *http = listener->events->http;
    g_autoptr(JsonBuilder) builder = NULL;

    if (listener->people == lumi_api_people_number(http))
        return;
    builder = json_builder_new();
    json_builder_begin_object(builder);
    lumi_api_people_put(http, listener->message, builder);
    json_builder_end_object(builder);
    g_autofree char *text = lumi_api_finish(builder);
    put_event(block, "people", text);
    listener->people = lumi_api_people_number(http);
}

/* The next block for somebody who has taken the last one. */
static void pump(struct listener *listener)
{
    struct lumi_api_events *events = listener->events;
    GString *block;

    if (listener->busy)
        return;
    block = g_string_new(NULL);
    if (listener->next < events->first) {
        g_string_append_printf(block, "event: gap\ndata: {\"lost\":%" PRIu64 "}\n\n", events->first - listener->next);
        listener->next = events->first;
    }
    for (; listener->next < events->next && block->len < BLOCK_BYTES; listener->next++) {
        const struct event *event = &events->ring[listener->next % RING];
        g_string_append_printf(block, "id: %" PRIx32 "-%" PRIu64 "\n", events->epoch, event->number);
        put_event(block, event->kind, event->data);
    }
    if (listener->next == events->next && events->progress && listener->progress != events->progress_number) {
        put_event(block, "progress", events->progress);
        listener->progress = events->progress_number;
    }
    if (listener->next == events->next)
        put_latest(listener, block);
    put_people(listener, block);
    if (!block->len && events->http->options.now_ns(events->http->options.context) - listener->written_ns > PING_NS)
        g_string_append(block, ": here\n\n");
    if (block->len)
        send_block(listener, block);
    else
        g_string_free(block, TRUE);
}

static void pump_all(struct lumi_api_events *events)
{
    for (guint i = 0; i < events->listeners->len; i++)
        pump(events->listeners->pdata[i]);
}

void lumi_api_events_latest(struct lumi_api_events *events, const char *kind, const char *name, char *data)
{
    struct latest made = {.kind = kind, .name = g_strdup(name), .data = data, .number = ++events->latest_number};

    for (guint i = 0; i < events->latest->len; i++) {
        struct latest *latest = &g_array_index(events->latest, struct latest, i);
        if (strcmp(latest->kind, kind) || strcmp(latest->name, name))
            continue;
        g_array_remove_index(events->latest, i);
        break;
    }
    g_array_append_val(events->latest, made);
    pump_all(events);
}

static void clear_latest(void *data)
{
    struct latest *latest = data;

    g_free(latest->name);
    g_free(latest->data);
}

/* The server does not read from who listens, so nobody tells it that the other side has closed. */
bool lumi_api_has_hung_up(GSocket *socket)
{
    struct pollfd fd = {.fd = g_socket_get_fd(socket), .events = POLLRDHUP};

    return poll(&fd, 1, 0) > 0;
}

/* Hangs up on who has hung up, and on who takes nothing: the next write fails, and the message is finished. */
static void look_after(struct listener *listener, int64_t now)
{
    GSocket *socket = lumi_api_socket(listener->message);

    if (!socket || (!lumi_api_has_hung_up(socket) && !(listener->busy && now - listener->written_ns > PATIENCE_NS)))
        return;
    g_socket_shutdown(socket, TRUE, TRUE, NULL);
    if (!listener->busy)
        send_block(listener, g_string_new(": gone\n\n"));
}

static gboolean on_tick(void *context)
{
    struct lumi_api_events *events = context;
    int64_t now = events->http->options.now_ns(events->http->options.context);

    if (!events->listeners->len) {
        lumi_api_drop(&events->tick);
        return G_SOURCE_REMOVE;
    }
    if (!events->looking) {
        struct look_letter *letter = g_new0(struct look_letter, 1);
        letter->letter.read = on_look;
        letter->events = events;
        events->looking = true;
        lumi_api_post_give(events->http->to_engine, &letter->letter);
    }
    for (guint i = 0; i < events->listeners->len; i++)
        look_after(events->listeners->pdata[i], now);
    pump_all(events);
    return G_SOURCE_CONTINUE;
}

static void on_wrote_chunk(SoupServerMessage *message, void *context)
{
    struct listener *listener = context;

    (void)message;
    listener->busy = false;
    listener->written_ns = listener->events->http->options.now_ns(listener->events->http->options.context);
    pump(listener);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    struct listener *listener = context;

    g_signal_handlers_disconnect_by_data(message, listener);
    g_ptr_array_remove_fast(listener->events->listeners, listener);
}

static void free_listener(void *data)
{
    struct listener *listener = data;

    g_object_unref(listener->message);
    g_free(listener);
}

static uint64_t where_to_begin(const struct lumi_api_events *events, SoupServerMessage *message)
{
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(message);
    const char *text = soup_message_headers_get_one(headers, "Last-Event-ID");
    uint64_t number;
    uint32_t epoch;

    if (!text)
        return events->next;
    if (!lumi_api_event_id_parse(text, &epoch, &number) || epoch != events->epoch || number >= events->next)
        return events->first;
    return number + 1;
}

void lumi_api_serve_events(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    struct lumi_api_events *events = http->events;
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);
    struct listener *listener;

    (void)body;
    if ((int)events->listeners->len >= http->options.listeners_max) {
        lumi_api_send_problem(message, 503, "limit", "too many listen to the events already");
        return;
    }
    listener = g_new0(struct listener, 1);
    listener->events = events;
    listener->message = g_object_ref(message);
    listener->next = where_to_begin(events, message);
    listener->written_ns = http->options.now_ns(http->options.context);
    lumi_api_guard_spare(http->guard, message); /* look_after instead */
    soup_server_message_set_status(message, 200, NULL);
    soup_message_headers_set_content_type(headers, "text/event-stream", NULL);
    soup_message_headers_replace(headers, "Cache-Control", "no-store");
    soup_message_headers_replace(headers, "X-Content-Type-Options", "nosniff");
    soup_message_headers_set_encoding(headers, SOUP_ENCODING_CHUNKED);
    soup_message_body_set_accumulate(soup_server_message_get_response_body(message), FALSE);
    g_signal_connect(message, "wrote-chunk", G_CALLBACK(on_wrote_chunk), listener);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), listener);
    g_ptr_array_add(events->listeners, listener);
    send_block(listener, g_string_new("retry: 2000\n\n"));
    if (!events->tick)
        events->tick = lumi_api_attach(g_timeout_source_new(TICK_MS), G_PRIORITY_DEFAULT, on_tick, events);
}

/* ---- life ---- */

int lumi_api_events_create(struct lumi_http *http, struct lumi_api_events **events, struct lumi_error *error)
{
    struct lumi_api_events *made = g_new0(struct lumi_api_events, 1);

    (void)error;
    made->http = http;
    made->epoch = g_random_int();
    made->first = made->next = 1;
    made->told = g_array_new(FALSE, FALSE, sizeof(struct lumi_engine_told));
    made->latest = g_array_new(FALSE, FALSE, sizeof(struct latest));
    g_array_set_clear_func(made->latest, clear_latest);
    made->listeners = g_ptr_array_new_with_free_func(free_listener);
    *events = made;
    return LUMI_OK;
}

void lumi_api_events_destroy(struct lumi_api_events *events)
{
    if (!events)
        return;
    lumi_api_drop(&events->idle);
    lumi_api_drop(&events->tick);
    for (guint i = 0; i < events->listeners->len; i++) {
        struct listener *listener = events->listeners->pdata[i];
        g_signal_handlers_disconnect_by_data(listener->message, listener);
    }
    g_ptr_array_unref(events->listeners);
    g_array_unref(events->told);
    g_array_unref(events->latest);
    for (int i = 0; i < RING; i++)
        g_free(events->ring[i].data);
    g_free(events->progress);
    g_free(events->seen);
    g_free(events);
}

void lumi_api_events_told(struct lumi_api_events *events, const struct lumi_engine_told *told)
{
    if (events->told->len >= RING) { /* the main loop has not come round for long: the oldest is lost, and counted */
        g_array_remove_index(events->told, 0);
        events->told_lost++;
    }
    g_array_append_val(events->told, *told);
    if (!events->idle) {
        events->idle = g_idle_source_new();
        g_source_set_priority(events->idle, G_PRIORITY_DEFAULT);
        g_source_set_callback(events->idle, on_idle, events, NULL);
        g_source_attach(events->idle, NULL);
    }
}

void lumi_api_events_processing(struct lumi_api_events *events, const struct lumi_process_status *status)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct news *news = make_news(events);

    json_builder_begin_object(builder);
    lumi_api_processing(builder, status);
    json_builder_end_object(builder);
    add_item(news, "processing", lumi_api_finish(builder));
    send_news(news);
}

void lumi_api_events_ingest(struct lumi_api_events *events, const struct lumi_ingest_status *status)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct news *news = make_news(events);

    json_builder_begin_object(builder);
    lumi_api_ingest(builder, status);
    json_builder_end_object(builder);
    add_item(news, "ingest", lumi_api_finish(builder));
    send_news(news);
}
