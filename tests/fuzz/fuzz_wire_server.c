/* A script of bytes, frames, events and time for the board's end of a link. A request is executed only in a session,
 * once, and in the order of the numbers; everything sent is a frame with a message in it. */
#include "proto/wire/server.h"
#include "wire_script.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define TOKENS 256

struct executed {
    uint32_t token, number;
};

struct board {
    struct lumi_wire_server server;
    struct lumi_wire_deframer out[LUMI_WIRE_LINKS];
    struct executed executed[TOKENS];
    uint64_t now_ns;
    int tokens;
    bool full;
};

static struct board board;

static void demand(bool holds)
{
    if (!holds)
        abort();
}

static void execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    struct executed *of = NULL;
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_note_tag};

    demand(context == &board && request->which_command != 0 && reply->result == lumi_wire_Result_DONE);
    for (int i = 0; i < board.tokens; i++)
        if (board.executed[i].token == request->token)
            of = &board.executed[i];
    if (!of && board.tokens < TOKENS) {
        of = &board.executed[board.tokens++];
        *of = (struct executed){request->token, 0};
    }
    if (of) {
        /* Numbers between may have been used up by requests that were refused unexecuted. */
        demand(request->number - of->number < 0x80000000u && request->number != of->number);
        of->number = request->number;
    }
    memset(event.kind.note.text, (int)(request->number & 0xff), sizeof event.kind.note.text);
    lumi_wire_server_event(&board.server, &event);
    memset(reply->text, (int)(request->number & 0xff), sizeof reply->text);
    reply->which_payload = request->number % 2 ? lumi_wire_Reply_status_tag : lumi_wire_Reply_shots_tag;
    if (request->number % 16 == 0)
        reply->payload.shots.states.size = (pb_size_t)(request->number >> 4); /* also what cannot be encoded */
}

static void status(void *context, lumi_wire_Status *message)
{
    (void)context;
    message->state = lumi_wire_State_IDLE;
}

static void nothing(void *context)
{
    (void)context;
}

static bool send(void *context, int link, const uint8_t *frame, size_t size)
{
    static lumi_wire_BoardFrame message;
    bool whole = false;

    (void)context;
    if (board.full)
        return false;
    for (size_t i = 0; i < size; i++)
        whole = lumi_wire_deframe(&board.out[link], frame[i]);
    demand(whole && lumi_wire_decode_board(board.out[link].data, board.out[link].size, &message));
    demand(message.which_body != 0);
    if (message.which_body == lumi_wire_BoardFrame_event_tag)
        demand((int32_t)(message.body.event.number - message.body.event.oldest) >= 0);
    return true;
}

static const struct lumi_wire_server_ops ops = {
    .execute = execute, .status = status, .emergency_stop = nothing, .heartbeat = nothing, .send = send};

static void sound(void)
{
    const struct lumi_wire_events *events = &board.server.events;

    demand(events->used <= LUMI_WIRE_EVENT_BYTES && events->head < LUMI_WIRE_EVENT_BYTES);
    demand(events->cursor - events->first <= events->next - events->first && events->cursor_at <= events->used);
    demand((events->first == events->next) == (events->used == 0));
    for (int i = 0; i < LUMI_WIRE_SESSIONS; i++)
        for (int k = 0; k < i; k++)
            demand(board.server.sessions[i].host == 0 ||
                   (board.server.sessions[i].host != board.server.sessions[k].host &&
                    board.server.sessions[i].token != board.server.sessions[k].token));
}

static void put(int link, const uint8_t *payload, size_t size)
{
    uint8_t frame[LUMI_WIRE_FRAME_MAX];

    lumi_wire_server_receive(&board.server, link, frame, lumi_wire_frame(payload, size, frame), board.now_ns);
}

/* A message with the token of a live session in it, and for a request its next number. */
static void put_in_session(const struct record *record, bool next)
{
    static lumi_wire_HostFrame message;
    const struct lumi_wire_session *session = &board.server.sessions[record->argument % LUMI_WIRE_SESSIONS];
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];

    if (!lumi_wire_decode_host(record->data, record->size, &message))
        return;
    if (message.which_body == lumi_wire_HostFrame_request_tag) {
        message.body.request.token = session->token;
        message.body.request.number = next ? session->last + 1 : session->last;
    } else if (message.which_body == lumi_wire_HostFrame_heartbeat_tag) {
        message.body.heartbeat.token = session->token;
        message.body.heartbeat.events_next += board.server.events.first;
    }
    put(record->argument % LUMI_WIRE_LINKS, payload, lumi_wire_encode_host(&message, payload, sizeof payload));
}

static void run(const struct record *record)
{
    int link = record->argument % LUMI_WIRE_LINKS;
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_shot_tag};

    switch (record->kind) {
    case 0:
        lumi_wire_server_receive(&board.server, link, record->data, record->size, board.now_ns);
        break;
    case 1:
        put(link, record->data, record->size);
        break;
    case 2:
    case 3:
        put_in_session(record, record->kind == 2);
        break;
    case 4:
        board.now_ns += record_number(record) % 4000000000u;
        break;
    case 5:
        board.full = record->argument & 1;
        break;
    default:
        for (int i = 0; i <= record->argument; i++) {
            event.kind.shot.edge_ns_count = (pb_size_t)(record->size % 17);
            lumi_wire_server_event(&board.server, &event);
        }
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const lumi_wire_Welcome identity = {.boot = 0xb007, .board = "fuzz"};
    struct script script = {data, size};
    struct record record;

    lumi_wire_server_init(&board.server, &ops, &board, &identity);
    for (int i = 0; i < LUMI_WIRE_LINKS; i++)
        lumi_wire_deframer_init(&board.out[i]);
    board.now_ns = 0;
    board.tokens = 0;
    board.full = false;
    if (size > 0) /* numbers of events begin anywhere */
        board.server.events.first = board.server.events.next = board.server.events.cursor = (uint32_t) - (int)data[0];
    while (script_next(&script, &record)) {
        run(&record);
        lumi_wire_server_poll(&board.server, board.now_ns);
        demand(lumi_wire_server_next_poll(&board.server, board.now_ns) >= board.now_ns);
        sound();
    }
    return 0;
}
