/* Addresses of streams, and what those that are one descriptor share. */
#include "daemon/rig/stream.h"
#include "proto/wire/transport.h"

#include <errno.h>
#include <glib.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static int serial_options(const char *address, char **fields, struct lumi_rig_serial_settings *settings,
                          struct lumi_error *error)
{
    for (; *fields; fields++) {
        char *end;
        if (!strcmp(*fields, "rs485")) {
            settings->rs485 = true;
        } else if (!strncmp(*fields, "baud=", 5)) {
            long baud = strtol(*fields + 5, &end, 10);
            if (end == *fields + 5 || *end || baud <= 0 || baud > INT_MAX)
                return lumi_fail(error, LUMI_ERR_ARG, "%s: '%s' is no baud rate", address, *fields + 5);
            settings->baud = (int)baud;
        } else {
            return lumi_fail(error, LUMI_ERR_ARG, "%s: '%s' is unknown (baud=RATE, rs485)", address, *fields);
        }
    }
    return LUMI_OK;
}

static int serial_address(const char *address, const char *path, struct lumi_rig_stream **stream,
                          struct lumi_error *error)
{
    struct lumi_rig_serial_settings settings = {.baud = LUMI_WIRE_SERIAL_BAUD};
    g_auto(GStrv) fields = g_strsplit(path, ",", -1);

    if (!fields[0] || !fields[0][0])
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no path (serial:/dev/ttyUSB0)", address);
    LUMI_TRY(serial_options(address, fields + 1, &settings, error));
    return lumi_rig_serial_create(fields[0], &settings, stream, error);
}

static int fd_address(const char *address, struct lumi_rig_stream **stream, struct lumi_error *error)
{
    char *end;
    long fd = strtol(address + 3, &end, 10);

    if (end == address + 3 || *end || fd < 0 || fd > INT_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no descriptor's number", address);
    return lumi_rig_socket_create(NULL, (int)fd, stream, error);
}

int lumi_rig_stream_create(const char *address, struct lumi_rig_stream **stream, struct lumi_error *error)
{
    *stream = NULL;
    if (g_str_has_prefix(address, "serial:"))
        return serial_address(address, address + 7, stream, error);
    if (g_str_has_prefix(address, "usb:"))
        return lumi_rig_usb_create(address + 4, stream, error);
    if (g_str_has_prefix(address, "unix:"))
        return lumi_rig_socket_create(address + 5, -1, stream, error);
    if (g_str_has_prefix(address, "fd:"))
        return fd_address(address, stream, error);
    if (address[0] == '/' || address[0] == '.')
        return serial_address(address, address, stream, error);
    return lumi_fail(error, LUMI_ERR_ARG,
                     "'%s' is no address of a board: serial:/dev/ttyUSB0, usb:, usb:SERIAL or unix:/path", address);
}

void lumi_rig_stream_destroy(struct lumi_rig_stream *stream)
{
    if (!stream)
        return;
    stream->ops->close(stream);
    stream->ops->destroy(stream);
}

long lumi_rig_fd_read(int fd, const char *name, uint8_t *data, size_t size, struct lumi_error *error)
{
    ssize_t count = read(fd, data, size);

    if (count > 0)
        return (long)count;
    if (count == 0)
        return lumi_fail(error, LUMI_ERR_IO, "%s: the other end has closed it", name);
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)
        return 0;
    return lumi_fail_errno(error, name, "read");
}

long lumi_rig_fd_write(int fd, const char *name, const uint8_t *data, size_t size, struct lumi_error *error)
{
    ssize_t count = send(fd, data, size, MSG_NOSIGNAL | MSG_DONTWAIT);

    if (count < 0 && errno == ENOTSOCK)
        count = write(fd, data, size); /* a terminal, which raises no SIGPIPE */
    if (count >= 0)
        return (long)count;
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)
        return 0;
    return lumi_fail_errno(error, name, "write");
}
