/* Which boards are on USB, and which of them is meant. */
#include "daemon/rig/usb_priv.h"
#include "proto/wire/transport.h"

#include <glib.h>
#include <stdio.h>
#include <string.h>

bool lumi_rig_usb_is_board(libusb_device *device)
{
    struct libusb_device_descriptor descriptor;
    struct libusb_config_descriptor *config;
    bool ours = false;

    if (libusb_get_device_descriptor(device, &descriptor) || descriptor.idVendor != LUMI_WIRE_USB_VENDOR ||
        descriptor.idProduct != LUMI_WIRE_USB_PRODUCT)
        return false;
    if (libusb_get_config_descriptor(device, 0, &config))
        return false;
    if (config->bNumInterfaces > LUMI_WIRE_USB_INTERFACE &&
        config->interface[LUMI_WIRE_USB_INTERFACE].num_altsetting > 0) {
        const struct libusb_interface_descriptor *setting = config->interface[LUMI_WIRE_USB_INTERFACE].altsetting;
        ours = setting->bInterfaceClass == LUMI_WIRE_USB_CLASS &&
               setting->bInterfaceSubClass == LUMI_WIRE_USB_SUBCLASS &&
               setting->bInterfaceProtocol == LUMI_WIRE_USB_PROTOCOL;
    }
    libusb_free_config_descriptor(config);
    return ours;
}

static void describe(libusb_device *device, struct lumi_rig_usb_board *board)
{
    memset(board, 0, sizeof *board);
    snprintf(board->place, sizeof board->place, "%03d/%03d", libusb_get_bus_number(device),
             libusb_get_device_address(device));
}

static void explain(struct lumi_rig_usb_board *board, int failed)
{
    if (failed == LIBUSB_ERROR_ACCESS)
        snprintf(board->text, sizeof board->text,
                 "/dev/bus/usb/%s: no permission: install 70-lumirig.rules in /etc/udev/rules.d, run 'udevadm control "
                 "--reload' and plug the board in again (docs/rig.md)",
                 board->place);
    else
        snprintf(board->text, sizeof board->text, "/dev/bus/usb/%s: %s", board->place, libusb_strerror(failed));
}

static int open_board(libusb_device *device, libusb_device_handle **handle, struct lumi_rig_usb_board *board)
{
    struct libusb_device_descriptor descriptor;
    int failed = libusb_open(device, handle);

    describe(device, board);
    if (failed) {
        explain(board, failed);
        *handle = NULL;
        return failed;
    }
    if (!libusb_get_device_descriptor(device, &descriptor) && descriptor.iSerialNumber)
        libusb_get_string_descriptor_ascii(*handle, descriptor.iSerialNumber, (unsigned char *)board->serial,
                                           sizeof board->serial);
    return 0;
}

static int claim(libusb_device_handle *handle, const struct lumi_rig_usb_board *board, struct lumi_error *error)
{
    int failed = libusb_claim_interface(handle, LUMI_WIRE_USB_INTERFACE);

    if (failed == LIBUSB_ERROR_BUSY)
        return lumi_fail(error, LUMI_ERR_BUSY, "usb:%s: another program has it", board->serial);
    if (failed)
        return lumi_fail(error, failed == LIBUSB_ERROR_NO_DEVICE ? LUMI_ERR_NOTFOUND : LUMI_ERR_IO,
                         "usb:%s: its interface cannot be claimed: %s", board->serial, libusb_strerror(failed));
    return LUMI_OK;
}

struct search {
    libusb_device_handle *handle; /* the first that fits */
    struct lumi_rig_usb_board board;
    GPtrArray *all; /* addresses of what was found, for messages */
    char refused[512];
    int fitting, boards;
};

static void consider(struct search *search, libusb_device *device, const char *serial)
{
    struct lumi_rig_usb_board board;
    libusb_device_handle *handle;

    if (!lumi_rig_usb_is_board(device))
        return;
    search->boards++;
    if (open_board(device, &handle, &board)) {
        snprintf(search->refused, sizeof search->refused, "%s", board.text);
        return;
    }
    g_ptr_array_add(search->all, g_strdup_printf("usb:%s", board.serial));
    if ((!serial[0] || !strcmp(serial, board.serial)) && !search->fitting++) {
        search->handle = handle;
        search->board = board;
        return;
    }
    libusb_close(handle);
}

static int by_text(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static int conclude(struct search *search, const char *serial, struct lumi_error *error)
{
    g_autofree char *all = NULL;

    g_ptr_array_sort(search->all, by_text);
    g_ptr_array_add(search->all, NULL);
    all = g_strjoinv(", ", (char **)search->all->pdata);
    if (search->fitting == 1)
        return claim(search->handle, &search->board, error);
    if (search->fitting > 1)
        return lumi_fail(error, LUMI_ERR_ARG, "there are %d boards on USB: say which of %s", search->fitting, all);
    if (search->refused[0])
        return lumi_fail(error, LUMI_ERR_IO, "usb:%s: %s", serial, search->refused);
    if (search->boards)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "usb:%s: no such board; there is %s", serial, all);
    return lumi_fail(error, LUMI_ERR_NOTFOUND, "no board on USB");
}

int lumi_rig_usb_find(libusb_context *context, const char *serial, libusb_device_handle **handle, char *found,
                      struct lumi_error *error)
{
    struct search search = {.all = g_ptr_array_new_with_free_func(g_free)};
    libusb_device **devices;
    ssize_t count = libusb_get_device_list(context, &devices);
    int code;

    *handle = NULL;
    for (ssize_t i = 0; i < count; i++)
        consider(&search, devices[i], serial);
    if (count >= 0)
        libusb_free_device_list(devices, 1);
    code = conclude(&search, serial, error);
    if (code == LUMI_OK) {
        *handle = search.handle;
        snprintf(found, sizeof search.board.serial, "%s", search.board.serial);
    } else if (search.handle) {
        libusb_close(search.handle);
    }
    g_ptr_array_free(search.all, TRUE);
    return code;
}

int lumi_rig_usb_list(struct lumi_rig_usb_board *boards, int max, struct lumi_error *error)
{
    libusb_context *context;
    libusb_device **devices;
    ssize_t count;
    int found = 0, failed = libusb_init(&context);

    if (failed)
        return lumi_fail(error, LUMI_ERR_IO, "USB: %s", libusb_strerror(failed));
    count = libusb_get_device_list(context, &devices);
    for (ssize_t i = 0; i < count; i++) {
        libusb_device_handle *handle;
        struct lumi_rig_usb_board board;
        if (!lumi_rig_usb_is_board(devices[i]))
            continue;
        if (!open_board(devices[i], &handle, &board))
            libusb_close(handle);
        if (found < max)
            boards[found] = board;
        found++;
    }
    if (count >= 0)
        libusb_free_device_list(devices, 1);
    libusb_exit(context);
    return found;
}
