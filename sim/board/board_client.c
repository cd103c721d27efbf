/* The wire's client on one of the emulated board's links. */
#include "sim/board/board_client.h"

#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/wire/transport.h"

#include <glib.h>
#include <string.h>

#define SLICE (F405_HZ / 4000u) /* how long the machine runs before bytes are looked at */
#define PATIENCE 10.0           /* s for a reply: an erase takes one */
#define IN_SIZE 512             /* as daemon/rig asks: ended by a packet that is not full */

struct board_client {
    struct f405_machine *machine;
    enum board_link link;
    struct lumi_wire_client wire;
    bool silent, replied, lost, stalled;
    lumi_wire_Reply reply;
    GArray *events; /* lumi_wire_Event */
    uint32_t events_lost;
    struct usb_transfer in, out;
    uint8_t received[IN_SIZE], sending[LUMI_WIRE_FRAME_MAX];
};

static uint64_t now_ns(const struct board_client *c)
{
    uint64_t cycles = f405_machine_now(c->machine);
    return cycles / 168 * 1000 + cycles % 168 * 1000 / 168;
}

/* ---- the client library's callbacks ---- */

static bool send(void *context, const uint8_t *frame, size_t size)
{
    struct board_client *c = context;
    if (c->silent)
        return false;
    if (c->link == BOARD_LINK_SERIAL)
        return f405_machine_serial_write(c->machine, frame, size) == size;
    if (c->out.queued || size > sizeof c->sending)
        return false;
    memcpy(c->sending, frame, size);
    c->out = (struct usb_transfer){.endpoint = LUMI_WIRE_USB_OUT, .data = c->sending, .size = size, .zero = true};
    usb_host_submit(f405_machine_usb(c->machine), &c->out);
    return true;
}

static void welcome(void *context, const lumi_wire_Welcome *message, bool restarted)
{
    (void)context;
    (void)message;
    (void)restarted;
}

static void reply(void *context, const lumi_wire_Reply *message)
{
    struct board_client *c = context;
    c->reply = *message;
    c->replied = true;
}

static void request_lost(void *context, uint32_t number)
{
    struct board_client *c = context;
    (void)number;
    c->lost = true;
}

static void event(void *context, const lumi_wire_Event *message)
{
    struct board_client *c = context;
    g_array_append_val(c->events, *message);
}

static void events_lost(void *context, uint32_t count)
{
    struct board_client *c = context;
    c->events_lost += count;
}

static void pulse(void *context, const lumi_wire_Pulse *message, uint64_t received_ns)
{
    (void)context;
    (void)message;
    (void)received_ns;
}

static const struct lumi_wire_client_ops ops = {send, welcome, reply, request_lost, event, events_lost, pulse};

/* ---- links ---- */

static void listen(struct board_client *c);

static void packet_came(struct usb_transfer *transfer, void *context)
{
    struct board_client *c = context;
    c->stalled = transfer->status == USB_STALLED; /* asked again by `step` */
    if (transfer->status != USB_DONE)
        return;
    if (!c->silent)
        lumi_wire_client_receive(&c->wire, c->received, transfer->length, now_ns(c));
    listen(c);
}

static void listen(struct board_client *c)
{
    c->in = (struct usb_transfer){.endpoint = LUMI_WIRE_USB_IN,
                                  .data = c->received,
                                  .size = sizeof c->received,
                                  .done = packet_came,
                                  .context = c};
    usb_host_submit(f405_machine_usb(c->machine), &c->in);
}

bool board_client_reconnect(struct board_client *c)
{
    if (c->link == BOARD_LINK_USB) {
        usb_host_cancel(f405_machine_usb(c->machine), &c->in);
        usb_host_cancel(f405_machine_usb(c->machine), &c->out);
        if (usb_enumerate(c->machine, 5) != USB_DONE)
            return false;
        listen(c);
    }
    lumi_wire_client_reconnected(&c->wire, now_ns(c));
    return true;
}

