/* A USB camera that is none: a UVC device (USB Video Class 1.0: MJPEG and YUY2 over a bulk endpoint, exposure, gain,
 * white balance) for a virtual machine to drive, by the usbredir protocol. Its pictures are numbered. usage: uvc_device
 * SOCKET SERIAL FPS. SIGUSR1 unplugs it for a second; SIGUSR2 breaks the next picture off in the middle, marked as
 * wrong; SIGTERM ends it, with figures. */
#include "tests/hardware/numbered_picture.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <jpeglib.h>
#include <usbredirparser.h>

#define CLOCK 48000000
#define PAYLOAD 16384u
#define URBS_MAX 64
#define LE16(x) (x) & 255, (x) >> 8 & 255
#define LE32(x) LE16(x), (x) >> 16 & 255, (x) >> 24 & 255
#define INTERVAL 333333 /* 100 ns */
#define FRAME_MAX(w, h) ((w) * (h)*2)
#define FRAME(subtype, index, w, h)                                                                                    \
    30, 0x24, subtype, index, 0, LE16(w), LE16(h), LE32(FRAME_MAX(w, h) * 8 * 5), LE32(FRAME_MAX(w, h) * 8 * 30),      \
        LE32(FRAME_MAX(w, h)), LE32(INTERVAL), 1, LE32(INTERVAL)

/* USB 2.0, 9.6; Universal Serial Bus Device Class Definition for Video Devices 1.0, 3.7 and 3.9; its Payload documents
 * "Motion-JPEG" 3.1 and "Uncompressed" 3.1. */
static const uint8_t device[18] = {18, 1, LE16(0x200), 0xef, 2, 1, 64, LE16(0x1209), LE16(2), LE16(0x100), 1, 2, 3, 1};
#define CONTROL_LENGTH (13 + 18 + 11 + 9)
#define STREAM_LENGTH (15 + 11 + 30 + 30 + 27 + 30)
static const uint8_t configuration[] = {
    /* configuration, the two interfaces belong together */
    9, 2, LE16(9 + 8 + 9 + CONTROL_LENGTH + 9 + STREAM_LENGTH + 7), 2, 1, 0, 0x80, 50, 8, 0x0b, 0, 2, 0x0e, 3, 0, 2,
    /* interface 0: control; camera 1 (exposure mode, priority, time) → processing 2 → output 3 */
    9, 4, 0, 0, 0, 0x0e, 1, 0, 2, 13, 0x24, 1, LE16(0x100), LE16(CONTROL_LENGTH), LE32(CLOCK), 1, 1, 18, 0x24, 2, 1,
    LE16(0x201), 0, 0, LE16(0), LE16(0), LE16(0), 3, 0x0e, 0, 0, 11, 0x24, 5, 2, 1, LE16(0), 2, LE16(0x1241), 0, 9,
    0x24, 3, 3, LE16(0x101), 0, 2, 0,
    /* interface 1: streaming */
    9, 4, 1, 0, 1, 0x0e, 2, 0, 0, 15, 0x24, 1, 2, LE16(STREAM_LENGTH), 0x81, 0, 3, 0, 0, 0, 1, 0, 0,
    /* format 1: MJPEG, format 2: YUY2 */
    11, 0x24, 6, 1, 2, 0, 1, 0, 0, 0, 0, FRAME(7, 1, 640, 480), FRAME(7, 2, 320, 240), 27, 0x24, 4, 2, 1, 'Y', 'U', 'Y',
    '2', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 16, 1, 0, 0, 0, 0, FRAME(5, 1, 320, 240),
    /* bulk in */
    7, 5, 0x81, 2, LE16(512), 0};

/* Controls by entity and selector (UVC 1.0, A.9). */
static struct control {
    int entity, selector, size;
    int32_t min, max, step, preset, value;
} controls[] = {{1, 2, 1, 1, 8, 9, 8, 8},    {1, 3, 1, 0, 1, 1, 0, 0},      {1, 4, 4, 1, 5000, 1, 156, 156},
                {2, 2, 2, -64, 64, 1, 0, 0}, {2, 4, 2, 16, 255, 1, 16, 16}, {2, 0xa, 2, 2800, 6500, 10, 4600, 4600},
                {2, 0xb, 1, 0, 1, 1, 1, 1}};
