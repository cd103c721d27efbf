/* A simulated rig behind a pseudo-terminal. The only file of sim/rig that knows the computer's clock. */
#include "sim/rig/serve.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define ANSWER_MS 1 /* the same where something has come that it may answer */
#define IDLE_MS 5   /* between two looks at the clock */
#define BEHIND 0.25 /* s: a computer that was busy for longer than that has stood still for the rig */
#define ROOM 65536  /* bytes for a host that does not read; beyond it they are lost, as on a wire */

struct server {
    struct sim_machine *machine;
    int master, slave;
    uint8_t waiting[ROOM];
    size_t waiting_size;
};

void sim_serve_options_init(struct sim_serve_options *options, const struct lumi_rig *rig)
{
    memset(options, 0, sizeof *options);
    sim_machine_options_init(&options->machine, rig);
    options->machine.link = BOARD_LINK_SERIAL;
    options->machine.link_rate = 11520;
    options->machine.link_delay = 1e-4;
    options->speed = 1;
    options->turn_fd = -1;
}

static double clock_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* The slave stays open here, so that hosts may come and go. */
static int open_terminal(struct server *server, char path[256], struct lumi_error *error)
{
    struct termios raw;
    const char *name;

    server->master = posix_openpt(O_RDWR | O_NOCTTY);
    if (server->master < 0 || grantpt(server->master) != 0 || unlockpt(server->master) != 0 ||
        !(name = ptsname(server->master)))
        return lumi_fail_errno(error, "/dev/ptmx", "opening a pseudo-terminal");
    snprintf(path, 256, "%s", name);
    server->slave = open(path, O_RDWR | O_NOCTTY);
    if (server->slave < 0 || tcgetattr(server->slave, &raw) != 0)
        return lumi_fail_errno(error, path, "opening");
    raw.c_iflag = 0;
    raw.c_oflag = 0;
    raw.c_lflag = 0;
    raw.c_cflag = CS8 | CREAD | CLOCAL;
    if (tcsetattr(server->slave, TCSANOW, &raw) != 0 || fcntl(server->master, F_SETFL, O_NONBLOCK) != 0)
        return lumi_fail_errno(error, path, "setting up");
    return LUMI_OK;
}

static bool leads_to(const char *link, const char *path)
{
    char target[256];
    ssize_t size = readlink(link, target, sizeof target);

    return size >= 0 && (size_t)size == strlen(path) && memcmp(target, path, (size_t)size) == 0;
}

/* One that was left behind (it leads nowhere, or to the number that this terminal has now) is taken over. */
static int make_link(const char *link, const char *path, struct lumi_error *error)
{
    struct stat there;

    if (lstat(link, &there) == 0) {
        if (!S_ISLNK(there.st_mode))
            return lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there, and no symbolic link", link);
        if (!leads_to(link, path) && stat(link, &there) == 0)
            return lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there, and what it leads to is another's", link);
        unlink(link);
    }
    if (symlink(path, link) != 0)
        return lumi_fail_errno(error, link, "linking");
    return LUMI_OK;
}

static void send_bytes(struct server *server)
{
    ssize_t gone;

    server->waiting_size += sim_machine_get(server->machine, server->waiting + server->waiting_size,
                                            sizeof server->waiting - server->waiting_size);
    gone = server->waiting_size > 0 ? write(server->master, server->waiting, server->waiting_size) : 0;
    if (gone > 0) {
        server->waiting_size -= (size_t)gone;
        memmove(server->waiting, server->waiting + gone, server->waiting_size);
    }
    if (server->waiting_size == sizeof server->waiting)
        server->waiting_size = 0;
}

/* Virtual time follows the clock, and never stands before what has come or behind what goes: bytes are read, time is
 * brought up to now, and only then they are put in. The board would otherwise stamp them before they were sent. */
static void follow(struct server *server, const struct sim_serve_options *options)
{
    double before = clock_now(), began = sim_machine_seconds(server->machine);
    uint8_t bytes[1024];

    while (!(options->stop && *options->stop)) {
        struct pollfd wait[2] = {{.fd = server->master, .events = POLLIN}, {.fd = options->turn_fd, .events = POLLIN}};
        ssize_t got = read(server->master, bytes, sizeof bytes);
        double now = clock_now();
        sim_machine_run(server->machine, fmin(now - before, BEHIND) * options->speed);
        before = now;
        if (got > 0)
            sim_machine_put(server->machine, bytes, (size_t)got);
        send_bytes(server);
        if (options->turn)
            options->turn(options->context, server->machine);
        if (options->seconds > 0 && sim_machine_seconds(server->machine) - began >= options->seconds)
            return;
        poll(wait, 2, got > 0 ? ANSWER_MS : IDLE_MS);
    }
}

int sim_serve(const struct lumi_rig *rig, const struct sim_serve_options *options, struct lumi_error *error)
{
    struct sim_machine_options machine = options->machine;
    struct server *server = calloc(1, sizeof *server);
    char path[256] = "";
    bool linked = false;
    int code;

    if (!server)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a simulated rig");
    server->master = server->slave = -1;
    machine.host = true; /* until the profile is there */
    server->machine = sim_machine_create(rig, &machine);
    if (!server->machine) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a simulated rig");
        goto done;
    }
    if (!options->blank)
        LUMI_GOTO(code, done, sim_machine_configure(server->machine, rig, error));
    sim_machine_release_host(server->machine);
    LUMI_GOTO(code, done, open_terminal(server, path, error));
    if (options->link)
        LUMI_GOTO(code, done, make_link(options->link, path, error));
    linked = options->link != NULL;
    sim_machine_set_faults(server->machine, options->faults);
    if (options->ready)
        options->ready(options->context, path);
    follow(server, options);
    code = LUMI_OK;
done:
    if (linked && leads_to(options->link, path))
        unlink(options->link);
    if (server->slave >= 0)
        close(server->slave);
    if (server->master >= 0)
        close(server->master);
    sim_machine_destroy(server->machine);
    free(server);
    return code;
}