struct board_client *board_client_create(struct f405_machine *machine, enum board_link link)
{
    struct board_client *c = lumi_calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->machine = machine;
    c->link = link;
    c->events = g_array_new(FALSE, FALSE, sizeof(lumi_wire_Event));
    lumi_wire_client_init(&c->wire, &ops, c, 0x1d0ul + (uint64_t)link);
    if (link == BOARD_LINK_USB) {
        usb_host_plug(f405_machine_usb(machine), true);
        if (!board_client_reconnect(c)) {
            board_client_destroy(c);
            return NULL;
        }
    }
    return c;
}

void board_client_destroy(struct board_client *c)
{
    if (!c)
        return;
    c->silent = true;
    c->in.done = NULL;
    if (c->in.queued)
        usb_host_cancel(f405_machine_usb(c->machine), &c->in);
    if (c->out.queued)
        usb_host_cancel(f405_machine_usb(c->machine), &c->out);
    g_array_free(c->events, TRUE);
    lumi_free(c);
}

const struct lumi_wire_client *board_client_wire(const struct board_client *c)
{
    return &c->wire;
}

/* ---- time ---- */

static int step(struct board_client *c, uint64_t end, struct lumi_error *error)
{
    uint64_t next = f405_machine_now(c->machine) + SLICE;
    uint8_t data[256];
    if (c->stalled)
        listen(c);
    if (!c->silent)
        lumi_wire_client_poll(&c->wire, now_ns(c));
    enum f405_stop stop = f405_machine_run_to(c->machine, next < end ? next : end);
    for (size_t n; (n = f405_machine_serial_read(c->machine, data, sizeof data)) > 0;)
        if (c->link == BOARD_LINK_SERIAL && !c->silent)
            lumi_wire_client_receive(&c->wire, data, n, now_ns(c));
    if (stop == F405_STOP_FAULT)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "%s", f405_fault(f405_machine_chip(c->machine)));
    if (stop == F405_STOP_LOADER)
        return lumi_fail(error, LUMI_ERR_CANCELLED, "the chip is in its loader");
    return LUMI_OK;
}

static uint64_t after(const struct board_client *c, double seconds)
{
    return f405_machine_now(c->machine) + (uint64_t)(seconds * F405_HZ);
}

int board_client_run(struct board_client *c, double seconds, struct lumi_error *error)
{
    uint64_t end = after(c, seconds);
    while (f405_machine_now(c->machine) < end)
        LUMI_TRY(step(c, end, error));
    return LUMI_OK;
}

int board_client_open(struct board_client *c, double seconds, struct lumi_error *error)
{
    uint64_t end = after(c, seconds);
    while (c->wire.state != LUMI_WIRE_CLIENT_OPEN && f405_machine_now(c->machine) < end)
        LUMI_TRY(step(c, end, error));
    if (c->wire.state != LUMI_WIRE_CLIENT_OPEN)
        return lumi_fail(error, LUMI_ERR_IO, "no session after %g s", seconds);
    return LUMI_OK;
}

int board_client_request(struct board_client *c, lumi_wire_Request *request, lumi_wire_Reply *answer,
                         struct lumi_error *error)
{
    uint64_t end = after(c, PATIENCE);
    LUMI_TRY(board_client_open(c, PATIENCE, error));
    while (c->wire.in_flight && f405_machine_now(c->machine) < end) /* one that was given up, until it is known lost */
        LUMI_TRY(step(c, end, error));
    c->replied = c->lost = false;
    LUMI_TRY(lumi_wire_client_request(&c->wire, request, now_ns(c), error));
    end = after(c, PATIENCE);
    while (!c->replied && !c->lost && f405_machine_now(c->machine) < end)
        LUMI_TRY(step(c, end, error));
    if (!c->replied)
        return lumi_fail(error, LUMI_ERR_IO, "%s", c->lost ? "lost with a restart" : "no answer");
    if (answer)
        *answer = c->reply;
    return lumi_wire_reply_result(&c->reply, error);
}

/* ---- commands ---- */

