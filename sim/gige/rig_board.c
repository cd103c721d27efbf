/* The process with the board: virtual time, mechanics, and what the cameras are told of them. */
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "sim/gige/rig_parts.h"
#include "sim/rig/serve.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define CLOCK_NS UINT64_C(20000000)    /* the shared clock is told this often */
#define FIRED 8                        /* exposures by software that are under way, of a camera */
#define REST_TICKS (BOARD_TICK_HZ / 4) /* without a step: the motor is at rest */

/* One that no line has triggered. */
struct fired {
    uint64_t begin, end; /* ticks; end 0: none */
    double angle;
};
struct board_process {
    const struct rig_board *setup;
    int seen; /* exposures up to here are told, or lost */
    bool told[4096];
    uint64_t clock_told;
    double exposure[LUMI_RIG_CAMERAS]; /* s */
    bool unplugged[LUMI_RIG_CAMERAS];
    struct rig_message drive_told;
    struct fired fired[LUMI_RIG_CAMERAS][FIRED];
    int steps_told; /* up to here they are in steps.txt */
    FILE *steps;
    char faults[600];
    volatile sig_atomic_t stop;
};

static uint64_t to_ns(uint64_t ticks)
{
    return ticks / BOARD_TICK_HZ * 1000000000 + ticks % BOARD_TICK_HZ * 1000000000 / BOARD_TICK_HZ;
}

static void tell(struct board_process *b, int eyes, const struct rig_message *message)
{
    (void)!send(b->setup->eyes[eyes], message, sizeof *message, MSG_NOSIGNAL);
}

static void tell_exposed(struct board_process *b, struct sim_machine *machine, int camera,
                         struct sim_gige_exposure *exposure)
{
    const struct sim_camera_fault *fault = sim_mechanics_camera_faults(sim_machine_mechanics(machine), camera);
    struct rig_message message = {.kind = RIG_MESSAGE_EXPOSED, .camera = camera};

    exposure->fault = (struct sim_gige_fault){.dropped = fault->frames_dropped,
                                              .doubled = fault->frames_doubled,
                                              .late = fault->frames_late,
                                              .loss = fault->packets_lost};
    exposure->askew = fault->askew * LUMI_PI / 180;
    message.exposure = *exposure;
    message.now_ns = to_ns(sim_machine_now(machine));
    tell(b, b->setup->owner[camera], &message);
}

/* Exposures are recorded in the order of their triggers, and done in that of their ends. */
static void tell_exposures(struct board_process *b, struct sim_machine *machine)
{
    const int window = (int)(sizeof b->told / sizeof b->told[0]);
    const struct sim_exposure *all;
    int count;

    all = sim_mechanics_exposures(sim_machine_mechanics(machine), &count);
    for (int i = b->seen; i < count && i < b->seen + window; i++) {
        const struct sim_exposure *e = &all[i];

        if (e->done && !b->told[i % window]) {
            struct sim_gige_exposure exposure = {.line = true,
                                                 .begin_ns = to_ns(e->begin),
                                                 .end_ns = to_ns(e->end),
                                                 .angle = e->angle,
                                                 .drop = e->drop,
                                                 .moved = e->moved};
            b->told[i % window] = true;
            tell_exposed(b, machine, e->camera, &exposure);
        }
    }
    while (b->seen < count && (all[b->seen].lost || b->told[b->seen % window])) {
        b->told[b->seen % window] = false;
        b->seen++;
    }
}

static void tell_fired(struct board_process *b, struct sim_machine *machine)
{
    const struct sim_mechanics *m = sim_machine_mechanics(machine);
    const uint64_t now = sim_machine_now(machine);

    for (int camera = 0; camera < b->setup->rig->rig.camera_count; camera++)
        for (int i = 0; i < FIRED; i++) {
            struct fired *fired = &b->fired[camera][i];
            const double angle = sim_mechanics_angle(m);

            if (fired->end == 0 || fired->end > now)
                continue;
            struct sim_gige_exposure exposure = {.begin_ns = to_ns(fired->begin),
                                                 .end_ns = to_ns(fired->end),
                                                 .angle = (fired->angle + angle) / 2,
                                                 .drop = sim_mechanics_drop(m),
                                                 .moved = angle - fired->angle};
            fired->end = 0;
            tell_exposed(b, machine, camera, &exposure);
        }
}

static void tell_plugs(struct board_process *b, struct sim_machine *machine)
{
    for (int camera = 0; camera < b->setup->rig->rig.camera_count; camera++) {
        const bool unplugged = sim_mechanics_camera_faults(sim_machine_mechanics(machine), camera)->unplugged;

        if (unplugged == b->unplugged[camera])
            continue;
        b->unplugged[camera] = unplugged;
        tell(b, b->setup->owner[camera],
             &(struct rig_message){.kind = RIG_MESSAGE_PLUG, .camera = camera, .on = !unplugged});
    }
}

static void tell_clock(struct board_process *b, struct sim_machine *machine)
{
    const uint64_t now = to_ns(sim_machine_now(machine));

    if (now - b->clock_told < CLOCK_NS && b->clock_told > 0)
        return;
    b->clock_told = now;
    for (int i = 0; i < b->setup->eye_count; i++)
        tell(b, i, &(struct rig_message){.kind = RIG_MESSAGE_CLOCK, .now_ns = now});
}

