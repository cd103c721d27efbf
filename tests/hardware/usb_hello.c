/* Talks to the rig's board with libusb and the wire's client, on a machine where the real kernel drives the device:
 * descriptors, a stall, sessions, frames of every length, a cleared halt, an unplugging in the middle of a transfer. */
#include "proto/wire/client.h"
#include "proto/wire/transport.h"

#include <libusb-1.0/libusb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static libusb_context *usb;
static libusb_device_handle *board;
static struct lumi_wire_client client;
static bool replied;

#define NEED(condition, ...)                                                                                           \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            printf("usb_hello: FAILED: %s: ", #condition);                                                             \
            printf(__VA_ARGS__);                                                                                       \
            printf("\n");                                                                                              \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static bool send(void *context, const uint8_t *frame, size_t size)
{
    int sent = 0;
    (void)context;
    int code =
        libusb_bulk_transfer(board, LUMI_WIRE_USB_OUT, (unsigned char *)(uintptr_t)frame, (int)size, &sent, 2000);
    if (code == 0 && size % LUMI_WIRE_USB_PACKET == 0)
        code = libusb_bulk_transfer(board, LUMI_WIRE_USB_OUT, (unsigned char *)(uintptr_t)frame, 0, &sent, 2000);
    return code == 0;
}
static void welcome(void *context, const lumi_wire_Welcome *message, bool restarted)
{
    (void)context;
    printf("usb_hello: welcome from %s, firmware %s, token %08x%s\n", message->board, message->firmware, message->token,
           restarted ? ", restarted" : "");
}
static void reply(void *context, const lumi_wire_Reply *message)
{
    (void)context;
    (void)message;
    replied = true;
}
static void request_lost(void *context, uint32_t number)
{
    (void)context;
    (void)number;
}
static void event(void *context, const lumi_wire_Event *message)
{
    (void)context;
    (void)message;
}
static void events_lost(void *context, uint32_t count)
{
    (void)context;
    (void)count;
}
static void pulse(void *context, const lumi_wire_Pulse *message, uint64_t received_ns)
{
    (void)context;
    (void)message;
    (void)received_ns;
}
static const struct lumi_wire_client_ops ops = {send, welcome, reply, request_lost, event, events_lost, pulse};

static void turn(void)
{
    uint8_t data[512];
    int size = 0;
    lumi_wire_client_poll(&client, now_ns());
    int code = libusb_bulk_transfer(board, LUMI_WIRE_USB_IN, data, sizeof data, &size, 20);
    if (size > 0)
        lumi_wire_client_receive(&client, data, (size_t)size, now_ns());
    NEED(code == 0 || code == LIBUSB_ERROR_TIMEOUT, "%s", libusb_error_name(code));
}

/* libusb begins anew for every look: nobody tells it of devices that come, there is no udev in that machine. */
static void open_board(double seconds)
{
    uint64_t end = now_ns() + (uint64_t)(seconds * 1e9);
    while (!(board = libusb_open_device_with_vid_pid(usb, LUMI_WIRE_USB_VENDOR, LUMI_WIRE_USB_PRODUCT)) &&
           now_ns() < end) {
        libusb_exit(usb);
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        NEED(libusb_init(&usb) == 0, "libusb");
    }
    NEED(board, "no device within %g s", seconds);
    int code = libusb_claim_interface(board, LUMI_WIRE_USB_INTERFACE);
    NEED(code == 0, "%s", libusb_error_name(code));
}

static void session(double seconds)
{
    uint64_t end = now_ns() + (uint64_t)(seconds * 1e9);
    while (client.state != LUMI_WIRE_CLIENT_OPEN && now_ns() < end)
        turn();
    NEED(client.state == LUMI_WIRE_CLIENT_OPEN, "no session within %g s", seconds);
}

static void request(lumi_wire_Request *message)
{
    struct lumi_error error = {0};
    uint64_t end = now_ns() + 10000000000u;
    replied = false;
    NEED(lumi_wire_client_request(&client, message, now_ns(), &error) == LUMI_OK, "%s", error.text);
    while (!replied && now_ns() < end)
        turn();
    NEED(replied, "no reply within 10 s");
}

