/* A stream of bytes to the rig's board: serial line, USB, or a socket that stands in for one. Never blocks; its owner,
 * one thread, polls the descriptors it names and reads and writes what goes.
 *
 * 1. A stream that fails is closed by its owner, who may open it again as often as it likes: what was unplugged and
 *    comes back is found again by its name.
 * 2. Bytes can be lost, damaged or doubled: the frames (proto/wire/frame.h) see to that. */
#ifndef LUMI_DAEMON_RIG_STREAM_H
#define LUMI_DAEMON_RIG_STREAM_H

#include "proto/base/result.h"

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_RIG_STREAM_POLL 16 /* descriptors of one stream, at most */
#define LUMI_RIG_STREAM_NAME 256

struct lumi_rig_stream;

struct lumi_rig_stream_ops {
    /* LUMI_ERR_NOTFOUND: not there (now). LUMI_ERR_BUSY: somebody else's. LUMI_ERR_IO: refused; the text says why. */
    int (*open)(struct lumi_rig_stream *stream, struct lumi_error *error);
    void (*close)(struct lumi_rig_stream *stream);
    /* Fills at most `max` and returns how many: what to wait for while open; while closed, what tells that it may have
     * come back (may be none). `write`: there is something to be written. */
    int (*poll_fds)(struct lumi_rig_stream *stream, struct pollfd *fds, int max, bool write);
    /* While closed: true where it seems to have come back, so that opening is worth a try at once. May be NULL. */
    bool (*arrived)(struct lumi_rig_stream *stream);
    /* The number of bytes, 0 for none now, or a negative code: the stream is gone. */
    long (*read)(struct lumi_rig_stream *stream, uint8_t *data, size_t size, struct lumi_error *error);
    long (*write)(struct lumi_rig_stream *stream, const uint8_t *data, size_t size, struct lumi_error *error);
    void (*destroy)(struct lumi_rig_stream *stream);
};

struct lumi_rig_stream {
    const struct lumi_rig_stream_ops *ops;
    char name[LUMI_RIG_STREAM_NAME]; /* for messages: "/dev/ttyUSB0", "usb:3400…" */
};

/* By its address; nothing is opened yet, but the address is checked (LUMI_ERR_ARG):
 *   serial:/dev/ttyUSB0[,baud=115200][,rs485]   a serial line; a bare path is one too, and so is a pseudo-terminal
 *   usb:  usb:SERIAL                            the one board on USB, or that with this serial number
 *   unix:/path                                  a socket that somebody listens on
 *   fd:N                                        an open descriptor (a socket pair), which it takes over; opens once */
int lumi_rig_stream_create(const char *address, struct lumi_rig_stream **stream, struct lumi_error *error);
void lumi_rig_stream_destroy(struct lumi_rig_stream *stream); /* NULL is fine; closes */

struct lumi_rig_serial_settings {
    int baud;
    bool rs485; /* the driver turns the transmitter on while it sends (TIOCSRS485) */
};
/* The kinds behind the addresses. */
int lumi_rig_serial_create(const char *path, const struct lumi_rig_serial_settings *settings,
                           struct lumi_rig_stream **stream, struct lumi_error *error);
int lumi_rig_socket_create(const char *path, int fd, struct lumi_rig_stream **stream, struct lumi_error *error);
int lumi_rig_usb_create(const char *serial, struct lumi_rig_stream **stream, struct lumi_error *error);

/* The boards on USB now: their serial numbers ("" where it cannot be read, with the reason in `text`). Returns how many
 * there are (at most `max` are filled in), or a negative code. */
struct lumi_rig_usb_board {
    char serial[64];
    char place[32]; /* bus and address: "1-4" */
    char text[512]; /* why it cannot be opened; empty: it can */
};
int lumi_rig_usb_list(struct lumi_rig_usb_board *boards, int max, struct lumi_error *error);

/* For the kinds that are one descriptor. `write` never raises SIGPIPE. */
long lumi_rig_fd_read(int fd, const char *name, uint8_t *data, size_t size, struct lumi_error *error);
long lumi_rig_fd_write(int fd, const char *name, const uint8_t *data, size_t size, struct lumi_error *error);

#endif
