/* The way to the board, as daemon/rig's link does it, in virtual time: a session, requests one after another, events
 * held until they are stored, clocks matched by the heartbeats. */
#include "capture_world.h"

#include "proto/base/bytes.h"
#include "sim/rig/machine_priv.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PATIENCE_NS (2 * WORLD_SECOND) /* without a word: silent */
#define RETRY_NS (WORLD_SECOND / 4)    /* a stream that is not there is tried again */
#define REQUEST_NS (10 * WORLD_SECOND) /* nobody waits longer for an answer */
#define TELL_NS (WORLD_SECOND / 2)

/* ---- what the client tells ---- */

static bool on_send(void *context, const uint8_t *frame, size_t size)
{
    struct world *w = context;

    if (!w->stream_open)
        return false;
    sim_machine_put(w->machine, frame, size);
    return true;
}

static void tell(struct world *w, const struct lumi_rig_notice *notice)
{
    if (w->engine)
        lumi_engine_rig_notice(w->engine, w->now_ns, notice);
}

static void tell_snapshot(struct world *w)
{
    w->snapshot_told_ns = w->now_ns;
    w->snapshot.clock_matched = lumi_clock_matched(&w->clock);
    w->snapshot.clock_drift_known = w->clock.drift_known;
    w->snapshot.clock_drift_ppm = w->clock.drift * 1e6;
    w->snapshot.clock_residual_ns = w->clock.residual_ns;
    w->snapshot.round_trip_ns = w->clock.round_trip_ns;
    if (w->snapshot.clock_matched)
        w->snapshot.clock_offset_ns =
            (int64_t)(lumi_clock_to_board(&w->clock, (uint64_t)w->now_ns) - (uint64_t)w->now_ns);
    w->snapshot.stop_pending = w->client.stops_left > 0;
    if (w->engine)
        lumi_engine_rig_status(w->engine, w->now_ns, &w->snapshot);
}

static void on_welcome(void *context, const lumi_wire_Welcome *welcome, bool restarted)
{
    struct world *w = context;
    struct lumi_rig_notice notice = {
        .kind = LUMI_RIG_NOTICE_CONNECTED, .host_ns = (uint64_t)w->now_ns, .restarted = restarted};

    w->snapshot.welcome = *welcome;
    w->snapshot.state = LUMI_RIG_LINK_OPEN;
    w->snapshot.code = LUMI_OK;
    w->snapshot.text[0] = 0;
    if (!w->boot_known || w->boot != welcome->boot) {
        w->snapshot.restarts += w->boot_known;
        lumi_clock_match_restart(&w->clock);
        w->snapshot.status_known = false;
    }
    w->boot = welcome->boot;
    w->boot_known = true;
    tell(w, &notice);
}

static void answer(struct world *w, int code, const char *text, const lumi_wire_Reply *reply)
{
    struct world_request done = w->requests[0];

    w->in_flight = false;
    memmove(w->requests, w->requests + 1, (size_t)--w->request_count * sizeof w->requests[0]);
    if (!w->engine)
        return;
    if (done.profile)
        lumi_engine_rig_profile(w->engine, w->now_ns, done.number, code, text, NULL);
    else
        lumi_engine_rig_reply(w->engine, w->now_ns, done.number, code, text, code == LUMI_ERR_IO ? NULL : reply);
}

static void answer_profile(struct world *w)
{
    lumi_wire_Profile *scratch = calloc(1, sizeof *scratch);
    struct lumi_rig *rig = calloc(1, sizeof *rig);
    struct lumi_error error = {0};
    struct world_request done = w->requests[0];
    int code = lumi_wire_decode_profile(w->profile, w->profile_size, scratch, rig, &error);

    if (code != LUMI_OK) {
        answer(w, code, error.text, NULL);
    } else {
        w->in_flight = false;
        memmove(w->requests, w->requests + 1, (size_t)--w->request_count * sizeof w->requests[0]);
        if (w->engine)
            lumi_engine_rig_profile(w->engine, w->now_ns, done.number, LUMI_OK, "", rig);
    }
    free(rig);
    free(scratch);
}

static void take_part(struct world *w, const lumi_wire_Reply *reply)
{
    const lumi_wire_ProfilePart *part = &reply->payload.profile;
    struct lumi_error error = {0};

    w->in_flight = false;
    if (lumi_wire_reply_result(reply, &error) != LUMI_OK) {
        answer(w, LUMI_ERR_NOTFOUND, error.text, NULL);
        return;
    }
    if (part->offset == 0)
        w->profile_size = 0;
    if (part->offset != w->profile_size || part->size > LUMI_WIRE_PROFILE_MAX) {
        answer(w, LUMI_ERR_FORMAT, "a part that does not fit", NULL);
        return;
    }
    memcpy(w->profile + part->offset, part->data.bytes, part->data.size);
    w->profile_size += part->data.size;
    w->requests[0].request.command.read_profile.offset = w->profile_size;
    if (w->profile_size >= part->size)
        answer_profile(w);
}