static void descriptors(void)
{
    struct libusb_device_descriptor d;
    struct libusb_bos_descriptor *bos = NULL;
    unsigned char text[3][128];
    uint8_t buffer[64];
    libusb_get_device_descriptor(libusb_get_device(board), &d);
    const uint8_t index[3] = {d.iManufacturer, d.iProduct, d.iSerialNumber};
    for (int i = 0; i < 3; i++)
        NEED(libusb_get_string_descriptor_ascii(board, index[i], text[i], sizeof text[i]) > 0, "string %d", i);
    printf("usb_hello: %04x:%04x usb %x.%02x \"%s\" \"%s\" \"%s\"\n", d.idVendor, d.idProduct, d.bcdUSB >> 8,
           d.bcdUSB & 255, text[0], text[1], text[2]);
    int code = libusb_get_bos_descriptor(board, &bos);
    printf("usb_hello: BOS: %s, %d capabilities\n", libusb_error_name(code), bos ? bos->bNumDeviceCaps : 0);
    libusb_free_bos_descriptor(bos);
    code = libusb_control_transfer(board, 0xc0, 0x5a, 0, 0x77, buffer, sizeof buffer, 1000);
    NEED(code == LIBUSB_ERROR_PIPE, "a request nobody knows: %s", libusb_error_name(code));
    printf("usb_hello: an unknown request is stalled\n");
}

static void round_trips(void)
{
    uint64_t least = UINT64_MAX, most = 0, begin = now_ns();
    int count = 300;
    for (int i = 0; i < count; i++) {
        lumi_wire_Request message = {.which_command = lumi_wire_Request_get_status_tag};
        uint64_t at = now_ns();
        request(&message);
        at = now_ns() - at;
        least = at < least ? at : least;
        most = at > most ? at : most;
    }
    printf("usb_hello: %d round trips: mean %.2f, least %.2f, most %.2f ms; %u sent again\n", count,
           (double)(now_ns() - begin) * 1e-6 / count, (double)least * 1e-6, (double)most * 1e-6, client.retries);
    for (unsigned size = 1; size <= 192; size++) { /* every length of frame, full packets with an empty one too */
        lumi_wire_Request message = {.which_command = lumi_wire_Request_write_profile_tag};
        message.command.write_profile.data.size = (pb_size_t)size;
        memset(message.command.write_profile.data.bytes, (int)size, size);
        request(&message);
    }
    printf("usb_hello: frames of 192 lengths answered\n");
}

static void halts(void)
{
    lumi_wire_Request message = {.which_command = lumi_wire_Request_get_status_tag};
    int in = libusb_clear_halt(board, LUMI_WIRE_USB_IN), out = libusb_clear_halt(board, LUMI_WIRE_USB_OUT);
    NEED(in == 0 && out == 0, "%s %s", libusb_error_name(in), libusb_error_name(out));
    /* Halts an endpoint by request: a transfer stalls until it is cleared. */
    int code = libusb_control_transfer(board, 0x02, 3, 0, LUMI_WIRE_USB_OUT, NULL, 0, 1000);
    uint8_t byte = 0;
    int sent = 0;
    NEED(code == 0, "SET_FEATURE: %s", libusb_error_name(code));
    code = libusb_bulk_transfer(board, LUMI_WIRE_USB_OUT, &byte, 1, &sent, 1000);
    NEED(code == LIBUSB_ERROR_PIPE, "a halted endpoint: %s", libusb_error_name(code));
    NEED(libusb_clear_halt(board, LUMI_WIRE_USB_OUT) == 0, "clearing");
    request(&message);
    printf("usb_hello: a halted endpoint stalls and is cleared\n");
}

static void unplugging(void)
{
    uint8_t data[64];
    int size = 0, code;
    uint64_t begin;
    printf("host: unplug\n");
    fflush(stdout);
    do
        code = libusb_bulk_transfer(board, LUMI_WIRE_USB_IN, data, sizeof data, &size, 10000);
    while (code == 0);
    NEED(code == LIBUSB_ERROR_NO_DEVICE || code == LIBUSB_ERROR_IO || code == LIBUSB_ERROR_PIPE, "%s",
         libusb_error_name(code));
    begin = now_ns();
    printf("usb_hello: unplugged: the transfer ends with %s\n", libusb_error_name(code));
    libusb_close(board);
    sleep(1);
    open_board(20);
    printf("usb_hello: there again after %.1f s\n", (double)(now_ns() - begin) * 1e-9);
    lumi_wire_client_reconnected(&client, now_ns());
    session(10);
    lumi_wire_Request message = {.which_command = lumi_wire_Request_get_status_tag};
    request(&message);
}

int main(void)
{
    setvbuf(stdout, NULL, _IOLBF, 0);
    NEED(libusb_init(&usb) == 0, "libusb");
    open_board(20);
    descriptors();
    lumi_wire_client_init(&client, &ops, NULL, 42);
    session(10);
    round_trips();
    halts();
    unplugging();
    printf("usb_hello: OK\n");
    return 0;
}
