/* What carries the frames (frame.h): the numbers that the board's port, the host's links and the tests must agree on.
 */
#ifndef LUMI_PROTO_WIRE_TRANSPORT_H
#define LUMI_PROTO_WIRE_TRANSPORT_H

#ifdef __cplusplus
extern "C" {
#endif

/* Serial: 8 data bits, no parity, one stop bit, no flow control. A frame is answered within milliseconds at this rate,
 * and every adapter and 30 m of RS-485 carry it. */
#define LUMI_WIRE_SERIAL_BAUD 115200

/* USB, full speed: one configuration, one interface of the vendor's class with two bulk endpoints. 0x1209:0x0001 is the
 * number that pid.codes gives to private tests, which others use as well: class, subclass and protocol of the interface
 * must fit too before a device is taken for ours. The serial number is the chip's unique ID in lower-case hex. */
#define LUMI_WIRE_USB_VENDOR 0x1209
#define LUMI_WIRE_USB_PRODUCT 0x0001
#define LUMI_WIRE_USB_INTERFACE 0
#define LUMI_WIRE_USB_CLASS 0xff
#define LUMI_WIRE_USB_SUBCLASS 0x4c
#define LUMI_WIRE_USB_PROTOCOL 0x01
#define LUMI_WIRE_USB_OUT 0x01 /* endpoint addresses */
#define LUMI_WIRE_USB_IN 0x81
#define LUMI_WIRE_USB_PACKET 64
/* A transfer whose last packet is full is ended by an empty one, in both directions. */
#define LUMI_WIRE_USB_MANUFACTURER "Lumisphere"
#define LUMI_WIRE_USB_NAME "Lumisphere rig"

#ifdef __cplusplus
}
#endif
#endif
