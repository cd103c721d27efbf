/* Which GigE Vision and USB3 Vision cameras are there. GigE Vision ones are asked for here and not through Aravis,
 * whose list holds cameras by their serial number: of two that have the same it shows one. */
#define _DEFAULT_SOURCE /* IFF_UP */
#include "daemon/camera/camera_aravis_priv.h"

#include <arpa/inet.h>
#include <errno.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define GVCP_PORT 3956      /* GigE Vision 2.0, 14.2 */
#define DISCOVERY_ID 0x4c55 /* of our request; the answer has it too */
#define DISCOVERY_MS 500    /* until all have answered: a camera may take its time, 14.4 */
#define INTERFACES_MAX 64
#define FOUND_MAX 128

/* Aravis' list of USB cameras is one for the program; and what Aravis 0.8 keeps of the kinds of XML documents
 * (arvdomimplementation.c) it does not lock: where two read their cameras' descriptions at once, one has no features.
 */
static pthread_mutex_t open_lock = PTHREAD_MUTEX_INITIALIZER;

/* Text of a bootstrap register: ends with its first 0, or with the register; what is no plain text is left out. */
static void copy_text(char *to, size_t room, const uint8_t *from, size_t size)
{
    size_t length = 0;

    for (size_t i = 0; i < size && from[i] && length + 1 < room; i++)
        if (from[i] > ' ' || (from[i] == ' ' && length > 0))
            to[length++] = from[i] < 127 ? (char)from[i] : '?';
    while (length > 0 && to[length - 1] == ' ')
        length--;
    to[length] = '\0';
}

bool aravis_discovery_parse(const uint8_t *packet, size_t size, struct lumi_camera_identity *identity)
{
    const uint8_t *data = packet + 8;

    /* GVCP header (15.1): status, answer's code (DISCOVERY_ACK 0x0003), length, id. */
    if (size < 8 + ARAVIS_DISCOVERY_SIZE || packet[0] != 0 || packet[1] != 0 || packet[2] != 0 || packet[3] != 3)
        return false;
    if (packet[6] != DISCOVERY_ID >> 8 || packet[7] != (DISCOVERY_ID & 255))
        return false;
    memset(identity, 0, sizeof *identity);
    identity->backend = LUMI_CAMERA_ARAVIS;
    snprintf(identity->address, sizeof identity->address, "%u.%u.%u.%u", data[0x24], data[0x25], data[0x26],
             data[0x27]);
    copy_text(identity->vendor, sizeof identity->vendor, data + 0x48, 32);
    copy_text(identity->model, sizeof identity->model, data + 0x68, 32);
    copy_text(identity->firmware, sizeof identity->firmware, data + 0x88, 32);
    copy_text(identity->serial, sizeof identity->serial, data + 0xd8, 16);
    if (identity->serial[0] == '\0') /* the register may be missing: then its MAC address tells it apart */
        snprintf(identity->serial, sizeof identity->serial, "%02x%02x%02x%02x%02x%02x", data[0x0a], data[0x0b],
                 data[0x0c], data[0x0d], data[0x0e], data[0x0f]);
    return true;
}

static void ask(int fd, in_addr_t to)
{
    /* 15.1: key 0x42, answer wanted, DISCOVERY_CMD 0x0002, no data, id. */
    static const uint8_t packet[8] = {0x42, 0x01, 0, 2, 0, 0, DISCOVERY_ID >> 8, DISCOVERY_ID & 255};
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(GVCP_PORT), .sin_addr.s_addr = to};

    (void)!sendto(fd, packet, sizeof packet, 0, (struct sockaddr *)&address, sizeof address);
}

static int ask_through(const struct ifaddrs *interface)
{
    struct sockaddr_in own, net;
    const int on = 1;
    int fd;

    memcpy(&own, interface->ifa_addr, sizeof own);
    own.sin_port = 0;
    fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return -1;
    if (bind(fd, (struct sockaddr *)&own, sizeof own) != 0 ||
        setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on) != 0) {
        close(fd);
        return -1;
    }
    ask(fd, htonl(INADDR_BROADCAST));
    if (interface->ifa_netmask) { /* a machine without a default route does not send the one above */
        memcpy(&net, interface->ifa_netmask, sizeof net);
        ask(fd, own.sin_addr.s_addr | ~net.sin_addr.s_addr);
    }
    return fd;
}

static int ask_everywhere(struct pollfd *sockets)
{
    struct ifaddrs *interfaces;
    int count = 0;

    if (getifaddrs(&interfaces) != 0)
        return 0;
    for (const struct ifaddrs *i = interfaces; i && count < INTERFACES_MAX; i = i->ifa_next) {
        int fd;

        if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET || !(i->ifa_flags & IFF_UP))
            continue;
        fd = ask_through(i);
        if (fd >= 0)
            sockets[count++] = (struct pollfd){.fd = fd, .events = POLLIN};
    }
    freeifaddrs(interfaces);
    return count;
}

