/* The operator's computer of a simulated rig: commands, and what the board tells. */
#include "sim/rig/machine_priv.h"

#include "proto/base/bytes.h"

#include <string.h>

static bool client_send(void *context, const uint8_t *frame, size_t size)
{
    struct sim_machine *m = context;

    if (m->unplugged)
        return false;
    sim_wire_path_send(&m->to_board, m->now, frame, size);
    return true;
}

static void client_welcome(void *context, const lumi_wire_Welcome *welcome, bool restarted)
{
    struct sim_machine *m = context;

    (void)welcome;
    m->starts += restarted;
}

static void client_reply(void *context, const lumi_wire_Reply *reply)
{
    struct sim_machine *m = context;

    m->reply = *reply;
    m->replied = true;
}

static void client_request_lost(void *context, uint32_t number)
{
    struct sim_machine *m = context;

    (void)number;
    m->request_lost = true;
}

static void client_event(void *context, const lumi_wire_Event *event)
{
    struct sim_machine *m = context;
    struct sim_machine_event kept = {m->starts, m->now, *event};

    g_array_append_val(m->events, kept);
}

static void client_events_lost(void *context, uint32_t count)
{
    struct sim_machine *m = context;

    m->events_lost += count;
}

static void client_pulse(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns)
{
    struct sim_machine *m = context;

    (void)received_ns;
    m->status = pulse->status;
    m->status_known = true;
}

const struct lumi_wire_client_ops sim_machine_client_ops = {
    client_send, client_welcome, client_reply, client_request_lost, client_event, client_events_lost, client_pulse,
};

static bool answered(struct sim_machine *m, void *context)
{
    (void)context;
    return m->replied || m->request_lost;
}

static bool open_and_free(struct sim_machine *m, void *context)
{
    (void)context;
    return m->client.state == LUMI_WIRE_CLIENT_OPEN && !m->client.in_flight;
}

#define PATIENCE 10.0 /* s */

int sim_machine_request(struct sim_machine *m, lumi_wire_Request *request, lumi_wire_Reply *reply,
                        struct lumi_error *error)
{
    if (!sim_machine_run_until(m, open_and_free, NULL, PATIENCE))
        return lumi_fail(error, LUMI_ERR_IO, "the board does not answer");
    m->replied = m->request_lost = false;
    LUMI_TRY(lumi_wire_client_request(&m->client, request, sim_machine_ns(m->now), error));
    if (!sim_machine_run_until(m, answered, NULL, PATIENCE))
        return lumi_fail(error, LUMI_ERR_IO, "the board does not answer a request");
    if (m->request_lost)
        return lumi_fail(error, LUMI_ERR_IO, "the board restarted with a request in flight");
    if (reply)
        *reply = m->reply;
    return lumi_wire_reply_result(&m->reply, error);
}

int sim_machine_configure(struct sim_machine *m, const struct lumi_rig *rig, struct lumi_error *error)
{
    g_autofree lumi_wire_Profile *scratch = g_new0(lumi_wire_Profile, 1);
    g_autofree uint8_t *bytes = g_malloc(LUMI_WIRE_PROFILE_MAX);
    size_t size = lumi_wire_encode_profile(rig, scratch, bytes, LUMI_WIRE_PROFILE_MAX);
    lumi_wire_Request request;
    size_t at = 0;

    if (size == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "the profile cannot be encoded");
    while (lumi_wire_profile_request(bytes, size, &at, &request))
        LUMI_TRY(sim_machine_request(m, &request, NULL, error));
    return LUMI_OK;
}

struct awaited {
    int from, kind;
    uint32_t starts; /* of the board, when the waiting began */
};

/* Leaves `from` at the event that was awaited. */
static bool has_come(struct sim_machine *m, void *context)
{
    struct awaited *awaited = context;

    for (; awaited->from < (int)m->events->len; awaited->from++)
        if (g_array_index(m->events, struct sim_machine_event, awaited->from).event.which_kind == awaited->kind)
            return true;
    return m->starts != awaited->starts;
}

/* The event, where has_come was ended by it. */
static const lumi_wire_Event *come(const struct sim_machine *m, const struct awaited *awaited)
{
    return awaited->from < (int)m->events->len
               ? &g_array_index(m->events, struct sim_machine_event, awaited->from).event
               : NULL;
}

