/* The host's end of the link. */
#include "proto/wire/client.h"

#include <assert.h>
#include <string.h>

void lumi_wire_client_init(struct lumi_wire_client *client, const struct lumi_wire_client_ops *ops, void *context,
                           uint64_t host)
{
    assert(host != 0);
    memset(client, 0, sizeof *client);
    client->ops = ops;
    client->context = context;
    client->host = host;
    client->version_min = LUMI_WIRE_VERSION_MIN;
    client->version_max = LUMI_WIRE_VERSION_MAX;
    client->hello_nonce = 1;
    lumi_wire_deframer_init(&client->deframer);
}

/* ---- sending ---- */

static bool send_payload(struct lumi_wire_client *client, const uint8_t *payload, size_t size)
{
    uint8_t frame[LUMI_WIRE_FRAME_MAX];

    return client->ops->send(client->context, frame, lumi_wire_frame(payload, size, frame));
}

static bool send_message(struct lumi_wire_client *client, const lumi_wire_HostFrame *message)
{
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];
    size_t size = lumi_wire_encode_host(message, payload, sizeof payload);

    return size > 0 && send_payload(client, payload, size);
}

static uint64_t due(bool sent, uint64_t now_ns, uint64_t again_ns)
{
    return now_ns + (sent ? again_ns : LUMI_WIRE_ROOM_NS);
}

static void send_hello(struct lumi_wire_client *client, uint64_t now_ns)
{
    lumi_wire_HostFrame out = {.which_body = lumi_wire_HostFrame_hello_tag};

    out.body.hello = (lumi_wire_Hello){.version_min = client->version_min,
                                       .version_max = client->version_max,
                                       .host = client->host,
                                       .nonce = client->hello_nonce};
    client->hello_due_ns = due(send_message(client, &out), now_ns, LUMI_WIRE_HELLO_NS);
}

static void send_request(struct lumi_wire_client *client, uint64_t now_ns)
{
    bool sent = send_payload(client, client->request, client->request_size);

    client->request_due_ns = due(sent, now_ns, LUMI_WIRE_RETRY_NS);
}

/* Quiet: only acknowledges. */
static void send_heartbeat(struct lumi_wire_client *client, bool quiet, uint64_t now_ns)
{
    lumi_wire_HostFrame out = {.which_body = lumi_wire_HostFrame_heartbeat_tag};

    out.body.heartbeat =
        (lumi_wire_Heartbeat){.token = client->welcome.token,
                              .host_time = now_ns,
                              .events_next = client->holds ? client->events_stored : client->events_next,
                              .observer = client->observer,
                              .quiet = quiet};
    bool sent = send_message(client, &out);
    if (!quiet)
        client->heartbeat_due_ns = due(sent, now_ns, LUMI_WIRE_HEARTBEAT_NS);
    if (sent)
        client->acknowledge = false;
    else
        client->acknowledge_due_ns = now_ns + LUMI_WIRE_ROOM_NS;
}

static bool send_stop(struct lumi_wire_client *client, uint64_t now_ns)
{
    lumi_wire_HostFrame out = {.which_body = lumi_wire_HostFrame_emergency_stop_tag};

    out.body.emergency_stop.nonce = client->stop_nonce;
    bool sent = send_message(client, &out);
    if (sent)
        client->stops_left--;
    client->stop_due_ns = due(sent, now_ns, LUMI_WIRE_RETRY_NS);
    return sent;
}

