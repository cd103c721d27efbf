/* Endpoint 0: the standard requests (USB 2.0 section 9.4) and Microsoft's one. */
#include "firmware/stm32f405/usb_device.h"

#include <string.h>

/* bmRequestType and bRequest together */
#define REQUEST(type, request) ((type) << 8 | (request))
#define STANDARD_OUT_DEVICE 0x00
#define STANDARD_OUT_INTERFACE 0x01
#define STANDARD_OUT_ENDPOINT 0x02
#define STANDARD_IN_DEVICE 0x80
#define STANDARD_IN_INTERFACE 0x81
#define STANDARD_IN_ENDPOINT 0x82
#define VENDOR_IN_DEVICE 0xc0
enum {
    GET_STATUS = 0,
    CLEAR_FEATURE = 1,
    SET_FEATURE = 3,
    SET_ADDRESS = 5,
    GET_DESCRIPTOR = 6,
    GET_CONFIGURATION = 8,
    SET_CONFIGURATION = 9,
    GET_INTERFACE = 10,
    SET_INTERFACE = 11
};
#define ENDPOINT_HALT 0
#define MICROSOFT_DESCRIPTOR_INDEX 7

static struct {
    uint8_t configuration;
    bool halted[2]; /* of endpoint 1: out, in */
    const uint8_t *data;
    size_t left;
    bool sending, end_with_empty;
    uint8_t text[USB_STRING_MAX];
} control;

static void configure(uint8_t configuration)
{
    if (control.configuration) {
        usb_link_close();
        usb_bulk_close();
    }
    control.configuration = configuration;
    control.halted[0] = control.halted[1] = false;
    if (configuration) {
        usb_bulk_open();
        usb_link_open();
    }
}

void usb_control_reset(void)
{
    configure(0);
    control.sending = false;
}

static void send_packet(void)
{
    const size_t size = control.left < USB_EP0_SIZE ? control.left : USB_EP0_SIZE;

    usb_ep0_send(control.data, size);
    control.data += size;
    control.left -= size;
}

/* The data stage to the host. A shorter answer than was asked for, of full packets only, ends with an empty one
 * (section 5.5.3). */
static bool answer(const struct usb_setup *setup, const uint8_t *data, size_t size)
{
    if (!data)
        return false;
    control.data = data;
    control.left = size < setup->length ? size : setup->length;
    control.end_with_empty = control.left < setup->length && control.left % USB_EP0_SIZE == 0 && control.left > 0;
    control.sending = true;
    send_packet();
    return true;
}

static bool answer_bytes(const struct usb_setup *setup, uint8_t first, uint8_t second, size_t size)
{
    control.text[0] = first;
    control.text[1] = second;
    return answer(setup, control.text, size);
}

void usb_control_sent(void)
{
    if (!control.sending)
        return; /* the empty packet of a status stage */
    if (control.left > 0) {
        send_packet();
    } else if (control.end_with_empty) {
        control.end_with_empty = false;
        send_packet();
    } else {
        control.sending = false;
        usb_ep0_receive_status();
    }
}

/* The status stage of a request without data. */
static bool done(void)
{
    usb_ep0_send(NULL, 0);
    return true;
}

/* Whether `index` is one of our endpoints. */
static bool known_endpoint(uint16_t index)
{
    return (index & 0xff7f) == 0 || (control.configuration && (index & 0xff7f) == 1);
}

static bool endpoint_status(const struct usb_setup *setup)
{
    const bool bulk = setup->index & 1;

    if (!known_endpoint(setup->index) || setup->value != 0)
        return false;
    return answer_bytes(setup, bulk && control.halted[setup->index >> 7 & 1], 0, 2);
}

static bool endpoint_feature(const struct usb_setup *setup, bool halted)
{
    const bool in = setup->index & 0x80;

    if (setup->value != ENDPOINT_HALT || !known_endpoint(setup->index))
        return false;
    if (setup->index & 1) {
        control.halted[in] = halted;
        usb_bulk_halt(in, halted);
        usb_link_halted(in, halted);
    }
    return done();
}

static bool set_interface(const struct usb_setup *setup)
{
    if (!control.configuration || setup->value != 0 || setup->index != 0)
        return false;
    configure(control.configuration); /* section 9.1.1.5: toggles begin anew */
    return done();
}

static bool get_descriptor(const struct usb_setup *setup)
{
    size_t size = 0;
    const uint8_t *data = usb_descriptor(setup->value, control.text, &size);

    return answer(setup, data, size);
}

static bool get_microsoft(const struct usb_setup *setup)
{
    size_t size;
    const uint8_t *data = usb_microsoft_set(&size);

    return setup->index == MICROSOFT_DESCRIPTOR_INDEX && answer(setup, data, size);
}

static bool execute(const struct usb_setup *setup)
{
    switch (REQUEST(setup->type, setup->request)) {
    case REQUEST(STANDARD_IN_DEVICE, GET_STATUS):
        return answer_bytes(setup, 0, 0, 2); /* powered by the bus, no remote wake-up */
    case REQUEST(STANDARD_IN_INTERFACE, GET_STATUS):
        return control.configuration && setup->index == 0 && answer_bytes(setup, 0, 0, 2);
    case REQUEST(STANDARD_IN_ENDPOINT, GET_STATUS):
        return endpoint_status(setup);
    case REQUEST(STANDARD_OUT_ENDPOINT, CLEAR_FEATURE):
        return endpoint_feature(setup, false);
    case REQUEST(STANDARD_OUT_ENDPOINT, SET_FEATURE):
        return endpoint_feature(setup, true);
    case REQUEST(STANDARD_OUT_DEVICE, SET_ADDRESS):
        if (setup->value > 127 || setup->index != 0 || setup->length != 0)
            return false;
        usb_set_address(setup->value);
        return done();
    case REQUEST(STANDARD_IN_DEVICE, GET_DESCRIPTOR):
        return get_descriptor(setup);
    case REQUEST(STANDARD_IN_DEVICE, GET_CONFIGURATION):
        return answer_bytes(setup, control.configuration, 0, 1);
    case REQUEST(STANDARD_OUT_DEVICE, SET_CONFIGURATION):
        if (setup->value > 1)
            return false;
        configure((uint8_t)setup->value);
        return done();
    case REQUEST(STANDARD_IN_INTERFACE, GET_INTERFACE):
        return control.configuration && setup->index == 0 && answer_bytes(setup, 0, 0, 1);
    case REQUEST(STANDARD_OUT_INTERFACE, SET_INTERFACE):
        return set_interface(setup);
    case REQUEST(VENDOR_IN_DEVICE, USB_MICROSOFT_REQUEST):
        return get_microsoft(setup);
    default:
        return false;
    }
}

void usb_control_setup(const uint8_t bytes[8])
{
    const struct usb_setup setup = {.type = bytes[0],
                                    .request = bytes[1],
                                    .value = (uint16_t)(bytes[2] | bytes[3] << 8),
                                    .index = (uint16_t)(bytes[4] | bytes[5] << 8),
                                    .length = (uint16_t)(bytes[6] | bytes[7] << 8)};

    usb_ep0_abort();
    control.sending = control.end_with_empty = false;
    if (!execute(&setup))
        usb_ep0_stall();
}
