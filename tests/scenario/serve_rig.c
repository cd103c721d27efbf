/* serve_rig RIG SPEED: a simulated rig in real time (or so many times faster) behind a pseudo-terminal, whose name it
 * prints on its first line. Lines on standard input do things to it: "estop 1", "estop 0", "cut 1" (the cable), "reset"
 * (the board's pin), "quit". Ends with its standard input. */
#define _GNU_SOURCE
#include "sim/rig/machine.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

struct server {
    struct sim_machine *machine;
    double speed, began;
    int master, keep;
    uint8_t out[65536];
    size_t out_size;
    char line[64];
    size_t line_size;
    bool quit;
};

static double now(void)
{
    struct timespec at;

    clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + (double)at.tv_nsec * 1e-9;
}

static int open_terminal(struct server *server)
{
    struct termios raw;

    server->master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (server->master < 0 || grantpt(server->master) || unlockpt(server->master))
        return -1;
    server->keep = open(ptsname(server->master), O_RDWR | O_NOCTTY);
    if (server->keep < 0 || tcgetattr(server->keep, &raw))
        return -1;
    cfmakeraw(&raw);
    return tcsetattr(server->keep, TCSANOW, &raw);
}

static void obey(struct server *server, const char *line)
{
    bool on = strchr(line, '1') != NULL;

    if (!strncmp(line, "estop", 5))
        sim_machine_estop(server->machine, on);
    else if (!strncmp(line, "cut", 3))
        sim_machine_link_cut(server->machine, on);
    else if (!strncmp(line, "reset", 5))
        sim_machine_reset(server->machine, BOARD_RESET_PIN);
    else if (!strncmp(line, "quit", 4))
        server->quit = true;
}

static void read_commands(struct server *server)
{
    char text[64];
    ssize_t count = read(STDIN_FILENO, text, sizeof text);

    if (count <= 0)
        server->quit = true;
    for (ssize_t i = 0; i < count; i++) {
        if (text[i] == '\n') {
            server->line[server->line_size] = '\0';
            obey(server, server->line);
            server->line_size = 0;
        } else if (server->line_size + 1 < sizeof server->line) {
            server->line[server->line_size++] = text[i];
        }
    }
}

static void move_bytes(struct server *server)
{
    uint8_t data[4096];
    ssize_t count = read(server->master, data, sizeof data);

    if (count > 0)
        sim_machine_put(server->machine, data, (size_t)count);
    server->out_size +=
        sim_machine_get(server->machine, server->out + server->out_size, sizeof server->out - server->out_size);
    count = server->out_size ? write(server->master, server->out, server->out_size) : 0;
    if (count > 0) {
        server->out_size -= (size_t)count;
        memmove(server->out, server->out + count, server->out_size);
    }
}

static void serve(struct server *server)
{
    server->began = now();
    while (!server->quit) {
        struct pollfd fds[2] = {{.fd = server->master, .events = POLLIN}, {.fd = STDIN_FILENO, .events = POLLIN}};
        poll(fds, 2, 1);
        if (fds[1].revents)
            read_commands(server);
        double ahead = (now() - server->began) * server->speed - sim_machine_seconds(server->machine);
        if (ahead > 0)
            sim_machine_run(server->machine, ahead);
        move_bytes(server);
    }
}

int main(int argc, char **argv)
{
    static struct server server;
    struct sim_machine_options options;
    struct lumi_error error = {0};
    struct lumi_rig rig;

    if (argc != 3 || lumi_rig_builtin(argv[1], &rig, &error)) {
        fprintf(stderr, "usage: serve_rig RIG SPEED %s\n", error.text);
        return 2;
    }
    server.speed = atof(argv[2]);
    sim_machine_options_init(&options, &rig);
    options.host = false;
    server.machine = sim_machine_create(&rig, &options);
    if (!server.machine || open_terminal(&server)) {
        fprintf(stderr, "serve_rig: no machine, or no terminal\n");
        return 1;
    }
    printf("%s\n", ptsname(server.master));
    fflush(stdout);
    serve(&server);
    sim_machine_destroy(server.machine);
    return 0;
}
