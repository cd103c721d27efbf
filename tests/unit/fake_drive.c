/* libmodbus' server with a drive's registers. */
#define _GNU_SOURCE
#include "fake_drive.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cmocka.h>

#define LOOKS 3

static void show(struct fake_drive *drive)
{
    uint16_t *registers = drive->registers->tab_registers;

    /* Bit 2 says "moves": what the map calls reached is its opposite. */
    registers[0] =
        (uint16_t)(1 | drive->enabled << 1 | (drive->looks > 0) << 2 | drive->fault << 3 | drive->homed << 4);
    registers[1] = (uint16_t)drive->fault_code;
    registers[2] = (uint16_t)((uint32_t)drive->position >> 16);
    registers[3] = (uint16_t)drive->position;
}

static void look(struct fake_drive *drive)
{
    if (drive->looks == 0 || drive->stuck || !drive->enabled || drive->fault)
        return;
    if (--drive->looks == 0) {
        drive->position = drive->target;
        if (drive->fault_at_move && drive->moves == drive->fault_at_move) {
            drive->fault = true;
            drive->fault_code = 42;
        }
    } else {
        drive->position += (drive->target - drive->position) / 2;
    }
}

static void obey(struct fake_drive *drive)
{
    uint16_t *registers = drive->registers->tab_registers;

    if (registers[12] == 1 && drive->enabled) {
        drive->target = (int32_t)((uint32_t)registers[10] << 16 | registers[11]);
        drive->looks = LOOKS;
        drive->moves++;
    }
    if (registers[13] == 1) {
        drive->looks = 0;
        drive->stops++;
    }
    if (registers[14] == 0xff) {
        drive->fault = false;
        drive->fault_code = 0;
        drive->resets++;
    }
    if (registers[15] == 1) {
        drive->target = 500;
        drive->looks = LOOKS;
        drive->homed = true;
    }
    registers[12] = registers[13] = registers[14] = registers[15] = 0;
}

static void answer(struct fake_drive *drive, const uint8_t *query, int size)
{
    int head = modbus_get_header_length(drive->bus);
    static const uint8_t damaged[] = {3, 3, 2, 0, 0, 0xde, 0xad};

    drive->requests++;
    if (drive->silent > 0) {
        drive->silent--;
    } else if (drive->damaged > 0) {
        drive->damaged--;
        assert_int_equal(write(modbus_get_socket(drive->bus), damaged, sizeof damaged), sizeof damaged);
    } else if (drive->exceptions > 0) {
        drive->exceptions--;
        modbus_reply_exception(drive->bus, query, (unsigned)drive->exception);
    } else {
        if (query[head] == MODBUS_FC_READ_HOLDING_REGISTERS && query[head + 1] == 0 && query[head + 2] == 0)
            look(drive);
        show(drive);
        modbus_reply(drive->bus, query, size, drive->registers);
        obey(drive);
    }
}

static bool readable(int fd)
{
    struct pollfd one = {.fd = fd, .events = POLLIN};

    return poll(&one, 1, 10) > 0;
}

static void one_round(struct fake_drive *drive)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int size;

    if (drive->tcp && drive->fd < 0) {
        if (readable(drive->listener))
            drive->fd = modbus_tcp_accept(drive->bus, &drive->listener);
        return;
    }
    if (!readable(drive->fd))
        return;
    size = modbus_receive(drive->bus, query);
    pthread_mutex_lock(&drive->lock);
    if (drive->tcp && (drive->hang_up || size < 0)) {
        close(drive->fd);
        drive->fd = -1;
        drive->hang_up = false;
    } else if (size > 0) {
        answer(drive, query, size);
    }
    pthread_mutex_unlock(&drive->lock);
}

static void *run(void *context)
{
    struct fake_drive *drive = context;

    for (;;) {
        pthread_mutex_lock(&drive->lock);
        bool ending = drive->ending;
        pthread_mutex_unlock(&drive->lock);
        if (ending)
            return NULL;
        one_round(drive);
    }
}

static void open_tcp(struct fake_drive *drive)
{
    struct sockaddr_in address;
    socklen_t size = sizeof address;

    drive->bus = modbus_new_tcp("127.0.0.1", 0);
    assert_non_null(drive->bus);
    drive->listener = modbus_tcp_listen(drive->bus, 1);
    assert_true(drive->listener >= 0 && !getsockname(drive->listener, (struct sockaddr *)&address, &size));
    snprintf(drive->address, sizeof drive->address, "tcp:127.0.0.1:%d", ntohs(address.sin_port));
}

static void open_rtu(struct fake_drive *drive)
{
    struct termios raw;

    drive->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    assert_true(drive->fd >= 0 && !grantpt(drive->fd) && !unlockpt(drive->fd));
    snprintf(drive->address, sizeof drive->address, "rtu:%s,baud=115200,parity=N", ptsname(drive->fd));
    drive->keep = open(ptsname(drive->fd), O_RDWR | O_NOCTTY | O_CLOEXEC);
    assert_true(drive->keep >= 0 && !tcgetattr(drive->keep, &raw));
    cfmakeraw(&raw);
    tcsetattr(drive->keep, TCSANOW, &raw);
    drive->bus = modbus_new_rtu("/dev/ptmx", 115200, 'N', 8, 1); /* never opened: the terminal is given to it */
    assert_non_null(drive->bus);
    modbus_set_socket(drive->bus, drive->fd);
    modbus_set_slave(drive->bus, 3);
}

void fake_drive_start(struct fake_drive *drive, bool tcp)
{
    drive->tcp = tcp;
    drive->listener = drive->fd = drive->keep = -1;
    drive->position = 500;
    pthread_mutex_init(&drive->lock, NULL);
    drive->registers = modbus_mapping_new(0, 0, 32, 0);
    assert_non_null(drive->registers);
    if (tcp)
        open_tcp(drive);
    else
        open_rtu(drive);
    assert_false(pthread_create(&drive->thread, NULL, run, drive));
}

void fake_drive_stop(struct fake_drive *drive)
{
    pthread_mutex_lock(&drive->lock);
    drive->ending = true;
    pthread_mutex_unlock(&drive->lock);
    pthread_join(drive->thread, NULL);
    if (drive->fd >= 0)
        close(drive->fd);
    if (drive->listener >= 0)
        close(drive->listener);
    if (drive->keep >= 0)
        close(drive->keep);
    modbus_mapping_free(drive->registers);
    modbus_free(drive->bus);
    pthread_mutex_destroy(&drive->lock);
}

bool fake_drive_reached(struct fake_drive *drive)
{
    pthread_mutex_lock(&drive->lock);
    bool reached = drive->looks == 0;
    pthread_mutex_unlock(&drive->lock);
    return reached;
}

int32_t fake_drive_position(struct fake_drive *drive)
{
    pthread_mutex_lock(&drive->lock);
    int32_t position = drive->position;
    pthread_mutex_unlock(&drive->lock);
    return position;
}
