/* The emulated board's USB connector for a virtual machine: a server of the usbredir protocol (libusbredirparser), as
 * qemu's `-device usb-redir` speaks it, in front of the USB host controller. The machine's time follows the wall clock.
 */
#ifndef LUMI_SIM_BOARD_USB_REDIR_H
#define LUMI_SIM_BOARD_USB_REDIR_H

#include "sim/board/f405_machine.h"

struct usb_redir;

/* Talks over `fd`, a connected non-blocking stream socket, which stays the caller's. */
struct usb_redir *usb_redir_create(struct f405_machine *machine, int fd);
void usb_redir_destroy(struct usb_redir *redir);
/* Takes in and puts out what there is; tells the other side of a device that came or went. False: it is gone. */
bool usb_redir_poll(struct usb_redir *redir);
bool usb_redir_wants_to_write(const struct usb_redir *redir);
/* What came by so far. */
struct usb_redir_counters {
    uint64_t control, bulk_in, bulk_out, bytes_in, bytes_out, stalls, cancelled, resets, connects;
};
const struct usb_redir_counters *usb_redir_counters(const struct usb_redir *redir);

#endif
