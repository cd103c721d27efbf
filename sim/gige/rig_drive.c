/* The process with the industrial drive: libmodbus' server in front of an axis that turns the platform. Its registers
 * are those that rig_drive_map describes. */
#include "sim/gige/rig_parts.h"
#include "sim/rig/mechanics.h"

#include <errno.h>
#include <math.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define REGISTERS 32
#define CLIENTS 4
#define MOVING_MS 4
#define RESTING_MS 500
#define ALARM 42
#define PEAK 1.5            /* of a smooth move's speed over its mean: 3x² − 2x³ */
#define QUERY_US 200000     /* for the rest of a question that has begun */
#define HOME_SPEED (1 / 4.) /* of the speed */

/* What libmodbus' tests and ours have alike (tests/unit/fake_drive.h): "reached" is the opposite of "moves". */
const char rig_drive_map[] = "# The simulated drive of lumi sim rig (docs/rig-drive.md).\n"
                             "[drive]\nname = simulated\ntimeout_s = 0.3\nretries = 2\nmove_timeout_s = 20\n"
                             "home_timeout_s = 60\n"
                             "[scale]\ncounts_per_turn = -36000\nzero_counts = 500\ntolerance_counts = 2\n"
                             "[status]\naddress = 0\nready = 0\nenabled = 1\nreached = !2\nfault = 3\nhomed = 4\n"
                             "[fault-code]\naddress = 1\n"
                             "[position]\naddress = 2\nwidth = 32\n"
                             "[target]\naddress = 0x0A\nwidth = 32\n"
                             "[speed]\naddress = 16\nwidth = 32\ncounts_per_s = 9000\n"
                             "[start]\naddress = 12\nvalue = 1\nclear = 0\n"
                             "[stop]\naddress = 13\nvalue = 1\nclear = 0\n"
                             "[reset]\naddress = 14\nvalue = 0xff\nclear = 0\n"
                             "[home]\naddress = 15\nvalue = 1\nclear = 0\n";

struct drive {
    const struct rig_drive *setup;
    modbus_t *bus;
    modbus_mapping_t *registers;
    int listener, clients[CLIENTS];
    /* The axis. */
    bool enabled, cause, silent; /* as the board tells */
    bool alarm, moving, homing, homed, arrived;
    double turns;    /* true */
    double unhomed;  /* turns that it takes for step 0 until it has homed: where it was switched on */
    double from, to; /* of the move */
    double begun, lasts;
    double speed; /* turns/s, peak */
};

static double seconds_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void tell(const struct drive *d)
{
    const struct rig_message message = {
        .kind = RIG_MESSAGE_TURNED, .turns = d->turns, .on = d->arrived && d->enabled && !d->moving && !d->alarm};

    (void)!send(d->setup->board, &message, sizeof message, MSG_NOSIGNAL);
}

static void begin(struct drive *d, double to, double speed)
{
    d->from = d->turns;
    d->to = to;
    d->begun = seconds_now();
    d->lasts = PEAK * fabs(to - d->turns) / (speed * d->setup->rig->speed);
    d->moving = true;
    d->arrived = false;
    tell(d);
}

/* It stands where it is. */
static void halt(struct drive *d)
{
    d->moving = d->homing = false;
    tell(d);
}

static void turn(struct drive *d)
{
    const double share = d->lasts > 0 ? fmin((seconds_now() - d->begun) / d->lasts, 1) : 1;

    if (!d->moving)
        return;
    d->turns = d->from + (d->to - d->from) * share * share * (3 - 2 * share);
    if (share >= 1) {
        d->turns = d->to;
        d->homed |= d->homing;
        d->moving = d->homing = false;
        d->arrived = true;
    }
    tell(d);
}

static double counts(const struct drive *d)
{
    return RIG_DRIVE_ZERO + (d->turns - (d->homed ? 0 : d->unhomed)) * RIG_DRIVE_COUNTS;
}

static void show(struct drive *d)
{
    uint16_t *registers = d->registers->tab_registers;
    const int32_t position = (int32_t)lround(counts(d));

    registers[0] = (uint16_t)(1 | d->enabled << 1 | d->moving << 2 | d->alarm << 3 | d->homed << 4);
    registers[1] = d->alarm ? ALARM : 0;
    registers[2] = (uint16_t)((uint32_t)position >> 16);
    registers[3] = (uint16_t)position;
}

static int32_t pair(const uint16_t *registers)
{
    return (int32_t)((uint32_t)registers[0] << 16 | registers[1]);
}