int board_client_configure(struct board_client *c, const struct lumi_rig *rig, struct lumi_error *error)
{
    g_autofree lumi_wire_Profile *scratch = g_new0(lumi_wire_Profile, 1);
    g_autofree uint8_t *bytes = g_malloc(LUMI_WIRE_PROFILE_MAX);
    size_t size = lumi_wire_encode_profile(rig, scratch, bytes, LUMI_WIRE_PROFILE_MAX);
    if (size == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "the profile cannot be encoded");
    lumi_wire_Request request;
    size_t at = 0;
    while (lumi_wire_profile_request(bytes, size, &at, &request))
        LUMI_TRY(board_client_request(c, &request, NULL, error));
    return LUMI_OK;
}

int board_client_status(struct board_client *c, lumi_wire_Status *status, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_get_status_tag};
    lumi_wire_Reply answer;
    LUMI_TRY(board_client_request(c, &request, &answer, error));
    *status = answer.payload.status;
    return LUMI_OK;
}

/* Until an event of this kind comes that was not there before place `from`. */
static const lumi_wire_Event *await(struct board_client *c, guint from, int kind, double seconds,
                                    struct lumi_error *error)
{
    uint64_t end = after(c, seconds);
    for (;;) {
        for (; from < c->events->len; from++) {
            const lumi_wire_Event *e = &g_array_index(c->events, lumi_wire_Event, from);
            if (e->which_kind == kind)
                return e;
        }
        if (f405_machine_now(c->machine) >= end) {
            lumi_fail(error, LUMI_ERR_IO, "no such event within %g s", seconds);
            return NULL;
        }
        if (step(c, end, error) != LUMI_OK)
            return NULL;
    }
}

int board_client_home(struct board_client *c, bool wind_up, int turn, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};
    guint from = c->events->len;
    request.command.home.wind_up = wind_up;
    request.command.home.turn = turn;
    LUMI_TRY(board_client_request(c, &request, NULL, error));
    const lumi_wire_Event *homed = await(c, from, lumi_wire_Event_homed_tag, 600, error);
    if (!homed)
        return LUMI_ERR_IO;
    return homed->kind.homed.found ? LUMI_OK
                                   : lumi_fail(error, LUMI_ERR_NOTFOUND, "homing: %s", homed->kind.homed.text);
}

int board_client_load_plan(struct board_client *c, const struct lumi_plan *plan, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_load_plan_tag};
    request.command.load_plan.has_plan = true;
    lumi_wire_from_plan(plan, &request.command.load_plan.plan);
    sim_mechanics_set_exposures(f405_machine_mechanics(c->machine), plan->exposures, plan->bracket);
    return board_client_request(c, &request, NULL, error);
}

int board_client_start(struct board_client *c, const struct lumi_plan *plan, uint32_t first_shot, bool only_missing,
                       struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_start_sweep_tag};
    request.command.start_sweep.first_shot = first_shot;
    request.command.start_sweep.only_missing = only_missing;
    request.command.start_sweep.plan_crc = lumi_wire_plan_crc(plan);
    return board_client_request(c, &request, NULL, error);
}

int board_client_wait_sweep(struct board_client *c, double seconds, lumi_wire_SweepEnded *ended,
                            struct lumi_error *error)
{
    /* The end of a sweep that was over before this was asked is the last such event. */
    const lumi_wire_Event *e = await(c, c->events->len, lumi_wire_Event_sweep_ended_tag, seconds, error);
    if (!e)
        return LUMI_ERR_IO;
    if (ended)
        *ended = e->kind.sweep_ended;
    return LUMI_OK;
}

int board_client_clear(struct board_client *c, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_clear_tag};
    lumi_wire_Status status;
    LUMI_TRY(board_client_status(c, &status, error));
    request.command.clear.faults = status.faults;
    return board_client_request(c, &request, NULL, error);
}

const lumi_wire_Event *board_client_events(const struct board_client *c, int *count)
{
    *count = (int)c->events->len;
    return (const lumi_wire_Event *)(const void *)c->events->data;
}

uint32_t board_client_events_lost(const struct board_client *c)
{
    return c->events_lost;
}