#define EXPOSURE (&controls[2])

struct urb {
    uint64_t id;
    struct usb_redir_bulk_packet_header header;
};
static struct {
    struct usbredirparser *parser;
    int fd;
    bool connected, broken;
    const char *serial;
    uint8_t probe[26];
    struct urb urbs[URBS_MAX];
    int urb_count;
    uint8_t *picture;
    size_t size, sent;
    bool sending;
    uint8_t toggle;
    unsigned number, connects, pictures;
} camera;
static volatile sig_atomic_t unplug, break_off, finish;

static void on_signal(int number)
{
    if (number == SIGUSR1)
        unplug = 1;
    else if (number == SIGUSR2)
        break_off = 1;
    else
        finish = 1;
}

static double wall(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* ---- pictures ---- */

static void picture_size(int *width, int *height)
{
    const bool small = camera.probe[2] == 2 || camera.probe[3] == 2;

    *width = small ? 320 : 640;
    *height = small ? 240 : 480;
}

static void make_jpeg(int width, int height)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned char *bytes = NULL;
    unsigned long size = 0;
    uint8_t row[3 * 640];
    JSAMPROW rows[1] = {row};

    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = (JDIMENSION)width;
    jpeg.image_height = (JDIMENSION)height;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 85, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++)
            memset(row + 3 * x, picture_grey(x, y, camera.number, (unsigned)EXPOSURE->value), 3);
        jpeg_write_scanlines(&jpeg, rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    camera.picture = bytes;
    camera.size = size;
}

static void make_yuyv(int width, int height)
{
    camera.size = (size_t)width * (size_t)height * 2;
    camera.picture = malloc(camera.size);
    for (int i = 0; camera.picture && i < width * height; i++) {
        camera.picture[2 * i] = picture_grey(i % width, i / width, camera.number, (unsigned)EXPOSURE->value);
        camera.picture[2 * i + 1] = 128;
    }
}

static void next_picture(void)
{
    int width, height;

    picture_size(&width, &height);
    free(camera.picture);
    camera.picture = NULL;
    camera.number++;
    camera.pictures++;
    if (camera.probe[2] == 2)
        make_yuyv(width, height);
    else
        make_jpeg(width, height);
    camera.broken = break_off;
    break_off = 0;
    if (camera.broken)
        camera.size /= 2;
    camera.toggle ^= 1;
    camera.sent = 0;
    camera.sending = camera.picture != NULL;
}

/* One payload to each transfer that waits: a header of two bytes (UVC 1.0, 2.4.3.3), then the picture's. */
static void send_payloads(void)
{
    static uint8_t payload[PAYLOAD];

    while (camera.sending && camera.urb_count > 0) {
        struct urb urb = camera.urbs[0];
        const size_t left = camera.size - camera.sent;
        const size_t part = left < PAYLOAD - 2 ? left : PAYLOAD - 2;
        const bool last = part == left;

        memmove(camera.urbs, camera.urbs + 1, (size_t)--camera.urb_count * sizeof camera.urbs[0]);
        payload[0] = 2;
        payload[1] = (uint8_t)(0x80 | camera.toggle | (last ? 2 : 0) | (camera.broken && last ? 0x40 : 0));
        memcpy(payload + 2, camera.picture + camera.sent, part);
        camera.sent += part;
        camera.sending = !last;
        urb.header.status = usb_redir_success;
        urb.header.length = (uint16_t)(part + 2);
        urb.header.length_high = (uint16_t)((part + 2) >> 16);
        usbredirparser_send_bulk_packet(camera.parser, urb.id, &urb.header, payload, (int)part + 2);
    }
}

/* ---- requests ---- */

static int answer_string(int index, uint8_t *answer)
{
    const char *const strings[] = {NULL, "Lumisphere", "numbered pictures", camera.serial};
    int length = 2;

    if (index == 0) {
        memcpy(answer, "\4\3\x09\4", 4);
        return 4;
    }
    if (index > 3)
        return -1;
    for (const char *c = strings[index]; *c; c++) {
        answer[length++] = (uint8_t)*c;
        answer[length++] = 0;
    }
    answer[0] = (uint8_t)length;
    answer[1] = 3;
    return length;
}

