/* The link's thread: stream and client, and nothing that waits longer than a poll. */
#include "daemon/rig/link_priv.h"

#include <glib.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define SECOND_NS 1000000000u
#define RETRY_NS 250000000u                 /* a stream that is not there is tried again after this */
#define FOREIGN_RETRY_NS (5ull * SECOND_NS) /* one that is somebody else's is left alone longer */
#define FOREIGN_BYTES 2048                  /* so much without a single frame of ours is no noise */
#define POLL_MAX_NS 500000000u
#define LAST_MS 30 /* for the last frame to leave: a line that is closed drops what it has not sent */

/* ---- notices ---- */

static void keep(struct lumi_rig_link *link, const struct lumi_rig_notice *notice)
{
    struct lumi_rig_kept_notice *kept;

    if (link->notices >= LUMI_RIG_NOTICES_MAX) {
        link->notices_dropped++;
        return;
    }
    kept = g_new0(struct lumi_rig_kept_notice, 1);
    kept->notice = *notice;
    kept->boot = link->boot;
    if (link->last_notice)
        link->last_notice->next = kept;
    else
        link->first_notice = kept;
    link->last_notice = kept;
    link->notices++;
    link->told = true;
    pthread_cond_broadcast(&link->changed);
}

/* Nobody took them for very long: said as soon as there is room, as with those that the board lost. */
static void keep_event(struct lumi_rig_link *link, const struct lumi_rig_notice *notice)
{
    if (link->notices_dropped && link->notices + 2 <= LUMI_RIG_NOTICES_MAX) {
        struct lumi_rig_notice lost = {
            .kind = LUMI_RIG_NOTICE_EVENTS_LOST, .host_ns = link->now_ns, .count = link->notices_dropped};
        link->notices_dropped = 0;
        keep(link, &lost);
    }
    keep(link, notice);
}

/* ---- what the client tells ---- */

static bool on_send(void *context, const uint8_t *frame, size_t size)
{
    struct lumi_rig_link *link = context;

    if (!link->open || link->out_size + size > sizeof link->out)
        return false;
    memcpy(link->out + link->out_size, frame, size);
    link->out_size += size;
    return true;
}

static void on_welcome(void *context, const lumi_wire_Welcome *welcome, bool restarted)
{
    struct lumi_rig_link *link = context;
    struct lumi_rig_notice notice = {
        .kind = LUMI_RIG_NOTICE_CONNECTED, .host_ns = link->now_ns, .restarted = restarted};

    link->snapshot.welcome = *welcome;
    if (!link->boot_known || link->boot != welcome->boot) {
        if (link->boot_known)
            link->snapshot.restarts++;
        lumi_clock_match_restart(&link->clock);
        link->snapshot.status_known = false;
    }
    link->boot = welcome->boot;
    link->boot_known = true;
    keep(link, &notice);
}

static void finish(struct lumi_rig_link *link, struct lumi_rig_pending *pending, int code)
{
    pending->code = code;
    pending->done = true;
    pthread_cond_broadcast(&link->changed);
}

static void on_reply(void *context, const lumi_wire_Reply *reply)
{
    struct lumi_rig_link *link = context;
    struct lumi_rig_pending *pending = link->in_flight;

    if (!pending)
        return; /* nobody waits for it any more */
    link->in_flight = NULL;
    *pending->reply = *reply;
    finish(link, pending, LUMI_OK);
}

static void on_request_lost(void *context, uint32_t number)
{
    struct lumi_rig_link *link = context;
    struct lumi_rig_pending *pending = link->in_flight;

    (void)number;
    link->snapshot.requests_lost++;
    if (!pending)
        return;
    link->in_flight = NULL;
    finish(link, pending,
           lumi_fail(pending->error, LUMI_ERR_IO,
                     "%s: the board started again before it answered; whether it has executed this is not known",
                     link->stream->name));
}

static void on_event(void *context, const lumi_wire_Event *event)
{
    struct lumi_rig_link *link = context;
    struct lumi_rig_notice notice = {
        .kind = LUMI_RIG_NOTICE_EVENT, .host_ns = lumi_clock_to_host(&link->clock, event->time_ns), .event = *event};

    keep_event(link, &notice);
}

static void on_events_lost(void *context, uint32_t count)
{
    struct lumi_rig_link *link = context;
    struct lumi_rig_notice notice = {.kind = LUMI_RIG_NOTICE_EVENTS_LOST, .host_ns = link->now_ns, .count = count};

    keep_event(link, &notice);
}

static void on_pulse(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns)
{
    struct lumi_rig_link *link = context;
    struct lumi_clock_sample sample = {.host_sent_ns = pulse->host_time,
                                       .board_received_ns = pulse->received_ns,
                                       .board_sent_ns = pulse->sent_ns,
                                       .host_received_ns = received_ns};

    lumi_clock_match_add(&link->clock, &sample);
    if (pulse->has_status) {
        link->snapshot.status = pulse->status;
        link->snapshot.status_known = true;
        link->snapshot.status_ns = received_ns;
        link->snapshot.status_board_ns = pulse->sent_ns;
        pthread_cond_broadcast(&link->changed);
    }
}