void lumi_wire_client_poll(struct lumi_wire_client *client, uint64_t now_ns)
{
    if (client->stops_left > 0 && now_ns >= client->stop_due_ns)
        send_stop(client, now_ns);
    if (client->state == LUMI_WIRE_CLIENT_HELLO && now_ns >= client->hello_due_ns)
        send_hello(client, now_ns);
    if (client->state != LUMI_WIRE_CLIENT_OPEN)
        return;
    if (client->in_flight && now_ns >= client->request_due_ns) {
        client->retries++;
        send_request(client, now_ns);
    }
    if (now_ns >= client->heartbeat_due_ns)
        send_heartbeat(client, false, now_ns);
    else if (client->acknowledge && now_ns >= client->acknowledge_due_ns)
        send_heartbeat(client, true, now_ns);
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

uint64_t lumi_wire_client_next_poll(const struct lumi_wire_client *client)
{
    uint64_t next = UINT64_MAX;

    if (client->stops_left > 0)
        next = earlier(next, client->stop_due_ns);
    if (client->state == LUMI_WIRE_CLIENT_HELLO)
        next = earlier(next, client->hello_due_ns);
    if (client->state == LUMI_WIRE_CLIENT_OPEN) {
        next = earlier(next, client->heartbeat_due_ns);
        if (client->acknowledge)
            next = earlier(next, client->acknowledge_due_ns);
        if (client->in_flight)
            next = earlier(next, client->request_due_ns);
    }
    return next;
}

bool lumi_wire_client_emergency_stop(struct lumi_wire_client *client, uint64_t now_ns)
{
    client->stop_nonce++;
    client->stops_left = LUMI_WIRE_STOPS;
    return send_stop(client, now_ns);
}

int lumi_wire_client_request(struct lumi_wire_client *client, lumi_wire_Request *request, uint64_t now_ns,
                             struct lumi_error *error)
{
    lumi_wire_HostFrame out = {.which_body = lumi_wire_HostFrame_request_tag};

    LUMI_TRY(lumi_wire_client_version(client, error));
    if (client->state != LUMI_WIRE_CLIENT_OPEN)
        return lumi_fail(error, LUMI_ERR_BUSY, "the rig's board has not answered yet");
    if (client->in_flight)
        return lumi_fail(error, LUMI_ERR_BUSY, "the rig's board has not answered the last command yet");
    request->token = client->welcome.token;
    request->number = client->number + 1;
    out.body.request = *request;
    client->request_size = lumi_wire_encode_host(&out, client->request, sizeof client->request);
    if (client->request_size == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "a command that cannot be encoded");
    client->number++;
    client->in_flight = true;
    send_request(client, now_ns);
    return LUMI_OK;
}

/* ---- receiving ---- */

/* Asks for the session anew: a Welcome to an earlier Hello no longer counts. */
static void say_hello(struct lumi_wire_client *client, uint64_t now_ns)
{
    client->state = LUMI_WIRE_CLIENT_HELLO;
    client->hello_nonce++;
    send_hello(client, now_ns);
}

void lumi_wire_client_reconnected(struct lumi_wire_client *client, uint64_t now_ns)
{
    uint32_t frames = client->deframer.frames, errors = client->deframer.errors;

    lumi_wire_deframer_init(&client->deframer);
    client->deframer.frames = frames;
    client->deframer.errors = errors;
    say_hello(client, now_ns);
}

/* A request in flight goes on in its own session, if that has executed it or comes to it next. */
static bool goes_on(const struct lumi_wire_client *client, const lumi_wire_Welcome *welcome)
{
    return welcome->token == client->welcome.token &&
           (welcome->last_request == client->number || welcome->last_request == client->number - 1);
}

static void on_welcome(struct lumi_wire_client *client, const lumi_wire_Welcome *welcome, uint64_t now_ns)
{
    if (client->state != LUMI_WIRE_CLIENT_HELLO || welcome->host != client->host ||
        welcome->nonce != client->hello_nonce)
        return;
    if (welcome->version < client->version_min || welcome->version > client->version_max || welcome->version == 0) {
        client->welcome = *welcome;
        client->state = LUMI_WIRE_CLIENT_VERSION;
        if (client->in_flight) {
            client->in_flight = false;
            client->ops->request_lost(client->context, client->number);
        }
        return;
    }
    bool restarted = client->welcomed && welcome->boot != client->welcome.boot;
    bool lost = client->in_flight && !goes_on(client, welcome);
    uint32_t number = client->number;

    if (restarted || !client->welcomed) {
        client->events_next = client->events_stored = restarted ? 0 : welcome->events_first;
        memset(client->early_kept, 0, sizeof client->early_kept);
    }
    if (lost)
        client->in_flight = false;
    /* In the session of before, our own count is newer: the reply may have overtaken this Welcome. */
    if (lost || welcome->token != client->welcome.token)
        client->number = welcome->last_request;
    client->welcome = *welcome;
    client->welcomed = true;
    client->state = LUMI_WIRE_CLIENT_OPEN;
    if (client->in_flight)
        send_request(client, now_ns);
    send_heartbeat(client, false, now_ns);
    client->ops->welcome(client->context, &client->welcome, restarted);
    if (lost)
        client->ops->request_lost(client->context, number);
}

static void on_reply(struct lumi_wire_client *client, const lumi_wire_Reply *reply, uint64_t now_ns)
{
    bool ours = client->welcomed && reply->token == client->welcome.token;

    if (reply->token == 0) {
        if (reply->number == client->stop_nonce)
            client->stops_left = 0;
    } else if (ours && reply->result == lumi_wire_Result_NO_SESSION) {
        if (client->state == LUMI_WIRE_CLIENT_OPEN)
            say_hello(client, now_ns);
    } else if (!ours || !client->in_flight || reply->number != client->number) {
        client->duplicates++;
    } else if (reply->result == lumi_wire_Result_OUT_OF_ORDER) {
        if (client->state == LUMI_WIRE_CLIENT_OPEN)
            say_hello(client, now_ns);
    } else {
        client->in_flight = false;
        client->ops->reply(client->context, reply);
    }
}

/* The event after the last one that was handed on, if it came early. It is taken out before it is handed on: the
 * callback may do anything. */
static bool take_early(struct lumi_wire_client *client, lumi_wire_Event *event)
{
    uint32_t place = client->events_next % LUMI_WIRE_EARLY;

    if (!client->early_kept[place])
        return false;
    client->early_kept[place] = false;
    *event = client->early[place];
    return event->number == client->events_next;
}

static void hand_on(struct lumi_wire_client *client, const lumi_wire_Event *event)
{
    client->events_next = event->number + 1;
    client->ops->event(client->context, event);
}

/* Up to the oldest that the board still keeps: the early ones are handed on, the missing ones counted. */
static void skip_to(struct lumi_wire_client *client, uint32_t oldest)
{
    lumi_wire_Event event;
    uint32_t missing = 0;

    for (int i = 0; i < LUMI_WIRE_EARLY && client->events_next != oldest; i++) {
        if (!take_early(client, &event)) {
            client->events_next++;
            missing++;
            continue;
        }
        if (missing > 0)
            client->ops->events_lost(client->context, missing);
        missing = 0;
        hand_on(client, &event);
    }
    missing += oldest - client->events_next; /* nothing that far ahead waits */
    client->events_next = oldest;
    if (missing > 0)
        client->ops->events_lost(client->context, missing);
}

static void acknowledge_soon(struct lumi_wire_client *client, uint64_t now_ns)
{
    if (client->acknowledge)
        return;
    client->acknowledge = true;
    client->acknowledge_due_ns = now_ns + LUMI_WIRE_ACKNOWLEDGE_NS;
}

void lumi_wire_client_stored(struct lumi_wire_client *client, uint32_t boot, uint32_t number, uint64_t now_ns)
{
    if (!client->welcomed || boot != client->welcome.boot || (int32_t)(number + 1 - client->events_stored) <= 0 ||
        (int32_t)(number + 1 - client->events_next) > 0)
        return;
    client->events_stored = number + 1;
    acknowledge_soon(client, now_ns);
}

void lumi_wire_client_take_charge(struct lumi_wire_client *client, bool charge, uint64_t now_ns)
{
    client->observer = !charge;
    if (client->state == LUMI_WIRE_CLIENT_OPEN)
        send_heartbeat(client, false, now_ns);
}

static void on_event(struct lumi_wire_client *client, lumi_wire_Event *event, uint64_t now_ns)
{
    int32_t kept = (int32_t)(event->number - event->oldest);

    if (client->observer || client->state != LUMI_WIRE_CLIENT_OPEN || event->boot != client->welcome.boot || kept < 0)
        return;
    /* One that was stored comes again: the board has not been told. */
    if (!client->holds || (int32_t)(event->number - client->events_stored) < 0)
        acknowledge_soon(client, now_ns);
    if ((int32_t)(event->oldest - client->events_next) > 0)
        skip_to(client, event->oldest);
    int32_t ahead = (int32_t)(event->number - client->events_next);
    if (ahead < 0) {
        client->duplicates++;
    } else if (ahead > 0) {
        client->gaps++;
        if (ahead < LUMI_WIRE_EARLY) {
            client->early[event->number % LUMI_WIRE_EARLY] = *event;
            client->early_kept[event->number % LUMI_WIRE_EARLY] = true;
        }
    } else {
        do {
            hand_on(client, event);
        } while (take_early(client, event));
    }
}

static void on_pulse(struct lumi_wire_client *client, const lumi_wire_Pulse *pulse, uint64_t now_ns)
{
    if (client->state != LUMI_WIRE_CLIENT_OPEN || pulse->token != client->welcome.token)
        return;
    if (pulse->host_time > now_ns || (client->pulsed && pulse->host_time <= client->pulse_time)) {
        client->duplicates++;
        return;
    }
    client->pulsed = true;
    client->pulse_time = pulse->host_time;
    client->ops->pulse(client->context, pulse, now_ns);
}

void lumi_wire_client_receive(struct lumi_wire_client *client, const uint8_t *data, size_t size, uint64_t now_ns)
{
    lumi_wire_BoardFrame in;

    for (size_t i = 0; i < size; i++) {
        if (!lumi_wire_deframe(&client->deframer, data[i]))
            continue;
        if (!lumi_wire_decode_board(client->deframer.data, client->deframer.size, &in) || in.which_body == 0) {
            client->unread++;
            continue;
        }
        client->heard_ns = now_ns;
        if (in.which_body == lumi_wire_BoardFrame_welcome_tag)
            on_welcome(client, &in.body.welcome, now_ns);
        else if (in.which_body == lumi_wire_BoardFrame_reply_tag)
            on_reply(client, &in.body.reply, now_ns);
        else if (in.which_body == lumi_wire_BoardFrame_pulse_tag)
            on_pulse(client, &in.body.pulse, now_ns);
        else
            on_event(client, &in.body.event, now_ns);
    }
}

int lumi_wire_client_version(const struct lumi_wire_client *client, struct lumi_error *error)
{
    const lumi_wire_Welcome *board = &client->welcome;

    if (client->state != LUMI_WIRE_CLIENT_VERSION)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_VERSION,
                     "the board (%s, firmware %s) speaks versions %u to %u of the rig's messages, this program %u to "
                     "%u: %s",
                     board->board, board->firmware, (unsigned)board->version_min, (unsigned)board->version_max,
                     (unsigned)client->version_min, (unsigned)client->version_max,
                     board->version_max < client->version_min ? "flash the board anew (lumi rig flash)"
                                                              : "update this program");
}
