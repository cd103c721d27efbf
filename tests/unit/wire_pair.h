/* A client and a server with nothing between them but what the test puts there: whatever each sends lies in a queue
 * until the test carries it over. The board behind the server counts what it is told. */
#ifndef LUMI_TESTS_UNIT_WIRE_PAIR_H
#define LUMI_TESTS_UNIT_WIRE_PAIR_H

#include "proto/wire/client.h"
#include "proto/wire/server.h"

#include <string.h>

#define PAIR_QUEUE 65536
#define PAIR_MS UINT64_C(1000000)

struct pair_queue {
    uint8_t data[PAIR_QUEUE];
    size_t size;
    bool full; /* takes nothing */
};

static inline bool pair_put(struct pair_queue *queue, const uint8_t *data, size_t size)
{
    if (queue->full || queue->size + size > PAIR_QUEUE)
        return false;
    memcpy(queue->data + queue->size, data, size);
    queue->size += size;
    return true;
}

/* The board: what it was told, and what it answers. */
struct pair_board {
    struct lumi_wire_server server;
    struct pair_queue out[LUMI_WIRE_LINKS];
    int executed, stops, heartbeats;
    lumi_wire_Request last;
    lumi_wire_Reply answer;
    int events_per_request;
};

static inline void pair_execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    struct pair_board *board = context;

    board->executed++;
    board->last = *request;
    *reply = board->answer;
    for (int i = 0; i < board->events_per_request; i++) {
        lumi_wire_Event event = {.which_kind = lumi_wire_Event_shot_tag};
        event.kind.shot.number = (uint32_t)board->executed;
        lumi_wire_server_event(&board->server, &event);
    }
}

static inline void pair_status(void *context, lumi_wire_Status *status)
{
    (void)context;
    status->step = -12345678901;
}

static inline void pair_stop(void *context)
{
    ((struct pair_board *)context)->stops++;
}

static inline void pair_heartbeat(void *context)
{
    ((struct pair_board *)context)->heartbeats++;
}

static inline bool pair_board_send(void *context, int link, const uint8_t *frame, size_t size)
{
    return pair_put(&((struct pair_board *)context)->out[link], frame, size);
}

static const struct lumi_wire_server_ops pair_server_ops = {.execute = pair_execute,
                                                            .status = pair_status,
                                                            .emergency_stop = pair_stop,
                                                            .heartbeat = pair_heartbeat,
                                                            .send = pair_board_send};

static inline void pair_board_start(struct pair_board *board, uint32_t boot)
{
    lumi_wire_Welcome identity = {.boot = boot, .board = "host", .firmware = "0.1.0"};

    memset(board, 0, sizeof *board);
    lumi_wire_server_init(&board->server, &pair_server_ops, board, &identity);
}

/* The host: what its client told it. */
struct pair_host {
    struct lumi_wire_client client;
    struct pair_queue out;
    int welcomes, restarts, replies, requests_lost, events, pulses;
    uint32_t events_lost, next_event;
    bool disorder; /* an event came that was not the next one */
    lumi_wire_Reply reply;
    lumi_wire_Event event;
    lumi_wire_Pulse pulse;
};

static inline bool pair_host_send(void *context, const uint8_t *frame, size_t size)
{
    return pair_put(&((struct pair_host *)context)->out, frame, size);
}

static inline void pair_welcome(void *context, const lumi_wire_Welcome *welcome, bool restarted)
{
    struct pair_host *host = context;

    host->welcomes++;
    if (restarted) {
        host->restarts++;
        host->next_event = 0;
    } else if (host->welcomes == 1) {
        host->next_event = welcome->events_first;
    }
}

static inline void pair_reply(void *context, const lumi_wire_Reply *reply)
{
    ((struct pair_host *)context)->replies++;
    ((struct pair_host *)context)->reply = *reply;
}

static inline void pair_request_lost(void *context, uint32_t number)
{
    (void)number;
    ((struct pair_host *)context)->requests_lost++;
}

static inline void pair_event(void *context, const lumi_wire_Event *event)
{
    struct pair_host *host = context;

    host->disorder = host->disorder || event->number != host->next_event;
    host->next_event = event->number + 1;
    host->events++;
    host->event = *event;
}

static inline void pair_events_lost(void *context, uint32_t count)
{
    ((struct pair_host *)context)->events_lost += count;
    ((struct pair_host *)context)->next_event += count;
}

static inline void pair_pulse(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns)
{
    (void)received_ns;
    ((struct pair_host *)context)->pulses++;
    ((struct pair_host *)context)->pulse = *pulse;
}

static const struct lumi_wire_client_ops pair_client_ops = {.send = pair_host_send,
                                                            .welcome = pair_welcome,
                                                            .reply = pair_reply,
                                                            .request_lost = pair_request_lost,
                                                            .event = pair_event,
                                                            .events_lost = pair_events_lost,
                                                            .pulse = pair_pulse};

static inline void pair_host_start(struct pair_host *host, uint64_t number)
{
    memset(host, 0, sizeof *host);
    lumi_wire_client_init(&host->client, &pair_client_ops, host, number);
}

/* Carries all that waits over `link`, both ways; so often that answers get through. */
static inline void pair_carry(struct pair_host *host, struct pair_board *board, int link, uint64_t now_ns)
{
    for (int i = 0; i < 3; i++) {
        size_t size = host->out.size;

        host->out.size = 0;
        lumi_wire_server_receive(&board->server, link, host->out.data, size, now_ns);
        lumi_wire_server_poll(&board->server, now_ns);
        size = board->out[link].size;
        board->out[link].size = 0;
        lumi_wire_client_receive(&host->client, board->out[link].data, size, now_ns);
    }
}

/* What the other side never sees. */
static inline void pair_lose(struct pair_queue *queue)
{
    queue->size = 0;
}

static inline void pair_run(struct pair_host *host, struct pair_board *board, int link, uint64_t from_ns,
                            uint64_t to_ns)
{
    for (uint64_t now = from_ns; now <= to_ns; now += 5 * PAIR_MS) {
        lumi_wire_client_poll(&host->client, now);
        pair_carry(host, board, link, now);
    }
}

#endif