static int answer_standard(const struct usb_redir_control_packet_header *request, uint8_t *answer)
{
    if (request->requesttype == 0x80 && request->request == 6 && request->value >> 8 == 1) {
        memcpy(answer, device, sizeof device);
        return sizeof device;
    }
    if (request->requesttype == 0x80 && request->request == 6 && request->value >> 8 == 2) {
        memcpy(answer, configuration, sizeof configuration);
        return sizeof configuration;
    }
    if (request->requesttype == 0x80 && request->request == 6 && request->value >> 8 == 3)
        return answer_string(request->value & 255, answer);
    if (request->requesttype == 0x80 && request->request == 6)
        return -1;
    memset(answer, 0, 2);
    return request->requesttype & 0x80 ? 2 : 0;
}

/* Probe and commit (UVC 1.0, 4.3.1.1). */
static int answer_stream(const struct usb_redir_control_packet_header *request, const uint8_t *data, int size,
                         uint8_t *answer)
{
    const int selector = request->value >> 8;
    int width, height;

    if (selector != 1 && selector != 2)
        return -1;
    if (request->request == 0x85) {
        memcpy(answer, (uint8_t[2]){sizeof camera.probe, 0}, 2);
        return 2;
    }
    if (request->request == 0x86) {
        answer[0] = 3;
        return 1;
    }
    if (request->request == 1 && size >= 8) {
        camera.probe[2] = data[2] == 2 ? 2 : 1;
        camera.probe[3] = camera.probe[2] == 1 && data[3] == 2 ? 2 : 1;
        picture_size(&width, &height);
        memcpy(camera.probe + 4, (uint8_t[4]){LE32(INTERVAL)}, 4);
        memcpy(camera.probe + 18, (uint8_t[8]){LE32(FRAME_MAX(width, height)), LE32(PAYLOAD)}, 8);
        return 0;
    }
    memcpy(answer, camera.probe, sizeof camera.probe);
    return request->request & 0x80 ? (int)sizeof camera.probe : -1;
}

static int answer_control(const struct usb_redir_control_packet_header *request, const uint8_t *data, int size,
                          uint8_t *answer)
{
    struct control *found = NULL;
    int32_t value;

    for (size_t i = 0; i < sizeof controls / sizeof *controls; i++)
        if (controls[i].entity == request->index >> 8 && controls[i].selector == request->value >> 8)
            found = &controls[i];
    if (!found)
        return -1;
    if (request->request == 1 && size >= found->size) {
        found->value = 0;
        for (int i = found->size - 1; i >= 0; i--)
            found->value = found->value << 8 | data[i];
        return 0;
    }
    switch (request->request) {
    case 0x81:
        value = found->value;
        break;
    case 0x82:
        value = found->min;
        break;
    case 0x83:
        value = found->max;
        break;
    case 0x84:
        value = found->step;
        break;
    case 0x85:
        memcpy(answer, (uint8_t[2]){(uint8_t)found->size, 0}, 2);
        return 2;
    case 0x86:
        answer[0] = 3;
        return 1;
    case 0x87:
        value = found->preset;
        break;
    default:
        return -1;
    }
    for (int i = 0; i < found->size; i++)
        answer[i] = (uint8_t)((uint32_t)value >> (8 * i));
    return found->size;
}

static void on_control(void *context, uint64_t id, struct usb_redir_control_packet_header *request, uint8_t *data,
                       int size)
{
    struct usb_redir_control_packet_header reply = *request;
    static uint8_t answer[1024];
    int length;

    (void)context;
    length = (request->requesttype & 0x60) == 0 ? answer_standard(request, answer)
             : (request->index & 255) == 1      ? answer_stream(request, data, size, answer)
                                                : answer_control(request, data, size, answer);
    if (length > request->length)
        length = request->length;
    reply.status = length < 0 ? usb_redir_stall : usb_redir_success;
    reply.length = request->endpoint & 0x80 && length > 0 ? (uint16_t)length : length == 0 ? request->length : 0;
    if (request->endpoint & 0x80)
        usbredirparser_send_control_packet(camera.parser, id, &reply, length > 0 ? answer : NULL,
                                           length > 0 ? length : 0);
    else
        usbredirparser_send_control_packet(camera.parser, id, &reply, NULL, 0);
    usbredirparser_free_packet_data(camera.parser, data);
}

