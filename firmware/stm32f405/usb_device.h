/* The USB device: between its files. usb_otg.c drives the core, usb_control.c answers on endpoint 0, usb_link.c is the
 * stream of bytes on endpoint 1, usb_descriptors.c says what the device is. All of it runs at PRIORITY_LINK or with
 * that held off. */
#ifndef LUMI_FIRMWARE_STM32F405_USB_DEVICE_H
#define LUMI_FIRMWARE_STM32F405_USB_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define USB_EP0_SIZE 64
#define USB_BULK_BURST 256 /* bytes of one transfer to the host: what its FIFO holds at once */

/* A request, USB 2.0 section 9.3. */
struct usb_setup {
    uint8_t type, request;
    uint16_t value, index, length;
};

/* usb_otg.c */
/* Endpoint 0 sends one packet (64 bytes at most, 0 too), answers with a stall, or expects the host's empty packet. */
void usb_ep0_send(const uint8_t *data, size_t size);
void usb_ep0_stall(void);
void usb_ep0_receive_status(void);
/* The host has begun another request: what endpoint 0 was about to send is withdrawn. */
void usb_ep0_abort(void);
void usb_set_address(unsigned address);
/* Endpoint 1: both directions on, toggles at DATA0; or off. */
void usb_bulk_open(void);
void usb_bulk_close(void);
void usb_bulk_halt(bool in, bool halted);             /* ending a halt starts with DATA0 */
void usb_bulk_send(const uint8_t *data, size_t size); /* USB_BULK_BURST bytes at most; not while one is under way */
void usb_bulk_receive(void);                          /* lets one packet in */

/* usb_control.c, told by usb_otg.c */
void usb_control_reset(void);
void usb_control_setup(const uint8_t bytes[8]);
void usb_control_sent(void);

/* usb_link.c, told by usb_otg.c and usb_control.c */
void usb_link_open(void);
void usb_link_close(void); /* what has not gone is dropped */
void usb_link_halted(bool in, bool halted);
void usb_link_received(const uint8_t *data, size_t size);
void usb_link_receive_done(void); /* the core is done with that packet: the next may be let in */
void usb_link_sent(void);
void usb_link_suspended(bool suspended);

/* usb_descriptors.c */
#define USB_MICROSOFT_REQUEST 0x20 /* of our choice: bMS_VendorCode */
/* The descriptor of a GET_DESCRIPTOR's value, or NULL. Strings are made in `text`. */
#define USB_STRING_MAX 64
const uint8_t *usb_descriptor(uint16_t value, uint8_t text[USB_STRING_MAX], size_t *size);
const uint8_t *usb_microsoft_set(size_t *size);

#endif
