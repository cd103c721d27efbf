/* The host controller: frames, transactions, transfers. */
#include "sim/board/usb_host.h"

#include "proto/base/memory.h"

#include <string.h>

#define BIT (F405_HZ / 12000000u) /* full speed: 12 Mbit/s */
#define FRAME (F405_HZ / 1000u)
#define RESET_TIME (10u * FRAME) /* USB 2.0 7.1.7.5 */
#define IDLE_TIME (3u * FRAME)
#define RESUME_TIME (20u * FRAME)
#define NAK_PAUSE (50u * BIT * 8u) /* a NAK costs a token and a handshake, and the rest of the bus gets its turn */
#define ENDPOINTS 4
#define TRIES 3

enum { STAGE_SETUP = 0, STAGE_DATA, STAGE_STATUS };

struct queue {
    struct usb_transfer *first;
    bool data1; /* the toggle of the next packet */
    uint64_t not_before;
};

struct usb_host {
    struct f405 *chip;
    bool plugged, suspended;
    int address, packet_size;
    uint64_t reset_until, resume_until, idle_at; /* F405_NEVER: not */
    uint64_t frame_at, free_at;                  /* the next start of frame; when the bus is free */
    unsigned frame;
    struct queue control, in[ENDPOINTS], out[ENDPOINTS];
    int turn;
    struct usb_counters counters;
};

struct usb_host *usb_host_create(struct f405 *chip)
{
    struct usb_host *host = lumi_calloc(1, sizeof *host);
    if (!host)
        return NULL;
    host->chip = chip;
    host->packet_size = 8;
    host->reset_until = host->resume_until = host->idle_at = F405_NEVER;
    return host;
}

static void finish(struct queue *queue, enum usb_status status)
{
    struct usb_transfer *t = queue->first;
    queue->first = t->next;
    t->next = NULL;
    t->queued = false;
    t->status = status;
    if (t->done)
        t->done(t, t->context);
}

static void end_all(struct usb_host *host, enum usb_status status)
{
    while (host->control.first)
        finish(&host->control, status);
    for (int i = 0; i < ENDPOINTS; i++) {
        while (host->in[i].first)
            finish(&host->in[i], status);
        while (host->out[i].first)
            finish(&host->out[i], status);
    }
}

void usb_host_destroy(struct usb_host *host)
{
    if (host)
        end_all(host, USB_GONE);
    lumi_free(host);
}

void usb_host_plug(struct usb_host *host, bool plugged)
{
    host->plugged = plugged;
    host->suspended = false;
    host->reset_until = host->resume_until = host->idle_at = F405_NEVER;
    host->frame_at = f405_now(host->chip) + FRAME;
    f405_usb_vbus(host->chip, plugged);
    if (!plugged)
        end_all(host, USB_GONE);
}

bool usb_host_sees_device(const struct usb_host *host)
{
    return host->plugged && f405_usb_attached(host->chip);
}

void usb_host_reset(struct usb_host *host)
{
    uint64_t now = f405_now(host->chip);
    end_all(host, USB_CANCELLED);
    host->address = 0;
    host->packet_size = 8;
    host->suspended = false;
    host->idle_at = host->resume_until = F405_NEVER;
    for (int i = 0; i < ENDPOINTS; i++)
        host->in[i].data1 = host->out[i].data1 = false;
    f405_usb_reset(host->chip, true);
    host->reset_until = now + RESET_TIME;
    host->frame_at = host->reset_until + FRAME;
}

void usb_host_suspend(struct usb_host *host, bool suspended)
{
    uint64_t now = f405_now(host->chip);
    if (suspended == host->suspended)
        return;
    if (suspended) {
        host->suspended = true;
        host->idle_at = now + IDLE_TIME;
    } else {
        f405_usb_suspend(host->chip, false);
        host->idle_at = F405_NEVER;
        host->resume_until = now + RESUME_TIME;
    }
}

void usb_host_set_address(struct usb_host *host, int address)
{
    host->address = address;
}

void usb_host_set_packet_size(struct usb_host *host, int size)
{
    host->packet_size = size;
}

static struct queue *queue_of(struct usb_host *host, int endpoint)
{
    int number = endpoint & 0x7f;
    if (number == 0)
        return &host->control;
    return endpoint & 0x80 ? &host->in[number % ENDPOINTS] : &host->out[number % ENDPOINTS];
}

