/* What the device says of itself. USB 2.0 section 9.6; BOS: USB 3.2 section 9.6.2; Microsoft OS 2.0 Descriptors
 * Specification (Microsoft, 2018): Windows takes its WinUSB driver without an installation. */
#include "firmware/stm32f405/port.h"
#include "firmware/stm32f405/usb_device.h"

#define U16(value) (uint8_t)((value)&0xff), (uint8_t)((value) >> 8)
#define LETTER(c) (uint8_t)(c), 0

enum { STRING_LANGUAGES = 0, STRING_MANUFACTURER, STRING_NAME, STRING_SERIAL, STRINGS };

static const uint8_t device[18] = {18,
                                   1,
                                   U16(0x0210), /* 2.1: it has a BOS */
                                   0,
                                   0,
                                   0, /* class: the interface's */
                                   USB_EP0_SIZE,
                                   U16(LUMI_WIRE_USB_VENDOR),
                                   U16(LUMI_WIRE_USB_PRODUCT),
                                   U16(0x0100),
                                   STRING_MANUFACTURER,
                                   STRING_NAME,
                                   STRING_SERIAL,
                                   1};

/* Powered by the bus as far as USB is concerned: 100 mA feed the board on a desk. No remote wake-up. */
static const uint8_t configuration[32] = {9,
                                          2,
                                          U16(32),
                                          1,
                                          1,
                                          0,
                                          0x80,
                                          50, /* configuration 1 */
                                          9,
                                          4,
                                          LUMI_WIRE_USB_INTERFACE,
                                          0,
                                          2,
                                          LUMI_WIRE_USB_CLASS,
                                          LUMI_WIRE_USB_SUBCLASS,
                                          LUMI_WIRE_USB_PROTOCOL,
                                          0,
                                          7,
                                          5,
                                          LUMI_WIRE_USB_OUT,
                                          2,
                                          U16(LUMI_WIRE_USB_PACKET),
                                          0, /* bulk */
                                          7,
                                          5,
                                          LUMI_WIRE_USB_IN,
                                          2,
                                          U16(LUMI_WIRE_USB_PACKET),
                                          0};

#define MICROSOFT_SIZE 162

static const uint8_t bos[33] = {
    5, 0x0f, U16(33), 1,
    /* platform capability {D8DD60DF-4589-4CC7-9CD2-659D9E648A9F}: MS OS 2.0, for Windows 8.1 (0x06030000) and later */
    28, 0x10, 5, 0, 0xdf, 0x60, 0xdd, 0xd8, 0x89, 0x45, 0xc7, 0x4c, 0x9c, 0xd2, 0x65, 0x9d, 0x9e, 0x64, 0x8a, 0x9f, 0,
    0, 3, 6, U16(MICROSOFT_SIZE), USB_MICROSOFT_REQUEST, 0};

static const uint8_t microsoft[MICROSOFT_SIZE] = {
    /* set header */
    U16(10), U16(0), 0, 0, 3, 6, U16(MICROSOFT_SIZE),
    /* feature: compatible ID */
    U16(20), U16(3), 'W', 'I', 'N', 'U', 'S', 'B', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    /* feature: registry property DeviceInterfaceGUIDs, a REG_MULTI_SZ of one */
    U16(132), U16(4), U16(7), U16(42), LETTER('D'), LETTER('e'), LETTER('v'), LETTER('i'), LETTER('c'), LETTER('e'),
    LETTER('I'), LETTER('n'), LETTER('t'), LETTER('e'), LETTER('r'), LETTER('f'), LETTER('a'), LETTER('c'), LETTER('e'),
    LETTER('G'), LETTER('U'), LETTER('I'), LETTER('D'), LETTER('s'), LETTER(0), U16(80),
    /* {6C756D69-7269-4C46-8F18-726967303031} */
    LETTER('{'), LETTER('6'), LETTER('C'), LETTER('7'), LETTER('5'), LETTER('6'), LETTER('D'), LETTER('6'), LETTER('9'),
    LETTER('-'), LETTER('7'), LETTER('2'), LETTER('6'), LETTER('9'), LETTER('-'), LETTER('4'), LETTER('C'), LETTER('4'),
    LETTER('6'), LETTER('-'), LETTER('8'), LETTER('F'), LETTER('1'), LETTER('8'), LETTER('-'), LETTER('7'), LETTER('2'),
    LETTER('6'), LETTER('9'), LETTER('6'), LETTER('7'), LETTER('3'), LETTER('0'), LETTER('3'), LETTER('0'), LETTER('3'),
    LETTER('1'), LETTER('}'), LETTER(0), LETTER(0)};

static size_t put_text(uint8_t text[USB_STRING_MAX], const char *from)
{
    size_t size = 2;

    for (; *from && size + 2 <= USB_STRING_MAX; from++) {
        text[size++] = (uint8_t)*from;
        text[size++] = 0;
    }
    return size;
}

/* The chip's unique ID in lower-case hex. */
static size_t put_serial(uint8_t text[USB_STRING_MAX])
{
    static const char digits[] = "0123456789abcdef";
    uint8_t id[BOARD_UNIQUE_ID];
    char hex[2 * BOARD_UNIQUE_ID + 1];

    system_unique_id(id);
    for (int i = 0; i < BOARD_UNIQUE_ID; i++) {
        hex[2 * i] = digits[id[i] >> 4];
        hex[2 * i + 1] = digits[id[i] & 15];
    }
    hex[2 * BOARD_UNIQUE_ID] = 0;
    return put_text(text, hex);
}

static const uint8_t *string(unsigned index, uint8_t text[USB_STRING_MAX], size_t *size)
{
    switch (index) {
    case STRING_LANGUAGES:
        text[2] = 0x09; /* English (United States) */
        text[3] = 0x04;
        *size = 4;
        break;
    case STRING_MANUFACTURER:
        *size = put_text(text, LUMI_WIRE_USB_MANUFACTURER);
        break;
    case STRING_NAME:
        *size = put_text(text, LUMI_WIRE_USB_NAME);
        break;
    case STRING_SERIAL:
        *size = put_serial(text);
        break;
    default:
        return NULL;
    }
    text[0] = (uint8_t)*size;
    text[1] = 3;
    return text;
}

const uint8_t *usb_descriptor(uint16_t value, uint8_t text[USB_STRING_MAX], size_t *size)
{
    const unsigned index = value & 0xff;

    if (value >> 8 == 3)
        return string(index, text, size);
    if (index != 0)
        return NULL;
    switch (value >> 8) {
    case 1:
        *size = sizeof device;
        return device;
    case 2:
        *size = sizeof configuration;
        return configuration;
    case 15:
        *size = sizeof bos;
        return bos;
    default:
        return NULL; /* among them the device qualifier: this device knows full speed only */
    }
}

const uint8_t *usb_microsoft_set(size_t *size)
{
    *size = sizeof microsoft;
    return microsoft;
}