static void on_bulk(void *context, uint64_t id, struct usb_redir_bulk_packet_header *header, uint8_t *data, int size)
{
    (void)context;
    (void)size;
    usbredirparser_free_packet_data(camera.parser, data);
    if (camera.urb_count < URBS_MAX)
        camera.urbs[camera.urb_count++] = (struct urb){id, *header};
    send_payloads();
}

static void on_cancel(void *context, uint64_t id)
{
    (void)context;
    for (int i = 0; i < camera.urb_count; i++)
        if (camera.urbs[i].id == id) {
            struct urb urb = camera.urbs[i];

            memmove(camera.urbs + i, camera.urbs + i + 1, (size_t)(--camera.urb_count - i) * sizeof camera.urbs[0]);
            urb.header.status = usb_redir_cancelled;
            urb.header.length = urb.header.length_high = 0;
            usbredirparser_send_bulk_packet(camera.parser, id, &urb.header, NULL, 0);
            camera.sending = false; /* the stream ends: the next one begins with a whole picture */
            return;
        }
}

static void on_set_configuration(void *context, uint64_t id, struct usb_redir_set_configuration_header *header)
{
    struct usb_redir_configuration_status_header status = {.configuration = header->configuration};

    (void)context;
    usbredirparser_send_configuration_status(camera.parser, id, &status);
}

static void on_get_configuration(void *context, uint64_t id)
{
    struct usb_redir_configuration_status_header status = {.configuration = 1};

    (void)context;
    usbredirparser_send_configuration_status(camera.parser, id, &status);
}

static void on_set_alt(void *context, uint64_t id, struct usb_redir_set_alt_setting_header *header)
{
    struct usb_redir_alt_setting_status_header status = {.interface = header->interface, .alt = header->alt};

    (void)context;
    usbredirparser_send_alt_setting_status(camera.parser, id, &status);
}

static void on_get_alt(void *context, uint64_t id, struct usb_redir_get_alt_setting_header *header)
{
    struct usb_redir_alt_setting_status_header status = {.interface = header->interface};

    (void)context;
    usbredirparser_send_alt_setting_status(camera.parser, id, &status);
}

static void on_reset(void *context)
{
    (void)context;
}

static void on_hello(void *context, struct usb_redir_hello_header *hello)
{
    (void)context;
    (void)hello;
}

/* ---- the socket ---- */

static void on_log(void *context, int level, const char *text)
{
    (void)context;
    if (level <= usbredirparser_warning)
        fprintf(stderr, "uvc_device: %s\n", text);
}

static int on_read(void *context, uint8_t *bytes, int size)
{
    const ssize_t got = read(camera.fd, bytes, (size_t)size);

    (void)context;
    return got < 0 && errno == EAGAIN ? 0 : got <= 0 ? -1 : (int)got;
}

static int on_write(void *context, uint8_t *bytes, int size)
{
    const ssize_t put = write(camera.fd, bytes, (size_t)size);

    (void)context;
    return put < 0 ? errno == EAGAIN ? 0 : -1 : (int)put;
}

static bool plug_in(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    uint32_t can[USB_REDIR_CAPS_SIZE] = {0};
    struct usbredirparser *p;

    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    camera.fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (camera.fd < 0 || connect(camera.fd, (struct sockaddr *)&address, sizeof address) != 0) {
        if (camera.fd >= 0)
            close(camera.fd);
        camera.fd = -1;
        return false;
    }
    fcntl(camera.fd, F_SETFL, O_NONBLOCK);
    camera.parser = p = usbredirparser_create();
    p->log_func = on_log;
    p->read_func = on_read;
    p->write_func = on_write;
    p->hello_func = on_hello;
    p->reset_func = on_reset;
    p->set_configuration_func = on_set_configuration;
    p->get_configuration_func = on_get_configuration;
    p->set_alt_setting_func = on_set_alt;
    p->get_alt_setting_func = on_get_alt;
    p->cancel_data_packet_func = on_cancel;
    p->control_packet_func = on_control;
    p->bulk_packet_func = on_bulk;
    usbredirparser_caps_set_cap(can, usb_redir_cap_connect_device_version);
    usbredirparser_caps_set_cap(can, usb_redir_cap_ep_info_max_packet_size);
    usbredirparser_caps_set_cap(can, usb_redir_cap_64bits_ids);
    usbredirparser_caps_set_cap(can, usb_redir_cap_32bits_bulk_length);
    usbredirparser_init(p, "uvc_device", can, USB_REDIR_CAPS_SIZE, usbredirparser_fl_usb_host);
    camera.connected = camera.sending = false;
    camera.urb_count = 0;
    for (size_t i = 0; i < sizeof controls / sizeof *controls; i++)
        controls[i].value = controls[i].preset; /* it had no power */
    return true;
}