void usb_host_clear_toggle(struct usb_host *host, int endpoint)
{
    queue_of(host, endpoint)->data1 = false;
}

void usb_host_submit(struct usb_host *host, struct usb_transfer *transfer)
{
    struct usb_transfer **end = &queue_of(host, transfer->endpoint)->first;
    while (*end)
        end = &(*end)->next;
    *end = transfer;
    transfer->next = NULL;
    transfer->queued = true;
    transfer->status = USB_PENDING;
    transfer->length = 0;
    transfer->stage = STAGE_SETUP;
    transfer->tries = 0;
    if (!usb_host_sees_device(host))
        end_all(host, USB_GONE);
}

void usb_host_cancel(struct usb_host *host, struct usb_transfer *transfer)
{
    struct usb_transfer **at = &queue_of(host, transfer->endpoint)->first;
    while (*at && *at != transfer)
        at = &(*at)->next;
    if (!*at)
        return;
    *at = transfer->next;
    transfer->next = NULL;
    transfer->queued = false;
    transfer->status = USB_CANCELLED;
    if (transfer->done)
        transfer->done(transfer, transfer->context);
}

const struct usb_counters *usb_host_counters(const struct usb_host *host)
{
    return &host->counters;
}

/* ---- one transaction ---- */

/* Token, data, handshake and the gaps between them, with some bit stuffing. */
static uint64_t bus_time(size_t bytes)
{
    return (13 * 8 + bytes * 8 * 7 / 6) * BIT;
}

/* False: the transfer goes on later. */
static bool answered(struct usb_host *host, struct queue *queue, enum f405_usb_answer answer)
{
    struct usb_transfer *t = queue->first;
    if (answer == F405_USB_ACK) {
        t->tries = 0;
        return true;
    }
    if (answer == F405_USB_NAK) {
        host->counters.naks++;
        t->tries = 0;
        queue->not_before = f405_now(host->chip) + NAK_PAUSE;
    } else if (answer == F405_USB_STALL) {
        host->counters.stalls++;
        finish(queue, USB_STALLED);
    } else {
        host->counters.silences++;
        if (++t->tries == TRIES)
            finish(queue, USB_SILENT);
    }
    return false;
}

/* A packet to the device; `*sent` its length. */
static bool send(struct usb_host *host, struct queue *queue, int endpoint, const uint8_t *data, size_t left,
                 size_t most, size_t *sent)
{
    *sent = left < most ? left : most;
    host->counters.outs++;
    host->free_at += bus_time(*sent);
    if (!answered(host, queue, f405_usb_out(host->chip, host->address, endpoint, queue->data1, data, *sent)))
        return false;
    queue->data1 = !queue->data1;
    return true;
}

/* A packet from the device into `data`, which has `room`. */
static bool receive(struct usb_host *host, struct queue *queue, int endpoint, uint8_t *data, size_t room, size_t *got)
{
    uint8_t packet[64];
    size_t size = 0;
    bool data1 = false;
    host->counters.ins++;
    enum f405_usb_answer answer = f405_usb_in(host->chip, host->address, endpoint, packet, &size, &data1);
    host->free_at += bus_time(size);
    if (!answered(host, queue, answer))
        return false;
    *got = 0;
    if (data1 != queue->data1) /* one that was taken before: USB 2.0 8.6.4 */
        return false;
    queue->data1 = !queue->data1;
    if (size > room) {
        finish(queue, USB_BABBLE);
        return false;
    }
    if (size)
        memcpy(data, packet, size);
    *got = size;
    return true;
}

static void control_transaction(struct usb_host *host)
{
    struct queue *q = &host->control;
    struct usb_transfer *t = q->first;
    bool in = t->setup[0] & 0x80;
    size_t most = (size_t)host->packet_size, n = 0;
    switch (t->stage) {
    case STAGE_SETUP:
        host->counters.setups++;
        host->free_at += bus_time(8);
        if (answered(host, q, f405_usb_setup(host->chip, host->address, 0, t->setup))) {
            q->data1 = true;
            t->stage = t->size ? STAGE_DATA : STAGE_STATUS;
        }
        break;
    case STAGE_DATA:
        if (in ? !receive(host, q, 0, t->data + t->length, t->size - t->length, &n)
               : !send(host, q, 0, t->data + t->length, t->size - t->length, most, &n))
            break;
        t->length += n;
        if (t->length == t->size || (in && n < most)) {
            t->stage = STAGE_STATUS;
            q->data1 = true;
        }
        break;
    default:
        if (in && t->size ? send(host, q, 0, NULL, 0, most, &n) : receive(host, q, 0, NULL, 0, &n))
            finish(q, USB_DONE);
    }
}

