/* usbredir, the side that has the device (usb-redir-protocol.txt, version 0.7). */
#include "sim/board/usb_redir.h"

#include "proto/base/memory.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>
#include <usbredirparser.h>

#define ADDRESS 9
#define DATA_MOST 65536

struct job {
    struct usb_transfer transfer;
    struct usb_redir *redir;
    uint64_t id;
    struct usb_redir_control_packet_header control;
    struct usb_redir_bulk_packet_header bulk;
    struct job *next;
    uint8_t data[];
};

struct usb_redir {
    struct f405_machine *machine;
    int fd;
    struct usbredirparser *parser;
    bool connected; /* the other side has been told of the device */
    uint64_t next_try;
    struct job *jobs;
    struct usb_redir_counters counters;
};

static int redir_read(void *context, uint8_t *data, int count)
{
    struct usb_redir *r = context;
    ssize_t n = read(r->fd, data, (size_t)count);
    if (n < 0)
        return errno == EAGAIN || errno == EINTR ? 0 : -1;
    return n == 0 ? -1 : (int)n;
}

static int redir_write(void *context, uint8_t *data, int count)
{
    struct usb_redir *r = context;
    ssize_t n = write(r->fd, data, (size_t)count);
    if (n < 0)
        return errno == EAGAIN || errno == EINTR ? 0 : -1;
    return (int)n;
}

static void redir_log(void *context, int level, const char *message)
{
    (void)context;
    (void)level;
    (void)message;
}

static int status_of(enum usb_status status)
{
    switch (status) {
    case USB_DONE:
        return usb_redir_success;
    case USB_STALLED:
        return usb_redir_stall;
    case USB_BABBLE:
        return usb_redir_babble;
    case USB_CANCELLED:
        return usb_redir_cancelled;
    case USB_TIMED_OUT:
        return usb_redir_timeout;
    default:
        return usb_redir_ioerror;
    }
}

/* ---- transfers ---- */

static void unlink_job(struct usb_redir *r, struct job *job)
{
    struct job **at = &r->jobs;
    while (*at && *at != job)
        at = &(*at)->next;
    if (*at)
        *at = job->next;
}

static void done(struct usb_transfer *t, void *context)
{
    struct job *job = context;
    struct usb_redir *r = job->redir;
    unlink_job(r, job);
    int status = status_of(t->status);
    r->counters.stalls += t->status == USB_STALLED;
    r->counters.cancelled += t->status == USB_CANCELLED;
    bool in = t->endpoint ? t->endpoint & 0x80 : t->setup[0] & 0x80;
    uint8_t *data = in && t->length ? job->data : NULL;
    int length = data ? (int)t->length : 0;
    if (t->endpoint == 0) {
        job->control.status = (uint8_t)status;
        job->control.length = (uint16_t)t->length;
        usbredirparser_send_control_packet(r->parser, job->id, &job->control, data, length);
    } else {
        job->bulk.status = (uint8_t)status;
        job->bulk.length = (uint16_t)t->length;
        job->bulk.length_high = (uint16_t)(t->length >> 16);
        r->counters.bytes_in += in ? t->length : 0;
        r->counters.bytes_out += in ? 0 : t->length;
        usbredirparser_send_bulk_packet(r->parser, job->id, &job->bulk, data, length);
    }
    lumi_free(job);
}

static struct job *new_job(struct usb_redir *r, uint64_t id, size_t room, const uint8_t *data, int size)
{
    struct job *job = lumi_calloc(1, sizeof *job + room + 1);
    if (!job)
        return NULL;
    job->redir = r;
    job->id = id;
    job->transfer.data = job->data;
    job->transfer.size = room;
    job->transfer.done = done;
    job->transfer.context = job;
    if (data && size > 0 && (size_t)size <= room)
        memcpy(job->data, data, (size_t)size);
    job->next = r->jobs;
    r->jobs = job;
    return job;
}

static void control_packet(void *context, uint64_t id, struct usb_redir_control_packet_header *h, uint8_t *data,
                           int size)
{
    struct usb_redir *r = context;
    struct job *job = new_job(r, id, h->length, data, size);
    usbredirparser_free_packet_data(r->parser, data);
    r->counters.control++;
    if (!job)
        return;
    const uint8_t setup[8] = {h->requesttype,     h->request,
                              (uint8_t)h->value,  (uint8_t)(h->value >> 8),
                              (uint8_t)h->index,  (uint8_t)(h->index >> 8),
                              (uint8_t)h->length, (uint8_t)(h->length >> 8)};
    memcpy(job->transfer.setup, setup, 8);
    job->control = *h;
    /* CLEAR_FEATURE(ENDPOINT_HALT): the host's toggle starts anew as the device's does. */
    if (h->requesttype == 0x02 && h->request == 1 && h->value == 0)
        usb_host_clear_toggle(f405_machine_usb(r->machine), h->index & 0xff);
    usb_host_submit(f405_machine_usb(r->machine), &job->transfer);
}

