/* Which cameras libcamera has, and by what they are known. */
#include "daemon/camera/camera_libcamera_priv.h"

#include <libudev.h>
#include <stdio.h>
#include <string.h>

struct listing {
    struct lumi_camera_identity *cameras;
    int max, count;
    struct udev *udev;
};

/* A USB camera is known by its serial number here too; a sensor by libcamera's name for it, which is where it is. */
static void identify(struct listing *listing, const struct shim_identity *from, struct lumi_camera_identity *identity)
{
    memset(identity, 0, sizeof *identity);
    identity->backend = LUMI_CAMERA_LIBCAMERA;
    snprintf(identity->serial, sizeof identity->serial, "%.*s", LUMI_CAMERA_TEXT - 1, from->id);
    snprintf(identity->address, sizeof identity->address, "%.*s", (int)sizeof identity->address - 1, from->id);
    snprintf(identity->model, sizeof identity->model, "%.*s", LUMI_CAMERA_TEXT - 1, from->model);
    snprintf(identity->firmware, sizeof identity->firmware, "libcamera %.60s", shim_version());
    identity->device_clock = identity->monotonic_clock = true;
    identity->clock_step_ns = 1000;
    for (int i = 0; listing->udev && i < from->device_count; i++) {
        struct udev_device *device = udev_device_new_from_devnum(listing->udev, 'c', (dev_t)from->devices[i]);
        struct udev_device *usb =
            device ? udev_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device") : NULL;
        const char *serial = usb ? udev_device_get_sysattr_value(usb, "serial") : NULL;
        const char *vendor = usb ? udev_device_get_sysattr_value(usb, "manufacturer") : NULL;

        if (serial && *serial)
            snprintf(identity->serial, sizeof identity->serial, "%.*s", LUMI_CAMERA_TEXT - 1, serial);
        if (vendor)
            snprintf(identity->vendor, sizeof identity->vendor, "%.*s", LUMI_CAMERA_TEXT - 1, vendor);
        udev_device_unref(device);
    }
}

static void add_camera(void *context, const struct shim_identity *identity)
{
    struct listing *listing = context;

    if (listing->count < listing->max)
        identify(listing, identity, &listing->cameras[listing->count]);
    listing->count++;
}

int camera_libcamera_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    struct listing listing = {.cameras = cameras, .max = max, .udev = udev_new()};
    const int code = shim_list(add_camera, &listing);

    if (listing.udev)
        udev_unref(listing.udev);
    return code == 0 ? listing.count
                     : lumi_fail(error, LUMI_ERR_IO, "libcamera does not list its cameras: %s", strerror(-code));
}