static void bulk_transaction(struct usb_host *host, struct queue *q)
{
    struct usb_transfer *t = q->first;
    size_t left = t->size - t->length, n = 0;
    int number = t->endpoint & 0x7f;
    if (t->endpoint & 0x80) {
        if (!receive(host, q, number, t->data + t->length, left, &n))
            return;
        t->length += n;
        if (n < 64 || t->length == t->size)
            finish(q, USB_DONE);
        return;
    }
    if (!send(host, q, number, t->data + t->length, left, 64, &n))
        return;
    t->length += n;
    if (t->length == t->size && (n < 64 || !t->zero))
        finish(q, USB_DONE);
}

/* ---- time ---- */

static struct queue *ready(struct usb_host *host, uint64_t now)
{
    struct queue *all[1 + 2 * ENDPOINTS] = {&host->control};
    int count = 1;
    for (int i = 1; i < ENDPOINTS; i++) {
        all[count++] = &host->in[i];
        all[count++] = &host->out[i];
    }
    for (int k = 0; k < count; k++) {
        struct queue *q = all[(host->turn + k) % count];
        if (q->first && q->not_before <= now) {
            host->turn = (host->turn + k + 1) % count;
            return q;
        }
    }
    return NULL;
}

static uint64_t first_ready(const struct usb_host *host)
{
    uint64_t at = host->control.first ? host->control.not_before : F405_NEVER;
    for (int i = 1; i < ENDPOINTS; i++) {
        const struct queue *pair[2] = {&host->in[i], &host->out[i]};
        for (int k = 0; k < 2; k++)
            if (pair[k]->first && pair[k]->not_before < at)
                at = pair[k]->not_before;
    }
    return at;
}

static bool talking(const struct usb_host *host)
{
    return host->plugged && !host->suspended && host->reset_until == F405_NEVER && host->resume_until == F405_NEVER &&
           f405_usb_attached(host->chip);
}

uint64_t usb_host_next(const struct usb_host *host)
{
    uint64_t next = host->reset_until;
    next = host->resume_until < next ? host->resume_until : next;
    next = host->idle_at < next ? host->idle_at : next;
    if (host->plugged && !f405_usb_attached(host->chip)) { /* it went: its transfers end at once */
        uint64_t left = first_ready(host);
        return left < next ? left : next;
    }
    if (!talking(host))
        return next;
    next = host->frame_at < next ? host->frame_at : next;
    uint64_t work = first_ready(host);
    work = work == F405_NEVER || work > host->free_at ? work : host->free_at;
    return work < next ? work : next;
}

void usb_host_event(struct usb_host *host, uint64_t now)
{
    if (host->reset_until <= now) {
        host->reset_until = F405_NEVER;
        f405_usb_reset(host->chip, false);
    }
    if (host->idle_at <= now) {
        host->idle_at = F405_NEVER;
        f405_usb_suspend(host->chip, true);
    }
    if (host->resume_until <= now) {
        host->resume_until = F405_NEVER;
        host->suspended = false;
        host->frame_at = now;
    }
    if (!talking(host)) {
        if (host->plugged && !f405_usb_attached(host->chip))
            end_all(host, USB_GONE);
        return;
    }
    if (host->frame_at <= now) {
        f405_usb_sof(host->chip, host->frame++);
        host->counters.frames++;
        host->frame_at = (host->frame_at + FRAME > now ? host->frame_at : now) + FRAME;
        host->free_at = now + bus_time(0);
    }
    if (host->free_at > now)
        return;
    struct queue *q = ready(host, now);
    if (!q)
        return;
    host->free_at = now;
    if (q == &host->control)
        control_transaction(host);
    else
        bulk_transaction(host, q);
}