static void on_reply(void *context, const lumi_wire_Reply *reply)
{
    struct world *w = context;
    struct lumi_error error = {0};

    if (!w->in_flight)
        return;
    if (w->requests[0].profile)
        take_part(w, reply);
    else
        answer(w, lumi_wire_reply_result(reply, &error), reply->text, reply);
}

static void on_request_lost(void *context, uint32_t number)
{
    struct world *w = context;

    (void)number;
    w->snapshot.requests_lost++;
    if (w->in_flight)
        answer(w, LUMI_ERR_IO, "the board started again before it answered", NULL);
}

static void on_event(void *context, const lumi_wire_Event *event)
{
    struct world *w = context;
    struct lumi_rig_notice notice = {
        .kind = LUMI_RIG_NOTICE_EVENT, .host_ns = lumi_clock_to_host(&w->clock, event->time_ns), .event = *event};

    tell(w, &notice);
}

static void on_events_lost(void *context, uint32_t count)
{
    struct world *w = context;
    struct lumi_rig_notice notice = {
        .kind = LUMI_RIG_NOTICE_EVENTS_LOST, .host_ns = (uint64_t)w->now_ns, .count = count};

    tell(w, &notice);
}

static void on_pulse(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns)
{
    struct world *w = context;
    struct lumi_clock_sample sample = {pulse->host_time, pulse->received_ns, pulse->sent_ns, received_ns};

    lumi_clock_match_add(&w->clock, &sample);
    if (!pulse->has_status)
        return;
    w->snapshot.status = pulse->status;
    w->snapshot.status_known = true;
    w->snapshot.status_ns = received_ns;
    w->snapshot.status_board_ns = pulse->sent_ns;
    tell_snapshot(w);
}

static const struct lumi_wire_client_ops ops = {
    on_send, on_welcome, on_reply, on_request_lost, on_event, on_events_lost, on_pulse,
};

/* ---- life ---- */

void world_board_restart_host(struct world *w)
{
    memset(&w->snapshot, 0, sizeof w->snapshot);
    snprintf(w->snapshot.name, sizeof w->snapshot.name, "simulated board");
    snprintf(w->snapshot.text, sizeof w->snapshot.text, "not opened yet");
    w->snapshot.code = LUMI_ERR_NOTFOUND;
    w->boot_known = w->stream_open = w->in_flight = false;
    w->request_count = 0;
    w->read_size = 0;
    w->stream_try_ns = w->now_ns;
    lumi_clock_match_init(&w->clock);
    lumi_wire_client_init(&w->client, &ops, w, ++w->client_number + w->options.seed * 1000);
    w->client.holds = true;
}

/* The profile goes onto the board by the machine's own host, which then leaves. */
bool world_board_create(struct world *w)
{
    struct sim_machine_options options;
    struct lumi_error error = {0};

    sim_machine_options_init(&options, &w->rig);
    options.seed = w->options.seed;
    options.link = w->options.link;
    options.link_delay = w->options.link_delay;
    options.link_rate = w->options.link_rate;
    w->machine = sim_machine_create(&w->rig, &options);
    w->profile = malloc(LUMI_WIRE_PROFILE_MAX);
    if (!w->machine || !w->profile)
        return world_wrong(w, "no memory for a board");
    if (sim_machine_configure(w->machine, &w->rig, &error) != LUMI_OK)
        return world_wrong(w, "the board takes no profile: %s", error.text);
    sim_machine_release_host(w->machine);
    double shortest = w->plan.exposures[0];
    for (int i = 1; i < w->plan.bracket; i++)
        shortest = w->plan.exposures[i] < shortest ? w->plan.exposures[i] : shortest;
    sim_mechanics_set_exposures(sim_machine_mechanics(w->machine), &shortest, 1);
    w->now_ns = world_host_ns(w, sim_machine_now(w->machine));
    world_board_restart_host(w);
    return true;
}

void world_board_destroy(struct world *w)
{
    sim_machine_destroy(w->machine);
    free(w->profile);
}

void world_board_request(struct world *w, uint32_t number, bool profile, const lumi_wire_Request *request)
{
    struct world_request *r = &w->requests[w->request_count];

    if (w->request_count == WORLD_REQUESTS) {
        world_wrong(w, "%d requests wait for the board", WORLD_REQUESTS);
        return;
    }
    w->request_count++;
    memset(r, 0, sizeof *r);
    r->number = number;
    r->profile = profile;
    r->deadline_ns = w->now_ns + REQUEST_NS;
    if (profile)
        r->request.which_command = lumi_wire_Request_read_profile_tag;
    else
        r->request = *request;
}