const struct lumi_wire_client_ops lumi_rig_link_client_ops = {
    .send = on_send,
    .welcome = on_welcome,
    .reply = on_reply,
    .request_lost = on_request_lost,
    .event = on_event,
    .events_lost = on_events_lost,
    .pulse = on_pulse,
};

/* ---- the stream ---- */

static void set_state(struct lumi_rig_link *link, enum lumi_rig_link_state state, int code, const char *text)
{
    bool changed = link->snapshot.state != state;

    link->snapshot.state = state;
    link->snapshot.code = code;
    if (text != link->snapshot.text)
        g_strlcpy(link->snapshot.text, text, sizeof link->snapshot.text);
    if (changed)
        pthread_cond_broadcast(&link->changed);
}

static void close_stream(struct lumi_rig_link *link, enum lumi_rig_link_state state, int code, const char *text)
{
    struct lumi_rig_notice notice = {.kind = LUMI_RIG_NOTICE_DISCONNECTED, .host_ns = link->now_ns};

    link->stream->ops->close(link->stream);
    link->open = false;
    link->out_size = 0;
    link->try_ns = link->now_ns + (state == LUMI_RIG_LINK_FOREIGN ? FOREIGN_RETRY_NS : RETRY_NS);
    set_state(link, state, code, text);
    g_strlcpy(notice.text, text, sizeof notice.text);
    keep(link, &notice);
}

/* Opening may take a while (a bus is searched): others go on meanwhile. */
static void try_open(struct lumi_rig_link *link)
{
    struct lumi_error error = {0};
    int code;

    pthread_mutex_unlock(&link->mutex);
    code = link->stream->ops->open(link->stream, &error);
    pthread_mutex_lock(&link->mutex);
    link->now_ns = lumi_rig_link_now();
    link->attempts++;
    if (code != LUMI_OK) {
        link->try_ns = link->now_ns + RETRY_NS;
        set_state(link, LUMI_RIG_LINK_CLOSED, code, error.text);
        pthread_cond_broadcast(&link->changed);
        return;
    }
    snprintf(link->snapshot.name, sizeof link->snapshot.name, "%s", link->stream->name);
    link->open = true;
    link->opened_ns = link->answered_ns = link->now_ns;
    link->received = 0;
    if (link->opened_before) {
        link->snapshot.reconnections++;
        lumi_wire_client_reconnected(&link->client, link->now_ns);
    }
    link->opened_before = true;
}

/* What is to be said of the link now. */
static void judge(struct lumi_rig_link *link)
{
    const struct lumi_wire_client *client = &link->client;
    uint64_t heard_ns = client->heard_ns > link->opened_ns ? client->heard_ns : link->opened_ns;
    double quiet = (double)(link->now_ns - heard_ns) * 1e-9;
    double unanswered;
    struct lumi_error error;
    char text[1024];

    if (!link->open)
        return;
    if (client->state != LUMI_WIRE_CLIENT_HELLO)
        link->answered_ns = link->now_ns;
    unanswered = (double)(link->now_ns - link->answered_ns) * 1e-9;
    if (lumi_wire_client_version(client, &error)) {
        lumi_fail_prefix(&error, "%s", link->stream->name);
        link->snapshot.welcome = client->welcome;
        set_state(link, LUMI_RIG_LINK_VERSION, LUMI_ERR_VERSION, error.text);
    } else if (client->state == LUMI_WIRE_CLIENT_OPEN && quiet < link->options.patience) {
        set_state(link, LUMI_RIG_LINK_OPEN, LUMI_OK, "");
    } else if (client->state == LUMI_WIRE_CLIENT_OPEN) {
        snprintf(text, sizeof text, "%s: the board has been silent for %.1f s", link->stream->name, quiet);
        set_state(link, LUMI_RIG_LINK_SILENT, LUMI_ERR_IO, text);
    } else if (link->answered_ns == link->opened_ns &&
               ((link->received >= FOREIGN_BYTES && heard_ns == link->opened_ns) ||
                (link->received && unanswered >= link->options.patience))) {
        snprintf(
            text, sizeof text,
            "%s: what answers there is no Lumisphere board (%llu bytes came, and no answer to a Hello among them); "
            "the port is somebody else's, or the baud rate is wrong",
            link->stream->name, (unsigned long long)link->received);
        close_stream(link, LUMI_RIG_LINK_FOREIGN, LUMI_ERR_UNSUPPORTED, text);
    } else {
        snprintf(text, sizeof text, "%s: nothing answers", link->stream->name);
        set_state(link, LUMI_RIG_LINK_SILENT, LUMI_ERR_IO, text);
    }
}

