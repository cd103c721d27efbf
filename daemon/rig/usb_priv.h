/* Boards on USB: finding and opening them (usb_find.c), moving bytes (usb.c). */
#ifndef LUMI_DAEMON_RIG_USB_PRIV_H
#define LUMI_DAEMON_RIG_USB_PRIV_H

#include "daemon/rig/stream.h"

#include <libusb-1.0/libusb.h>

/* By its numbers and the class of its interface; nothing is opened. */
bool lumi_rig_usb_is_board(libusb_device *device);
/* Opens the one board, or that with serial number `serial` ("": any), and claims its interface. Its serial number goes
 * to `found` (64 bytes). */
int lumi_rig_usb_find(libusb_context *context, const char *serial, libusb_device_handle **handle, char *found,
                      struct lumi_error *error);

#endif
