/* A board on the other end of a link: the protocol's server in a thread, behind a pseudo-terminal or a socket. What its
 * commands do is the test's. */
#ifndef LUMI_TESTS_UNIT_FAKE_BOARD_H
#define LUMI_TESTS_UNIT_FAKE_BOARD_H

#include "proto/wire/server.h"

#include <pthread.h>

struct fake_board {
    /* Set before fake_board_start. */
    void *context;
    void (*execute)(struct fake_board *board, const lumi_wire_Request *request, lumi_wire_Reply *reply);
    void (*idle)(struct fake_board *board); /* every few milliseconds, with the lock held; may be NULL */
    lumi_wire_Welcome identity;
    uint64_t clock_ahead_ns; /* of the host's */

    /* With the lock held. */
    pthread_mutex_t lock;
    lumi_wire_Status status;
    int executed, stops, heartbeats;
    bool mute;        /* hears everything, says nothing */
    const char *talk; /* says this instead, again and again */

    /* Its own. */
    char address[128];
    struct lumi_wire_server server;
    int fd, listener, keep, wake[2];
    bool ending, hang_up;
    pthread_t thread;
};

/* "pty" or a path for a socket. The address is what lumi_rig_link_open takes. */
void fake_board_start(struct fake_board *board, const char *kind);
void fake_board_stop(struct fake_board *board);
uint64_t fake_board_time(const struct fake_board *board);
void fake_board_restart(struct fake_board *board); /* forgets everything */
void fake_board_hang_up(struct fake_board *board); /* sockets: closes the connection and takes the next one */
void fake_board_event(struct fake_board *board, lumi_wire_Event *event);

void fake_board_nap(int milliseconds);

#endif
