/* A capture as one file: read a piece at a time by the carrier, given to the connection when it has taken the piece
 * before. Whoever is slow holds one piece in memory, and is hung up on when none of it is taken for a minute; what
 * broke off goes on with a range (RFC 9110, 14), as the same capture has the same bytes: its seal is the ETag. */
#include "daemon/http/api_shelf.h"

#include <string.h>

#define DOWNLOADS 4
#define PIECE ((size_t)256 << 10)
#define TICK_MS 1000
#define PATIENCE_NS (60 * 1000000000LL)

struct download {
    struct lumi_api_job job; /* one piece, or the beginning; never two at once */
    struct lumi_api_shelf *shelf;
    SoupServerMessage *message;
    char *name;
    bool given;    /* the job is the carrier's */
    bool gone;     /* who asked has hung up */
    bool busy;     /* a piece is on its way */
    bool answered; /* the headers are */
    int64_t written_ns;
    struct lumi_shelf_bundle *bundle;
    int64_t at, end; /* of what was asked for */
    uint8_t *data;
    size_t size;
    int code;
    struct lumi_error error;
};

static int64_t now(const struct lumi_api_shelf *shelf)
{
    return shelf->http->options.now_ns(shelf->http->options.context);
}

static void free_download(struct download *d)
{
    lumi_shelf_bundle_close(d->bundle);
    g_object_unref(d->message);
    g_free(d->data);
    g_free(d->name);
    g_free(d);
}

static void forget(struct download *d)
{
    int others = 0;

    g_ptr_array_remove_fast(d->shelf->downloads, d);
    for (guint i = 0; i < d->shelf->downloads->len; i++)
        others += !strcmp(((struct download *)d->shelf->downloads->pdata[i])->name, d->name);
    if (!others)
        lumi_api_shelf_give_back(d->shelf, d->name);
    free_download(d);
}

/* ---- in the carrier ---- */

static void work(struct lumi_api_job *job)
{
    struct download *d = (struct download *)job;

    char path[LUMI_SHELF_PATH];

    if (!d->bundle) {
        d->code = lumi_shelf_find(d->shelf->http->options.folder, d->name, path, &d->error);
        if (d->code == LUMI_OK)
            d->code = lumi_shelf_bundle_open(path, d->name, &d->bundle, &d->error);
    } else
        d->code = lumi_shelf_bundle_read(d->bundle, d->at, d->data, (size_t)MIN((int64_t)PIECE, d->end - d->at),
                                         &d->size, &d->error);
}

/* ---- in the server's thread ---- */

static void hang_up(struct download *d)
{
    GSocket *socket = lumi_api_socket(d->message);

    if (socket)
        g_socket_shutdown(socket, TRUE, TRUE, NULL);
}

/* The length was promised: only breaking off tells. What is written then fails, and the message is finished. */
static void break_off(struct download *d)
{
    hang_up(d);
    soup_message_body_append(soup_server_message_get_response_body(d->message), SOUP_MEMORY_STATIC, "", 1);
    d->busy = true;
    soup_server_message_unpause(d->message);
}

static void ask(struct download *d)
{
    d->given = true;
    if (lumi_api_worker_give(d->shelf->carrier, &d->job))
        return;
    d->given = false; /* so much is deleted at once */
    if (d->answered)
        break_off(d);
    else {
        lumi_api_send_problem(d->message, 503, "busy", "too much is done with captures already");
        soup_server_message_unpause(d->message);
    }
}

static void give(struct download *d)
{
    SoupMessageBody *body = soup_server_message_get_response_body(d->message);

    soup_message_body_append(body, SOUP_MEMORY_COPY, d->data, d->size);
    d->at += (int64_t)d->size;
    if (d->at == d->end)
        soup_message_body_complete(body);
    d->busy = true;
    d->written_ns = now(d->shelf);
    soup_server_message_unpause(d->message);
}

static void on_wrote_chunk(SoupServerMessage *message, void *context)
{
    struct download *d = context;

    (void)message;
    d->busy = false;
    if (d->at < d->end)
        ask(d);
}

/* False: the whole is sent. */
static bool wants_range(const struct download *d, const char *tag, int64_t size, int64_t *from, int64_t *to)
{
    SoupMessageHeaders *headers = soup_server_message_get_request_headers(d->message);
    const char *only = soup_message_headers_get_one(headers, "If-Range");
    SoupRange *ranges = NULL;
    int count = 0;
    bool one;

    if ((only && strcmp(only, tag)) || !soup_message_headers_get_ranges(headers, size, &ranges, &count))
        return false;
    one = count == 1; /* several at once are answered with the whole, which is allowed */
    if (one) {
        *from = ranges[0].start;
        *to = ranges[0].end + 1;
    }
    soup_message_headers_free_ranges(headers, ranges);
    return one;
}

static void put_headers(struct download *d, SoupMessageHeaders *headers, const char *tag)
{
    g_autofree char *file = g_strdup_printf("attachment; filename=\"%s.tar\"", d->name);

    for (char *at = file + strlen("attachment; filename=\""); *at; at++)
        if ((*at == '"' && at[1]) || *at == '\\' || (unsigned char)*at >= 127)
            *at = '_';
    soup_message_headers_replace(headers, "Content-Type", "application/x-tar");
    soup_message_headers_replace(headers, "Content-Disposition", file);
    soup_message_headers_replace(headers, "Accept-Ranges", "bytes");
    soup_message_headers_replace(headers, "Cache-Control", "no-cache");
    soup_message_headers_replace(headers, "ETag", tag);
}

