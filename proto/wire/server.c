/* The board's end of the link. */
#include "proto/wire/server.h"

#include <assert.h>
#include <float.h>
#include <string.h>

/* Around the bytes of an event that is sent: BoardFrame's tag and length, then boot and oldest. */
#define EVENT_HEAD_MAX 3
#define EVENT_TAIL_MAX (1 + 4 + 1 + 5)
#define TAG_VARINT 0u
#define TAG_BYTES 2u
#define TAG_FIXED32 5u

static_assert(EVENT_HEAD_MAX + LUMI_WIRE_EVENT_MAX + EVENT_TAIL_MAX <= LUMI_WIRE_PAYLOAD_MAX, "an event fits a frame");
static_assert(lumi_wire_BoardFrame_size <= LUMI_WIRE_PAYLOAD_MAX && lumi_wire_HostFrame_size <= LUMI_WIRE_PAYLOAD_MAX,
              "every message fits a frame");

void lumi_wire_server_init(struct lumi_wire_server *server, const struct lumi_wire_server_ops *ops, void *context,
                           const lumi_wire_Welcome *identity)
{
    memset(server, 0, sizeof *server);
    server->ops = ops;
    server->context = context;
    server->identity = *identity;
    if (server->identity.version_max == 0) {
        server->identity.version_min = LUMI_WIRE_VERSION_MIN;
        server->identity.version_max = LUMI_WIRE_VERSION_MAX;
    }
    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++)
        server->sessions[i].reply_link = -1;
    for (int i = 0; i < LUMI_WIRE_LINKS; i++)
        lumi_wire_deframer_init(&server->links[i].deframer);
    lumi_wire_events_init(&server->events);
    server->event_link = -1;
}

static bool send_payload(struct lumi_wire_server *server, int link, const uint8_t *payload, size_t size)
{
    return server->ops->send(server->context, link, server->frame, lumi_wire_frame(payload, size, server->frame));
}

static bool send_message(struct lumi_wire_server *server, int link, const lumi_wire_BoardFrame *message)
{
    size_t size = lumi_wire_encode_board(message, server->payload, sizeof server->payload);

    return size == 0 || send_payload(server, link, server->payload, size);
}

static lumi_wire_BoardFrame *blank(struct lumi_wire_server *server, pb_size_t body)
{
    lumi_wire_BoardFrame *out = &server->scratch[1].out;

    memset(out, 0, sizeof *out);
    out->which_body = body;
    return out;
}

/* ---- sessions ---- */

static struct lumi_wire_session *session_of(struct lumi_wire_server *server, uint32_t token)
{
    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++)
        if (server->sessions[i].host != 0 && server->sessions[i].token == token)
            return &server->sessions[i];
    return NULL;
}

/* A finalizer that spreads every bit: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014. */
static uint64_t mix(uint64_t value)
{
    value = (value ^ value >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    value = (value ^ value >> 27) * UINT64_C(0x94d049bb133111eb);
    return value ^ value >> 31;
}

static uint32_t new_token(struct lumi_wire_server *server, uint64_t host, uint64_t now_ns)
{
    uint32_t token;

    do {
        uint64_t seed = (uint64_t)server->identity.boot << 32 | ++server->tokens;
        token = (uint32_t)(mix(mix(mix(seed) ^ host) ^ now_ns) >> 32);
    } while (token == 0 || session_of(server, token));
    return token;
}

/* The host's session, or a new one in place of the one that was silent longest. */
static struct lumi_wire_session *open_session(struct lumi_wire_server *server, uint64_t host, uint64_t now_ns)
{
    struct lumi_wire_session *oldest = &server->sessions[0];

    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++) {
        struct lumi_wire_session *session = &server->sessions[i];

        if (session->host == host)
            return session;
        if (oldest->host != 0 && (session->host == 0 || session->heard_ns < oldest->heard_ns))
            oldest = session;
    }
    if (oldest->host != 0 && oldest->token == server->event_token)
        server->event_link = -1;
    *oldest = (struct lumi_wire_session){
        .host = host, .token = new_token(server, host, now_ns), .heard_ns = now_ns, .reply_link = -1};
    return oldest;
}

