/* The cameras' sockets, and the thread that answers on them. */
#include "sim/gige/gige_priv.h"

#include "proto/base/memory.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define TURN_MS 100 /* between two looks at heartbeats, where nothing comes */

/* ---- sockets ---- */

static int open_socket(in_addr_t address, uint16_t port, bool shared)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = address};
    const int on = 1;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

    if (fd < 0)
        return -1;
    if ((shared && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) ||
        bind(fd, (struct sockaddr *)&to, sizeof to) != 0) {
        const int problem = errno;
        close(fd);
        errno = problem;
        return -1;
    }
    return fd;
}

/* A broadcast on the loopback network goes to 127.255.255.255, and there to all who share it. */
int gige_sockets_open(struct gige_camera *camera, struct lumi_error *error)
{
    const in_addr_t address = htonl(gige_get(&camera->control.registers, GIGE_DEVICE_ADDRESS));

    camera->gvcp = open_socket(address, GIGE_PORT, false);
    if (camera->gvcp < 0)
        return lumi_fail(error, errno == EADDRINUSE ? LUMI_ERR_BUSY : LUMI_ERR_IO, "camera %s: %s cannot be had: %s",
                         camera->options.serial, camera->options.address, strerror(errno));
    camera->broadcast = open_socket(htonl(ntohl(address) | 0xffffff), GIGE_PORT, true);
    camera->gvsp = open_socket(address, 0, false);
    if (camera->gvsp < 0)
        return lumi_fail_errno(error, camera->options.address, "opening a socket");
    fcntl(camera->gvsp, F_SETFL, 0); /* a frame waits where the network is full */
    return LUMI_OK;
}

void gige_sockets_close(struct gige_camera *camera)
{
    const int fds[] = {camera->gvcp, camera->broadcast, camera->gvsp};

    for (int i = 0; i < 3; i++)
        if (fds[i] >= 0)
            close(fds[i]);
}

/* ---- what a request makes a camera do ---- */

static const struct gige_block *find_block(const struct gige_camera *camera, uint16_t id)
{
    for (int i = 0; i < GIGE_HISTORY; i++)
        if (camera->history[i].data && camera->history[i].id == id)
            return &camera->history[i];
    return NULL;
}

static void send_again(struct gige_camera *camera)
{
    const struct gige_control *c = &camera->control;
    const struct gige_block *block = find_block(camera, c->resend_block);
    uint8_t packet[GIGE_STREAM_PACKET];
    struct sockaddr_in to;

    if (!gige_destination(camera, &to))
        return;
    for (uint32_t i = c->resend_first; i <= c->resend_last && i - c->resend_first < 4096; i++) {
        const size_t size =
            block ? gige_stream_packet(block, i, packet) : gige_stream_refusal(c->resend_block, i, packet);

        (void)!sendto(camera->gvsp, packet, size, MSG_DONTWAIT, (struct sockaddr *)&to, sizeof to);
        camera->status.resent += block != NULL;
    }
}

static void send_test(struct gige_camera *camera)
{
    const size_t size = gige_get(&camera->control.registers, GIGE_PACKET_SIZE) & 0xffff;
    static const uint8_t zero[GIGE_STREAM_PACKET];
    struct sockaddr_in to;

    if (gige_destination(camera, &to) && size > 28 && size - 28 <= sizeof zero)
        (void)!sendto(camera->gvsp, zero, size - 28, MSG_DONTWAIT, (struct sockaddr *)&to, sizeof to);
}

/* With the lock. What has to be told to the source once it is let go: bits of GIGE_DO_TRIGGER, GIGE_DO_EXPOSURE. */
static unsigned act(struct sim_gige *gige, struct gige_camera *camera)
{
    struct gige_control *c = &camera->control;
    const struct gige_registers *r = &c->registers;
    const bool on = gige_get(r, GIGE_ACQUISITION) && gige_get(r, GIGE_TRIGGER_MODE);
    const unsigned source = gige_get(r, GIGE_TRIGGER_SOURCE);
    unsigned tell = c->actions & GIGE_DO_EXPOSURE;

    if (c->actions & (GIGE_DO_START | GIGE_DO_STOP)) {
        gige_forget(camera);
        camera->next_free_ns = 0;
    }
    if (c->actions & GIGE_DO_START)
        camera->block = 0;
    if ((c->actions & GIGE_DO_TRIGGER && on && source == GIGE_SOURCE_SOFTWARE) ||
        (c->actions & GIGE_DO_ACTION && on && source == GIGE_SOURCE_ACTION1))
        tell |= GIGE_DO_TRIGGER;
    if (c->actions & GIGE_DO_TEST_PACKET)
        send_test(camera);
    if (c->actions & GIGE_DO_RESEND)
        send_again(camera);
    if (c->actions & GIGE_DO_LATCH) {
        const uint64_t ticks = gige_ticks(camera, gige->source.now_ns(gige->source.context));

        gige_set(&c->registers, GIGE_TIMESTAMP, (uint32_t)(ticks >> 32));
        gige_set(&c->registers, GIGE_TIMESTAMP + 4, (uint32_t)ticks);
    }
    return tell;
}

