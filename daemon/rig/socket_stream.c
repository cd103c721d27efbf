/* A socket in place of a wire: a simulated board that listens on a path, or one end of a socket pair. */
#include "daemon/rig/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

struct socket_stream {
    struct lumi_rig_stream base;
    char *path; /* NULL: `given` is the stream, once */
    int fd, given;
};

static int set_nonblocking(int fd)
{
    int flags = fcntl(fd, F_GETFL);

    return flags < 0 ? -1 : fcntl(fd, F_SETFL, flags | O_NONBLOCK);
}

static int socket_open(struct lumi_rig_stream *stream, struct lumi_error *error)
{
    struct socket_stream *self = (struct socket_stream *)stream;
    struct sockaddr_un address = {.sun_family = AF_UNIX};

    if (!self->path) {
        if (self->given < 0)
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: was closed", stream->name);
        self->fd = self->given;
        self->given = -1;
        return set_nonblocking(self->fd) ? lumi_fail_errno(error, stream->name, "open") : LUMI_OK;
    }
    snprintf(address.sun_path, sizeof address.sun_path, "%s", self->path);
    self->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (self->fd < 0)
        return lumi_fail_errno(error, stream->name, "socket");
    /* Connecting to a local socket succeeds or fails at once unless the listener's queue is full. */
    if (set_nonblocking(self->fd) || connect(self->fd, (struct sockaddr *)&address, sizeof address)) {
        int code = lumi_fail_errno(error, stream->name, "connect");
        if (errno == ECONNREFUSED)
            code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: nobody listens there", stream->name);
        close(self->fd);
        self->fd = -1;
        return code;
    }
    return LUMI_OK;
}

static void socket_close(struct lumi_rig_stream *stream)
{
    struct socket_stream *self = (struct socket_stream *)stream;

    if (self->fd >= 0)
        close(self->fd);
    self->fd = -1;
}

static int socket_poll_fds(struct lumi_rig_stream *stream, struct pollfd *fds, int max, bool write)
{
    struct socket_stream *self = (struct socket_stream *)stream;

    if (self->fd < 0 || max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = self->fd, .events = (short)(POLLIN | (write ? POLLOUT : 0))};
    return 1;
}

static long socket_read(struct lumi_rig_stream *stream, uint8_t *data, size_t size, struct lumi_error *error)
{
    return lumi_rig_fd_read(((struct socket_stream *)stream)->fd, stream->name, data, size, error);
}

static long socket_write(struct lumi_rig_stream *stream, const uint8_t *data, size_t size, struct lumi_error *error)
{
    return lumi_rig_fd_write(((struct socket_stream *)stream)->fd, stream->name, data, size, error);
}

static void socket_destroy(struct lumi_rig_stream *stream)
{
    struct socket_stream *self = (struct socket_stream *)stream;

    if (self->given >= 0)
        close(self->given);
    g_free(self->path);
    g_free(self);
}

static const struct lumi_rig_stream_ops socket_ops = {
    .open = socket_open,
    .close = socket_close,
    .poll_fds = socket_poll_fds,
    .read = socket_read,
    .write = socket_write,
    .destroy = socket_destroy,
};

int lumi_rig_socket_create(const char *path, int fd, struct lumi_rig_stream **stream, struct lumi_error *error)
{
    struct sockaddr_un address;
    struct socket_stream *self;

    if (path && (!path[0] || strlen(path) >= sizeof address.sun_path))
        return lumi_fail(error, LUMI_ERR_ARG, "unix:%s: a path of 1 to %zu letters wanted", path,
                         sizeof address.sun_path - 1);
    self = g_new0(struct socket_stream, 1);
    self->base.ops = &socket_ops;
    self->path = g_strdup(path);
    self->fd = -1;
    self->given = path ? -1 : fd;
    if (path)
        snprintf(self->base.name, sizeof self->base.name, "unix:%s", path);
    else
        snprintf(self->base.name, sizeof self->base.name, "fd:%d", fd);
    *stream = &self->base;
    return LUMI_OK;
}