static bool known(const struct lumi_camera_identity *cameras, int count, const char *address)
{
    for (int i = 0; i < count; i++)
        if (strcmp(cameras[i].address, address) == 0)
            return true;
    return false;
}

static int gather(int fd, struct lumi_camera_identity *cameras, int count)
{
    struct lumi_camera_identity found;
    uint8_t packet[1024];
    ssize_t size;

    while ((size = recv(fd, packet, sizeof packet, 0)) >= 0)
        if (count < FOUND_MAX && aravis_discovery_parse(packet, (size_t)size, &found) &&
            !known(cameras, count, found.address))
            cameras[count++] = found;
    return count;
}

static int find_gige(struct lumi_camera_identity *cameras)
{
    const int64_t end = camera_now_ns() + DISCOVERY_MS * (int64_t)1000000;
    struct pollfd sockets[INTERFACES_MAX];
    int count = 0, open = ask_everywhere(sockets);

    for (int64_t now = camera_now_ns(); open > 0 && now < end; now = camera_now_ns()) {
        if (poll(sockets, (nfds_t)open, (int)((end - now) / 1000000) + 1) < 0 && errno != EINTR)
            break;
        for (int i = 0; i < open; i++)
            if (sockets[i].revents & POLLIN)
                count = gather(sockets[i].fd, cameras, count);
    }
    for (int i = 0; i < open; i++)
        close(sockets[i].fd);
    return count;
}

static int find_usb(struct lumi_camera_identity *cameras, int count)
{
    pthread_mutex_lock(&open_lock);
    ArvInterface *usb = arv_uv_interface_get_instance();
    arv_interface_update_device_list(usb);
    unsigned found = arv_interface_get_n_devices(usb);
    for (unsigned i = 0; i < found && count < FOUND_MAX; i++) {
        struct lumi_camera_identity *camera = &cameras[count++];

        memset(camera, 0, sizeof *camera);
        camera->backend = LUMI_CAMERA_ARAVIS;
        const char *serial = arv_interface_get_device_serial_nbr(usb, i);
        const char *vendor = arv_interface_get_device_vendor(usb, i), *model = arv_interface_get_device_model(usb, i);
        const char *id = arv_interface_get_device_id(usb, i);
        g_strlcpy(camera->serial, serial ? serial : "", sizeof camera->serial);
        g_strlcpy(camera->vendor, vendor ? vendor : "", sizeof camera->vendor);
        g_strlcpy(camera->model, model ? model : "", sizeof camera->model);
        g_strlcpy(camera->address, id ? id : "", sizeof camera->address);
    }
    pthread_mutex_unlock(&open_lock);
    return count;
}

/* (transfer full) */
static struct lumi_camera_identity *find_all(int *count)
{
    struct lumi_camera_identity *found = g_new0(struct lumi_camera_identity, FOUND_MAX);

    *count = find_usb(found, find_gige(found));
    return found;
}

int camera_aravis_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    int count;
    g_autofree struct lumi_camera_identity *found = find_all(&count);

    (void)error;
    for (int i = 0; i < count && i < max; i++)
        cameras[i] = found[i];
    return count;
}

/* An address of four numbers is asked directly: a camera behind a router answers no broadcast. */
static bool is_address(const char *what)
{
    struct in_addr address;

    return inet_pton(AF_INET, what, &address) == 1;
}

int aravis_find(const char *what, struct lumi_camera_identity *camera, struct lumi_error *error)
{
    int count, at;

    if (is_address(what)) {
        memset(camera, 0, sizeof *camera);
        camera->backend = LUMI_CAMERA_ARAVIS;
        g_strlcpy(camera->address, what, sizeof camera->address);
        return LUMI_OK;
    }
    g_autofree struct lumi_camera_identity *found = find_all(&count);
    at = camera_pick(found, count, what, error);
    if (at < 0)
        return at;
    *camera = found[at];
    return LUMI_OK;
}

ArvDevice *aravis_device_open(const struct lumi_camera_identity *found, GError **error)
{
    ArvDevice *device;

    pthread_mutex_lock(&open_lock);
    if (is_address(found->address))
        device = arv_interface_open_device(arv_gv_interface_get_instance(), found->address, error);
    else
        device = arv_interface_open_device(arv_uv_interface_get_instance(), found->address, error);
    pthread_mutex_unlock(&open_lock);
    return device;
}

ArvChunkParser *aravis_chunk_parser(ArvCamera *camera)
{
    pthread_mutex_lock(&open_lock);
    ArvChunkParser *parser = arv_camera_create_chunk_parser(camera);
    pthread_mutex_unlock(&open_lock);
    return parser;
}