static void tell_source(struct sim_gige *gige, int index, unsigned what, double exposure)
{
    if (what & GIGE_DO_EXPOSURE && gige->source.exposure_time)
        gige->source.exposure_time(gige->source.context, index, exposure);
    if (what & GIGE_DO_TRIGGER)
        gige->source.fire(gige->source.context, index);
}

/* ---- the thread ---- */

static void answer(struct sim_gige *gige, int index, int fd)
{
    struct gige_camera *camera = gige->cameras[index];
    uint8_t request[1024], reply[GIGE_PACKET_MAX];
    struct sockaddr_in from;
    socklen_t length = sizeof from;
    ssize_t size;

    while ((size = recvfrom(fd, request, sizeof request, 0, (struct sockaddr *)&from, &length)) >= 0) {
        const struct gige_peer peer = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
        size_t made = 0;
        unsigned tell = 0;
        double exposure = 0;

        pthread_mutex_lock(&gige->lock);
        if (!camera->unplugged) {
            made = gige_control_answer(&camera->control, &peer, gige_clock_ns(), request, (size_t)size, reply);
            tell = act(gige, camera);
            exposure = gige_get_real(&camera->control.registers, GIGE_EXPOSURE_TIME) * 1e-6;
        }
        pthread_mutex_unlock(&gige->lock);
        if (made > 0) /* always from the camera's own address */
            (void)!sendto(camera->gvcp, reply, made, 0, (struct sockaddr *)&from, sizeof from);
        tell_source(gige, index, tell, exposure);
        length = sizeof from;
    }
}

/* Cameras that run by themselves, and programs that have gone silent. Returns ms until it has to look again. */
static int look_around(struct sim_gige *gige)
{
    const uint64_t now = gige_clock_ns();
    bool fire[GIGE_CAMERAS] = {false};
    int wait = TURN_MS;

    pthread_mutex_lock(&gige->lock);
    for (int i = 0; i < gige->count; i++) {
        struct gige_camera *camera = gige->cameras[i];
        const struct gige_registers *r = &camera->control.registers;
        const double rate = gige_get_real(r, GIGE_FRAME_RATE);

        if (gige_control_expire(&camera->control, now))
            gige_forget(camera);
        if (!gige_get(r, GIGE_ACQUISITION) || gige_get(r, GIGE_TRIGGER_MODE) || !(rate >= 0.1 && rate <= 1000))
            continue;
        if (now >= camera->next_free_ns) {
            fire[i] = camera->count < 4; /* one that cannot be drawn fast enough leaves frames out */
            camera->next_free_ns = now + (uint64_t)(1e9 / rate);
        }
        const int left = (int)((camera->next_free_ns - now) / 1000000) + 1;
        wait = left < wait ? left : wait;
    }
    pthread_mutex_unlock(&gige->lock);
    for (int i = 0; i < gige->count; i++)
        if (fire[i])
            gige->source.fire(gige->source.context, i);
    return wait;
}

void *gige_network(void *context)
{
    struct sim_gige *gige = context;
    struct pollfd fds[1 + 2 * GIGE_CAMERAS] = {{.fd = gige->wake[0], .events = POLLIN}};
    bool stop = false;

    for (int i = 0; i < gige->count; i++) {
        fds[1 + 2 * i] = (struct pollfd){.fd = gige->cameras[i]->gvcp, .events = POLLIN};
        fds[2 + 2 * i] = (struct pollfd){.fd = gige->cameras[i]->broadcast, .events = POLLIN};
    }
    while (!stop) {
        poll(fds, (nfds_t)(1 + 2 * gige->count), look_around(gige));
        for (int i = 0; i < 2 * gige->count; i++)
            if (fds[1 + i].revents & POLLIN)
                answer(gige, i / 2, fds[1 + i].fd);
        pthread_mutex_lock(&gige->lock);
        stop = gige->stop;
        pthread_mutex_unlock(&gige->lock);
    }
    return NULL;
}