static void bulk_packet(void *context, uint64_t id, struct usb_redir_bulk_packet_header *h, uint8_t *data, int size)
{
    struct usb_redir *r = context;
    bool in = h->endpoint & 0x80;
    size_t length = h->length | (size_t)h->length_high << 16;
    struct job *job = length <= DATA_MOST ? new_job(r, id, length, data, size) : NULL;
    usbredirparser_free_packet_data(r->parser, data);
    if (in)
        r->counters.bulk_in++;
    else
        r->counters.bulk_out++;
    if (!job) {
        h->status = usb_redir_inval;
        h->length = h->length_high = 0;
        usbredirparser_send_bulk_packet(r->parser, id, h, NULL, 0);
        return;
    }
    job->bulk = *h;
    job->transfer.endpoint = h->endpoint;
    usb_host_submit(f405_machine_usb(r->machine), &job->transfer);
}

static void cancel_packet(void *context, uint64_t id)
{
    struct usb_redir *r = context;
    for (struct job *job = r->jobs; job; job = job->next)
        if (job->id == id) {
            usb_host_cancel(f405_machine_usb(r->machine), &job->transfer);
            return;
        }
}

/* ---- configuration ---- */

static void device_reset(void *context)
{
    struct usb_redir *r = context;
    r->counters.resets++;
    usb_enumerate(r->machine, ADDRESS);
}

static void set_configuration(void *context, uint64_t id, struct usb_redir_set_configuration_header *h)
{
    struct usb_redir *r = context;
    enum usb_status status = usb_control(r->machine, 0x00, 9, h->configuration, 0, NULL, 0, NULL);
    struct usb_redir_configuration_status_header answer = {.status = (uint8_t)status_of(status),
                                                           .configuration = h->configuration};
    usb_host_clear_toggle(f405_machine_usb(r->machine), 0x01);
    usb_host_clear_toggle(f405_machine_usb(r->machine), 0x81);
    usbredirparser_send_configuration_status(r->parser, id, &answer);
}

static void get_configuration(void *context, uint64_t id)
{
    struct usb_redir *r = context;
    uint8_t value = 0;
    enum usb_status status = usb_control(r->machine, 0x80, 8, 0, 0, &value, 1, NULL);
    struct usb_redir_configuration_status_header answer = {.status = (uint8_t)status_of(status),
                                                           .configuration = value};
    usbredirparser_send_configuration_status(r->parser, id, &answer);
}

static void set_alt_setting(void *context, uint64_t id, struct usb_redir_set_alt_setting_header *h)
{
    struct usb_redir *r = context;
    enum usb_status status = usb_control(r->machine, 0x01, 11, h->alt, h->interface, NULL, 0, NULL);
    struct usb_redir_alt_setting_status_header answer = {
        .status = (uint8_t)status_of(status), .interface = h->interface, .alt = h->alt};
    usb_host_clear_toggle(f405_machine_usb(r->machine), 0x01);
    usb_host_clear_toggle(f405_machine_usb(r->machine), 0x81);
    usbredirparser_send_alt_setting_status(r->parser, id, &answer);
}

static void get_alt_setting(void *context, uint64_t id, struct usb_redir_get_alt_setting_header *h)
{
    struct usb_redir *r = context;
    struct usb_redir_alt_setting_status_header answer = {.status = usb_redir_success, .interface = h->interface};
    usbredirparser_send_alt_setting_status(r->parser, id, &answer);
}

static void hello(void *context, struct usb_redir_hello_header *h)
{
    (void)context;
    (void)h;
}

