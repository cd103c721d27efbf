/* The board on USB as a stream: libusb's asynchronous transfers, driven by the owner's poll. USB 2.0 specification, 5.8
 * (bulk transfers), 9.4.5 (halted endpoints).
 *
 * 1. Some IN transfers are always with the kernel, so that nothing waits in the board; they come back in the order in
 *    which they were given, are emptied by `read` in that order, and go back.
 * 2. An endpoint that stalls is cleared when all its transfers have come back, and goes on.
 * 3. A transfer of whole packets is ended by an empty one (proto/wire/transport.h). */
#include "daemon/rig/usb_priv.h"
#include "proto/wire/transport.h"

#include <glib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define IN_COUNT 4
#define IN_SIZE 512 /* whole packets */
#define OUT_SIZE 1024
#define OUT_TIMEOUT_MS 1000 /* a board that takes nothing for so long: the bytes are dropped, frames are sent again */
#define ERRORS_MAX 8        /* in a row: then the device is given up */
#define FRESH_ATTEMPTS 8    /* after so many without a board the bus is searched anew, for machines without udev */
#define CLOSE_ROUNDS 50     /* of 20 ms, that transfers are given to come back */

enum transfer_state { IDLE, WITH_KERNEL, FULL };

struct in_transfer {
    struct libusb_transfer *transfer;
    enum transfer_state state;
    size_t taken; /* of a full one, by `read` */
    uint8_t data[IN_SIZE];
};

/* What the transfers' callbacks reach: it outlives the stream where a transfer never comes back. */
struct usb_pipes {
    libusb_device_handle *handle;
    struct in_transfer in[IN_COUNT];
    int in_next; /* the one that `read` empties next, and the first to come back */
    struct libusb_transfer *out;
    bool out_busy;
    uint8_t out_data[OUT_SIZE];
    bool in_stalled, out_stalled, gone;
    int errors;
};

struct usb_stream {
    struct lumi_rig_stream base;
    char serial[64];
    libusb_context *context;
    libusb_hotplug_callback_handle hotplug;
    bool hotplug_on, arrived;
    int attempts;
    struct usb_pipes *pipes; /* while open */
};

/* ---- transfers ---- */

static void judge_status(struct usb_pipes *pipes, const struct libusb_transfer *transfer, bool *stalled)
{
    switch (transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
        pipes->errors = 0;
        break;
    case LIBUSB_TRANSFER_STALL:
        *stalled = true;
        break;
    case LIBUSB_TRANSFER_NO_DEVICE:
        pipes->gone = true;
        break;
    case LIBUSB_TRANSFER_CANCELLED:
    case LIBUSB_TRANSFER_TIMED_OUT:
        break;
    default:
        if (++pipes->errors > ERRORS_MAX)
            pipes->gone = true;
    }
}

static void LIBUSB_CALL on_in(struct libusb_transfer *transfer)
{
    struct usb_pipes *pipes = transfer->user_data;

    for (int i = 0; i < IN_COUNT; i++)
        if (pipes->in[i].transfer == transfer) {
            pipes->in[i].state = transfer->actual_length > 0 ? FULL : IDLE;
            pipes->in[i].taken = 0;
        }
    judge_status(pipes, transfer, &pipes->in_stalled);
}

static void LIBUSB_CALL on_out(struct libusb_transfer *transfer)
{
    struct usb_pipes *pipes = transfer->user_data;

    pipes->out_busy = false;
    judge_status(pipes, transfer, &pipes->out_stalled);
}

static void submit_in(struct usb_pipes *pipes, struct in_transfer *in)
{
    int failed;

    libusb_fill_bulk_transfer(in->transfer, pipes->handle, LUMI_WIRE_USB_IN, in->data, IN_SIZE, on_in, pipes, 0);
    failed = libusb_submit_transfer(in->transfer);
    in->state = failed ? IDLE : WITH_KERNEL;
    if (failed == LIBUSB_ERROR_NO_DEVICE || (failed && ++pipes->errors > ERRORS_MAX))
        pipes->gone = true;
}

/* Empty ones go back in order, behind those that are still full or with the kernel. */
static void feed(struct usb_pipes *pipes)
{
    if (pipes->in_stalled)
        return;
    for (int i = 0; i < IN_COUNT && !pipes->gone; i++) {
        struct in_transfer *in = &pipes->in[pipes->in_next];
        if (in->state != IDLE)
            break;
        submit_in(pipes, in);
        pipes->in_next = (pipes->in_next + 1) % IN_COUNT;
    }
}

static bool in_with_kernel(const struct usb_pipes *pipes)
{
    for (int i = 0; i < IN_COUNT; i++)
        if (pipes->in[i].state == WITH_KERNEL)
            return true;
    return false;
}