/* ---- service ---- */

static void set_state(struct world *w, enum lumi_rig_link_state state, int code, const char *text)
{
    bool changed = w->snapshot.state != state;

    w->snapshot.state = state;
    w->snapshot.code = code;
    snprintf(w->snapshot.text, sizeof w->snapshot.text, "%s", text);
    if (changed)
        tell_snapshot(w);
}

static void watch_stream(struct world *w)
{
    if (w->stream_open && w->machine->unplugged) {
        struct lumi_rig_notice notice = {.kind = LUMI_RIG_NOTICE_DISCONNECTED, .host_ns = (uint64_t)w->now_ns};
        w->stream_open = false;
        w->stream_try_ns = w->now_ns + RETRY_NS;
        w->read_size = 0;
        snprintf(notice.text, sizeof notice.text, "the board is gone");
        tell(w, &notice);
        set_state(w, LUMI_RIG_LINK_CLOSED, LUMI_ERR_NOTFOUND, "the board is gone");
    } else if (!w->stream_open && w->now_ns >= w->stream_try_ns) {
        w->stream_try_ns = w->now_ns + RETRY_NS;
        if (w->machine->unplugged)
            return;
        w->stream_open = true;
        w->snapshot.reconnections += w->client.welcomed;
        if (w->client.welcomed)
            lumi_wire_client_reconnected(&w->client, (uint64_t)w->now_ns);
    }
}

static void watch_silence(struct world *w)
{
    int64_t heard = (int64_t)w->client.heard_ns;

    if (!w->stream_open)
        return;
    if (w->client.state == LUMI_WIRE_CLIENT_OPEN && w->now_ns - heard < PATIENCE_NS)
        set_state(w, LUMI_RIG_LINK_OPEN, LUMI_OK, "");
    else
        set_state(w, LUMI_RIG_LINK_SILENT, LUMI_ERR_IO, "nothing answers");
}

static void start_request(struct world *w)
{
    struct lumi_error error = {0};

    while (w->request_count > 0 && w->now_ns >= w->requests[0].deadline_ns)
        answer(w, LUMI_ERR_IO, "no answer; whether the board has executed it is not known", NULL);
    if (w->request_count > 0 && !w->in_flight) {
        int code = lumi_wire_client_request(&w->client, &w->requests[0].request, (uint64_t)w->now_ns, &error);
        w->in_flight = code == LUMI_OK;
        if (code != LUMI_OK && code != LUMI_ERR_BUSY)
            answer(w, code, error.text, NULL);
    }
}

void world_board_service(struct world *w)
{
    watch_stream(w);
    if (w->read_size > 0) {
        size_t size = w->read_size;
        w->read_size = 0;
        if (w->stream_open)
            lumi_wire_client_receive(&w->client, w->read_ahead, size, (uint64_t)w->now_ns);
    }
    if (w->stream_open && lumi_wire_client_next_poll(&w->client) <= (uint64_t)w->now_ns)
        lumi_wire_client_poll(&w->client, (uint64_t)w->now_ns);
    watch_silence(w);
    start_request(w);
    if (w->now_ns - w->snapshot_told_ns >= TELL_NS)
        tell_snapshot(w);
}

int64_t world_board_next(const struct world *w)
{
    int64_t next = w->snapshot_told_ns + TELL_NS;

    if (!w->stream_open && w->stream_try_ns < next)
        next = w->stream_try_ns;
    if (w->stream_open && lumi_wire_client_next_poll(&w->client) < (uint64_t)next)
        next = (int64_t)lumi_wire_client_next_poll(&w->client);
    if (w->request_count > 0 && w->requests[0].deadline_ns < next)
        next = w->requests[0].deadline_ns;
    return next;
}

/* ---- what is remembered ---- */

/* As an array grows: to the next power of two. */
static size_t grown(size_t bytes)
{
    size_t room = 16;

    while (room < bytes)
        room *= 2;
    return room;
}

size_t world_records_bytes(const struct world *w)
{
    const struct sim_machine *m = w->machine;
    int count;

    sim_mechanics_exposures(sim_machine_mechanics(w->machine), &count);
    return (size_t)w->exposure_room * sizeof *w->exposures + grown((size_t)count * sizeof(struct sim_exposure)) +
           grown(m->steps->len * sizeof(uint64_t)) + grown(m->events->len * sizeof(struct sim_machine_event));
}
