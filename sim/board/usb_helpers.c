/* Transfers that are waited for, and the enumeration every host does. */
#include "sim/board/f405_machine.h"

#include <string.h>

#define STEP (F405_HZ / 10000u)

static enum usb_status wait_for(struct f405_machine *machine, struct usb_transfer *transfer, double seconds)
{
    uint64_t end = f405_machine_now(machine) + (uint64_t)(seconds * F405_HZ);
    usb_host_submit(f405_machine_usb(machine), transfer);
    while (transfer->status == USB_PENDING && f405_machine_now(machine) < end)
        if (f405_machine_run_to(machine, f405_machine_now(machine) + STEP) == F405_STOP_FAULT)
            break;
    if (transfer->status == USB_PENDING) {
        usb_host_cancel(f405_machine_usb(machine), transfer);
        return USB_TIMED_OUT;
    }
    return transfer->status;
}

enum usb_status usb_control(struct f405_machine *machine, uint8_t type, uint8_t request, uint16_t value, uint16_t index,
                            void *data, uint16_t size, size_t *length)
{
    struct usb_transfer transfer = {
        .setup = {type, request, (uint8_t)value, (uint8_t)(value >> 8), (uint8_t)index, (uint8_t)(index >> 8),
                  (uint8_t)size, (uint8_t)(size >> 8)},
        .data = data,
        .size = size,
    };
    enum usb_status status = wait_for(machine, &transfer, 5);
    if (length)
        *length = transfer.length;
    return status;
}

enum usb_status usb_bulk(struct f405_machine *machine, int endpoint, void *data, size_t size, bool zero, double seconds,
                         size_t *length)
{
    struct usb_transfer transfer = {.endpoint = endpoint, .data = data, .size = size, .zero = zero};
    enum usb_status status = wait_for(machine, &transfer, seconds);
    if (length)
        *length = transfer.length;
    return status;
}

enum usb_status usb_enumerate(struct f405_machine *machine, int address)
{
    struct usb_host *host = f405_machine_usb(machine);
    uint8_t descriptor[18] = {0};
    for (int i = 0; i < 1000 && !usb_host_sees_device(host); i++)
        f405_machine_run(machine, 1e-3);
    if (!usb_host_sees_device(host))
        return USB_GONE;
    f405_machine_run(machine, 0.1); /* USB 2.0 7.1.7.3: debounce */
    usb_host_reset(host);
    f405_machine_run(machine, 0.02);
    /* The first eight bytes tell the packet size. */
    enum usb_status status = usb_control(machine, 0x80, 6, 0x0100, 0, descriptor, 8, NULL);
    if (status != USB_DONE)
        return status;
    usb_host_set_packet_size(host, descriptor[7]);
    status = usb_control(machine, 0x00, 5, (uint16_t)address, 0, NULL, 0, NULL);
    if (status != USB_DONE)
        return status;
    usb_host_set_address(host, address);
    f405_machine_run(machine, 0.002); /* 9.2.6.3 */
    status = usb_control(machine, 0x80, 6, 0x0100, 0, descriptor, sizeof descriptor, NULL);
    if (status == USB_DONE)
        status = usb_control(machine, 0x00, 9, 1, 0, NULL, 0, NULL);
    return status;
}
