/* Which V4L2 cameras are there, and by what they are known: the USB device's serial number, or udev's ID_SERIAL_SHORT,
 * or, where there is neither, the bus it hangs on. */
#include "daemon/camera/camera_v4l2_priv.h"

#include <fcntl.h>
#include <libudev.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Whether it is a camera that is used by its node alone: not a codec, a metadata node, or a part of a pipeline that has
 * to be put together first (that is libcamera's). */
static bool ask_node(const char *node, struct v4l2_capability *capability)
{
    const int fd = open(node, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    uint32_t can;
    bool camera;

    if (fd < 0)
        return false;
    memset(capability, 0, sizeof *capability);
    camera = v4l2_ioctl(fd, VIDIOC_QUERYCAP, capability) == 0;
    close(fd);
    can = capability->capabilities & V4L2_CAP_DEVICE_CAPS ? capability->device_caps : capability->capabilities;
    return camera && can & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE) && can & V4L2_CAP_STREAMING &&
           !(can & (V4L2_CAP_VIDEO_M2M | V4L2_CAP_VIDEO_M2M_MPLANE | V4L2_CAP_IO_MC));
}

static void text(char *to, size_t size, const char *from)
{
    snprintf(to, size, "%.*s", (int)size - 1, from ? from : "");
}

static void identify(struct udev_device *device, const struct v4l2_capability *capability,
                     struct lumi_camera_identity *identity)
{
    struct udev_device *usb = udev_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device");
    const char *serial = usb ? udev_device_get_sysattr_value(usb, "serial") : NULL;
    const char *index = udev_device_get_sysattr_value(device, "index");
    const uint32_t v = capability->version;

    memset(identity, 0, sizeof *identity);
    identity->backend = LUMI_CAMERA_V4L2;
    if (!serial || !*serial)
        serial = udev_device_get_property_value(device, "ID_SERIAL_SHORT");
    if (!serial || !*serial)
        serial = (const char *)capability->bus_info;
    text(identity->serial, sizeof identity->serial - 8, serial);
    if (usb && index && atoi(index) > 0) /* one device, several cameras */
        snprintf(identity->serial + strlen(identity->serial), 8, "#%u", (unsigned)atoi(index) % 1000000);
    text(identity->vendor, sizeof identity->vendor, usb ? udev_device_get_sysattr_value(usb, "manufacturer") : NULL);
    if (!identity->vendor[0])
        text(identity->vendor, sizeof identity->vendor, (const char *)capability->driver);
    text(identity->model, sizeof identity->model, usb ? udev_device_get_sysattr_value(usb, "product") : NULL);
    if (!identity->model[0])
        text(identity->model, sizeof identity->model, (const char *)capability->card);
    if (usb)
        text(identity->firmware, sizeof identity->firmware, udev_device_get_sysattr_value(usb, "bcdDevice"));
    else
        snprintf(identity->firmware, sizeof identity->firmware, "Linux %u.%u.%u", v >> 16 & 255, v >> 8 & 255, v & 255);
    text(identity->address, sizeof identity->address, udev_device_get_devnode(device));
    identity->device_clock = identity->monotonic_clock = true;
    identity->clock_step_ns = 1000;
}

int camera_v4l2_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    struct udev *udev = udev_new();
    struct udev_enumerate *found = udev ? udev_enumerate_new(udev) : NULL;
    struct udev_list_entry *entry;
    int count = 0;

    if (!found || udev_enumerate_add_match_subsystem(found, "video4linux") < 0 ||
        udev_enumerate_scan_devices(found) < 0) {
        count = lumi_fail(error, LUMI_ERR_IO, "cameras of V4L2: udev does not list them");
        goto out;
    }
    udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(found))
    {
        struct udev_device *device = udev_device_new_from_syspath(udev, udev_list_entry_get_name(entry));
        const char *node = device ? udev_device_get_devnode(device) : NULL;
        struct v4l2_capability capability;

        if (node && ask_node(node, &capability)) {
            if (count < max)
                identify(device, &capability, &cameras[count]);
            count++;
        }
        udev_device_unref(device);
    }
out:
    if (found)
        udev_enumerate_unref(found);
    if (udev)
        udev_unref(udev);
    return count;
}