static void pull_out(void)
{
    if (camera.fd < 0)
        return;
    usbredirparser_destroy(camera.parser);
    close(camera.fd);
    camera.fd = -1;
}

static void tell_device(void)
{
    struct usb_redir_interface_info_header interfaces = {
        .interface_count = 2, .interface = {0, 1}, .interface_class = {0x0e, 0x0e}, .interface_subclass = {1, 2}};
    struct usb_redir_device_connect_header connect = {.speed = usb_redir_speed_high,
                                                      .device_class = 0xef,
                                                      .device_subclass = 2,
                                                      .device_protocol = 1,
                                                      .vendor_id = 0x1209,
                                                      .product_id = 2,
                                                      .device_version_bcd = 0x100};
    struct usb_redir_ep_info_header endpoints;

    memset(&endpoints, 0, sizeof endpoints);
    memset(endpoints.type, usb_redir_type_invalid, sizeof endpoints.type);
    endpoints.type[0] = endpoints.type[16] = usb_redir_type_control;
    endpoints.max_packet_size[0] = endpoints.max_packet_size[16] = 64;
    endpoints.type[17] = usb_redir_type_bulk; /* 0x81 */
    endpoints.max_packet_size[17] = 512;
    endpoints.interface[17] = 1;
    usbredirparser_send_interface_info(camera.parser, &interfaces);
    usbredirparser_send_ep_info(camera.parser, &endpoints);
    usbredirparser_send_device_connect(camera.parser, &connect);
    camera.connected = true;
    camera.connects++;
}

/* Until `until`, or until something came; false when the other end is gone. */
static bool talk(double until)
{
    const double left = until - wall();
    struct pollfd ready = {camera.fd, POLLIN, 0};

    if (usbredirparser_has_data_to_write(camera.parser))
        ready.events |= POLLOUT;
    if (poll(&ready, 1, left > 0 ? (int)(left * 1000) + 1 : 0) < 0 && errno != EINTR)
        return false;
    if (ready.revents & (POLLIN | POLLHUP) && usbredirparser_do_read(camera.parser) != 0)
        return false;
    if (!camera.connected && usbredirparser_peer_has_cap(camera.parser, usb_redir_cap_connect_device_version))
        tell_device();
    return !usbredirparser_has_data_to_write(camera.parser) || usbredirparser_do_write(camera.parser) == 0;
}

int main(int count, char **argument)
{
    struct sigaction action = {.sa_handler = on_signal};
    double due, back = 0, rate;

    if (count != 4 || (rate = atof(argument[3])) <= 0) {
        fprintf(stderr, "usage: uvc_device SOCKET SERIAL FPS\n");
        return 2;
    }
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGUSR2, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    camera.serial = argument[2];
    camera.fd = -1;
    memcpy(camera.probe + 2, (uint8_t[6]){1, 1, LE32(INTERVAL)}, 6);
    memcpy(camera.probe + 18, (uint8_t[8]){LE32(FRAME_MAX(640, 480)), LE32(PAYLOAD)}, 8);
    for (due = wall(); !finish;) {
        if (unplug) {
            unplug = 0;
            pull_out();
            back = wall() + 1;
            printf("uvc_device: unplugged after picture %u\n", camera.number);
            fflush(stdout);
        }
        if (camera.fd < 0 && (wall() < back || !plug_in(argument[1]))) {
            poll(NULL, 0, 50);
            continue;
        }
        if (!talk(due))
            pull_out();
        if (wall() >= due) {
            due = wall() + 1 / rate;
            if (camera.fd >= 0 && camera.urb_count > 0 && !camera.sending) {
                next_picture();
                send_payloads();
            }
        }
    }
    pull_out();
    printf("uvc_device: connected %u times, %u pictures\n", camera.connects, camera.pictures);
    free(camera.picture);
    return 0;
}
