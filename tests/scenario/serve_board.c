/* serve_board IMAGE PROFILE SPEED: the flashed bytes on the emulated board in a small simulated rig, their serial line
 * behind a pseudo-terminal whose name is printed on the first line; at most SPEED times as fast as the clock. Writes
 * the rig's profile to PROFILE first. Ends with its standard input. */
#define _GNU_SOURCE
#include "sim/board/f405_machine.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define SLICE 0.02 /* s of the board's time between two looks at the line */

static double now(void)
{
    struct timespec at;

    clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + (double)at.tv_nsec * 1e-9;
}

static int open_terminal(int *keep)
{
    struct termios raw;
    int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);

    if (master < 0 || grantpt(master) || unlockpt(master))
        return -1;
    *keep = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (*keep < 0 || tcgetattr(*keep, &raw))
        return -1;
    cfmakeraw(&raw);
    return tcsetattr(*keep, TCSANOW, &raw) ? -1 : master;
}

/* Few microsteps and near its index mark: little to emulate. */
static struct f405_machine *make_board(const char *image, const char *profile)
{
    struct sim_mechanics_options options;
    struct lumi_error error = {0};
    struct lumi_rig rig;
    static char text[LUMI_RIG_TEXT_MAX];
    FILE *file = fopen(profile, "w");

    if (!file || lumi_rig_builtin("arc16", &rig, &error))
        return NULL;
    rig.microsteps = 4;
    rig.control.motion.home_speed = 0.5;
    lumi_rig_print(&rig, text, sizeof text);
    fputs(text, file);
    fclose(file);
    sim_mechanics_options_init(&options, &rig);
    options.start_turns = -0.03;
    struct f405_machine *machine = f405_machine_create(&rig, &options);
    if (!machine || f405_machine_flash(machine, image, &error)) {
        fprintf(stderr, "serve_board: %s\n", error.text);
        return NULL;
    }
    f405_machine_power(machine, true);
    return machine;
}

static void move_bytes(struct f405_machine *machine, int line)
{
    static uint8_t in[4096], out[65536];
    static size_t in_size, out_size;
    ssize_t count = read(line, in + in_size, sizeof in - in_size);

    if (count > 0)
        in_size += (size_t)count;
    size_t taken = f405_machine_serial_write(machine, in, in_size);
    in_size -= taken;
    memmove(in, in + taken, in_size);
    out_size += f405_machine_serial_read(machine, out + out_size, sizeof out - out_size);
    count = out_size ? write(line, out, out_size) : 0;
    if (count > 0) {
        out_size -= (size_t)count;
        memmove(out, out + count, out_size);
    }
}

int main(int argc, char **argv)
{
    int keep = -1, line = open_terminal(&keep);
    struct f405_machine *machine = argc == 4 && line >= 0 ? make_board(argv[1], argv[2]) : NULL;

    if (!machine) {
        fprintf(stderr, "usage: serve_board IMAGE PROFILE SPEED\n");
        return 2;
    }
    printf("serial:%s\n", ptsname(line));
    fflush(stdout);
    double speed = atof(argv[3]), due = now();
    for (;;) {
        struct pollfd fds[2] = {{.fd = line, .events = POLLIN}, {.fd = STDIN_FILENO, .events = POLLIN}};
        double wait = due - now();
        poll(fds, 2, wait > 0 ? (int)(wait * 1000) + 1 : 0);
        char byte;
        if (fds[1].revents && read(STDIN_FILENO, &byte, 1) <= 0)
            break;
        move_bytes(machine, line);
        if (now() < due)
            continue;
        f405_machine_run(machine, SLICE);
        const char *fault = f405_fault(f405_machine_chip(machine));
        if (fault) {
            fprintf(stderr, "serve_board: %s\n", fault);
            return 1;
        }
        due = (due + SLICE / speed > now() ? due : now()) + SLICE / speed;
    }
    f405_machine_destroy(machine);
    close(keep);
    close(line);
    return 0;
}
