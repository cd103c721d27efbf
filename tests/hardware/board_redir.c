/* The emulated board at the end of a usbredir socket, for a virtual machine to drive: its time follows the wall clock.
 * usage: board_redir IMAGE SOCKET. SIGUSR1 unplugs the cable for a second; SIGTERM ends it, with figures. */
#include "sim/board/usb_redir.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define SLICE_MS 1
#define BEHIND_MOST 0.1 /* s: what is lost to a busy machine is not made up for */

static volatile sig_atomic_t unplug, finish;

static void on_signal(int number)
{
    if (number == SIGUSR1)
        unplug = 1;
    else
        finish = 1;
}

static double wall(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static int listen_on(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path)
        return -1;
    strcpy(address.sun_path, path);
    unlink(path);
    int server = socket(AF_UNIX, SOCK_STREAM, 0);
    if (server < 0 || bind(server, (struct sockaddr *)&address, sizeof address) || listen(server, 1))
        return -1;
    printf("board_redir: waiting on %s\n", path);
    fflush(stdout);
    return server;
}

static void tell(struct f405_machine *machine, const struct usb_redir *redir)
{
    const struct usb_redir_counters *c = usb_redir_counters(redir);
    const struct usb_counters *u = usb_host_counters(f405_machine_usb(machine));
    printf("board_redir: %llu connects, %llu resets, %llu control transfers, %llu bulk in (%llu bytes), %llu bulk out "
           "(%llu bytes), %llu stalls, %llu cancelled; %llu frames, %llu NAKs, %.1f s of virtual time\n",
           (unsigned long long)c->connects, (unsigned long long)c->resets, (unsigned long long)c->control,
           (unsigned long long)c->bulk_in, (unsigned long long)c->bytes_in, (unsigned long long)c->bulk_out,
           (unsigned long long)c->bytes_out, (unsigned long long)c->stalls, (unsigned long long)c->cancelled,
           (unsigned long long)u->frames, (unsigned long long)u->naks, (double)f405_machine_now(machine) / F405_HZ);
}

struct cable {
    int server, fd; /* −1: no machine is at the other end */
    struct usb_redir *redir;
    double back; /* when it is plugged in again; 0: it is */
};

/* A machine that has come, or has lost its power: the board has its own and goes on. */
static void look(struct f405_machine *machine, struct cable *cable)
{
    if (cable->redir && !usb_redir_poll(cable->redir)) {
        usb_host_plug(f405_machine_usb(machine), false);
        tell(machine, cable->redir);
        usb_redir_destroy(cable->redir);
        close(cable->fd);
        cable->redir = NULL;
        cable->fd = -1;
    }
    if (!cable->redir && (cable->fd = accept(cable->server, NULL, NULL)) >= 0) {
        fcntl(cable->fd, F_SETFL, O_NONBLOCK);
        cable->redir = usb_redir_create(machine, cable->fd);
        usb_host_plug(f405_machine_usb(machine), true);
    }
}

static void pull(struct f405_machine *machine, struct cable *cable, double now)
{
    if (unplug) {
        unplug = 0;
        usb_host_plug(f405_machine_usb(machine), false);
        cable->back = now + 1;
        printf("board_redir: unplugged\n");
        fflush(stdout);
    }
    if (cable->back > 0 && now > cable->back) {
        cable->back = 0;
        usb_host_plug(f405_machine_usb(machine), cable->redir != NULL);
    }
}

static void serve(struct f405_machine *machine, struct cable *cable)
{
    double begin = wall();
    uint64_t origin = f405_machine_now(machine);
    while (!finish && !f405_fault(f405_machine_chip(machine))) {
        look(machine, cable);
        double now = wall(), at = (double)(f405_machine_now(machine) - origin) / F405_HZ;
        pull(machine, cable, now);
        if (now - begin - at > BEHIND_MOST)
            begin = now - at - BEHIND_MOST;
        if (now - begin > at) {
            f405_machine_run(machine, now - begin - at > SLICE_MS * 1e-3 ? SLICE_MS * 1e-3 : now - begin - at);
            continue;
        }
        struct pollfd ready = {cable->redir ? cable->fd : cable->server, POLLIN, 0};
        if (cable->redir && usb_redir_wants_to_write(cable->redir))
            ready.events |= POLLOUT;
        poll(&ready, 1, SLICE_MS);
    }
}

int main(int count, char **argument)
{
    struct sigaction action = {.sa_handler = on_signal};
    struct sim_mechanics_options options;
    struct lumi_error error = {0};
    struct lumi_rig rig;
    if (count != 3) {
        fprintf(stderr, "usage: board_redir IMAGE SOCKET\n");
        return 2;
    }
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    if (lumi_rig_builtin("arc16", &rig, &error) != LUMI_OK)
        return 1;
    sim_mechanics_options_init(&options, &rig);
    struct f405_machine *machine = f405_machine_create(&rig, &options);
    if (!machine || f405_machine_flash(machine, argument[1], &error) != LUMI_OK) {
        fprintf(stderr, "board_redir: %s\n", machine ? error.text : "no machine");
        return 1;
    }
    struct cable cable = {.server = listen_on(argument[2]), .fd = -1};
    if (cable.server < 0 || fcntl(cable.server, F_SETFL, O_NONBLOCK)) {
        fprintf(stderr, "board_redir: %s: %s\n", argument[2], strerror(errno));
        return 1;
    }
    f405_machine_power(machine, true);
    serve(machine, &cable);
    if (cable.redir)
        tell(machine, cable.redir);
    const char *fault = f405_fault(f405_machine_chip(machine));
    if (fault)
        fprintf(stderr, "board_redir: %s\n", fault);
    usb_redir_destroy(cable.redir);
    f405_machine_destroy(machine);
    return fault != NULL;
}