/* The enable line, and what the fault script does to the drive. */
static void tell_drive(struct board_process *b, struct sim_machine *machine)
{
    const struct sim_mechanics *m = sim_machine_mechanics(machine);
    const struct sim_drive_fault *fault = sim_mechanics_drive_faults(m);
    const struct rig_message now = {
        .kind = RIG_MESSAGE_DRIVE, .on = sim_mechanics_enabled(m), .alarm = fault->alarm, .silent = fault->silent};
    const struct rig_message *told = &b->drive_told;

    if (b->setup->drive < 0 || (now.on == told->on && now.alarm == told->alarm && now.silent == told->silent))
        return;
    b->drive_told = now;
    (void)!send(b->setup->drive, &now, sizeof now, MSG_NOSIGNAL);
}

/* Each time the motor has come to rest: when its last step was, by the clock, and how many there were. So that an
 * emergency stop can be timed by what the motor did. */
static void tell_steps(struct board_process *b, struct sim_machine *machine)
{
    const uint64_t now = sim_machine_now(machine);
    struct timespec clock;
    const uint64_t *ticks;
    int count;

    ticks = sim_machine_step_ticks(machine, &count);
    if (count <= b->steps_told || now - ticks[count - 1] < REST_TICKS)
        return;
    clock_gettime(CLOCK_REALTIME, &clock);
    const double since = (double)(now - ticks[count - 1]) / BOARD_TICK_HZ / b->setup->rig->speed;
    fprintf(b->steps, "%.4f %d\n", (double)clock.tv_sec + clock.tv_nsec * 1e-9 - since, count);
    fflush(b->steps);
    b->steps_told = count;
}

/* A script that somebody has put into the folder since is taken, and its file removed. */
static void take_faults(struct board_process *b, struct sim_machine *machine)
{
    static struct sim_fault_script script;
    struct lumi_error error;
    uint8_t *text;
    size_t size;

    if (access(b->faults, R_OK) != 0 || lumi_file_read(b->faults, 1 << 20, &text, &size, &error) != LUMI_OK)
        return;
    if (sim_fault_script_parse((const char *)text, size, b->faults, &script, &error) == LUMI_OK)
        sim_machine_set_faults(machine, &script);
    else
        fprintf(stderr, "lumi sim rig: %s\n", error.text);
    lumi_free(text);
    unlink(b->faults);
}

static void hear_drive(struct board_process *b, struct sim_machine *machine)
{
    struct rig_message message;

    while (b->setup->drive >= 0 &&
           recv(b->setup->drive, &message, sizeof message, MSG_DONTWAIT) == (ssize_t)sizeof message)
        if (message.kind == RIG_MESSAGE_TURNED)
            sim_mechanics_drive_to(sim_machine_mechanics(machine), message.turns, message.on);
}

static void hear(struct board_process *b, struct sim_machine *machine, const struct rig_message *message)
{
    const uint64_t now = sim_machine_now(machine);
    const int camera = message->camera;

    if (camera < 0 || camera >= b->setup->rig->rig.camera_count)
        return;
    if (message->kind == RIG_MESSAGE_EXPOSURE) {
        b->exposure[camera] = message->seconds;
        sim_mechanics_set_camera_exposure(sim_machine_mechanics(machine), camera, message->seconds);
        return;
    }
    for (int i = 0; message->kind == RIG_MESSAGE_FIRE && i < FIRED; i++) {
        struct fired *fired = &b->fired[camera][i];

        if (fired->end != 0)
            continue;
        const double seconds = b->exposure[camera] > 0 ? b->exposure[camera] : 0.004;
        *fired = (struct fired){now, now + (uint64_t)(seconds * BOARD_TICK_HZ) + 1,
                                sim_mechanics_angle(sim_machine_mechanics(machine))};
        return;
    }
}

static void turn(void *context, struct sim_machine *machine)
{
    struct board_process *b = context;
    struct rig_message message;
    char byte;

    for (int i = 0; i < b->setup->eye_count; i++)
        while (recv(b->setup->eyes[i], &message, sizeof message, MSG_DONTWAIT) == (ssize_t)sizeof message)
            hear(b, machine, &message);
    hear_drive(b, machine);
    take_faults(b, machine);
    tell_drive(b, machine);
    tell_steps(b, machine);
    tell_clock(b, machine);
    tell_plugs(b, machine);
    tell_exposures(b, machine);
    tell_fired(b, machine);
    struct pollfd life = {.fd = b->setup->life, .events = POLLIN};
    if (poll(&life, 1, 0) > 0 && read(b->setup->life, &byte, 1) == 0)
        b->stop = 1;
}

static void ready(void *context, const char *path)
{
    const struct board_process *b = context;

    (void)path;
    rig_report(b->setup->report, LUMI_OK, NULL);
}

int rig_board_run(const struct rig_board *setup, struct lumi_error *error)
{
    static struct board_process board;
    struct sim_serve_options options;
    char link[600], steps[600];
    int code;

    board.setup = setup;
    sim_serve_options_init(&options, &setup->rig->rig);
    snprintf(link, sizeof link, "%s/board", setup->rig->folder);
    options.machine.seed = options.machine.mechanics.seed = setup->rig->seed;
    options.link = link;
    options.speed = setup->rig->speed;
    options.faults = setup->rig->faults;
    options.stop = &board.stop;
    options.ready = ready;
    options.turn = turn;
    options.turn_fd = setup->eye_count > 0 ? setup->eyes[0] : -1;
    options.context = &board;
    snprintf(board.faults, sizeof board.faults, "%s/faults.now", setup->rig->folder);
    unlink(board.faults);
    snprintf(steps, sizeof steps, "%s/steps.txt", setup->rig->folder);
    board.steps = fopen(steps, "w");
    if (!board.steps)
        return lumi_fail_errno(error, steps, "making it");
    code = sim_serve(&setup->rig->rig, &options, error);
    fclose(board.steps);
    return code;
}
