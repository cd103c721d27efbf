/* Says Hello over a serial line that is a unix socket and asks for the status: qemu_hello SOCKET. */
#include "proto/wire/client.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define PATIENCE 60 /* s */

static int fd;
static bool replied;
static lumi_wire_Reply answer;

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static bool send_frame(void *context, const uint8_t *frame, size_t size)
{
    (void)context;
    return write(fd, frame, size) == (ssize_t)size;
}
static void welcome(void *context, const lumi_wire_Welcome *message, bool restarted)
{
    (void)context;
    (void)restarted;
    printf("qemu_hello: welcome from %s, firmware %s\n", message->board, message->firmware);
}
static void reply(void *context, const lumi_wire_Reply *message)
{
    (void)context;
    answer = *message;
    replied = true;
}
static void request_lost(void *context, uint32_t number)
{
    (void)context;
    (void)number;
}
static void event(void *context, const lumi_wire_Event *message)
{
    (void)context;
    printf("qemu_hello: event %u of kind %d at %.3f s\n", message->number, message->which_kind,
           (double)message->time_ns * 1e-9);
}
static void events_lost(void *context, uint32_t count)
{
    (void)context;
    (void)count;
}
static void pulse(void *context, const lumi_wire_Pulse *message, uint64_t received_ns)
{
    (void)context;
    (void)message;
    (void)received_ns;
}
static const struct lumi_wire_client_ops ops = {send_frame, welcome, reply, request_lost, event, events_lost, pulse};

static int connect_to(const char *path, uint64_t end)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path)
        return -1;
    strcpy(address.sun_path, path);
    while (now_ns() < end) {
        fd = socket(AF_UNIX, SOCK_STREAM, 0);
        if (fd >= 0 && connect(fd, (struct sockaddr *)&address, sizeof address) == 0)
            return 0;
        close(fd);
        poll(NULL, 0, 50);
    }
    return -1;
}

int main(int count, char **argument)
{
    static struct lumi_wire_client client;
    uint64_t end = now_ns() + PATIENCE * 1000000000ull;
    int asked = 0;
    if (count != 2 || connect_to(argument[1], end)) {
        fprintf(stderr, "qemu_hello: no socket\n");
        return 1;
    }
    lumi_wire_client_init(&client, &ops, NULL, 7);
    for (int done = 0; done < 20 && now_ns() < end;) {
        uint8_t data[256];
        struct pollfd ready = {fd, POLLIN, 0};
        if (client.state == LUMI_WIRE_CLIENT_OPEN && asked == done) {
            lumi_wire_Request request = {.which_command = lumi_wire_Request_get_status_tag};
            replied = false;
            asked += lumi_wire_client_request(&client, &request, now_ns(), NULL) == LUMI_OK;
        }
        lumi_wire_client_poll(&client, now_ns());
        if (poll(&ready, 1, 10) > 0) {
            ssize_t n = read(fd, data, sizeof data);
            if (n <= 0)
                break;
            lumi_wire_client_receive(&client, data, (size_t)n, now_ns());
        }
        if (replied) {
            replied = false;
            done++;
        }
        if (done == 20) {
            printf("qemu_hello: 20 replies, state %d, %u sent again\n", (int)answer.payload.status.state,
                   client.retries);
            return answer.payload.status.state != lumi_wire_State_NO_PROFILE;
        }
    }
    printf("qemu_hello: no answer\n");
    return 1;
}