static void clear(struct usb_pipes *pipes, unsigned char endpoint)
{
    int failed = libusb_clear_halt(pipes->handle, endpoint);

    if (failed == LIBUSB_ERROR_NO_DEVICE || (failed && ++pipes->errors > ERRORS_MAX))
        pipes->gone = true;
}

static void recover(struct usb_pipes *pipes)
{
    if (pipes->in_stalled && !pipes->gone) {
        if (in_with_kernel(pipes)) {
            for (int i = 0; i < IN_COUNT; i++)
                if (pipes->in[i].state == WITH_KERNEL)
                    libusb_cancel_transfer(pipes->in[i].transfer);
        } else {
            clear(pipes, LUMI_WIRE_USB_IN);
            pipes->in_stalled = false;
        }
    }
    if (pipes->out_stalled && !pipes->out_busy && !pipes->gone) {
        clear(pipes, LUMI_WIRE_USB_OUT); /* what was in it is lost with it; its frame is sent again */
        pipes->out_stalled = false;
    }
}

static void work(struct usb_stream *self)
{
    struct timeval now = {0, 0};
    int failed = libusb_handle_events_timeout_completed(self->context, &now, NULL);

    if (self->pipes) {
        if (failed == LIBUSB_ERROR_NO_DEVICE)
            self->pipes->gone = true;
        recover(self->pipes);
        feed(self->pipes);
    }
}

static long lost(struct usb_stream *self, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_IO, "usb:%s: unplugged, or it no longer answers", self->serial);
}

static long usb_read(struct lumi_rig_stream *stream, uint8_t *data, size_t size, struct lumi_error *error)
{
    struct usb_stream *self = (struct usb_stream *)stream;
    struct usb_pipes *pipes = self->pipes;
    size_t done = 0;

    work(self);
    for (int i = 0; i < IN_COUNT; i++) {
        struct in_transfer *in = &pipes->in[(pipes->in_next + i) % IN_COUNT];
        size_t length;
        if (in->state == WITH_KERNEL || done == size)
            break; /* those after it came later */
        if (in->state != FULL)
            continue;
        length = MIN((size_t)in->transfer->actual_length - in->taken, size - done);
        memcpy(data + done, in->data + in->taken, length);
        done += length;
        in->taken += length;
        if (in->taken < (size_t)in->transfer->actual_length)
            break;
        in->state = IDLE;
    }
    feed(pipes);
    if (done)
        return (long)done;
    return pipes->gone ? lost(self, error) : 0;
}

static long usb_write(struct lumi_rig_stream *stream, const uint8_t *data, size_t size, struct lumi_error *error)
{
    struct usb_stream *self = (struct usb_stream *)stream;
    struct usb_pipes *pipes = self->pipes;
    int failed;

    work(self);
    if (pipes->gone)
        return lost(self, error);
    if (pipes->out_busy || pipes->out_stalled)
        return 0;
    size = MIN(size, OUT_SIZE);
    memcpy(pipes->out_data, data, size);
    libusb_fill_bulk_transfer(pipes->out, pipes->handle, LUMI_WIRE_USB_OUT, pipes->out_data, (int)size, on_out, pipes,
                              OUT_TIMEOUT_MS);
    pipes->out->flags = LIBUSB_TRANSFER_ADD_ZERO_PACKET;
    failed = libusb_submit_transfer(pipes->out);
    if (failed == LIBUSB_ERROR_NO_DEVICE || (failed && ++pipes->errors > ERRORS_MAX)) {
        pipes->gone = true;
        return lost(self, error);
    }
    pipes->out_busy = !failed;
    return failed ? 0 : (long)size;
}

/* ---- opening and closing ---- */

static int LIBUSB_CALL on_hotplug(libusb_context *context, libusb_device *device, libusb_hotplug_event event,
                                  void *user)
{
    struct usb_stream *self = user;

    (void)context;
    (void)device;
    if (event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED)
        self->arrived = true;
    return 0;
}

static void drop_context(struct usb_stream *self)
{
    if (!self->context)
        return;
    if (self->hotplug_on)
        libusb_hotplug_deregister_callback(self->context, self->hotplug);
    libusb_exit(self->context);
    self->context = NULL;
    self->hotplug_on = false;
}

static int make_context(struct usb_stream *self, struct lumi_error *error)
{
    int failed = libusb_init(&self->context);

    if (failed) {
        self->context = NULL;
        return lumi_fail(error, LUMI_ERR_IO, "USB: %s", libusb_strerror(failed));
    }
    self->hotplug_on = libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) &&
                       !libusb_hotplug_register_callback(self->context, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED, 0,
                                                         LUMI_WIRE_USB_VENDOR, LUMI_WIRE_USB_PRODUCT,
                                                         LIBUSB_HOTPLUG_MATCH_ANY, on_hotplug, self, &self->hotplug);
    return LUMI_OK;
}