int sim_machine_home(struct sim_machine *m, bool wind_up, int turn, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};
    struct awaited homed = {(int)m->events->len, lumi_wire_Event_homed_tag, m->starts};

    request.command.home.wind_up = wind_up;
    request.command.home.turn = turn;
    LUMI_TRY(sim_machine_request(m, &request, NULL, error));
    if (!sim_machine_run_until(m, has_come, &homed, 1800))
        return lumi_fail(error, LUMI_ERR_IO, "homing does not end");
    const lumi_wire_Event *event = come(m, &homed);
    if (!event)
        return lumi_fail(error, LUMI_ERR_IO, "the board restarted while homing");
    if (!event->kind.homed.found)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "homing failed: %s", event->kind.homed.text);
    return LUMI_OK;
}

int sim_machine_load_plan(struct sim_machine *m, const struct lumi_plan *plan, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_load_plan_tag};

    m->plan = *plan;
    m->planned = true;
    sim_mechanics_set_exposures(m->mechanics, plan->exposures, plan->bracket);
    request.command.load_plan.has_plan = true;
    lumi_wire_from_plan(plan, &request.command.load_plan.plan);
    return sim_machine_request(m, &request, NULL, error);
}

int sim_machine_start(struct sim_machine *m, int first_shot, bool only_missing, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_start_sweep_tag};

    request.command.start_sweep.first_shot = (uint32_t)first_shot;
    request.command.start_sweep.only_missing = only_missing;
    request.command.start_sweep.plan_crc = lumi_wire_plan_crc(&m->plan);
    return sim_machine_request(m, &request, NULL, error);
}

int sim_machine_wait_sweep(struct sim_machine *m, double seconds, struct lumi_error *error)
{
    struct awaited ended = {(int)m->events->len, lumi_wire_Event_sweep_ended_tag, m->starts};

    if (!sim_machine_run_until(m, has_come, &ended, seconds))
        return lumi_fail(error, LUMI_ERR_IO, "the sweep has not ended after %g s", seconds);
    if (!come(m, &ended))
        return lumi_fail(error, LUMI_ERR_IO, "the board restarted in the sweep");
    return LUMI_OK;
}

int sim_machine_status(struct sim_machine *m, lumi_wire_Status *status, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_get_status_tag};
    lumi_wire_Reply reply;

    LUMI_TRY(sim_machine_request(m, &request, &reply, error));
    if (reply.which_payload != lumi_wire_Reply_status_tag)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "a status without a status");
    *status = reply.payload.status;
    return LUMI_OK;
}

int sim_machine_clear(struct sim_machine *m, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_clear_tag};
    lumi_wire_Status status;

    LUMI_TRY(sim_machine_status(m, &status, error));
    request.command.clear.faults = status.faults;
    return sim_machine_request(m, &request, NULL, error);
}

int sim_machine_pause(struct sim_machine *m, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_pause_tag};

    return sim_machine_request(m, &request, NULL, error);
}

int sim_machine_shots(struct sim_machine *m, uint8_t *states, int count, struct lumi_error *error)
{
    for (int at = 0; at < count;) {
        lumi_wire_Request request = {.which_command = lumi_wire_Request_read_shots_tag};
        lumi_wire_Reply reply;
        request.command.read_shots.first = (uint32_t)at;
        LUMI_TRY(sim_machine_request(m, &request, &reply, error));
        const lumi_wire_Shots *shots = &reply.payload.shots;
        if (reply.which_payload != lumi_wire_Reply_shots_tag || shots->count == 0 || (int)shots->first != at)
            return lumi_fail(error, LUMI_ERR_INTERNAL, "the board does not tell shot %d", at);
        for (uint32_t i = 0; i < shots->count && at < count; i++, at++)
            states[at] = shots->states.bytes[i / 4] >> (2 * (i % 4)) & 3;
    }
    return LUMI_OK;
}

void sim_machine_emergency_stop(struct sim_machine *m)
{
    lumi_wire_client_emergency_stop(&m->client, sim_machine_ns(m->now));
}

const struct sim_machine_event *sim_machine_events(const struct sim_machine *m, int *count)
{
    *count = (int)m->events->len;
    return (const struct sim_machine_event *)(const void *)m->events->data;
}

uint32_t sim_machine_restarts(const struct sim_machine *m)
{
    return m->starts;
}

uint32_t sim_machine_events_lost(const struct sim_machine *m)
{
    return m->events_lost;
}

const lumi_wire_Event *sim_machine_find(const struct sim_machine *m, int from, int kind)
{
    for (int i = (int)m->events->len - 1; i >= from; i--) {
        const struct sim_machine_event *event = &g_array_index(m->events, struct sim_machine_event, i);
        if (event->event.which_kind == kind)
            return &event->event;
    }
    return NULL;
}

lumi_wire_Status sim_machine_last_status(const struct sim_machine *m)
{
    return m->status;
}