static void refuse_range(struct download *d, SoupMessageHeaders *headers, int64_t size)
{
    g_autofree char *whole = g_strdup_printf("bytes */%" G_GINT64_FORMAT, size);

    lumi_api_send_problem(d->message, 416, "argument", "there are no such bytes");
    soup_message_headers_replace(headers, "Content-Range", whole);
    soup_server_message_unpause(d->message);
}

static void begin(struct download *d)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(d->message);
    const int64_t size = lumi_shelf_bundle_size(d->bundle);
    g_autofree char *tag = g_strdup_printf("\"%s\"", lumi_shelf_bundle_seal(d->bundle));
    bool part;

    d->end = size;
    part = wants_range(d, tag, size, &d->at, &d->end);
    /* The library would cut the ranges out of what it takes for the whole. */
    soup_message_headers_remove(soup_server_message_get_request_headers(d->message), "Range");
    if (part && (d->at < 0 || d->at >= size || d->end > size || d->end <= d->at)) {
        refuse_range(d, headers, size);
        return;
    }
    put_headers(d, headers, tag);
    if (part)
        soup_message_headers_set_content_range(headers, d->at, d->end - 1, size);
    soup_server_message_set_status(d->message, part ? 206 : 200, NULL);
    soup_message_headers_set_content_length(headers, d->end - d->at);
    soup_message_body_set_accumulate(soup_server_message_get_response_body(d->message), FALSE);
    lumi_api_guard_spare(d->shelf->http->guard, d->message); /* look_after instead */
    d->answered = true;
    d->data = g_malloc(PIECE);
    g_signal_connect(d->message, "wrote-chunk", G_CALLBACK(on_wrote_chunk), d);
    ask(d);
}

static void come_back(struct lumi_api_letter *letter, bool dropped)
{
    struct download *d = (struct download *)letter;

    d->given = false;
    if (dropped)
        return; /* lumi_api_bundles_end */
    if (d->gone)
        forget(d);
    else if (d->code == LUMI_OK && !d->answered)
        begin(d);
    else if (d->code == LUMI_OK)
        give(d);
    else if (d->answered)
        break_off(d);
    else {
        struct lumi_api_answer answer = {0};
        lumi_api_problem_of(&answer, d->code, d->error.text);
        lumi_api_send(d->message, &answer);
        soup_server_message_unpause(d->message);
    }
}

static void on_finished(SoupServerMessage *message, void *context)
{
    struct download *d = context;

    g_signal_handlers_disconnect_by_data(message, d);
    d->gone = true;
    if (!d->given)
        forget(d);
}

static gboolean on_tick(void *context)
{
    struct lumi_api_shelf *shelf = context;

    if (!shelf->downloads->len) {
        lumi_api_drop(&shelf->tick);
        return G_SOURCE_REMOVE;
    }
    for (guint i = 0; i < shelf->downloads->len; i++) {
        struct download *d = shelf->downloads->pdata[i];
        if (d->busy && now(shelf) - d->written_ns > PATIENCE_NS)
            hang_up(d);
    }
    return G_SOURCE_CONTINUE;
}

static bool refused(struct lumi_http *http, SoupServerMessage *message)
{
    if (!http->options.folder)
        lumi_api_send_problem(message, 404, "notfound", "there are no captures here");
    else if (http->shelf->downloads->len >= DOWNLOADS)
        lumi_api_send_problem(message, 503, "busy", "so many captures are being downloaded already: try again later");
    else
        return false;
    return true;
}

/* Several may carry the same one. */
static bool take(struct lumi_http *http, SoupServerMessage *message, const char *name)
{
    for (guint i = 0; i < http->shelf->downloads->len; i++)
        if (!strcmp(((struct download *)http->shelf->downloads->pdata[i])->name, name))
            return true;
    return lumi_api_shelf_take(http->shelf, message, name, "downloaded");
}

void lumi_api_serve_bundle(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    if (refused(http, message) || !take(http, message, body->part))
        return;
    struct download *d = g_new0(struct download, 1);
    d->job.work = work;
    d->job.letter.read = come_back;
    d->shelf = http->shelf;
    d->message = g_object_ref(message);
    d->name = g_strdup(body->part);
    g_ptr_array_add(http->shelf->downloads, d);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), d);
    if (!http->shelf->tick)
        http->shelf->tick = lumi_api_attach(g_timeout_source_new(TICK_MS), G_PRIORITY_DEFAULT, on_tick, http->shelf);
    soup_server_message_pause(message);
    ask(d);
}

void lumi_api_bundles_end(struct lumi_api_shelf *shelf)
{
    lumi_api_drop(&shelf->tick);
    for (guint i = 0; i < shelf->downloads->len; i++) {
        struct download *d = shelf->downloads->pdata[i];
        g_signal_handlers_disconnect_by_data(d->message, d);
        free_download(d);
    }
    g_ptr_array_set_size(shelf->downloads, 0);
}
