/* A script of bytes, frames, requests and time for the host's end of a link. A reply is handed on only to a request
 * that is in flight, events come one after the other with what is lost counted, pulses in order. */
#include "proto/wire/client.h"
#include "wire_script.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct host {
    struct lumi_wire_client client;
    struct lumi_wire_deframer out;
    uint64_t now_ns, pulse_time;
    uint32_t event_next, number;
    bool waiting, full, pulsed;
};

static struct host host;

static void demand(bool holds)
{
    if (!holds)
        abort();
}

static bool send(void *context, const uint8_t *frame, size_t size)
{
    static lumi_wire_HostFrame message;
    bool whole = false;

    (void)context;
    if (host.full)
        return false;
    for (size_t i = 0; i < size; i++)
        whole = lumi_wire_deframe(&host.out, frame[i]);
    demand(whole && lumi_wire_decode_host(host.out.data, host.out.size, &message) && message.which_body != 0);
    if (message.which_body == lumi_wire_HostFrame_request_tag)
        demand(message.body.request.token == host.client.welcome.token && message.body.request.token != 0);
    return true;
}

static void welcome(void *context, const lumi_wire_Welcome *message, bool restarted)
{
    (void)context;
    (void)restarted;
    demand(message->host == host.client.host && host.client.state == LUMI_WIRE_CLIENT_OPEN);
    host.event_next = host.client.events_next;
}

static void reply(void *context, const lumi_wire_Reply *message)
{
    (void)context;
    demand(host.waiting && message->number == host.number && message->result != lumi_wire_Result_NO_SESSION);
    host.waiting = false;
}

static void request_lost(void *context, uint32_t number)
{
    (void)context;
    demand(host.waiting && number == host.number);
    host.waiting = false;
}

static void event(void *context, const lumi_wire_Event *message)
{
    (void)context;
    demand(message->number == host.event_next++);
}

static void events_lost(void *context, uint32_t count)
{
    (void)context;
    demand(count > 0);
    host.event_next += count;
}

static void pulse(void *context, const lumi_wire_Pulse *message, uint64_t received_ns)
{
    (void)context;
    demand(received_ns == host.now_ns && message->host_time <= received_ns);
    demand(!host.pulsed || message->host_time > host.pulse_time);
    host.pulsed = true;
    host.pulse_time = message->host_time;
}

static const struct lumi_wire_client_ops ops = {.send = send,
                                                .welcome = welcome,
                                                .reply = reply,
                                                .request_lost = request_lost,
                                                .event = event,
                                                .events_lost = events_lost,
                                                .pulse = pulse};

static void put(const uint8_t *payload, size_t size)
{
    uint8_t frame[LUMI_WIRE_FRAME_MAX];

    lumi_wire_client_receive(&host.client, frame, lumi_wire_frame(payload, size, frame), host.now_ns);
}

/* A message with what the client expects in it: its host and nonce, its token, its boot, numbers near its own. */
static void put_fitting(const struct record *record)
{
    static lumi_wire_BoardFrame message;
    const struct lumi_wire_client *client = &host.client;
    uint8_t payload[LUMI_WIRE_PAYLOAD_MAX];

    if (!lumi_wire_decode_board(record->data, record->size, &message))
        return;
    if (message.which_body == lumi_wire_BoardFrame_welcome_tag) {
        message.body.welcome.host = client->host;
        message.body.welcome.nonce = client->hello_nonce;
        if (record->argument & 1) {
            message.body.welcome.token = client->welcome.token;
            message.body.welcome.boot = client->welcome.boot;
        }
        message.body.welcome.token += message.body.welcome.token == 0;
    } else if (message.which_body == lumi_wire_BoardFrame_reply_tag) {
        message.body.reply.token = client->welcome.token;
        message.body.reply.number = client->number;
    } else if (message.which_body == lumi_wire_BoardFrame_pulse_tag) {
        message.body.pulse.token = client->welcome.token;
    } else if (message.which_body == lumi_wire_BoardFrame_event_tag) {
        message.body.event.boot = client->welcome.boot;
        message.body.event.number += client->events_next;
        message.body.event.oldest += client->events_next;
    }
    put(payload, lumi_wire_encode_board(&message, payload, sizeof payload));
}

static void ask(const struct record *record)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_write_profile_tag};

    request.command.write_profile.data.size = (pb_size_t)(record->size % 257);
    if (lumi_wire_client_request(&host.client, &request, host.now_ns, NULL) == LUMI_OK) {
        demand(!host.waiting && request.number == host.client.number);
        host.waiting = true;
        host.number = request.number;
    }
}

static void run(const struct record *record)
{
    switch (record->kind) {
    case 0:
        lumi_wire_client_receive(&host.client, record->data, record->size, host.now_ns);
        break;
    case 1:
        put(record->data, record->size);
        break;
    case 2:
    case 3:
        put_fitting(record);
        break;
    case 4:
        host.now_ns += record_number(record) % 1000000000u;
        break;
    case 5:
        host.full = record->argument & 1;
        break;
    case 6:
        lumi_wire_client_reconnected(&host.client, host.now_ns);
        break;
    case 7:
        lumi_wire_client_emergency_stop(&host.client, host.now_ns);
        break;
    case 8:
        lumi_wire_client_stored(&host.client, host.client.welcome.boot + (record->argument & 1),
                                host.client.events_next - 1 + (uint32_t)record_number(record) % 16, host.now_ns);
        break;
    case 9:
        lumi_wire_client_take_charge(&host.client, record->argument & 1, host.now_ns);
        break;
    default:
        ask(record);
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct script script = {data, size};
    struct record record;
    struct lumi_error error = {0};

    memset(&host, 0, sizeof host);
    lumi_wire_client_init(&host.client, &ops, &host, 1);
    host.client.observer = size > 0 && data[size - 1] == 0xff;
    host.client.holds = size > 1 && data[size - 2] & 1;
    lumi_wire_deframer_init(&host.out);
    while (script_next(&script, &record)) {
        run(&record);
        lumi_wire_client_poll(&host.client, host.now_ns);
        demand(lumi_wire_client_next_poll(&host.client) > host.now_ns);
        demand(host.waiting == host.client.in_flight && host.event_next == host.client.events_next);
        demand((int32_t)(host.client.events_next - host.client.events_stored) >= 0);
        if (lumi_wire_client_version(&host.client, &error) != LUMI_OK)
            demand(error.text[0] != 0 && !strchr(error.text, '\n'));
    }
    return 0;
}