static void receive(struct lumi_rig_link *link)
{
    uint8_t data[4096];
    struct lumi_error error = {0};

    while (link->open) {
        long count = link->stream->ops->read(link->stream, data, sizeof data, &error);
        if (count < 0) {
            close_stream(link, LUMI_RIG_LINK_CLOSED, (int)count, error.text);
            return;
        }
        if (count == 0)
            return;
        link->received += (uint64_t)count;
        lumi_wire_client_receive(&link->client, data, (size_t)count, link->now_ns);
        if (count < (long)sizeof data)
            return;
    }
}

static void transmit(struct lumi_rig_link *link)
{
    struct lumi_error error = {0};

    while (link->open && link->out_size) {
        long count = link->stream->ops->write(link->stream, link->out, link->out_size, &error);
        if (count < 0) {
            close_stream(link, LUMI_RIG_LINK_CLOSED, (int)count, error.text);
            return;
        }
        if (count == 0)
            return;
        link->out_size -= (size_t)count;
        memmove(link->out, link->out + count, link->out_size);
    }
}

/* ---- requests ---- */

static void fail_all(struct lumi_rig_link *link, int code, const char *text)
{
    while (link->queue) {
        struct lumi_rig_pending *pending = link->queue;
        link->queue = pending->next;
        finish(link, pending, lumi_fail(pending->error, code, "%s", text));
    }
}

static void start_request(struct lumi_rig_link *link)
{
    if (link->stop_wanted) {
        link->stop_wanted = false; /* the client repeats it until the board confirms it */
        lumi_wire_client_emergency_stop(&link->client, link->now_ns);
    }
    link->snapshot.stop_pending = link->client.stops_left > 0;
    if (link->snapshot.state == LUMI_RIG_LINK_VERSION)
        fail_all(link, LUMI_ERR_VERSION, link->snapshot.text);
    while (link->queue && !link->in_flight) {
        struct lumi_rig_pending *pending = link->queue;
        struct lumi_error error = {0};
        int code = lumi_wire_client_request(&link->client, &pending->request, link->now_ns, &error);
        if (code == LUMI_ERR_BUSY)
            return; /* one that nobody waits for is still in flight, or there is no session */
        link->queue = pending->next;
        if (code == LUMI_OK)
            link->in_flight = pending;
        else
            finish(link, pending, lumi_fail(pending->error, code, "%s", error.text));
    }
}

/* ---- the loop ---- */

static int wait_ms(const struct lumi_rig_link *link)
{
    uint64_t until = link->now_ns + POLL_MAX_NS;

    if (link->open) {
        uint64_t next = lumi_wire_client_next_poll(&link->client);
        until = next < until ? next : until;
    } else if (link->try_ns < until) {
        until = link->try_ns;
    }
    return until <= link->now_ns ? 0 : (int)((until - link->now_ns + 999999) / 1000000);
}

static void wait_for_something(struct lumi_rig_link *link)
{
    struct pollfd fds[1 + LUMI_RIG_STREAM_POLL];
    int count, timeout = wait_ms(link);
    bool told = link->told;
    char drain[64];

    link->told = false;
    count = 1 + link->stream->ops->poll_fds(link->stream, fds + 1, LUMI_RIG_STREAM_POLL, link->out_size > 0);
    fds[0] = (struct pollfd){.fd = link->wake[0], .events = POLLIN};
    pthread_mutex_unlock(&link->mutex);
    if (told && link->options.wake)
        link->options.wake(link->options.context);
    poll(fds, (nfds_t)count, timeout);
    while (read(link->wake[0], drain, sizeof drain) == (ssize_t)sizeof drain)
        ;
    pthread_mutex_lock(&link->mutex);
    link->now_ns = lumi_rig_link_now();
}

void *lumi_rig_link_thread(void *context)
{
    struct lumi_rig_link *link = context;

    pthread_mutex_lock(&link->mutex);
    link->now_ns = lumi_rig_link_now();
    while (!link->closing) {
        bool back = !link->open && link->stream->ops->arrived && link->stream->ops->arrived(link->stream);
        if (!link->open && (back || link->now_ns >= link->try_ns))
            try_open(link);
        if (link->open) {
            receive(link);
            lumi_wire_client_poll(&link->client, link->now_ns);
            judge(link);
            start_request(link);
            transmit(link);
        }
        if (link->closing)
            break;
        wait_for_something(link);
    }
    if (link->open && link->client.acknowledge) { /* what was stored last */
        link->client.acknowledge_due_ns = 0;
        lumi_wire_client_poll(&link->client, lumi_rig_link_now());
        transmit(link);
        poll(NULL, 0, LAST_MS);
    }
    if (link->in_flight)
        finish(link, link->in_flight, lumi_fail(link->in_flight->error, LUMI_ERR_CANCELLED, "the link was closed"));
    link->in_flight = NULL;
    fail_all(link, LUMI_ERR_CANCELLED, "the link was closed");
    pthread_mutex_unlock(&link->mutex);
    return NULL;
}