/* Answers the link's last Hello; opens a session if there is none yet. */
static bool send_welcome(struct lumi_wire_server *server, int link, uint64_t now_ns)
{
    const lumi_wire_Hello *hello = &server->links[link].hello;
    const lumi_wire_Welcome *identity = &server->identity;
    lumi_wire_BoardFrame *out = blank(server, lumi_wire_BoardFrame_welcome_tag);
    lumi_wire_Welcome *welcome = &out->body.welcome;
    uint32_t version = hello->version_max < identity->version_max ? hello->version_max : identity->version_max;

    *welcome = *identity;
    welcome->version = version >= hello->version_min && version >= identity->version_min ? version : 0;
    welcome->host = hello->host;
    welcome->nonce = hello->nonce;
    welcome->token = welcome->last_request = 0;
    if (welcome->version != 0) {
        struct lumi_wire_session *session = open_session(server, hello->host, now_ns);

        session->heard_ns = now_ns;
        welcome->token = session->token;
        welcome->last_request = session->last;
        welcome->events_first = server->events.first;
    }
    return send_message(server, link, out);
}

/* ---- requests ---- */

static void fill_counts(const struct lumi_wire_server *server, lumi_wire_Status *status)
{
    status->events_next = server->events.next;
    status->events_lost = server->events.lost;
}

static bool is_finite(double value)
{
    return value >= -DBL_MAX && value <= DBL_MAX;
}

static bool finite_plan(const lumi_wire_Plan *plan)
{
    for (pb_size_t i = 0; i < plan->exposures_count; i++)
        if (!is_finite(plan->exposures[i]))
            return false;
    return is_finite(plan->turn_time) && is_finite(plan->position_time) && is_finite(plan->settle) &&
           is_finite(plan->bracket_gap) && is_finite(plan->blur_max);
}

static bool finite_request(const lumi_wire_Request *request)
{
    switch (request->which_command) {
    case lumi_wire_Request_jog_tag:
        return is_finite(request->command.jog.turns) && is_finite(request->command.jog.speed);
    case lumi_wire_Request_test_triggers_tag:
        return is_finite(request->command.test_triggers.exposure) && is_finite(request->command.test_triggers.gap);
    case lumi_wire_Request_load_plan_tag:
        return finite_plan(&request->command.load_plan.plan);
    case lumi_wire_Request_fire_here_tag:
        return is_finite(request->command.fire_here.timeout);
    default:
        return true;
    }
}

static void refuse(lumi_wire_Reply *reply, lumi_wire_Result result, const char *text)
{
    reply->result = result;
    lumi_wire_copy_text(reply->text, sizeof reply->text, text);
}

/* The one place where a request is executed: once `last` is set, its number does not come here again. */
static void execute(struct lumi_wire_server *server, struct lumi_wire_session *session,
                    const lumi_wire_Request *request, bool malformed)
{
    lumi_wire_BoardFrame *out = blank(server, lumi_wire_BoardFrame_reply_tag);
    lumi_wire_Reply *reply = &out->body.reply;

    session->last = request->number;
    if (malformed)
        refuse(reply, lumi_wire_Result_BAD, "a text or a list is too long, or the request is malformed");
    else if (request->which_command == 0)
        refuse(reply, lumi_wire_Result_UNSUPPORTED, "not a command of this version");
    else if (!finite_request(request))
        refuse(reply, lumi_wire_Result_BAD, "a number is not finite");
    else
        server->ops->execute(server->context, request, reply);
    reply->token = session->token;
    reply->number = session->last;
    lumi_wire_clean_text(reply->text, sizeof reply->text);
    if (reply->which_payload == lumi_wire_Reply_status_tag)
        fill_counts(server, &reply->payload.status);
    session->reply_size = (uint16_t)lumi_wire_encode_board(out, session->reply, sizeof session->reply);
    if (session->reply_size == 0) {
        reply->which_payload = 0;
        refuse(reply, lumi_wire_Result_FAILED, "done, but its reply cannot be sent");
        session->reply_size = (uint16_t)lumi_wire_encode_board(out, session->reply, sizeof session->reply);
    }
    assert(session->reply_size > 0);
}

/* A reply that belongs to no request that was executed. */
static void answer(struct lumi_wire_server *server, int link, uint32_t token, uint32_t number, lumi_wire_Result result)
{
    struct lumi_wire_server_link *to = &server->links[link];

    to->answer = true;
    to->answer_token = token;
    to->answer_number = number;
    to->answer_result = result;
}

static bool send_answer(struct lumi_wire_server *server, int link)
{
    const struct lumi_wire_server_link *to = &server->links[link];
    lumi_wire_BoardFrame *out = blank(server, lumi_wire_BoardFrame_reply_tag);

    out->body.reply.token = to->answer_token;
    out->body.reply.number = to->answer_number;
    out->body.reply.result = to->answer_result;
    return send_message(server, link, out);
}