/* Reads the device's own descriptors and tells them. */
static bool announce(struct usb_redir *r)
{
    uint8_t device[18], config[256];
    size_t length = 0;
    if (usb_enumerate(r->machine, ADDRESS) != USB_DONE ||
        usb_control(r->machine, 0x80, 6, 0x0100, 0, device, sizeof device, NULL) != USB_DONE ||
        usb_control(r->machine, 0x80, 6, 0x0200, 0, config, sizeof config, &length) != USB_DONE)
        return false;
    struct usb_redir_interface_info_header interfaces = {0};
    struct usb_redir_ep_info_header endpoints;
    memset(&endpoints, 0, sizeof endpoints);
    memset(endpoints.type, usb_redir_type_invalid, sizeof endpoints.type);
    endpoints.type[0] = endpoints.type[16] = usb_redir_type_control;
    endpoints.max_packet_size[0] = endpoints.max_packet_size[16] = device[7];
    for (size_t i = 0; i + 1 < length && config[i] >= 2 && i + config[i] <= length; i += config[i]) {
        const uint8_t *d = config + i;
        if (d[1] == 4 && d[0] >= 9 && interfaces.interface_count < 32) {
            uint32_t n = interfaces.interface_count++;
            interfaces.interface[n] = d[2];
            interfaces.interface_class[n] = d[5];
            interfaces.interface_subclass[n] = d[6];
            interfaces.interface_protocol[n] = d[7];
        } else if (d[1] == 5 && d[0] >= 7) {
            int n = (d[2] & 15) | (d[2] & 0x80 ? 16 : 0);
            endpoints.type[n] = d[3] & 3;
            endpoints.interval[n] = d[6];
            endpoints.max_packet_size[n] = (uint16_t)(d[4] | d[5] << 8);
        }
    }
    struct usb_redir_device_connect_header connect = {
        .speed = usb_redir_speed_full,
        .device_class = device[4],
        .device_subclass = device[5],
        .device_protocol = device[6],
        .vendor_id = (uint16_t)(device[8] | device[9] << 8),
        .product_id = (uint16_t)(device[10] | device[11] << 8),
        .device_version_bcd = (uint16_t)(device[12] | device[13] << 8),
    };
    usbredirparser_send_interface_info(r->parser, &interfaces);
    usbredirparser_send_ep_info(r->parser, &endpoints);
    usbredirparser_send_device_connect(r->parser, &connect);
    r->counters.connects++;
    return true;
}

struct usb_redir *usb_redir_create(struct f405_machine *machine, int fd)
{
    struct usb_redir *r = lumi_calloc(1, sizeof *r);
    if (!r)
        return NULL;
    r->machine = machine;
    r->fd = fd;
    r->parser = usbredirparser_create();
    if (!r->parser) {
        lumi_free(r);
        return NULL;
    }
    struct usbredirparser *p = r->parser;
    p->priv = r;
    p->log_func = redir_log;
    p->read_func = redir_read;
    p->write_func = redir_write;
    p->hello_func = hello;
    p->reset_func = device_reset;
    p->set_configuration_func = set_configuration;
    p->get_configuration_func = get_configuration;
    p->set_alt_setting_func = set_alt_setting;
    p->get_alt_setting_func = get_alt_setting;
    p->cancel_data_packet_func = cancel_packet;
    p->control_packet_func = control_packet;
    p->bulk_packet_func = bulk_packet;
    uint32_t caps[USB_REDIR_CAPS_SIZE] = {0};
    usbredirparser_caps_set_cap(caps, usb_redir_cap_connect_device_version);
    usbredirparser_caps_set_cap(caps, usb_redir_cap_ep_info_max_packet_size);
    usbredirparser_caps_set_cap(caps, usb_redir_cap_64bits_ids);
    usbredirparser_caps_set_cap(caps, usb_redir_cap_32bits_bulk_length);
    usbredirparser_init(p, "lumisphere board", caps, USB_REDIR_CAPS_SIZE, usbredirparser_fl_usb_host);
    return r;
}

void usb_redir_destroy(struct usb_redir *r)
{
    if (!r)
        return;
    while (r->jobs)
        usb_host_cancel(f405_machine_usb(r->machine), &r->jobs->transfer);
    usbredirparser_destroy(r->parser);
    lumi_free(r);
}

bool usb_redir_poll(struct usb_redir *r)
{
    if (usbredirparser_do_read(r->parser) != 0)
        return false;
    bool there = usb_host_sees_device(f405_machine_usb(r->machine));
    if (r->connected && !there) {
        usbredirparser_send_device_disconnect(r->parser);
        r->connected = false;
    } else if (!r->connected && there && f405_machine_now(r->machine) >= r->next_try &&
               usbredirparser_peer_has_cap(r->parser, usb_redir_cap_connect_device_version)) {
        r->connected = announce(r);
        r->next_try = f405_machine_now(r->machine) + F405_HZ / 2;
    }
    while (usbredirparser_has_data_to_write(r->parser)) {
        int n = usbredirparser_do_write(r->parser);
        if (n < 0)
            return false;
        break;
    }
    return true;
}

bool usb_redir_wants_to_write(const struct usb_redir *r)
{
    return usbredirparser_has_data_to_write(r->parser);
}

const struct usb_redir_counters *usb_redir_counters(const struct usb_redir *r)
{
    return &r->counters;
}
