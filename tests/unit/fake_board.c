/* A board in a thread. */
#define _GNU_SOURCE
#include "fake_board.h"

#include <fcntl.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

uint64_t fake_board_time(const struct fake_board *board)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec + board->clock_ahead_ns;
}

static void on_execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    struct fake_board *board = context;

    board->executed++;
    if (board->execute)
        board->execute(board, request, reply);
}

static void on_status(void *context, lumi_wire_Status *status)
{
    *status = ((struct fake_board *)context)->status;
}

static void on_stop(void *context)
{
    ((struct fake_board *)context)->stops++;
}

static void on_heartbeat(void *context)
{
    ((struct fake_board *)context)->heartbeats++;
}

static bool on_send(void *context, int link, const uint8_t *frame, size_t size)
{
    struct fake_board *board = context;

    (void)link;
    if (board->fd < 0 || board->mute)
        return true;
    ssize_t sent = board->listener >= 0 ? send(board->fd, frame, size, MSG_NOSIGNAL) : write(board->fd, frame, size);
    return sent == (ssize_t)size;
}

static const struct lumi_wire_server_ops ops = {
    .execute = on_execute,
    .status = on_status,
    .emergency_stop = on_stop,
    .heartbeat = on_heartbeat,
    .send = on_send,
};

static void drop(struct fake_board *board)
{
    if (board->fd >= 0)
        close(board->fd);
    board->fd = -1;
}

static void take_bytes(struct fake_board *board)
{
    uint8_t data[4096];
    ssize_t count = read(board->fd, data, sizeof data);

    if (count > 0)
        lumi_wire_server_receive(&board->server, 0, data, (size_t)count, fake_board_time(board));
    else if (board->listener >= 0)
        drop(board);
}

static void one_round(struct fake_board *board)
{
    struct pollfd fds[3] = {{.fd = board->wake[0], .events = POLLIN},
                            {.fd = board->fd, .events = POLLIN},
                            {.fd = board->fd < 0 ? board->listener : -1, .events = POLLIN}};
    char some[16];

    pthread_mutex_unlock(&board->lock);
    poll(fds, 3, 5);
    pthread_mutex_lock(&board->lock);
    if (fds[0].revents && read(board->wake[0], some, sizeof some) < 0)
        return;
    if (board->hang_up)
        drop(board);
    board->hang_up = false;
    if (fds[2].revents && board->fd < 0)
        board->fd = accept(board->listener, NULL, NULL);
    else if (fds[1].revents && board->fd >= 0)
        take_bytes(board);
    if (board->talk && board->fd >= 0 && write(board->fd, board->talk, strlen(board->talk)) < 0)
        drop(board);
    if (board->idle)
        board->idle(board);
    lumi_wire_server_poll(&board->server, fake_board_time(board));
}

static void *run(void *context)
{
    struct fake_board *board = context;

    pthread_mutex_lock(&board->lock);
    while (!board->ending)
        one_round(board);
    pthread_mutex_unlock(&board->lock);
    return NULL;
}

static void open_pty(struct fake_board *board)
{
    struct termios raw;

    board->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    assert_true(board->fd >= 0 && !grantpt(board->fd) && !unlockpt(board->fd));
    snprintf(board->address, sizeof board->address, "serial:%s", ptsname(board->fd));
    /* Held open, so that the master does not hang up while nobody else has it. */
    board->keep = open(board->address + 7, O_RDWR | O_NOCTTY | O_CLOEXEC);
    assert_true(board->keep >= 0 && !tcgetattr(board->keep, &raw));
    cfmakeraw(&raw);
    tcsetattr(board->keep, TCSANOW, &raw);
}

static void open_socket(struct fake_board *board, const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};

    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    unlink(path);
    board->listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(board->listener >= 0);
    assert_false(bind(board->listener, (struct sockaddr *)&address, sizeof address));
    assert_false(listen(board->listener, 2));
    snprintf(board->address, sizeof board->address, "unix:%s", path);
}

static void begin(struct fake_board *board)
{
    lumi_wire_server_init(&board->server, &ops, board, &board->identity);
}

void fake_board_start(struct fake_board *board, const char *kind)
{
    board->fd = board->listener = board->keep = -1;
    if (!board->identity.boot)
        board->identity.boot = 1;
    if (!board->identity.board[0]) {
        snprintf(board->identity.board, sizeof board->identity.board, "host");
        snprintf(board->identity.firmware, sizeof board->identity.firmware, "9.9.9");
    }
    pthread_mutex_init(&board->lock, NULL);
    if (!strcmp(kind, "pty"))
        open_pty(board);
    else
        open_socket(board, kind);
    begin(board);
    assert_false(pipe(board->wake));
    assert_false(pthread_create(&board->thread, NULL, run, board));
}

void fake_board_stop(struct fake_board *board)
{
    pthread_mutex_lock(&board->lock);
    board->ending = true;
    pthread_mutex_unlock(&board->lock);
    assert_int_equal(write(board->wake[1], "", 1), 1);
    pthread_join(board->thread, NULL);
    drop(board);
    if (board->listener >= 0)
        close(board->listener);
    if (board->keep >= 0)
        close(board->keep);
    close(board->wake[0]);
    close(board->wake[1]);
    pthread_mutex_destroy(&board->lock);
}

void fake_board_restart(struct fake_board *board)
{
    pthread_mutex_lock(&board->lock);
    board->identity.boot++;
    begin(board);
    pthread_mutex_unlock(&board->lock);
}

void fake_board_hang_up(struct fake_board *board)
{
    pthread_mutex_lock(&board->lock);
    board->hang_up = true;
    pthread_mutex_unlock(&board->lock);
    assert_int_equal(write(board->wake[1], "", 1), 1);
}

void fake_board_event(struct fake_board *board, lumi_wire_Event *event)
{
    pthread_mutex_lock(&board->lock);
    event->time_ns = fake_board_time(board);
    lumi_wire_server_event(&board->server, event);
    pthread_mutex_unlock(&board->lock);
}

void fake_board_nap(int milliseconds)
{
    nanosleep(&(struct timespec){.tv_nsec = milliseconds * 1000000}, NULL);
}