static void on_request(struct lumi_wire_server *server, int link, const lumi_wire_Request *request, bool malformed,
                       uint64_t now_ns)
{
    struct lumi_wire_session *session = session_of(server, request->token);

    if (!session) {
        answer(server, link, request->token, request->number, lumi_wire_Result_NO_SESSION);
        return;
    }
    session->heard_ns = now_ns;
    if (request->number == session->last + 1) {
        execute(server, session, request, malformed);
        session->reply_link = link;
    } else if (request->number == session->last && session->reply_size > 0) {
        server->repeated++;
        session->reply_link = link;
    } else {
        answer(server, link, request->token, request->number, lumi_wire_Result_OUT_OF_ORDER);
    }
}

/* ---- heartbeats and events ---- */

static void take_events(struct lumi_wire_server *server, int link, const lumi_wire_Heartbeat *beat, uint64_t now_ns)
{
    bool other = server->event_link != link || server->event_token != beat->token;

    server->event_link = link;
    server->event_token = beat->token;
    server->event_heard_ns = now_ns;
    if (lumi_wire_events_acknowledge(&server->events, beat->events_next))
        server->event_resend_ns = now_ns + LUMI_WIRE_EVENT_RESEND_NS;
    if (other)
        lumi_wire_events_rewind(&server->events);
    server->ops->heartbeat(server->context);
}

static void on_heartbeat(struct lumi_wire_server *server, int link, const lumi_wire_Heartbeat *beat, uint64_t now_ns)
{
    struct lumi_wire_session *session = session_of(server, beat->token);

    if (!session) {
        answer(server, link, beat->token, 0, lumi_wire_Result_NO_SESSION);
        return;
    }
    session->heard_ns = now_ns;
    if (!beat->observer)
        take_events(server, link, beat, now_ns);
    if (!beat->quiet) {
        server->links[link].pulse = true;
        server->links[link].beat = *beat;
        server->links[link].beat_ns = now_ns;
    }
}

static bool send_pulse(struct lumi_wire_server *server, int link, uint64_t now_ns)
{
    const struct lumi_wire_server_link *from = &server->links[link];
    lumi_wire_BoardFrame *out = blank(server, lumi_wire_BoardFrame_pulse_tag);
    lumi_wire_Pulse *pulse = &out->body.pulse;

    pulse->token = from->beat.token;
    pulse->host_time = from->beat.host_time;
    pulse->received_ns = from->beat_ns;
    pulse->sent_ns = now_ns;
    pulse->has_status = true;
    server->ops->status(server->context, &pulse->status);
    fill_counts(server, &pulse->status);
    return send_message(server, link, out);
}

static size_t put_varint(uint8_t *data, uint32_t value)
{
    size_t size = 0;

    while (value >= 0x80) {
        data[size++] = (uint8_t)(value | 0x80);
        value >>= 7;
    }
    data[size++] = (uint8_t)value;
    return size;
}

static size_t put_tag(uint8_t *data, uint32_t field, uint32_t type)
{
    return put_varint(data, field << 3 | type);
}

static size_t put_fixed32(uint8_t *data, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        data[i] = (uint8_t)(value >> 8 * i);
    return 4;
}

/* The next event's frame, made around its bytes without decoding them. 0: there is none. */
static size_t event_payload(struct lumi_wire_server *server)
{
    uint8_t tail[EVENT_TAIL_MAX], *out = server->payload;
    size_t size = lumi_wire_events_peek(&server->events, out + EVENT_HEAD_MAX), tail_size, head;

    if (size == 0)
        return 0;
    tail_size = put_tag(tail, lumi_wire_Event_boot_tag, TAG_FIXED32);
    tail_size += put_fixed32(tail + tail_size, server->identity.boot);
    tail_size += put_tag(tail + tail_size, lumi_wire_Event_oldest_tag, TAG_VARINT);
    tail_size += put_varint(tail + tail_size, server->events.first);
    head = put_tag(out, lumi_wire_BoardFrame_event_tag, TAG_BYTES);
    head += put_varint(out + head, (uint32_t)(size + tail_size));
    memmove(out + head, out + EVENT_HEAD_MAX, size);
    memcpy(out + head + size, tail, tail_size);
    return head + size + tail_size;
}