/* What was written into the registers. */
static void obey(struct drive *d)
{
    uint16_t *registers = d->registers->tab_registers;
    const bool ready = d->enabled && !d->alarm;

    if (pair(registers + 16) > 0)
        d->speed = pair(registers + 16) / fabs(RIG_DRIVE_COUNTS);
    if (registers[13] == 1)
        halt(d);
    if (registers[14] == 0xff && d->alarm) {
        d->alarm = d->cause;
        tell(d);
    }
    if (registers[12] == 1 && ready) {
        const double to = (pair(registers + 10) - RIG_DRIVE_ZERO) / RIG_DRIVE_COUNTS + (d->homed ? 0 : d->unhomed);
        if (!d->moving || to != d->to)
            begin(d, to, d->speed);
    }
    if (registers[15] == 1 && ready) {
        d->homed = false;
        d->homing = true;
        begin(d, 0, d->speed * HOME_SPEED);
    }
    memset(registers + 12, 0, 4 * sizeof *registers);
}

/* ---- its lines ---- */

/* False: the board has gone. */
static bool hear_board(struct drive *d)
{
    struct rig_message message;
    ssize_t size;

    while ((size = recv(d->setup->board, &message, sizeof message, MSG_DONTWAIT)) > 0) {
        if (size != (ssize_t)sizeof message || message.kind != RIG_MESSAGE_DRIVE)
            continue;
        d->enabled = message.on;
        d->cause = message.alarm;
        d->silent = message.silent;
        d->alarm |= d->cause;
        if (!d->enabled || d->alarm)
            halt(d);
        else
            tell(d);
    }
    return size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
}

static void take_client(struct drive *d)
{
    int free_place = 0, fd;

    while (free_place < CLIENTS && d->clients[free_place] >= 0)
        free_place++;
    fd = accept(d->listener, NULL, NULL);
    if (fd >= 0 && free_place == CLIENTS)
        close(fd);
    else if (fd >= 0)
        d->clients[free_place] = fd;
}

static void serve(struct drive *d, int *client)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int size;

    modbus_set_socket(d->bus, *client);
    size = modbus_receive(d->bus, query);
    if (size < 0) {
        close(*client);
        *client = -1;
    } else if (size > 0 && !d->silent) {
        turn(d);
        show(d);
        modbus_reply(d->bus, query, size, d->registers);
        obey(d);
    }
}

static void serve_all(struct drive *d)
{
    struct pollfd wait[2 + CLIENTS];
    bool there = true;

    while (there) {
        wait[0] = (struct pollfd){.fd = d->setup->board, .events = POLLIN};
        wait[1] = (struct pollfd){.fd = d->listener, .events = POLLIN};
        for (int i = 0; i < CLIENTS; i++)
            wait[2 + i] = (struct pollfd){.fd = d->clients[i], .events = POLLIN};
        if (poll(wait, 2 + CLIENTS, d->moving ? MOVING_MS : RESTING_MS) < 0 && errno != EINTR)
            return;
        turn(d);
        there = hear_board(d);
        if (wait[1].revents)
            take_client(d);
        for (int i = 0; i < CLIENTS; i++)
            if (wait[2 + i].revents && d->clients[i] >= 0)
                serve(d, &d->clients[i]);
    }
}

int rig_drive_run(const struct rig_drive *setup, struct lumi_error *error)
{
    struct drive d = {.setup = setup, .listener = -1, .speed = RIG_DRIVE_SPEED / fabs(RIG_DRIVE_COUNTS)};
    struct sim_mechanics_options start;
    char address[16];
    int code = LUMI_OK;

    for (int i = 0; i < CLIENTS; i++)
        d.clients[i] = -1;
    sim_mechanics_options_init(&start, &setup->rig->rig);
    d.turns = d.unhomed = start.start_turns;
    sim_rig_processes_address(setup->rig, setup->rig->rig.camera_count, address);
    d.bus = modbus_new_tcp(address, SIM_RIG_DRIVE_PORT);
    d.registers = d.bus ? modbus_mapping_new(0, 0, REGISTERS, 0) : NULL;
    if (!d.registers) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a simulated drive");
        goto done;
    }
    modbus_set_byte_timeout(d.bus, 0, QUERY_US);
    modbus_set_indication_timeout(d.bus, 0, QUERY_US);
    d.listener = modbus_tcp_listen(d.bus, CLIENTS);
    if (d.listener < 0) {
        code = lumi_fail(error, LUMI_ERR_IO, "%s, port %d: %s", address, SIM_RIG_DRIVE_PORT, modbus_strerror(errno));
        goto done;
    }
    rig_report(setup->report, LUMI_OK, NULL);
    serve_all(&d);
done:
    for (int i = 0; i < CLIENTS; i++)
        if (d.clients[i] >= 0)
            close(d.clients[i]);
    if (d.listener >= 0)
        close(d.listener);
    if (d.registers)
        modbus_mapping_free(d.registers);
    if (d.bus)
        modbus_free(d.bus);
    return code;
}
