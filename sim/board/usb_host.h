/* A USB 1.1 host controller with one port, at the level of packets, on the emulated chip's connector: start-of-frame
 * every millisecond, tokens, toggles, NAKs that are asked again, three silent tries that end a transfer, frames that
 * have only so much room (USB 2.0 chapters 5 and 8). It knows no descriptor: enumeration is the caller's, with the
 * helpers below.
 *
 * Transfers of one endpoint go in the order in which they were submitted; the endpoints take turns. */
#ifndef LUMI_SIM_BOARD_USB_HOST_H
#define LUMI_SIM_BOARD_USB_HOST_H

#include "sim/board/f405.h"

struct usb_host;
struct f405_machine;

enum usb_status {
    USB_PENDING = 0,
    USB_DONE,
    USB_STALLED,
    USB_SILENT, /* no handshake in three tries */
    USB_BABBLE, /* more than was asked for */
    USB_CANCELLED,
    USB_GONE,     /* the device went */
    USB_TIMED_OUT /* by the helpers that wait */
};

struct usb_transfer {
    int endpoint;     /* address: 0x00 control, 0x01 OUT, 0x81 IN */
    uint8_t setup[8]; /* control */
    uint8_t *data;
    size_t size; /* to send, or room to receive */
    bool zero;   /* OUT: a full last packet is followed by an empty one */
    void (*done)(struct usb_transfer *transfer, void *context);
    void *context;
    /* results */
    enum usb_status status;
    size_t length;
    /* the host's own */
    int stage, tries;
    bool queued;
    struct usb_transfer *next;
};

struct usb_counters {
    uint64_t frames, setups, ins, outs, naks, stalls, silences;
};

struct usb_host *usb_host_create(struct f405 *chip);
void usb_host_destroy(struct usb_host *host);

/* The cable: 5 V come and go. Unplugging ends every transfer with USB_GONE. */
void usb_host_plug(struct usb_host *host, bool plugged);
bool usb_host_sees_device(const struct usb_host *host);
/* Drives a reset for 10 ms from now on; toggles and address start anew. */
void usb_host_reset(struct usb_host *host);
/* No more frames, and the device is told after 3 ms; or 20 ms of resume, then frames again. */
void usb_host_suspend(struct usb_host *host, bool suspended);
void usb_host_set_address(struct usb_host *host, int address);
void usb_host_set_packet_size(struct usb_host *host, int size); /* of endpoint 0 */
/* The host's toggle of an endpoint to DATA0: after clearing a halt. */
void usb_host_clear_toggle(struct usb_host *host, int endpoint);

void usb_host_submit(struct usb_host *host, struct usb_transfer *transfer);
void usb_host_cancel(struct usb_host *host, struct usb_transfer *transfer);
const struct usb_counters *usb_host_counters(const struct usb_host *host);

/* For the machine: when something happens next, and that it is due. */
uint64_t usb_host_next(const struct usb_host *host);
void usb_host_event(struct usb_host *host, uint64_t now);

/* ---- helpers that run the machine until the transfer has ended, or so many seconds have passed ---- */
enum usb_status usb_control(struct f405_machine *machine, uint8_t type, uint8_t request, uint16_t value, uint16_t index,
                            void *data, uint16_t size, size_t *length);
enum usb_status usb_bulk(struct f405_machine *machine, int endpoint, void *data, size_t size, bool zero, double seconds,
                         size_t *length);
/* Waits for the device, resets it, gives it an address, reads its device descriptor, sets configuration 1. */
enum usb_status usb_enumerate(struct f405_machine *machine, int address);

#endif