static void send_events(struct lumi_wire_server *server, uint64_t now_ns)
{
    struct lumi_wire_events *events = &server->events;
    size_t size;

    if (now_ns - server->event_heard_ns >= LUMI_WIRE_SILENCE_NS) {
        server->event_link = -1;
        return;
    }
    if (events->cursor != events->first && now_ns >= server->event_resend_ns)
        lumi_wire_events_rewind(events);
    while ((size = event_payload(server)) > 0) {
        if (!send_payload(server, server->event_link, server->payload, size))
            return;
        if (events->cursor == events->first)
            server->event_resend_ns = now_ns + LUMI_WIRE_EVENT_RESEND_NS;
        lumi_wire_events_advance(events);
    }
}

/* ---- entries ---- */

static void send_waiting(struct lumi_wire_server *server, uint64_t now_ns)
{
    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++) {
        struct lumi_wire_session *session = &server->sessions[i];

        if (session->reply_link >= 0 && send_payload(server, session->reply_link, session->reply, session->reply_size))
            session->reply_link = -1;
    }
    for (int i = 0; i < LUMI_WIRE_LINKS; i++) {
        struct lumi_wire_server_link *link = &server->links[i];

        link->welcome = link->welcome && !send_welcome(server, i, now_ns);
        link->answer = link->answer && !send_answer(server, i);
        link->pulse = link->pulse && !send_pulse(server, i, now_ns);
    }
}

/* Nothing that goes before events waits for this link. */
static bool clear_for_events(const struct lumi_wire_server *server, int link)
{
    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++)
        if (server->sessions[i].reply_link == link)
            return false;
    return !server->links[link].welcome && !server->links[link].answer && !server->links[link].pulse;
}

static void on_frame(struct lumi_wire_server *server, int link, uint64_t now_ns)
{
    const struct lumi_wire_deframer *deframer = &server->links[link].deframer;
    lumi_wire_HostFrame *in = &server->scratch[0].in;

    if (!lumi_wire_decode_host(deframer->data, deframer->size, in)) {
        lumi_wire_Request *head = &in->body.request;

        memset(in, 0, sizeof *in);
        if (lumi_wire_decode_request_head(deframer->data, deframer->size, &head->token, &head->number))
            on_request(server, link, head, true, now_ns);
        else
            server->unread++;
        return;
    }
    switch (in->which_body) {
    case lumi_wire_HostFrame_hello_tag:
        server->links[link].welcome = in->body.hello.host != 0;
        server->links[link].hello = in->body.hello;
        break;
    case lumi_wire_HostFrame_request_tag:
        on_request(server, link, &in->body.request, false, now_ns);
        break;
    case lumi_wire_HostFrame_heartbeat_tag:
        on_heartbeat(server, link, &in->body.heartbeat, now_ns);
        break;
    case lumi_wire_HostFrame_emergency_stop_tag:
        server->ops->emergency_stop(server->context);
        answer(server, link, 0, in->body.emergency_stop.nonce, lumi_wire_Result_DONE);
        break;
    default:
        server->unread++;
        break;
    }
}

void lumi_wire_server_receive(struct lumi_wire_server *server, int link, const uint8_t *data, size_t size,
                              uint64_t now_ns)
{
    assert(link >= 0 && link < LUMI_WIRE_LINKS);
    for (size_t i = 0; i < size; i++)
        if (lumi_wire_deframe(&server->links[link].deframer, data[i])) {
            on_frame(server, link, now_ns);
            send_waiting(server, now_ns);
        }
}

void lumi_wire_server_poll(struct lumi_wire_server *server, uint64_t now_ns)
{
    send_waiting(server, now_ns);
    if (server->event_link >= 0 && clear_for_events(server, server->event_link))
        send_events(server, now_ns);
}

uint64_t lumi_wire_server_next_poll(const struct lumi_wire_server *server, uint64_t now_ns)
{
    const struct lumi_wire_events *events = &server->events;

    for (int i = 0; i < LUMI_WIRE_LINKS; i++)
        if (!clear_for_events(server, i))
            return now_ns;
    if (server->event_link < 0 || events->first == events->next)
        return UINT64_MAX;
    if (events->cursor != events->next)
        return now_ns;
    return server->event_resend_ns;
}

void lumi_wire_server_event(struct lumi_wire_server *server, lumi_wire_Event *event)
{
    lumi_wire_clean_event(event);
    bool kept = lumi_wire_events_add(&server->events, event);
    assert(kept);
    (void)kept;
}