static void free_pipes(struct usb_pipes *pipes)
{
    for (int i = 0; i < IN_COUNT; i++)
        libusb_free_transfer(pipes->in[i].transfer);
    libusb_free_transfer(pipes->out);
    libusb_release_interface(pipes->handle, LUMI_WIRE_USB_INTERFACE);
    libusb_close(pipes->handle);
    g_free(pipes);
}

static int usb_open(struct lumi_rig_stream *stream, struct lumi_error *error)
{
    struct usb_stream *self = (struct usb_stream *)stream;
    libusb_device_handle *handle;
    struct usb_pipes *pipes;
    int code;

    if (self->attempts++ % FRESH_ATTEMPTS == FRESH_ATTEMPTS - 1)
        drop_context(self);
    if (!self->context)
        LUMI_TRY(make_context(self, error));
    self->arrived = false;
    LUMI_TRY(lumi_rig_usb_find(self->context, self->serial, &handle, self->serial, error));
    pipes = g_new0(struct usb_pipes, 1);
    pipes->handle = handle;
    pipes->out = libusb_alloc_transfer(0);
    for (int i = 0; i < IN_COUNT; i++)
        pipes->in[i].transfer = libusb_alloc_transfer(0);
    if (!pipes->out || !pipes->in[IN_COUNT - 1].transfer) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "usb:%s: no memory for its transfers", self->serial);
        goto fail;
    }
    feed(pipes);
    if (pipes->gone) {
        code = (int)lost(self, error);
        goto fail;
    }
    self->pipes = pipes;
    self->attempts = 0;
    snprintf(stream->name, sizeof stream->name, "usb:%s", self->serial);
    return LUMI_OK;
fail:
    self->pipes = pipes;
    stream->ops->close(stream);
    return code;
}

static void usb_close(struct lumi_rig_stream *stream)
{
    struct usb_stream *self = (struct usb_stream *)stream;
    struct usb_pipes *pipes = self->pipes;
    bool waits = true;

    if (!pipes)
        return;
    self->pipes = NULL;
    for (int i = 0; i < IN_COUNT; i++)
        if (pipes->in[i].state == WITH_KERNEL)
            libusb_cancel_transfer(pipes->in[i].transfer);
    if (pipes->out_busy)
        libusb_cancel_transfer(pipes->out);
    for (int round = 0; round < CLOSE_ROUNDS && waits; round++) {
        struct timeval some = {0, 20000};
        waits = in_with_kernel(pipes) || pipes->out_busy;
        if (waits)
            libusb_handle_events_timeout_completed(self->context, &some, NULL);
    }
    if (!waits) {
        free_pipes(pipes);
        return;
    }
    /* The kernel keeps a transfer: freeing what it may still write to would be worse than keeping it. */
    self->context = NULL;
    self->hotplug_on = false;
}

static int usb_poll_fds(struct lumi_rig_stream *stream, struct pollfd *fds, int max, bool write)
{
    struct usb_stream *self = (struct usb_stream *)stream;
    const struct libusb_pollfd **list = self->context ? libusb_get_pollfds(self->context) : NULL;
    int count = 0;

    (void)write; /* a transfer that comes back makes room */
    for (int i = 0; list && list[i] && count < max; i++)
        fds[count++] = (struct pollfd){.fd = list[i]->fd, .events = list[i]->events};
    if (list)
        libusb_free_pollfds(list);
    return count;
}

static bool usb_arrived(struct lumi_rig_stream *stream)
{
    struct usb_stream *self = (struct usb_stream *)stream;

    if (self->context)
        work(self);
    return self->arrived;
}

static void usb_destroy(struct lumi_rig_stream *stream)
{
    struct usb_stream *self = (struct usb_stream *)stream;

    drop_context(self);
    g_free(self);
}

static const struct lumi_rig_stream_ops usb_ops = {
    .open = usb_open,
    .close = usb_close,
    .poll_fds = usb_poll_fds,
    .arrived = usb_arrived,
    .read = usb_read,
    .write = usb_write,
    .destroy = usb_destroy,
};

int lumi_rig_usb_create(const char *serial, struct lumi_rig_stream **stream, struct lumi_error *error)
{
    struct usb_stream *self;

    if (strlen(serial) >= sizeof self->serial)
        return lumi_fail(error, LUMI_ERR_ARG, "usb:%s: no serial number is that long", serial);
    self = g_new0(struct usb_stream, 1);
    self->base.ops = &usb_ops;
    snprintf(self->serial, sizeof self->serial, "%s", serial);
    snprintf(self->base.name, sizeof self->base.name, "usb:%s", serial);
    *stream = &self->base;
    return LUMI_OK;
}
